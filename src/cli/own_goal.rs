//! The fate of a goal that this process has sent, by the servo's status reports.

use super::not_arrived::{NotArrived, Standing};
use crate::servo::{Figures, Input, State};
use crate::wire::StatusReport;
use crate::wire::messages::Time;
use std::time::{Duration, Instant};

/// A servo that stands this long will not move by itself.
const PATIENCE: Duration = Duration::from_secs(5);

/// A servo that stalled gets this long to be heard of again: it has been patient already.
const GRACE: Duration = Duration::from_millis(500);

/// A message of a goal is taken or rejected within this time, or lost: no servo lets one wait for its frame for more than 2 s.
const TO_BE_TAKEN: Duration = Duration::from_millis(2500);

/// A goal of which nothing was heard is sent again after this long, the same message: it can be lost on its way.
const REPEAT: Duration = Duration::from_millis(500);

/// What becomes of a goal. Its stamp distinguishes it from all others; once it is taken, the servo's count of goals says whether it is
/// still the one that is pursued.
pub(super) struct OwnGoal {
    stamp: String,
    count_before: u64,
    sent: Instant,
    last_sent: Instant,
    in_frame: bool,
    taken: Option<Taken>,
    /// When the servo last drove the arm.
    driven: Instant,
}

struct Taken {
    count: u64,
    /// What the motion had come to, where an earlier goal of the same pose began it.
    before: Figures,
}

impl OwnGoal {
    /// Of a goal stamped `stamp` in `frame` (empty: the base frame), sent after the report `before`.
    pub fn sent(stamp: &Time, frame: &str, before: &StatusReport) -> Self {
        let now = Instant::now();
        Self {
            stamp: stamp.to_string(),
            count_before: before.goal_count,
            sent: now,
            last_sent: now,
            in_frame: !frame.is_empty(),
            taken: None,
            driven: now,
        }
    }

    /// Whether the servo pursues this goal by this very message at the report.
    fn is_in_force(&self, report: &StatusReport) -> bool {
        report.goal_stamp.as_ref() == Some(&self.stamp)
    }

    /// When to send it again. Each message of a goal waits for its frame by itself: another one is due only when the one before cannot
    /// be taken any more.
    fn repeat(&self) -> Duration {
        if self.in_frame { TO_BE_TAKEN } else { REPEAT }
    }

    /// Whether it is to be sent again now, after the report; the caller does so.
    pub fn send_again(&mut self, report: &StatusReport) -> bool {
        let is_due = self.may_be_lost(report) && self.last_sent.elapsed() > self.repeat();
        if is_due {
            self.last_sent = Instant::now();
        }
        is_due
    }

    /// Whether the servo has this goal at the report, or can be kept from taking it only by a stop; none where that is still open.
    pub fn is_left(&self, report: &StatusReport) -> Option<bool> {
        if self.is_in_force(report) {
            return Some(true);
        }
        if self.taken.is_some() || self.is_rejected(report) || self.last_sent.elapsed() > TO_BE_TAKEN {
            return Some(false);
        }
        // Where nothing else rules, a stop does away with what waits for its frame, and with nothing of others.
        let is_free = report.goal.is_none() && report.input != Some(Input::Twist);
        (self.in_frame && is_free).then_some(true)
    }

    /// How long it may still be open what becomes of it.
    pub fn open_for(&self) -> Duration {
        TO_BE_TAKEN.saturating_sub(self.last_sent.elapsed())
    }

    /// Whether no goal at all has come to the servo since this one was sent: it may be sent again.
    fn may_be_lost(&self, report: &StatusReport) -> bool {
        self.taken.is_none() && report.goal_count == self.count_before && !self.is_rejected(report)
    }

    /// Whether the pursuit is over at this report, one way or the other: the report with this goal's own figures where the arm
    /// has arrived.
    pub fn judge(
        &mut self,
        report: &StatusReport,
        timeout: Duration,
    ) -> Result<Option<StatusReport>, NotArrived> {
        self.follow(report)?;
        let own = self.own_figures(report);
        let Some(own) = own else {
            return if self.sent.elapsed() > timeout { Err(not_taken(report, timeout)) } else { Ok(None) };
        };
        match own.state {
            State::Settled => Ok(Some(own)),
            _ if self.sent.elapsed() > timeout => Err(timed_out(&own, timeout)),
            state => self.patience(state, &own).map(|()| None),
        }
    }

    /// The report with the figures of the motion since this goal was sent; none before it was taken.
    pub fn own_figures(&self, report: &StatusReport) -> Option<StatusReport> {
        let before = self.taken.as_ref()?.before;
        let since = |figures: Figures| Figures {
            elapsed: figures.elapsed - before.elapsed,
            arrival_time: figures.arrival_time.map(|time| (time - before.elapsed).max(0.0)),
            path_length: figures.path_length - before.path_length,
            ..figures
        };
        Some(StatusReport { figures: report.figures.map(since), ..report.clone() })
    }

