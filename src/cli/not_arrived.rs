//! Why an arm did not arrive, in words. What to try at a stall, the servo itself says in its reason.

use crate::servo::{Figures, State};
use crate::wire::StatusReport;
use std::fmt;
use thiserror::Error;

/// Why the arm did not arrive.
#[derive(Debug, Error)]
pub(super) enum NotArrived {
    #[error(
        "no status from a servo within {0} s: is `dq_servo servo` (or `dual`) running, in this domain and namespace?"
    )]
    NoServo(f64),
    #[error("the servo has been silent for {0} s")]
    Silent(f64),
    #[error("the servo rejected the goal: {0}")]
    Rejected(String),
    #[error("the servo has not taken the goal within {0} s")]
    NotTaken(f64),
    #[error("not arrived after {seconds} s: {standing}")]
    TimedOut { seconds: f64, standing: Box<Standing> },
    #[error("the servo has no joint states: {0} (is the robot running, for example `dq_servo puma560`?)")]
    NoRobot(Box<Standing>),
    #[error("the servo is paused: {0} (`dq_servo resume` lets it go on)")]
    Paused(Box<Standing>),
    #[error("the servo does not drive the arm: {0}")]
    Stands(Box<Standing>),
    #[error("the arm gets no nearer: {0}")]
    Stalled(String),
    #[error("the servo has another goal: somebody else publishes goals too")]
    OtherGoal,
    #[error("the servo does not pursue the goal any more: {0}")]
    Revoked(String),
    #[error("the servo has dropped the goal: it was started again")]
    Dropped,
}

/// What the servo says of the way to the goal.
#[derive(Clone, Debug)]
pub(super) struct Standing {
    state: State,
    reason: Option<String>,
    joint_at_limit: Option<String>,
    figures: Option<Figures>,
}

impl From<&StatusReport> for Standing {
    fn from(report: &StatusReport) -> Self {
        let StatusReport { state, reason, joint_at_limit, figures, .. } = report.clone();
        Self { state, reason, joint_at_limit, figures }
    }
}

/// State, reason and distance, as far as they are known.
impl fmt::Display for Standing {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "state {}", self.state)?;
        match (&self.reason, &self.joint_at_limit) {
            (Some(reason), _) => write!(f, ", {reason}")?,
            (None, Some(joint)) => write!(f, ", {joint} is at its position limit")?,
            (None, None) => {}
        }
        match &self.figures {
            Some(figures) => write!(f, ", {}", remaining(figures)),
            None => Ok(()),
        }
    }
}

/// The distance to the goal.
pub(super) fn remaining(figures: &Figures) -> String {
    let (position, rotation) = (figures.position_error * 1e3, figures.rotation_error.to_degrees());
    format!("{position:.1} mm and {rotation:.2}° from the goal")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn standing(state: State) -> Box<Standing> {
        Box::new(Standing { state, reason: None, joint_at_limit: None, figures: None })
    }

    #[test]
    fn there_are_no_numbers_before_there_are_any() {
        let text = NotArrived::NoRobot(standing(State::WaitingForState)).to_string();
        assert!(text.contains("waiting_for_state") && !text.contains("mm"), "{text}");
    }

    #[test]
    fn times_are_those_that_were_asked_for() {
        let timed_out = |seconds| NotArrived::TimedOut { seconds, standing: standing(State::Tracking) };
        assert!(timed_out(0.5).to_string().starts_with("not arrived after 0.5 s: state tracking"));
        assert!(timed_out(60.0).to_string().starts_with("not arrived after 60 s: "));
    }

    #[test]
    fn the_joint_and_the_reason_are_named() {
        let figures = Figures { position_error: 0.25, ..Figures::default() };
        let limited = Standing {
            joint_at_limit: Some("elbow".to_owned()),
            figures: Some(figures),
            ..*standing(State::Stalled)
        };
        let text = NotArrived::Stands(limited.into()).to_string();
        for part in ["elbow is at its position limit", "250.0 mm"] {
            assert!(text.contains(part), "{text}");
        }
        let reason = Some("singular: σ = 0.001".to_owned());
        let singular = Standing { reason, ..*standing(State::Stalled) };
        let text = NotArrived::Stands(singular.into()).to_string();
        assert!(text.contains("σ = 0.001"), "{text}");
    }
}
