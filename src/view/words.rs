//! The servo's state in words.

use crate::servo::{Figures, State};
use crate::wire::StatusReport;
use std::time::Duration;

/// What the servo called `servo` is doing, by its last report and how long ago that came; and whether there is one for two arms.
pub(super) fn words(servo: &str, heard: Option<(&StatusReport, Duration)>, two_arms: bool) -> String {
    match heard {
        None if two_arms => "the servo that is here has two arms: dq_servo view --dual shows them".to_owned(),
        None => format!("no servo heard yet: is {servo} running, in this domain?"),
        Some((_, silent)) if silent > StatusReport::SILENCE => {
            format!("the servo is gone: nothing heard of {servo} for {:.0} s", silent.as_secs_f64())
        }
        Some((report, _)) => of_report(report),
    }
}

fn of_report(report: &StatusReport) -> String {
    let figures = report.figures.unwrap_or_default();
    let why = |otherwise: &str| report.reason.clone().unwrap_or_else(|| otherwise.to_owned());
    match report.state {
        State::WaitingForState => "waiting for the robot's joint states".to_owned(),
        State::Holding if report.reason.is_some() => format!("holding: {}", why("")),
        State::Holding => "holding: no goal".to_owned(),
        State::Tracking if report.goal_beyond_reach => {
            format!("tracking a goal beyond reach: {}", to_go(&figures))
        }
        State::Jogging => "jogging: a twist moves the tool".to_owned(),
        State::Tracking => format!("tracking: {} after {:.1} s", to_go(&figures), figures.elapsed),
        State::Settled => format!(
            "settled after {:.1} s and {:.2} m",
            figures.arrival_time.unwrap_or(figures.elapsed),
            figures.path_length
        ),
        State::Stalled => format!("stalled: {}", why("no progress")),
        State::JointLimit => {
            let joint = report.joint_at_limit.as_deref().unwrap_or("a joint");
            format!("{joint} is held back by its limit: {}", to_go(&figures))
        }
        State::NotFollowing => format!("not following: {}", why("the arm does not move as commanded")),
        State::StaleState => "the robot's joint states are late: standing".to_owned(),
        State::StaleGoal => "the stream of goals is silent: standing".to_owned(),
        State::Paused => "paused".to_owned(),
        State::Stopping => "stopping".to_owned(),
    }
}

fn to_go(figures: &Figures) -> String {
    format!("{:.0} mm and {:.1}° to go", figures.position_error * 1e3, figures.rotation_error.to_degrees())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wire::messages::{DiagnosticStatus, KeyValue};

    fn report(state: State, values: &[(&str, &str)]) -> StatusReport {
        let value =
            |(key, value): &(&str, &str)| KeyValue { key: (*key).to_owned(), value: (*value).to_owned() };
        let message = DiagnosticStatus {
            message: state.name().to_owned(),
            values: values.iter().chain(&[("law", "logc")]).map(value).collect(),
            ..DiagnosticStatus::default()
        };
        StatusReport::from_message(&message).unwrap()
    }

    #[test]
    fn a_state_is_a_sentence_for_people() {
        let at = |state, values: &[(&str, &str)]| {
            words("/dq_servo", Some((&report(state, values), Duration::ZERO)), false)
        };
        let arrived = [("elapsed_s", "9"), ("arrival_time_s", "4.21"), ("path_length_m", "0.634")];
        assert_eq!(at(State::Settled, &arrived), "settled after 4.2 s and 0.63 m");
        let on_the_way =
            [("elapsed_s", "1.25"), ("position_error_m", "0.1204"), ("rotation_error_rad", "0.1")];
        assert_eq!(at(State::Tracking, &on_the_way), "tracking: 120 mm and 5.7° to go after 1.2 s");
        assert_eq!(at(State::Holding, &[]), "holding: no goal");
        let away = [("reason", "the robot was away for 3 s")];
        assert_eq!(at(State::Holding, &away), "holding: the robot was away for 3 s");
        assert_eq!(
            at(State::Stalled, &[("reason", "singular: sigma = 1e-5")]),
            "stalled: singular: sigma = 1e-5"
        );
        let elbow = at(State::JointLimit, &[("joint_at_limit", "elbow")]);
        assert!(elbow.starts_with("elbow is held back by its limit"), "{elbow}");
    }

    #[test]
    fn a_servo_that_was_never_heard_and_one_that_is_gone_are_said_to_be() {
        assert_eq!(words("/s", None, false), "no servo heard yet: is /s running, in this domain?");
        assert!(words("/s", None, true).contains("two arms"));
        let report = report(State::Settled, &[]);
        let gone = words("/s", Some((&report, Duration::from_secs(3))), false);
        assert_eq!(gone, "the servo is gone: nothing heard of /s for 3 s");
    }
}