    fn is_rejected(&self, report: &StatusReport) -> bool {
        report.rejected_goal.as_ref().is_some_and(|(stamp, _)| *stamp == self.stamp)
    }

    /// Whether the goal is taken, and is not lost to another.
    fn follow(&mut self, report: &StatusReport) -> Result<(), NotArrived> {
        match (&self.taken, &report.rejected_goal) {
            (None, Some((stamp, why))) if *stamp == self.stamp => Err(NotArrived::Rejected(why.clone())),
            (None, _) if self.is_in_force(report) => {
                // Where the servo had this goal already, its figures began before this message.
                let joined = report.goal_count == self.count_before;
                let before = report.figures.filter(|_| joined).unwrap_or_default();
                self.taken = Some(Taken { count: report.goal_count, before });
                Ok(())
            }
            (None, _) if self.sent.elapsed() <= self.repeat() + TO_BE_TAKEN => Ok(()),
            (None, _) if report.goal_count > self.count_before => Err(NotArrived::OtherGoal),
            (None, _) => Err(NotArrived::NotTaken((self.repeat() + TO_BE_TAKEN).as_secs_f64())),
            (Some(_), _) if report.goal.is_none() => Err(NotArrived::Dropped),
            (Some(taken), _) if report.goal_count != taken.count => Err(NotArrived::OtherGoal),
            (Some(_), _) => Ok(()),
        }
    }

    /// Gives up where the servo has not driven the arm for too long.
    fn patience(&mut self, state: State, report: &StatusReport) -> Result<(), NotArrived> {
        if matches!(state, State::Tracking | State::JointLimit) {
            self.driven = Instant::now();
        }
        let patience = if state == State::Stalled { GRACE } else { PATIENCE };
        if self.driven.elapsed() <= patience {
            return Ok(());
        }
        let standing = Box::new(Standing::from(report));
        Err(match state {
            State::WaitingForState | State::StaleState => NotArrived::NoRobot(standing),
            State::Paused => NotArrived::Paused(standing),
            _ if report.goal_beyond_reach => NotArrived::BeyondReach(standing),
            _ => NotArrived::Stalled { standing },
        })
    }
}

/// Why a goal that the servo has not taken did not arrive. The distances in `report` are to another goal, so they are left out.
fn not_taken(report: &StatusReport, timeout: Duration) -> NotArrived {
    match report.state {
        State::WaitingForState | State::StaleState => {
            NotArrived::NoRobot(Box::new(Standing::from(&StatusReport { figures: None, ..report.clone() })))
        }
        _ => NotArrived::NotTaken(timeout.as_secs_f64()),
    }
}

