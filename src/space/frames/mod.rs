//! Where frames are with respect to each other: what TF publishes, kept for a while, and looked up at a time.
//!
//! No I/O, no clock: stamps are numbers, and time is an argument. Between two transforms of a frame the rotation is interpolated on
//! its great circle and the translation on a straight line, each by itself: so does tf2, and a goal must be where RViz and all other
//! nodes of ROS 2 see it. On a screw (ScLERP) it would be elsewhere by up to the sagitta of the arc, 0.1 mm for 10 mm and 5° a step.
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
