//! What the labels of a servo's commands say that it was asked for.

use crate::wire::CycleLabel;
use std::time::Duration;

/// No twist is in force for longer than this.
const LONGEST_TWIST: Duration = Duration::from_secs(1);

/// Follows the labels of the commands of a servo from one start of it to the next.
#[derive(Default)]
pub(super) struct Asked {
    stops: Option<u64>,
    goals: u64,
    goals_before_stop: u64,
    twists: u64,
    /// Since the last twist came.
    since_twist: Duration,
    last_twist: Duration,
}

impl Asked {
    /// Takes the label of the next command. True where the servo was stopped since the one before; stops before the first one that is
    /// known are of no account.
    pub fn take(&mut self, label: &CycleLabel) -> bool {
        if std::mem::replace(&mut self.twists, label.twists) != label.twists {
            self.last_twist = label.now;
        }
        self.since_twist = label.now.saturating_sub(self.last_twist);
        let stopped = self.stops.replace(label.stops).is_some_and(|before| before < label.stops);
        if stopped {
            self.goals_before_stop = label.goals;
        }
        self.goals = label.goals;
        stopped
    }

    /// Whether a goal has come since the servo's start, or since it was stopped.
    pub fn has_goal(&self) -> bool {
        self.goals > self.goals_before_stop
    }

    /// Whether a twist may be in force.
    pub fn has_twist(&self) -> bool {
        self.twists > 0 && self.since_twist <= LONGEST_TWIST
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn label(stops: u64, goals: u64, twists: u64, now: u64) -> CycleLabel {
        CycleLabel { stops, goals, twists, now: Duration::from_millis(now), ..CycleLabel::new(1) }
    }

    #[test]
    fn stops_are_those_that_were_seen_to_happen_and_goals_those_after_them() {
        let mut asked = Asked::default();
        assert!(!asked.has_goal() && !asked.take(&label(2, 3, 0, 0)) && asked.has_goal());
        assert!(asked.take(&label(3, 5, 0, 1)) && !asked.has_goal());
        assert!(!asked.take(&label(3, 6, 0, 2)) && asked.has_goal());
    }

    #[test]
    fn a_twist_is_in_force_for_a_second() {
        let mut asked = Asked::default();
        for (twists, now, has) in [(0, 0, false), (1, 5000, true), (1, 6000, true), (1, 6001, false)] {
            asked.take(&label(0, 0, twists, now));
            assert_eq!(asked.has_twist(), has, "{now}");
        }
    }
}
