//! Serial arms of revolute and prismatic joints: Denavit–Hartenberg rows, robot descriptions (URDF), forward kinematics, Jacobians.

pub mod bounds;
mod chain;
mod description;
mod dh;
mod error;
mod half_turns;
mod link;
mod state;
mod urdf;
mod urdf_reader;

pub use chain::{Chain, Joint, JointKind};
pub use description::{DescribedArm, DescribedJoint, DescriptionError, JointLimits, Motion};
pub use dh::{Convention, DhRow};
pub use error::ArmError;
pub use state::{ArmState, JointAxis};
pub use urdf_reader::{Description, LONGEST_DESCRIPTION};
