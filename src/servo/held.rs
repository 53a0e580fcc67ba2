//! What a servo keeps of a motion while the arm stands.

use super::{Asker, Goal};
use std::time::Duration;

/// The goal of an arm that stands: one that is paused, has stalled, or whose consent was revoked. With the settings it is all that
/// decides what the arm does next, so that a replay can begin there. Times are of the cycle's clock.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Held {
    /// The goal.
    pub goal: Goal,
    /// The stamp of its message \[ns\].
    pub stamp: i64,
    /// Who asked for it.
    pub asker: Asker,
    /// When that was sent.
    pub sent: Duration,
    /// When the goal was received.
    pub received: Duration,
    /// Whether the arm has stalled.
    pub stalled: bool,
    /// Whether the consent was revoked.
    pub revoked: bool,
}
