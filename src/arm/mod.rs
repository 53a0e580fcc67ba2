//! Serial arms of revolute and prismatic joints: Denavit–Hartenberg rows, robot descriptions (URDF), forward kinematics, Jacobians.

mod axis;
pub mod bounds;
mod chain;
mod description;
mod dh;
mod error;
mod half_turns;
mod link;
pub(crate) mod pair;
mod state;
mod urdf;
mod urdf_reader;

pub use axis::JointAxis;
pub use chain::{Chain, Joint, JointKind};
pub use description::{DescribedArm, DescribedJoint, DescriptionError, JointLimits, Motion};
pub use dh::{Convention, DhRow};
pub use error::ArmError;
pub use state::ArmState;
pub use urdf_reader::{Description, LONGEST_DESCRIPTION};
