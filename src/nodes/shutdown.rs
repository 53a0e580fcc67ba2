//! The shutdown of a servo node. After the request to stop, the arm decelerates until it is at rest. Then the node sends zeros
//! until the robot stands still, and ends. Each step has a deadline.

use dq_kinematics::arm::JointKind;
use std::time::Duration;
use thiserror::Error;
use tokio::sync::watch;

/// The longest time from the request to stop until the arm is at rest. After this time, the node sends zeros even if the arm moves.
pub(super) const LONGEST_DECELERATION: Duration = Duration::from_secs(2);

/// The shortest time for which zeros are sent. RustDDS sends messages from its own thread, which ends with the participant, so zeros
/// could be lost if the participant ended at once.
pub(super) const SHORTEST_FINAL_ZEROS: Duration = Duration::from_millis(20);

/// The longest time for which zeros are sent if the robot does not report that it stands still.
const LONGEST_FINAL_ZEROS: Duration = Duration::from_millis(500);

/// How long to wait until the cycle ends: [`LONGEST_DECELERATION`], [`LONGEST_FINAL_ZEROS`] and one second. A cycle that takes
/// longer counts as hanging.
pub(super) const PATIENCE: Duration = Duration::from_millis(3500);

/// Joint speeds up to this [rad/s, prismatic: m/s] are noise of a robot that stands still.
const STANDING: f64 = 0.01;

/// The reason why a servo node did not end properly.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum ShutdownError {
    /// The law or the limits did not bring the command to zero in time.
    #[error("the arm was not at rest after {:.1} s, at {speed:.3} {unit}: zeros were sent", LONGEST_DECELERATION.as_secs_f64())]
    NotAtRest {
        /// The command of the fastest joint at the deadline.
        speed: f64,
        /// The unit of `speed`.
        unit: &'static str,
    },
    /// The robot does not follow: it moves although zeros were sent.
    #[error("the robot still moves at {speed:.3} {unit}, {:.1} s after the first zeros", LONGEST_FINAL_ZEROS.as_secs_f64())]
    StillMoving {
        /// The speed of the fastest joint in the last joint state.
        speed: f64,
        /// The unit of `speed`.
        unit: &'static str,
    },
    /// The cycle panicked or could not continue.
    #[error("the cycle ended by itself, and zeros were sent: {0}")]
    Failed(String),
    /// The node was dropped, or a second signal arrived, before the end.
    #[error("ended before the arm was seen at rest: zeros were sent")]
    CutShort,
    /// The cycle's thread hangs.
    #[error("the cycle does not answer: zeros were sent")]
    NoAnswer,
}

/// The result of a cycle: an error if the node did not end properly.
pub(super) type Outcome = Result<(), ShutdownError>;

/// The action of the cycle in one period of the shutdown.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Step {
    /// Send the servo's command, which decelerates.
    Decelerate,
    /// Send zeros.
    FinalZeros,
    /// End the node with this outcome.
    Gone(Outcome),
}

/// A shutdown in progress.
pub(super) struct Shutdown {
    asked: Duration,
    /// The unit of joint speeds in errors. With both kinds of joints, this text names both units.
    unit: &'static str,
    zeros_since: Option<Duration>,
    /// The command of the fastest joint at the deadline [rad/s, prismatic: m/s], if the arm was not at rest.
    not_at_rest: Option<f64>,
}

impl Shutdown {
    /// Begins the shutdown at `now`. The arms have joints of these kinds.
    pub fn new(now: Duration, kinds: &[JointKind]) -> Self {
        let unit = match (kinds.contains(&JointKind::Revolute), kinds.contains(&JointKind::Prismatic)) {
            (_, false) => "rad/s",
            (false, true) => "m/s",
            (true, true) => "rad/s or m/s",
        };
        Self { asked: now, unit, zeros_since: None, not_at_rest: None }
    }

