//! The end of a servo node, a protocol with a deadline for each step: a stop is asked for → the arm decelerates → it is at rest →
//! final zeros until the robot stands → gone.

use dq_kinematics::arm::JointKind;
use std::time::Duration;
use thiserror::Error;
use tokio::sync::watch;

/// The arm gets this long to come to rest; then zeros are sent all the same.
pub(super) const LONGEST_DECELERATION: Duration = Duration::from_secs(2);

/// Zeros are sent at least this long: RustDDS sends from a thread of its own, which ends with the participant.
pub(super) const SHORTEST_FINAL_ZEROS: Duration = Duration::from_millis(20);

/// Zeros are sent at most this long for a robot that does not answer with a standstill.
const LONGEST_FINAL_ZEROS: Duration = Duration::from_millis(500);

/// A cycle that has not ended by then does not run any more: all of the above, and a second.
pub(super) const PATIENCE: Duration = Duration::from_millis(3500);

/// A robot stands whose joints report no more than this [rad/s], which is noise.
const STANDING: f64 = 0.01;

/// How a servo node ended that did not end as it should.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum ShutdownError {
    /// The law or the limits did not bring the command to zero in time.
    #[error("the arm was not at rest after {:.1} s, at {speed:.3} {unit}: zeros were sent", LONGEST_DECELERATION.as_secs_f64())]
    NotAtRest {
        /// The fastest joint's command when the deadline came.
        speed: f64,
        /// Its unit.
        unit: &'static str,
    },
    /// The robot does not follow: it moves although zeros were sent.
    #[error("the robot still moves at {speed:.3} {unit}, {:.1} s after the first zeros", LONGEST_FINAL_ZEROS.as_secs_f64())]
    StillMoving {
        /// The fastest joint's speed in the last joint state.
        speed: f64,
        /// Its unit.
        unit: &'static str,
    },
    /// The cycle panicked or could not go on.
    #[error("the cycle ended by itself, and zeros were sent: {0}")]
    Failed(String),
    /// The node was dropped, or a second signal came, before the end.
    #[error("ended before the arm was seen at rest: zeros were sent")]
    CutShort,
    /// The cycle's thread hangs.
    #[error("the cycle does not answer: zeros were sent")]
    NoAnswer,
}

/// How a cycle ended.
pub(super) type Outcome = Result<(), ShutdownError>;

/// What the cycle is to do, now that the end was asked for.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Step {
    /// Send the servo's command, which decelerates.
    Decelerate,
    /// Send zeros.
    FinalZeros,
    /// Go.
    Gone(Outcome),
}

/// The end in progress.
pub(super) struct Shutdown {
    asked: Duration,
    /// Of the fastest joint's speed, whichever joint that is.
    unit: &'static str,
    zeros_since: Option<Duration>,
    /// The fastest joint's command [rad/s] that the deadline found.
    not_at_rest: Option<f64>,
}

impl Shutdown {
    /// The end is asked for at `now`, of arms with joints of these kinds.
    pub fn new(now: Duration, kinds: &[JointKind]) -> Self {
        let unit = match (kinds.contains(&JointKind::Revolute), kinds.contains(&JointKind::Prismatic)) {
            (_, false) => "rad/s",
            (false, true) => "m/s",
            (true, true) => "rad/s or m/s",
        };
        Self { asked: now, unit, zeros_since: None, not_at_rest: None }
    }

    /// What to do at `now`: by the fastest joint's command [rad/s], and by the fastest joint's speed [rad/s] in what robots have
    /// reported since the end was asked for, if they have.
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

/// Waits for the end of a cycle that was asked to end, for `patience` at most.
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

    /// Steps each 2 ms from 1 s on until the end, by what the command and the robot do that long after the stop was asked for.
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
    fn it_decelerates_then_sends_zeros_until_the_robot_stands() {
        let (after, outcome, steps) = end(braking, |after| Some(braking(after.saturating_sub(50 * MS))));
        assert_eq!((after, outcome), (150 * MS, Ok(())));
        assert_eq!(steps.iter().filter(|step| **step == Step::Decelerate).count(), 50);
        assert_eq!(steps.last(), Some(&Step::FinalZeros));
    }

    #[test]
    fn zeros_are_sent_for_a_moment_to_a_robot_that_stands_and_longer_to_one_that_is_silent() {
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
