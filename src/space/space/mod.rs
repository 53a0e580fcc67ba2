//! The space around the arm: keep-outs, the arm's own body, keep-ins of its tool, and the distances between them.

mod body;
mod fitted;
mod gap;
mod hull;
mod inside;
mod keep_out;
mod meetings;
mod name;
mod placed;
mod scene;
mod segment;
mod shape;
mod solid;

pub use body::{Body, Capsule, CapsuleError};
pub use fitted::{Fitted, merged};
pub use gap::Gap;
pub use hull::Hull;
pub use keep_out::KeepOut;
pub use name::{LONGEST as LONGEST_NAME, Name, NameError};
#[cfg(debug_assertions)]
#[doc(hidden)]
pub use placed::MEASURED;
pub use placed::{Near, Placed};
pub use scene::{LeftOut, MOST_CAPSULES, MOST_KEEP_OUTS, MOST_PAIRS, Pair, Scene, SceneError, Tool, Why};
pub use segment::Segment;
pub use shape::Shape;
pub use solid::{KeepOutError, NO_TURN, Solid};
