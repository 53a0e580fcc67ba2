//! The servo's state in words.

use dq_wire::StatusReport;
use std::time::Duration;

/// Describes the state of the servo `servo`. `heard` is the latest report of the servo, with its age; `None` if no report has arrived
/// yet. `two_arms` is true if the namespace has a servo for two arms.
pub(super) fn explain(servo: &str, heard: Option<(&StatusReport, Duration)>, two_arms: bool) -> String {
    match heard {
        None if two_arms => "the servo that is here has two arms: dq_servo view --dual shows them".to_owned(),
        None => format!("no servo heard yet: is {servo} running, in this domain?"),
        Some((_, silent)) if silent > StatusReport::SILENCE => {
            format!("the servo is gone: nothing received from {servo} for {:.0} s", silent.as_secs_f64())
        }
        Some((report, _)) => for_people(&report.sentence()),
    }
}

/// Replaces the names of services in a servo's text by the names of the page's buttons.
fn for_people(text: &str) -> String {
    text.replace("call ~/pause with false", "press Resume")
        .replace("~/stop was called", "the arm was stopped")
}

#[cfg(test)]
mod tests {
    use super::*;
    use dq_core::servo::{Reason, Revocation};
    use dq_messages::messages::{DiagnosticStatus, KeyValue};

    /// The servo's texts name services. A user of the page has buttons instead.
    #[test]
    fn a_revoked_motion_names_the_page_s_button_and_no_service() {
        let revoked = Reason::Revoked(Revocation::Stopped);
        let text = revoked.explain(|_| String::new(), |_, _| String::new(), |_| String::new());
        assert_eq!(for_people(&text), "the arm was stopped; to go on, send a goal again or press Resume");
    }

    #[test]
    fn a_servo_that_was_never_heard_and_one_that_ended_are_reported() {
        assert_eq!(explain("/s", None, false), "no servo heard yet: is /s running, in this domain?");
        assert!(explain("/s", None, true).contains("two arms"));
        let law = KeyValue { key: "law".to_owned(), value: "logc".to_owned() };
        let message = DiagnosticStatus {
            message: "settled".to_owned(),
            values: vec![law],
            ..DiagnosticStatus::default()
        };
        let report = StatusReport::from_message(&message).unwrap();
        let gone = explain("/s", Some((&report, Duration::from_secs(3))), false);
        assert_eq!(gone, "the servo is gone: nothing received from /s for 3 s");
    }
}
