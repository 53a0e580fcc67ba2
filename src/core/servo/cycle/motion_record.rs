//! The record of the motion in progress: its beginning and its outcome.

use super::Servo;
use crate::servo::{Motion, Outcome, Reconfiguration, STREAM};
use dq_metrics::MotionMeter;
use std::time::Duration;

impl Servo {
    /// Records the present outcome of the motion in progress if the outcome has changed.
    pub(super) fn record_motion(&mut self, now: Duration) {
        let revocation = self.requests.consent().revocation();
        let Some(pursuit) = self.mode.pursuit_mut() else { return };
        let stands = pursuit.moved.is_none_or(|moved| now.saturating_sub(moved) > STREAM);
        let is_open = matches!(pursuit.watch.reconfiguration, Reconfiguration::Searching(_));
        let outcome = match (revocation, pursuit.watch.stall) {
            (Some(why), _) => Outcome::Revoked(why),
            // The search will soon return a result, which the record of the stall then includes.
            (None, Some(_)) if is_open => return,
            (None, Some(stall)) => Outcome::Stalled(stall),
            (None, None) if pursuit.record.settled && stands => Outcome::Arrived,
            (None, None) => Outcome::Underway,
        };
        if pursuit.record.outcome.is_none() {
            self.record(Outcome::Underway);
        }
        let joints = self.output.command.len();
        let Some(pursuit) = self.mode.pursuit_mut() else { return };
        let record = &mut pursuit.record;
        match record.outcome {
            // After its arrival, the arm's behavior belongs to no motion, unless a stream continues.
            Some(Outcome::Arrived) if stands => {}
            Some(Outcome::Arrived | Outcome::Stalled(_)) if outcome == Outcome::Underway => {
                record.outcome = Some(outcome);
                record.peak_speeds.resize(joints, 0.0);
            }
            Some(before) if before == outcome || matches!(before, Outcome::Revoked(_)) => {}
            _ => {
                if let (Outcome::Stalled(_), Some(meter)) = (outcome, &mut record.meter) {
                    meter.stalled();
                }
                self.record(outcome);
            }
        }
    }

    /// Ends the motion in progress, unless it has already ended.
    pub(super) fn end_motion(&mut self, outcome: Outcome) {
        let recorded = self.mode.pursuit().and_then(|pursuit| pursuit.record.outcome);
        if recorded.is_some_and(|before| !before.is_end()) {
            self.record(outcome);
        }
    }

    fn record(&mut self, outcome: Outcome) {
        let Some(pursuit) = self.mode.pursuit_mut() else { return };
        let record = &mut pursuit.record;
        record.outcome = Some(outcome);
        let motion = Motion {
            number: self.motions.count,
            goal: pursuit.goal,
            by_joints: pursuit.by_joints,
            stamp: pursuit.stamp,
            asker: pursuit.asker,
            controller: self.settings.controller,
            tool: self.settings.tool_offset,
            start: record.start.map(|(_, pose)| pose),
            began: record.start.map_or(pursuit.received, |(began, _)| began),
            outcome,
            reconfiguration: pursuit.watch.reconfiguration,
            reconfigured: record.reconfigured,
            figures: record.meter.as_ref().map(MotionMeter::figures).unwrap_or_default(),
            // Avoids an allocation if there are no speeds yet, or the record is not needed anymore.
            peak_speeds: match outcome {
                Outcome::Underway => Vec::new(),
                Outcome::Stalled(_) => record.peak_speeds.clone(),
                _ => std::mem::take(&mut record.peak_speeds),
            },
        };
        self.motions.push(motion);
    }
}
