//! Control laws: from the pose error to joint velocities.
//!
//! The laws are one table of what is fed back ([`Metric`]) and which map makes joint velocities of it ([`Map`]); the rest
//! derive their gains:
//!
//! | fed back | × transpose | × damped inverse | with derived gains |
//! |---|---|---|---|
//! | R⁸ difference | diffc | diffc_inverse | lq: from the weights of a quadratic cost |
//! | screw logarithm | logc_transpose | logc | predefined_time: from the time to arrive |
//! | decoupled logarithm | double_geodesic_transpose | double_geodesic | |
//! | unit quaternion's vector part, translation | unit_quaternion_transpose | unit_quaternion | h_infinity: from attenuation bounds |
//!
//! A law may be asked for less than a pose, by its [`Aim`]: then the goal is, each cycle, the nearest pose to the tool's that meets what is
//! asked for, so that the error lies in the rows of the Jacobian that are asked for, and the map uses these rows alone. With the R⁸
//! difference that is the error of diffc_inverse for diffc too, at a quarter of its gain, which is the same law to first order for a
//! tool at the base frame's origin.
//!
//! The reference work compares diffc with logc, and so the error and the map at once. Taken apart on its own motion, the
//! curved path, the overshoot and the high gain come from the transpose, not from R⁸:
//!
//! | | K [1/s] | path by straight line | overshoot \[mm\] |
//! |---|---|---|---|
//! | R⁸ × transpose (diffc) | 185 | 1.252 | 10.9 |
//! | screw log × transpose | 20 | 1.241 | 10.7 |
//! | R⁸ × damped inverse | 1 | 1.136 | 0 |
//! | screw log × damped inverse (logc) | 1 | 1.134 | 0 |

mod aim;
mod controller;
mod cooperative;
mod damped_inverse;
mod double_cover;
mod gains;
mod gram;
mod halves;
mod law;
mod metric;
mod names;
mod pose_space;
mod symmetric;
mod transpose;

pub use aim::Aim;
pub use controller::{Controller, pose_error};
pub use cooperative::{Cooperative, Feedback, Primitive};
pub use damped_inverse::Damping;
pub use double_cover::{SignMemory, nearer_goal};
pub use gains::{Attenuation, LqWeights, PredefinedTime, TwistGains};
pub use law::{Law, Map, Metric};
pub use names::UnknownName;
pub(crate) use names::named;
