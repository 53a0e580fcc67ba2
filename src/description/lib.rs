#![doc = include_str!("README.md")]
#![warn(clippy::unwrap_used, clippy::expect_used)]
// These macros panic if nobody reads the output. Results go through `cli::print`, everything else through `stderr`.
#![warn(clippy::print_stdout, clippy::print_stderr)]

mod arm;
mod body;
mod collada_file;
mod guess;
pub mod mesh_file;
mod places;
mod stl_file;
mod urdf;
mod urdf_lenient;
mod urdf_reader;
mod urdf_shapes;
mod urdf_tree;

pub use arm::{DescribedArm, DescribedJoint, DescriptionError, JointLimits, Mimic, Motion};
pub use body::{FittedBody, LIMB_RADIUS, fitted};
pub use guess::{Guess, guess_frames};
pub use places::Place;
pub use urdf_reader::Description;
pub use urdf_shapes::{Collision, Rgb, Shape, Visual, collisions, visuals};
pub use urdf_tree::{LONGEST_DESCRIPTION, oddity};
