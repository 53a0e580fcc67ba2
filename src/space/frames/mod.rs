//! Transforms between frames. The module keeps the recent transforms that TF publishes, and finds the pose of a frame at a given time.
//!
//! The module does no I/O and reads no clock: stamps are numbers, and time is an argument. Between two transforms of a frame, the rotation
//! is interpolated on a great circle and the translation on a straight line, independently. tf2 does the same, and a goal must be at the
//! place where RViz and all other ROS 2 nodes see it. On a screw (ScLERP), the place would deviate by up to the sagitta of the arc: 0.1 mm
//! for steps of 10 mm and 5°.
//!
//! ```
//! use dq_space::frames::{FrameTree, Transform};
//! let mut tree = FrameTree::default();
//! let table = Transform {
//!     parent: "base_link", child: "table", stamp: 0, translation: [0.5, 0.0, 0.2], rotation_xyzw: [0.0, 0.0, 0.0, 1.0],
//! };
//! tree.insert(&table, true)?;
//! let base_from_table = tree.lookup("base_link", "table", 0)?;
//! assert_eq!(base_from_table.translation().x, 0.5);
//! assert_eq!(tree.lookup("base_link", "chair", 0).unwrap_err().label(), "unknown_frame");
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod error;
mod followed;
mod history;
mod keep_outs;
mod tree;
mod waiting;

pub use error::{FrameError, Ignored};
pub use followed::{Followed, FrameMotion};
pub use keep_outs::{FramedKeepOut, FramedKeepOuts, KeepOutKey, KeepOutRefused};
pub use tree::{FrameTree, Transform};
pub use waiting::{Answer, FramedGoal, WaitingGoals};
