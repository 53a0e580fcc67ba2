#![doc = include_str!("README.md")]
//!
//! # Conventions
//!
//! The whole program uses these conventions:
//!
//! - Hamilton product; scalar first inside, `(w, x, y, z)`; on the wire ROS order `(x, y, z, w)`. Meters, radians, seconds.
//! - Equations and functions "of the paper" are those of the reference work (Sathuluri 2018).
//! - A pose is a unit dual quaternion `q = r + ε ½ t r` (eq. 13): `r` rotates, `t` translates, both in the base frame.
//! - Unit means `q q* = 1`. So the real part r and the dual part d obey `|r| = 1` and `⟨r, d⟩ = 0`.
//! - `q` and `-q` are the same pose. `dq_kinematics::control::SignMemory` chooses the sign for the laws.
//! - Pose error `e = q_d* q` (eq. 28). Twists are ordered angular first, `ξ = (ω, v)`; the body twist moves the pose by
//!   `q̇ = ½ q (ω + ε v)`.
//! - Names carry frames: `base_from_tool` maps tool coordinates to base coordinates. In a product, equal neighbors
//!   cancel: `base_from_a * a_from_b` is `base_from_b`.
//!
//! # The paper's appendix A, by its names
//!
//! | appendix | here |
//! |---|---|
//! | `quat` | [`quaternion_from_angle_axis`] |
//! | `qmult`, `cquat` | `*` and `conjugate` of [`nalgebra::Quaternion`] |
//! | `decq` | [`angle_axis`] |
//! | `Hp`, `Hn` | [`hamilton_plus`], [`hamilton_minus`] (eq. 9, 10) |
//! | `dHp`, `dHn` | [`dual_hamilton_plus`], [`dual_hamilton_minus`] |
//! | `unitdq` | [`UnitDualQuaternion::from_translation_angle_axis`] (eq. 13) |
//! | `cdualq`, `dqmult` | `conjugate` and `*` of [`DualQuaternion`], [`inverse`](UnitDualQuaternion::inverse) and `*` of [`UnitDualQuaternion`] |
//! | `logdq`, `explogdq` | [`UnitDualQuaternion::half_log`], [`UnitDualQuaternion::half_exp`] (the decoupled pair of eq. 32) |
//! | — | [`UnitDualQuaternion::screw_log`], [`UnitDualQuaternion::screw_exp`] (the true SE(3) pair), [`UnitDualQuaternion::adjoint`] |
//! | `R82dual` | [`DualQuaternion::from_vector8`] |
//! | `R62dual` | [`DualQuaternion::from_vector6`] |
//! | `frameplotter` | its geometry: [`UnitDualQuaternion::half_exp`], then [`UnitDualQuaternion::frame`] |
//!
//! A search in these docs finds each function by its name in the appendix. An example with all of them:
//!
//! ```
//! use dq_algebra::*;
//! use nalgebra::Vector3;
//! let turn = quaternion_from_angle_axis(1.0, &Vector3::z_axis()); // quat (eq. 8)
//! assert_eq!(angle_axis(&turn).0, 1.0); // decq
//! let pose = UnitDualQuaternion::from_translation_angle_axis(Vector3::x(), 1.0, &Vector3::z_axis()); // unitdq (eq. 13)
//! assert!((pose.translation() - Vector3::x()).norm() < 1e-15);
//! let product = pose * pose; // dqmult
//! let by_matrix = dual_hamilton_plus(pose.as_dual_quaternion()) * pose.to_vector8(); // dHp (eq. 9–11)
//! assert!((by_matrix - product.to_vector8()).norm() < 1e-15);
//! assert!((product.half_log()[2] - 1.0).abs() < 1e-15); // logdq (eq. 32): half of the angle 2 rad
//! assert!((product.screw_log()[2] - 2.0).abs() < 1e-15); // the logarithm of SE(3), unlike the paper's
//! ```
//!
//! The tests check all of this: properties of random poses, a grid from 0 past π, and comparisons with nalgebra, the matrix
//! exponential and the paper's printed numbers.
#![warn(clippy::unwrap_used, clippy::expect_used)]
// Both macros panic if nobody reads the stream. Results go through `cli::print`, everything else through `stderr`.
#![warn(clippy::print_stdout, clippy::print_stderr)]

mod dual_quaternion;
mod hamilton;
mod log;
mod log_factors;
mod primitives;
mod quaternion;
mod unit_dual_quaternion;

pub use dual_quaternion::DualQuaternion;
pub use hamilton::{dual_hamilton_minus, dual_hamilton_plus, hamilton_minus, hamilton_plus};
pub use log::{log_coefficients, screw_log, split, stack};
pub use primitives::{Line, Plane};
pub use quaternion::{NotUnit, angle_axis, quaternion_from_angle_axis, rotation_vector, unit_rotation};
pub use unit_dual_quaternion::UnitDualQuaternion;

use thiserror::Error;

/// The eight numbers of a dual quaternion: the real part, then the dual part, each with its scalar first.
pub type Vector8 = nalgebra::SVector<f64, 8>;
/// An 8×8 matrix that acts on a [`Vector8`].
pub type Matrix8 = nalgebra::SMatrix<f64, 8, 8>;

/// The reason why a dual quaternion cannot be normalized to a pose.
#[derive(Clone, Copy, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum DqError {
    /// The real part is zero, so it cannot be scaled to norm 1.
    #[error("a dual quaternion whose real part is 0 is not a pose: expected a norm above 0")]
    ZeroRealPart,
    /// A number is infinite or NaN.
    #[error("a dual quaternion with a non-finite number ({0}) is not a pose")]
    NonFinite(f64),
}
