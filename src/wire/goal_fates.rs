//! What became of goals, so that whoever sent one learns the fate of its own.

use crate::servo::Rejection;
use crate::wire::messages::Time;

/// The fates of the last goals. A goal is known by the stamp in its header, which its sender should make unique.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct GoalFates {
    taken: Option<Time>,
    rejected: Option<(Time, Rejection)>,
}

impl GoalFates {
    /// Notes that the goal stamped `stamp` was taken.
    pub fn take(&mut self, stamp: &Time) {
        self.taken = Some(stamp.clone());
    }

    /// Notes that the goal stamped `stamp` was rejected, and why.
    pub fn reject(&mut self, stamp: &Time, why: Rejection) {
        self.rejected = Some((stamp.clone(), why));
    }

    /// The stamp of the last goal that was taken.
    pub fn taken(&self) -> Option<&Time> {
        self.taken.as_ref()
    }

    /// The stamp of the last goal that was rejected, and the reason.
    pub fn rejected(&self) -> Option<&(Time, Rejection)> {
        self.rejected.as_ref()
    }
}
