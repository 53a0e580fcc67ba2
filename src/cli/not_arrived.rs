//! The reason why an arm did not arrive. The text comes from the report of the motion or, if the motion has not ended, from the
//! servo's status.

use thiserror::Error;

/// The reason why the arm did not arrive.
#[derive(Debug, Error)]
pub(super) enum NotArrived {
    #[error(
        "no status from a servo within {0} s: is `dq_servo servo` (or `dual`) running, in this domain and namespace?"
    )]
    NoServo(f64),
    #[error("the servo has been silent for {0} s")]
    Silent(f64),
    #[error("the servo has not taken the goal within {0} s")]
    NotTaken(f64),
    /// The motion has ended, or the servo rejected the goal. The text is the servo's report.
    #[error("{0}")]
    Ended(String),
    #[error("{0}: somebody else publishes goals too")]
    Replaced(String),
    #[error("not arrived after {seconds} s: {status}")]
    TimedOut { seconds: f64, status: String },
    #[error("the servo has no joint states: {0} (is the robot running, for example `dq_servo puma560`?)")]
    NoRobot(String),
    #[error("the servo is {0} (`dq_servo resume` lets it go on)")]
    Paused(String),
    #[error("the servo does not drive the arm: {0}")]
    Stands(String),
    #[error("the servo has dropped the goal: it was started again")]
    Dropped,
}
