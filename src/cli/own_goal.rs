//! Tracks a goal that this process has sent, by the reports on the servo's `~/motions`.

use super::not_arrived::NotArrived;
use dq_core::servo::{Input, State};
use dq_messages::messages::Time;
use dq_wire::{MotionReport, Outcome, StatusReport};
use std::time::{Duration, Instant};

/// The command gives up if the servo has not driven the arm toward the goal for this long, for example because the servo is paused.
const PATIENCE: Duration = Duration::from_secs(5);

/// The longest time until the servo accepts or rejects a goal message: a goal waits for its frame for at most 2 s. If there is no
/// response within this time, the message is lost.
const TO_BE_TAKEN: Duration = Duration::from_millis(2500);

/// A goal message to which there is no response is sent again after this time, because messages can be lost.
const REPEAT: Duration = Duration::from_millis(500);

/// A goal that was sent. The stamp identifies the goal until the servo gives it the number of a motion.
pub(super) struct OwnGoal {
    stamp: String,
    sent: Instant,
    last_sent: Instant,
    in_frame: bool,
    /// The number that the servo gives the motion to the goal; `None` until the servo reports it.
    number: Option<u64>,
    /// The time at which the servo last drove the arm.
    driven: Instant,
    /// The time at which the servo last reported this goal; `None` if it has not reported the goal yet.
    had: Option<Instant>,
}

impl OwnGoal {
    /// Creates the state of a goal with the time stamp `stamp`. `in_frame` is true if the goal is in a frame that the servo
    /// must look up in TF.
    pub fn sent(stamp: &Time, in_frame: bool) -> Self {
        let now = Instant::now();
        Self {
            stamp: stamp.to_string(),
            sent: now,
            last_sent: now,
            in_frame,
            number: None,
            driven: now,
            had: None,
        }
    }

    /// Returns the time after which to send the goal again. Each message of a goal in another frame waits for the frame
    /// independently. So the next message is sent only after the previous one has expired.
    fn repeat(&self) -> Duration {
        if self.in_frame { TO_BE_TAKEN } else { REPEAT }
    }

    /// Returns whether the caller must send the goal again now.
    pub fn send_again(&mut self) -> bool {
        let is_due = self.had.is_none() && self.last_sent.elapsed() > self.repeat();
        if is_due {
            self.last_sent = Instant::now();
        }
        is_due
    }

    /// Returns true if a stop would withdraw this goal: `report` shows that the goal is in force, or that it may still wait for its
    /// frame. Returns false if the goal has ended or has expired. Returns `None` if neither is known yet.
    pub fn is_left(&self, report: &StatusReport) -> Option<bool> {
        if report.goal_stamp.as_ref() == Some(&self.stamp) {
            return Some(true);
        }
        if self.had.is_some() || self.last_sent.elapsed() > TO_BE_TAKEN {
            return Some(false);
        }
        // The goal may still wait for its frame. If no other input is active, a stop withdraws only this goal, and no goal of other
        // senders.
        let is_free = report.goal.is_none() && report.input != Some(Input::Twist);
        (self.in_frame && is_free).then_some(true)
    }

    /// Returns the remaining time in which the servo may still accept or reject the goal message.
    pub fn open_for(&self) -> Duration {
        TO_BE_TAKEN.saturating_sub(self.last_sent.elapsed())
    }

    /// Returns whether `motion` is known to be the motion to this goal.
    pub fn is_of(&self, motion: &MotionReport) -> bool {
        motion.goal_stamp == self.stamp || self.number == Some(motion.number)
    }

    /// Processes a report of a motion or a rejected goal. Returns the motion to this goal once the arm has arrived.
    pub fn hear(&mut self, motion: MotionReport) -> Result<Option<MotionReport>, NotArrived> {
        if motion.goal_stamp == self.stamp {
            self.number = self.number.or((motion.number > 0).then_some(motion.number));
            self.had = Some(Instant::now());
        } else if self.number != Some(motion.number) {
            return Ok(None);
        }
        match motion.outcome {
            Outcome::Underway => Ok(None),
            // Keep waiting: before the timeout, someone may request a reconfiguration, with which the arm continues.
            Outcome::Stalled if motion.may_be_reconfigured() => Ok(None),
            Outcome::Arrived => Ok(Some(motion)),
            Outcome::Replaced => Err(NotArrived::Replaced(motion.sentence())),
            Outcome::Rejected | Outcome::Stalled | Outcome::Revoked => {
                Err(NotArrived::Ended(motion.sentence()))
            }
        }
    }

