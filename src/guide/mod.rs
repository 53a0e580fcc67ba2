//! Pages for people who use the program: what it does, how it is used, what was measured.
// In the heads of their tables units stand in brackets, which rustdoc would take for links.
#![allow(rustdoc::broken_intra_doc_links)]

#[doc = include_str!("reference_work.md")]
pub mod reference_work {}

#[doc = include_str!("laws.md")]
pub mod laws {}

#[doc = include_str!("commands.md")]
pub mod commands {}

#[doc = include_str!("bags.md")]
pub mod bags {}

#[doc = include_str!("view.md")]
pub mod view {}

#[doc = include_str!("ros2.md")]
pub mod ros2 {}

#[doc = include_str!("real_robot.md")]
pub mod real_robot {}

#[doc = include_str!("moving_goals.md")]
pub mod moving_goals {}

#[doc = include_str!("secured.md")]
pub mod secured {}

#[doc = include_str!("safety.md")]
pub mod safety {}

#[doc = include_str!("speed.md")]
pub mod speed {}

#[doc = include_str!("contributing.md")]
pub mod contributing {}
