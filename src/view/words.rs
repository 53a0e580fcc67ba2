//! The servo's state in words.

use crate::servo::State;
use crate::wire::{MotionReport, Outcome, StatusReport};
use std::time::Duration;

/// What the servo called `servo` is doing, by its last report and how long ago that came, and by its last motion where the arm is there;
/// and whether there is one for two arms.
pub(super) fn words(
    servo: &str,
    heard: Option<(&StatusReport, Duration)>,
    motion: Option<&MotionReport>,
    two_arms: bool,
) -> String {
    let arrived = motion.filter(|motion| motion.outcome == Outcome::Arrived);
    match heard {
        None if two_arms => "the servo that is here has two arms: dq_servo view --dual shows them".to_owned(),
        None => format!("no servo heard yet: is {servo} running, in this domain?"),
        Some((_, silent)) if silent > StatusReport::SILENCE => {
            format!("the servo is gone: nothing heard of {servo} for {:.0} s", silent.as_secs_f64())
        }
        Some((report, _)) => match arrived {
            Some(motion) if report.state == State::Settled => format!("settled: {}", motion.sentence()),
            _ => report.sentence(),
        },
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wire::messages::{DiagnosticStatus, KeyValue, Time};

    fn report(state: State) -> StatusReport {
        let law = KeyValue { key: "law".to_owned(), value: "logc".to_owned() };
        let message =
            DiagnosticStatus { message: state.to_string(), values: vec![law], ..DiagnosticStatus::default() };
        StatusReport::from_message(&message).unwrap()
    }

    #[test]
    fn at_the_goal_the_motion_has_the_word_and_else_the_status() {
        let rejected = MotionReport::rejected(&Time::default(), None, String::new());
        let arrived = MotionReport { outcome: Outcome::Arrived, ..rejected.clone() };
        let says = |state, motion| words("/s", Some((&report(state), Duration::ZERO)), Some(motion), false);
        assert_eq!(says(State::Settled, &arrived), "settled: arrived in 0.00 s over 0.000 m");
        assert_eq!(says(State::Holding, &arrived), "holding: no goal");
        assert_eq!(says(State::Settled, &rejected), "settled");
    }

    #[test]
    fn a_servo_that_was_never_heard_and_one_that_is_gone_are_said_to_be() {
        assert_eq!(words("/s", None, None, false), "no servo heard yet: is /s running, in this domain?");
        assert!(words("/s", None, None, true).contains("two arms"));
        let gone = words("/s", Some((&report(State::Settled), Duration::from_secs(3))), None, false);
        assert_eq!(gone, "the servo is gone: nothing heard of /s for 3 s");
    }
}