    /// Returns an error if `report` shows that the arm will not arrive.
    pub fn watch(&mut self, report: &StatusReport, timeout: Duration) -> Result<(), NotArrived> {
        if report.goal_stamp.as_ref() == Some(&self.stamp) {
            self.had = Some(Instant::now());
        }
        let Some(had) = self.had else {
            let lost = self.sent.elapsed() > self.repeat() + TO_BE_TAKEN;
            return match (self.sent.elapsed() > timeout || lost, report.state) {
                (false, _) => Ok(()),
                (true, State::WaitingForState | State::StaleState) => {
                    // The distances in the report refer to another goal.
                    let report = StatusReport { figures: None, ..report.clone() };
                    Err(NotArrived::NoRobot(report.sentence()))
                }
                (true, _) => {
                    Err(NotArrived::NotTaken(timeout.min(self.repeat() + TO_BE_TAKEN).as_secs_f64()))
                }
            };
        };
        let is_driven = matches!(
            report.state,
            State::Tracking | State::JointLimit | State::Constrained | State::Reconfiguring
        );
        if is_driven || report.may_be_reconfigured() {
            self.driven = Instant::now();
        }
        let impatient = self.driven.elapsed() > PATIENCE;
        match report.state {
            _ if report.goal.is_none() && had.elapsed() > REPEAT => Err(NotArrived::Dropped),
            State::WaitingForState | State::StaleState if impatient || self.sent.elapsed() > timeout => {
                Err(NotArrived::NoRobot(report.sentence()))
            }
            _ if self.sent.elapsed() > timeout => {
                Err(NotArrived::TimedOut { seconds: timeout.as_secs_f64(), status: report.sentence() })
            }
            State::Paused if impatient => Err(NotArrived::Paused(report.sentence())),
            _ if impatient && report.state != State::Settled => Err(NotArrived::Stands(report.sentence())),
            _ => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use dq_metrics::Figures;

    const TIMEOUT: Duration = Duration::from_secs(60);

    fn stamp(sec: i32) -> Time {
        Time { sec, nanosec: 0 }
    }

    /// Returns the report of a servo whose goal has this stamp.
    fn report(of: i32, state: State) -> StatusReport {
        StatusReport {
            state,
            law: "logc".to_owned(),
            aim: None,
            input: None,
            goal: Some([0.0; 7]),
            goal_beyond_reach: false,
            goal_count: 1,
            goal_stamp: Some(stamp(of).to_string()),
            reason: None,
            joint_at_limit: None,
            clearance: None,
            reconfiguration: None,
            figures: Some(Figures::default()),
            cycle_jitter: Default::default(),
        }
    }

    fn motion(number: u64, of: i32, outcome: Outcome) -> MotionReport {
        let rejected = MotionReport::rejected(&stamp(of), None, "why".to_owned());
        MotionReport { number, outcome, ..rejected }
    }

    #[test]
    fn a_goal_arrives_by_its_own_motion_and_by_no_other() {
        let mut goal = OwnGoal::sent(&stamp(2), false);
        let mut hear = |number, of, outcome| goal.hear(motion(number, of, outcome)).unwrap();
        assert_eq!(hear(1, 1, Outcome::Arrived), None, "one before it");
        assert_eq!(hear(0, 7, Outcome::Rejected), None, "another's");
        assert_eq!(hear(2, 2, Outcome::Underway), None);
        // Another sender of the same goal does not start another motion.
        assert_eq!(hear(2, 3, Outcome::Arrived).map(|motion| motion.number), Some(2));
    }

    #[test]
    fn every_other_outcome_is_an_error_with_its_reason() {
        let end = |outcome| {
            let mut goal = OwnGoal::sent(&stamp(2), false);
            goal.hear(motion(2, 2, Outcome::Underway)).unwrap();
            goal.hear(motion(2, 2, outcome)).unwrap_err().to_string()
        };
        for (outcome, words) in [
            (Outcome::Stalled, "stalled after 0.00 s, 0.0 mm and 0.00° from the goal: why"),
            (
                Outcome::Replaced,
                "replaced after 0.00 s, 0.0 mm and 0.00° from the goal: why: somebody else publishes goals too",
            ),
            (Outcome::Revoked, "revoked after 0.00 s, 0.0 mm and 0.00° from the goal: why"),
            (Outcome::Rejected, "the goal was rejected: why"),
        ] {
            assert_eq!(end(outcome), words);
        }
    }

    #[test]
    fn a_stalled_motion_that_may_be_reconfigured_is_awaited_until_the_timeout() {
        let mut goal = OwnGoal::sent(&stamp(2), false);
        goal.driven = Instant::now().checked_sub(2 * PATIENCE).unwrap();
        let stalled = motion(2, 2, Outcome::Stalled);
        let found = MotionReport { reconfiguration: "found".to_owned(), ..stalled.clone() };
        assert_eq!(goal.hear(found).unwrap(), None);
        let waits = StatusReport { reconfiguration: Some("found".to_owned()), ..report(2, State::Stalled) };
        assert!(goal.watch(&waits, TIMEOUT).is_ok());
        assert!(matches!(goal.watch(&waits, Duration::ZERO), Err(NotArrived::TimedOut { .. })));
        goal.driven = Instant::now().checked_sub(2 * PATIENCE).unwrap();
        let stands = StatusReport { reconfiguration: Some("not_found".to_owned()), ..waits };
        assert!(matches!(goal.watch(&stands, TIMEOUT), Err(NotArrived::Stands(_))));
        let none = MotionReport { reconfiguration: "not_found".to_owned(), ..stalled };
        assert!(matches!(goal.hear(none), Err(NotArrived::Ended(_))));
    }

    #[test]
    fn the_timeout_applies_to_goals_in_progress_and_to_those_not_yet_taken() {
        let mut goal = OwnGoal::sent(&stamp(2), false);
        let other = report(1, State::Tracking);
        assert!(goal.watch(&other, TIMEOUT).is_ok());
        let late = goal.watch(&other, Duration::ZERO).unwrap_err().to_string();
        assert_eq!(
            late, "the servo has not taken the goal within 0 s",
            "the other goal's way is not this one's"
        );
        let late = goal.watch(&report(1, State::StaleState), Duration::ZERO).unwrap_err().to_string();
        assert!(late.contains("no joint states") && !late.contains("mm"), "{late}");
        let late = goal.watch(&report(2, State::Tracking), Duration::from_nanos(1)).unwrap_err().to_string();
        assert!(late.starts_with("not arrived after 0.000000001 s: tracking, 0.0 mm"), "{late}");
        let late = goal.watch(&report(2, State::StaleState), Duration::ZERO);
        assert!(matches!(late, Err(NotArrived::NoRobot(_))), "{late:?}");
    }

    #[test]
    fn a_goal_that_waits_for_its_frame_is_left_until_its_outcome_is_known_and_another_s_is_not() {
        let nothing = StatusReport { goal: None, goal_stamp: None, ..report(1, State::Holding) };
        let jogged = StatusReport { input: Some(Input::Twist), ..nothing.clone() };
        let mut goal = OwnGoal::sent(&stamp(2), true);
        let left = [&nothing, &jogged, &report(1, State::Tracking)].map(|report| goal.is_left(report));
        assert_eq!(left, [Some(true), None, None]);
        assert!(!goal.send_again(), "another one would wait by itself");
        assert!(goal.watch(&report(2, State::Tracking), TIMEOUT).is_ok());
        assert_eq!(goal.is_left(&report(2, State::Tracking)), Some(true));
        assert_eq!(goal.is_left(&report(3, State::Tracking)), Some(false));
        let in_base = OwnGoal::sent(&stamp(2), false);
        assert_eq!(in_base.is_left(&nothing), None, "it comes at once or is rejected");
        let mut rejected = OwnGoal::sent(&stamp(2), true);
        assert!(rejected.hear(motion(0, 2, Outcome::Rejected)).is_err());
        assert_eq!(rejected.is_left(&nothing), Some(false));
    }
}
