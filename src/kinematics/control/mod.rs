//! Control laws: from the pose error to joint velocities.
//!
//! The laws are one table of what is fed back ([`PoseError`]) and which map makes joint velocities of it ([`Map`]); the rest
//! derive their gains. Each is a [`ControlLaw`], as one of your own is ([`register`]):
//!
//! | fed back | × transpose | × damped inverse | with derived gains |
//! |---|---|---|---|
//! | R⁸ difference; with the inverse as seen from the tool, `q* q_d − 1` | diffc | diffc_inverse | lq: from the weights of a quadratic cost |
//! | screw logarithm | logc_transpose | logc | predefined_time: from the time to arrive; logc_pd: second order, with a gain of the velocity |
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
//! | `q* q_d − 1` × damped inverse | 1 | 1.136 | 0 |
//! | screw log × damped inverse (logc) | 1 | 1.134 | 0 |
//!
//! A law in a closed loop, with the gains and the arm that the servo has by default:
//!
//! ```
//! use dq_kinematics::arm::ArmState;
//! use dq_config::{NodeParameters, ServoParameters};
//! use dq_kinematics::control::{Law, nearer_goal, pose_error};
//! let (parameters, _warnings) = ServoParameters::start("/dq_servo", Vec::new())?;
//! let parameters = ServoParameters::from_store(&parameters)?;
//! let (chain, controller) = (parameters.arms.chain(), parameters.settings.controller.with_law(Law::Logc, 2.0));
//! let goal = chain.forward_kinematics(&[0.4, -0.9, 0.3, 0.2, 1.2, 0.0])?;
//! let (mut theta, mut theta_dot) = ([0.0, -1.2, 0.1, 0.4, 1.0, 0.3], [0.0; 6]);
//! let mut arm = ArmState::new(chain);
//! for _cycle in 0..5000 {
//!     chain.evaluate(&theta, &mut arm)?;
//!     let nearer = nearer_goal(&goal, &arm.base_from_tool());
//!     controller.joint_velocity(&arm, &nearer, &mut theta_dot);
//!     theta.iter_mut().zip(&theta_dot).for_each(|(angle, speed)| *angle += 0.002 * speed);
//! }
//! assert!(pose_error(&arm, &goal).translation().norm() < 1e-6, "after 10 s at a gain of 2 1/s");
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod aim;
mod angular_linear;
mod approach;
mod control_law;
mod controller;
mod damped_inverse;
mod double_cover;
mod gram;
mod law;
mod laws;
mod pose_error;
mod pose_space;
mod quadratic_program;
mod stiffness;
mod symmetric;
mod transpose;

pub use aim::Aim;
pub use angular_linear::AngularLinear;
pub use approach::Approach;
pub use control_law::{ControlLaw, LawGains, LawInput, Map};
pub use controller::{AllowedRate, Controller, pose_error};
pub use damped_inverse::Damping;
pub use double_cover::{SignMemory, nearer_goal};
pub use law::{Law, RegisterError, register};
pub use pose_error::PoseError;
pub use quadratic_program::{Infeasible, QuadraticProgram};
pub use stiffness::Stiffness;
