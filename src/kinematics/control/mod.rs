//! Control laws: from the pose error to joint velocities.
//!
//! Most laws are combinations of an error ([`PoseError`]) and a map to joint velocities ([`Map`]). The others also derive their gains. Each
//! law is a [`ControlLaw`]. You can add your own with [`register`].
//!
//! | error | × transpose | × damped inverse | with derived gains |
//! |---|---|---|---|
//! | R⁸ difference (for the damped inverse: `q* q_d − 1`) | diffc | diffc_inverse | lq: from the weights of a quadratic cost |
//! | screw logarithm | logc_transpose | logc | predefined_time: from the time to arrive; logc_pd: second order, with a velocity gain |
//! | decoupled logarithm | double_geodesic_transpose | double_geodesic | |
//! | unit quaternion's vector part, translation | unit_quaternion_transpose | unit_quaternion | h_infinity: from attenuation bounds |
//!
//! The [`Aim`] may leave part of the pose free. Then the goal in each cycle is the pose that meets the aim and is nearest to the
//! tool's pose. The error has only the components that the aim determines, and the map uses only the rows of the Jacobian for these
//! components. In this case diffc feeds back the error of diffc_inverse, at a quarter of the gain K of diffc. If the tool is at the
//! base frame's origin, this equals the usual diffc to first order.
//!
//! The reference work (Sathuluri 2018) compares diffc with logc, which differ in both error and map. The following table repeats the
//! motion of the reference work with each combination of these errors and maps. It shows that the curved path, the overshoot and the
//! high gain come from the transpose, not from R⁸:
//!
//! | | K [1/s] | path length / straight line | overshoot \[mm\] |
//! |---|---|---|---|
//! | R⁸ × transpose (diffc) | 185 | 1.252 | 10.9 |
//! | screw log × transpose | 20 | 1.241 | 10.7 |
//! | `q* q_d − 1` × damped inverse | 1 | 1.136 | 0 |
//! | screw log × damped inverse (logc) | 1 | 1.134 | 0 |
//!
//! A law in a closed loop, with the servo's default gains and arm:
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
mod control_law;
mod controller;
mod damped_inverse;
mod double_cover;
mod gram;
mod law;
mod law_memory;
mod laws;
mod pose_error;
mod pose_space;
mod quadratic_program;
mod stiffness;
mod symmetric;
mod transpose;

pub use aim::Aim;
pub use angular_linear::{AngularLinear, six_numbers};
pub use control_law::{ControlLaw, LawGains, LawInput, MEMORY, Map, ToolMotion};
pub use controller::{AllowedRate, Controller, pose_error};
pub use damped_inverse::Damping;
pub use double_cover::{SignMemory, nearer_goal};
pub use law::{Law, RegisterError, register};
pub use law_memory::LawMemory;
pub use pose_error::PoseError;
pub use quadratic_program::{Infeasible, QuadraticProgram};
pub use stiffness::Stiffness;