    /// Returns what to do at `now`. `command` is the command of the fastest joint. `reported` is the last reported speed of the
    /// fastest joint; `None` if the robots have reported no speeds since the shutdown began. Both are in rad/s, or m/s for a
    /// prismatic joint.
    pub fn step(&mut self, now: Duration, command: f64, reported: Option<f64>) -> Step {
        if self.zeros_since.is_none() {
            if command > 0.0 && now.saturating_sub(self.asked) <= LONGEST_DECELERATION {
                return Step::Decelerate;
            }
            self.not_at_rest = (command > 0.0).then_some(command);
        }
        let zeros_for = now.saturating_sub(*self.zeros_since.get_or_insert(now));
        let moving = reported.filter(|speed| *speed > STANDING);
        let stands = reported.is_some() && moving.is_none();
        if zeros_for < SHORTEST_FINAL_ZEROS || (zeros_for < LONGEST_FINAL_ZEROS && !stands) {
            return Step::FinalZeros;
        }
        Step::Gone(match (self.not_at_rest, moving) {
            (_, Some(speed)) => Err(ShutdownError::StillMoving { speed, unit: self.unit }),
            (Some(speed), None) => Err(ShutdownError::NotAtRest { speed, unit: self.unit }),
            (None, None) => Ok(()),
        })
    }
}

/// Waits up to `patience` for the end of a cycle that was asked to end.
pub(super) async fn ended(outcome: &mut watch::Receiver<Option<Outcome>>, patience: Duration) -> Outcome {
    match tokio::time::timeout(patience, outcome.wait_for(Option::is_some)).await {
        Ok(Ok(outcome)) => outcome.clone().unwrap_or(Ok(())),
        Ok(Err(_)) | Err(_) => Err(ShutdownError::NoAnswer),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: Duration = Duration::from_millis(1);

    /// Begins a shutdown at 1 s, and calls [`Shutdown::step`] every 2 ms. Returns the duration of the shutdown, its outcome, and
    /// all steps before the end. `command` and `reported` get the time since the shutdown began.
    fn end(
        command: impl Fn(Duration) -> f64,
        reported: impl Fn(Duration) -> Option<f64>,
    ) -> (Duration, Outcome, Vec<Step>) {
        let begin = Duration::from_secs(1);
        let (mut shutdown, mut steps) =
            (Shutdown::new(begin, &[JointKind::Revolute, JointKind::Prismatic]), Vec::new());
        for cycle in 0..5000 {
            let after = 2 * cycle * MS;
            match shutdown.step(begin + after, command(after), reported(after)) {
                Step::Gone(outcome) => return (after, outcome, steps),
                step => steps.push(step),
            }
        }
        panic!("no end");
    }

    fn braking(after: Duration) -> f64 {
        (1.0 - after.as_secs_f64() / 0.1).max(0.0)
    }

    #[test]
    fn it_decelerates_then_sends_zeros_until_the_robot_is_at_rest() {
        let (after, outcome, steps) = end(braking, |after| Some(braking(after.saturating_sub(50 * MS))));
        assert_eq!((after, outcome), (150 * MS, Ok(())));
        assert_eq!(steps.iter().filter(|step| **step == Step::Decelerate).count(), 50);
        assert_eq!(steps.last(), Some(&Step::FinalZeros));
    }

    #[test]
    fn zeros_are_sent_briefly_to_a_robot_at_rest_and_longer_to_a_silent_one() {
        assert_eq!(end(|_| 0.0, |_| Some(0.0)).0, SHORTEST_FINAL_ZEROS);
        let (after, outcome, _) = end(|_| 0.0, |_| None);
        assert_eq!((after, outcome), (LONGEST_FINAL_ZEROS, Ok(())));
    }

    #[test]
    fn an_arm_that_does_not_come_to_rest_gets_zeros_at_the_deadline() {
        let (after, outcome, steps) = end(|_| 0.3, |_| Some(0.0));
        assert_eq!(outcome, Err(ShutdownError::NotAtRest { speed: 0.3, unit: "rad/s or m/s" }));
        assert!(after <= LONGEST_DECELERATION + SHORTEST_FINAL_ZEROS + 4 * MS);
        assert_eq!(steps.last(), Some(&Step::FinalZeros));
    }

    #[test]
    fn a_robot_that_moves_on_is_reported_and_its_noise_is_not() {
        assert_eq!(
            end(braking, |_| Some(0.2)).1,
            Err(ShutdownError::StillMoving { speed: 0.2, unit: "rad/s or m/s" })
        );
        assert_eq!(end(braking, |_| Some(1e-3)).1, Ok(()));
    }

    #[tokio::test]
    async fn a_cycle_that_hangs_is_not_waited_for() {
        assert!(PATIENCE > LONGEST_DECELERATION + LONGEST_FINAL_ZEROS);
        let (end, mut outcome) = watch::channel(None);
        assert_eq!(ended(&mut outcome, MS).await, Err(ShutdownError::NoAnswer));
        end.send_replace(Some(Ok(())));
        assert_eq!(ended(&mut outcome, MS).await, Ok(()));
    }
}
