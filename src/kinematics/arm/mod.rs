//! Serial arms of revolute and prismatic joints: Denavit–Hartenberg rows, forward kinematics, Jacobians.
//!
//! Two links of 0.4 m and 0.3 m in a plane, by Craig's rows:
//!
//! ```
//! use dq_kinematics::arm::{ArmState, Chain, Convention, DhRow};
//! use std::f64::consts::FRAC_PI_2;
//! let row = |a| DhRow { alpha: 0.0, a, d: 0.0, theta_offset: 0.0 };
//! // The third row describes the hand, which turns with its own joint.
//! let chain = Chain::new(Convention::ModifiedDh, &[row(0.0), row(0.4), row(0.3)])?;
//! let mut arm = ArmState::new(&chain);
//! chain.evaluate(&[0.0, FRAC_PI_2, 0.0], &mut arm)?;
//! let tool = arm.tool_point();
//! assert!((tool.x - 0.4).abs() < 1e-15 && (tool.y - 0.3).abs() < 1e-15);
//! // The velocity of the tool point at 1 rad/s of the first joint: that joint's vector to the tool point, turned by 90°.
//! let (_, velocity) = arm.tool_motions().next().unwrap();
//! assert!((velocity.x + 0.3).abs() < 1e-15 && (velocity.y - 0.4).abs() < 1e-15);
//! # Ok::<(), dq_kinematics::arm::ArmError>(())
//! ```

mod arms;
pub mod bounds;
mod chain;
mod coupling;
mod dh;
mod error;
mod half_turns;
mod joint;
mod link;
pub(crate) mod pair;
mod state;

pub use arms::{Arms, Reach, ToolSpeed};
pub use chain::Chain;
pub use coupling::Coupling;
pub use dh::{Convention, DhRow};
pub use error::ArmError;
pub use joint::{Joint, JointKind};
pub use state::ArmState;