fn timed_out(report: &StatusReport, timeout: Duration) -> NotArrived {
    let standing = Box::new(Standing::from(report));
    match report.state {
        State::WaitingForState | State::StaleState => NotArrived::NoRobot(standing),
        _ if report.goal_beyond_reach => NotArrived::BeyondReach(standing),
        _ => NotArrived::TimedOut { seconds: timeout.as_secs_f64(), standing },
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TIMEOUT: Duration = Duration::from_secs(60);

    fn stamp(sec: i32) -> Time {
        Time { sec, nanosec: 0 }
    }

    /// A report of a servo whose goal number `count` came with this stamp.
    fn report(count: u64, of: i32, state: State) -> StatusReport {
        StatusReport {
            state,
            law: "logc".to_owned(),
            aim: None,
            input: None,
            goal: Some([0.0; 7]),
            goal_beyond_reach: false,
            goal_count: count,
            goal_stamp: Some(stamp(of).to_string()),
            rejected_goal: None,
            stall: None,
            reason: None,
            joint_at_limit: None,
            figures: Some(Figures {
                elapsed: 6.0,
                path_length: 0.6,
                arrival_time: Some(5.0),
                ..Figures::default()
            }),
            cycle_jitter_us: (0.0, 0.0),
        }
    }

    fn rejected(of: i32) -> StatusReport {
        StatusReport {
            rejected_goal: Some((stamp(of).to_string(), "no such frame".to_owned())),
            ..report(1, 1, State::Settled)
        }
    }

    #[test]
    fn a_rejected_goal_is_never_reached_and_another_s_rejection_fails_none() {
        let before = report(1, 1, State::Settled);
        let mut goal = OwnGoal::sent(&stamp(2), "", &before);
        // The arm stands where this goal would have it, by another one.
        assert!(matches!(goal.judge(&before, TIMEOUT), Ok(None)));
        assert!(matches!(goal.judge(&rejected(7), TIMEOUT), Ok(None)));
        assert!(
            matches!(goal.judge(&rejected(2), TIMEOUT), Err(NotArrived::Rejected(why)) if why == "no such frame")
        );
        assert!(!goal.may_be_lost(&rejected(2)) && goal.may_be_lost(&rejected(7)));
    }

    #[test]
    fn a_goal_sent_again_has_figures_of_its_own() {
        let mut goal = OwnGoal::sent(&stamp(2), "", &report(1, 1, State::Settled));
        let arrived = goal.judge(&report(1, 2, State::Settled), TIMEOUT).unwrap().unwrap().figures.unwrap();
        assert_eq!((arrived.arrival_time, arrived.path_length), (Some(0.0), 0.0));
    }

    #[test]
    fn a_new_goal_has_all_the_figures() {
        let mut goal = OwnGoal::sent(&stamp(2), "", &report(1, 1, State::Settled));
        assert!(goal.judge(&report(2, 2, State::Tracking), TIMEOUT).unwrap().is_none());
        // Somebody else wants the same, which makes it no other goal.
        let arrived = goal.judge(&report(2, 3, State::Settled), TIMEOUT).unwrap().unwrap().figures.unwrap();
        assert_eq!((arrived.arrival_time, arrived.path_length), (Some(5.0), 0.6));
        assert!(!goal.is_in_force(&report(2, 3, State::Settled)));
    }

    #[test]
    fn a_goal_that_is_replaced_or_dropped_is_given_up() {
        let start = || {
            let mut goal = OwnGoal::sent(&stamp(2), "", &report(1, 1, State::Settled));
            assert!(goal.judge(&report(2, 2, State::Tracking), TIMEOUT).unwrap().is_none());
            goal
        };
        let other = start().judge(&report(3, 3, State::Settled), TIMEOUT);
        assert!(matches!(other, Err(NotArrived::OtherGoal)), "{other:?}");
        let stopped = StatusReport { goal: None, goal_stamp: None, ..report(2, 2, State::Holding) };
        let dropped = start().judge(&stopped, TIMEOUT);
        assert!(matches!(dropped, Err(NotArrived::Dropped)), "{dropped:?}");
    }

    #[test]
    fn without_joint_states_that_is_why_time_ran_out() {
        let mut goal = OwnGoal::sent(&stamp(2), "", &report(1, 1, State::Settled));
        let late = goal.judge(&report(1, 2, State::StaleState), Duration::ZERO);
        assert!(matches!(late, Err(NotArrived::NoRobot(_))), "{late:?}");
    }

    #[test]
    fn time_runs_out_for_goals_that_are_pursued_and_for_those_that_are_not_yet_taken() {
        let mut goal = OwnGoal::sent(&stamp(2), "", &report(1, 1, State::Settled));
        let other = StatusReport { figures: Some(Figures::default()), ..report(1, 1, State::Settled) };
        let late = goal.judge(&other, Duration::ZERO).unwrap_err().to_string();
        assert_eq!(
            late, "the servo has not taken the goal within 0 s",
            "the other goal's way is not this one's"
        );
        let without = StatusReport { state: State::StaleState, ..other };
        let late = goal.judge(&without, Duration::ZERO).unwrap_err().to_string();
        assert!(late.contains("no joint states") && !late.contains("mm"), "{late}");
        let late = goal.judge(&report(1, 2, State::Tracking), Duration::ZERO);
        assert!(matches!(late, Err(NotArrived::TimedOut { .. })), "{late:?}");
    }

    #[test]
    fn a_goal_that_waits_for_its_frame_is_left_until_its_fate_is_known_and_another_s_is_not() {
        let nothing = StatusReport { goal: None, goal_stamp: None, ..report(0, 1, State::Holding) };
        let jogged = StatusReport { input: Some(Input::Twist), ..nothing.clone() };
        let anothers = report(1, 1, State::Tracking);
        let mut goal = OwnGoal::sent(&stamp(2), "table", &nothing);
        let left = [&nothing, &jogged, &anothers, &rejected(2)].map(|report| goal.is_left(report));
        assert_eq!(left, [Some(true), None, None, Some(false)]);
        assert!(!goal.send_again(&nothing), "another one would wait by itself");
        assert!(goal.judge(&report(2, 2, State::Tracking), TIMEOUT).unwrap().is_none());
        assert_eq!(goal.is_left(&report(2, 2, State::Tracking)), Some(true));
        assert_eq!(goal.is_left(&report(3, 3, State::Tracking)), Some(false));
        let in_base = OwnGoal::sent(&stamp(2), "", &nothing);
        assert_eq!(in_base.is_left(&nothing), None, "it comes at once or is rejected");
    }
}
