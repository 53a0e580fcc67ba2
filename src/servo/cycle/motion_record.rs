//! The record of the motion in progress: when it begins, and what becomes of it.

use super::Servo;
use super::tracking::STREAM;
use crate::servo::{Motion, MotionMeter, Outcome, Reconfiguration};
use std::time::Duration;

impl Servo {
    /// Records what has become of the motion in progress by now, where that is news.
    pub(super) fn record_motion(&mut self, now: Duration) {
        let Some(tracking) = &mut self.goals.tracking else { return };
        let stands = tracking.moved.is_none_or(|moved| now.saturating_sub(moved) > STREAM);
        let is_open = matches!(tracking.watch.reconfiguration, Reconfiguration::Searching(_));
        let outcome = match (self.consent.revocation(), tracking.watch.stall) {
            (Some(why), _) => Outcome::Revoked(why),
            // What there is to say of it is known in a moment.
            (None, Some(_)) if is_open => return,
            (None, Some(stall)) => Outcome::Stalled(stall),
            (None, None) if tracking.settled && stands => Outcome::Arrived,
            (None, None) => Outcome::Underway,
        };
        if tracking.recorded.is_none() {
            self.record(Outcome::Underway);
        }
        let Some(tracking) = &mut self.goals.tracking else { return };
        match tracking.recorded {
            // What the arm does after it has arrived belongs to no motion, until a stream goes on.
            Some(Outcome::Arrived) if stands => {}
            Some(Outcome::Arrived | Outcome::Stalled(_)) if outcome == Outcome::Underway => {
                tracking.recorded = Some(outcome);
                tracking.peak_speeds.resize(self.output.command.len(), 0.0);
            }
            Some(before) if before == outcome || matches!(before, Outcome::Revoked(_)) => {}
            _ => {
                if let (Outcome::Stalled(_), Some(meter)) = (outcome, &mut tracking.meter) {
                    meter.stalled();
                    self.status.figures = meter.figures();
                }
                self.record(outcome);
            }
        }
    }

    /// Ends the motion in progress, if there is one that has not come to its end.
    pub(super) fn end_motion(&mut self, outcome: Outcome) {
        let recorded = self.goals.tracking.as_ref().and_then(|tracking| tracking.recorded);
        if recorded.is_some_and(|before| !before.is_end()) {
            self.record(outcome);
        }
    }

    fn record(&mut self, outcome: Outcome) {
        let Some(tracking) = &mut self.goals.tracking else { return };
        tracking.recorded = Some(outcome);
        let motion = Motion {
            number: self.status.goal_count,
            goal: tracking.goal,
            stamp: tracking.stamp,
            asker: tracking.asker,
            controller: self.settings.controller,
            tool: self.settings.tool_offset,
            start: tracking.start.map(|(_, pose)| pose),
            began: tracking.start.map_or(tracking.received, |(began, _)| began),
            outcome,
            reconfiguration: tracking.watch.reconfiguration,
            reconfigured: tracking.reconfigured,
            figures: tracking.meter.as_ref().map(MotionMeter::figures).unwrap_or_default(),
            // Without an allocation where there is nothing yet, or nothing to come.
            peak_speeds: match outcome {
                Outcome::Underway => Vec::new(),
                Outcome::Stalled(_) => tracking.peak_speeds.clone(),
                _ => std::mem::take(&mut tracking.peak_speeds),
            },
        };
        self.goals.motions.push(motion);
    }
}
