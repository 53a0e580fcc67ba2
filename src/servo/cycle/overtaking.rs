//! A goal that waits for its TF frame is rejected if, while it waited, a stop, a twist or another task came, or the robot was away,
//! jumped or was blocked.

use super::Servo;
use crate::servo::{Rearm, Rejection, Task};
use std::time::Duration;

/// The latest event after which no goal that came before it may drive the arm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Overtaking {
    /// Goals that came up to then are meant.
    until: Duration,
    happened: Duration,
    why: Rearm,
}

impl<T: Task> Servo<T> {
    /// Lets no goal drive the arm that came up to `until` and is found from `now` on.
    pub(super) fn overtake(&mut self, until: Duration, now: Duration, why: Rearm) {
        if self.overtaking.is_none_or(|before| before.until <= until) {
            self.overtaking = Some(Overtaking { until, happened: now, why });
        }
    }

    /// Why a goal that was found now, and came at `came`, is not wanted any more.
    pub(super) fn overtaken(&self, came: Duration) -> Option<Rejection> {
        let Overtaking { happened, why, .. } = self.overtaking.filter(|it| came <= it.until)?;
        let after = happened.saturating_sub(came).as_secs_f64();
        let why = if matches!(why, Rearm::CameLater(_)) { Rearm::CameLater(after) } else { why };
        Some(Rejection::Overtaken(why))
    }
}
