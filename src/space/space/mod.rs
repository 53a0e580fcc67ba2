//! The space around the arm: keep-outs, the arm's own body, keep-ins of its tool, and the distances between them.
//!
//! ```
//! use dq_kinematics::arm::{Chain, Convention, DhRow};
//! use dq_space::space::{Body, KeepOut, Near, Placed, Scene};
//! let row = |a| DhRow { alpha: 0.0, a, d: 0.0, theta_offset: 0.0 };
//! let chains = [Chain::new(Convention::ModifiedDh, &[row(0.0), row(0.4), row(0.3)])?];
//! // Two links of 0.4 m and 0.3 m in a plane, with a radius of 5 cm, and a ball near them.
//! let ball: KeepOut = "ball sphere 0.9 0.0 0.0 0.1".parse()?;
//! let scene = Scene::new(Body::along(&chains, 0.05), vec![ball], &chains, &[(-3.0, 3.0); 3])?;
//! let mut placed = Placed::of(&scene);
//! placed.place(&scene, &chains, &[0.0; 3]);
//! let mut near = Vec::with_capacity(9);
//! placed.near(&scene, std::iter::empty(), |_| 0.1, &mut near);
//! let nearest = near.iter().min_by(|a: &&Near, b| a.gap.distance.total_cmp(&b.gap.distance)).unwrap();
//! assert!((nearest.gap.distance - 0.05).abs() < 1e-12);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

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
