//! What every stream of commands must hold, whatever happened: the check of it.
//!
//! It is not part of the cycle, which holds the limits by how it computes: it is the second opinion on what came out, for tests and
//! for recorded runs.

use super::Limits;
use std::time::Duration;
use thiserror::Error;

/// Room for rounding, relative.
const ROUNDING: f64 = 1e-9;

/// How far a joint may overrun a position limit \[rad\] before that counts: joint states are some cycles old.
const POSITION_TOLERANCE: f64 = 1e-3;

/// An invariant that a command did not hold. Joints are counted from 1, arm after arm.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum Violation {
    /// Not one number a joint.
    #[error("{got} numbers for {expected} joints")]
    WrongLength {
        /// Joints that have limits.
        expected: usize,
        /// Numbers there were.
        got: usize,
    },
    /// Infinite, or not a number.
    #[error("joint {joint}: {value} is not finite")]
    NonFinite {
        /// The joint.
        joint: usize,
        /// What was found.
        value: f64,
    },
    /// Faster than the velocity limit (DESIGN section 8, rule 5).
    #[error("joint {joint}: {speed} rad/s is beyond the velocity limit of {limit} rad/s")]
    Velocity {
        /// The joint.
        joint: usize,
        /// Its speed [rad/s].
        speed: f64,
        /// What it may have [rad/s].
        limit: f64,
    },
    /// A larger step than the acceleration limit allows in the time (rule 6).
    #[error("joint {joint}: a step of {step} rad/s, where the acceleration limit allows {limit} rad/s")]
    Acceleration {
        /// The joint.
        joint: usize,
        /// The step [rad/s].
        step: f64,
        /// What it may be [rad/s].
        limit: f64,
    },
    /// Faster than before although there was reason to stand (rules 1, 2, 3, 9 and ~/pause, ~/stop).
    #[error(
        "joint {joint}: {speed} rad/s after {before} rad/s, where the arm was to come to rest and to stay there"
    )]
    NotStanding {
        /// The joint.
        joint: usize,
        /// Its speed [rad/s].
        speed: f64,
        /// Its speed before [rad/s].
        before: f64,
    },
    /// Farther beyond its position limit than it has been (rule 7).
    #[error("joint {joint}: at {position} rad, {beyond} rad beyond its position limit")]
    Position {
        /// The joint.
        joint: usize,
        /// Where it is \[rad\].
        position: f64,
        /// How far beyond the limit \[rad\].
        beyond: f64,
    },
}

/// Follows a stream of commands and of joint positions, and tells what of it breaks a rule.
#[derive(Clone, Debug)]
pub struct Invariants {
    limits: Limits,
    period: Duration,
    last: Option<(Duration, Vec<f64>)>,
    /// How far beyond its position limits each joint has been \[rad\].
    beyond: Option<Vec<f64>>,
}

impl Invariants {
    /// For commands under `limits` from a cycle of `period`; nothing is known yet of what went before.
    pub fn new(limits: Limits, period: Duration) -> Self {
        Self { limits, period, last: None, beyond: None }
    }

    /// Puts other limits into force, as a change of parameters does. Speeds above a limit that was lowered may come down to it.
    pub fn set_limits(&mut self, limits: Limits) {
        self.limits = limits;
        // Limits that close in leave joints outside that did nothing.
        self.beyond = None;
    }

    /// Checks the joint velocities `command` [rad/s], made by the cycle at `time`; `standing`: the servo then had reason to stand
    /// still (no goal, paused, stopped, stale, stalled). Between two commands further apart than the period there were others,
    /// and as much more of a step is granted.
    ///
    /// # Errors
    /// The first [`Violation`] found; the next command is judged against this one all the same.
    pub fn check(&mut self, time: Duration, command: &[f64], standing: bool) -> Result<(), Violation> {
        self.check_numbers(command)?;
        let result = match &self.last {
            Some((before, last)) => {
                let elapsed = time.saturating_sub(*before).max(self.period);
                self.check_step(last, command, elapsed.as_secs_f64(), standing)
            }
            None => self.check_speed(&vec![0.0; command.len()], command),
        };
        self.last = Some((time, command.to_vec()));
        result
    }

    /// Checks joint positions \[rad\], in the order of the commands. A joint that is found outside its limits may stay there and
    /// come inside, but must not go on outward.
    ///
    /// # Errors
    /// The first [`Violation`] found.
    pub fn check_positions(&mut self, positions: &[f64]) -> Result<(), Violation> {
        self.check_numbers(positions)?;
        let limits = &self.limits.position;
        let bounds = limits.lower.iter().zip(&limits.upper);
        let beyond: Vec<_> = positions
            .iter()
            .zip(bounds)
            .map(|(position, (lower, upper))| (lower - position).max(position - upper).max(0.0))
            .collect();
        let worst = self.beyond.get_or_insert_with(|| beyond.clone());
        for (joint, (now, worst)) in beyond.iter().zip(worst).enumerate() {
            let further = *now > *worst + POSITION_TOLERANCE;
            // One that has come back inside has no excuse any more.
            *worst = if further { *now } else { worst.min(*now) };
            if further {
                return Err(Violation::Position {
                    joint: joint + 1,
                    position: positions[joint],
                    beyond: *now,
                });
            }
        }
        Ok(())
    }

    fn check_numbers(&self, numbers: &[f64]) -> Result<(), Violation> {
        let expected = self.limits.joint_velocity.len();
        if numbers.len() != expected {
            return Err(Violation::WrongLength { expected, got: numbers.len() });
        }
        match numbers.iter().position(|number| !number.is_finite()) {
            Some(joint) => Err(Violation::NonFinite { joint: joint + 1, value: numbers[joint] }),
            None => Ok(()),
        }
    }

    fn check_speed(&self, last: &[f64], command: &[f64]) -> Result<(), Violation> {
        for (joint, (speed, before)) in command.iter().zip(last).enumerate() {
            // After a limit was lowered the command comes down to it at the acceleration limit.
            let limit = self.limits.joint_velocity[joint].max(before.abs());
            if speed.abs() > limit * (1.0 + ROUNDING) {
                return Err(Violation::Velocity { joint: joint + 1, speed: *speed, limit });
            }
        }
        Ok(())
    }

    fn check_step(
        &self,
        last: &[f64],
        command: &[f64],
        elapsed: f64,
        standing: bool,
    ) -> Result<(), Violation> {
        self.check_speed(last, command)?;
        for (joint, (speed, before)) in command.iter().zip(last).enumerate() {
            let (step, limit) = ((speed - before).abs(), self.limits.joint_acceleration[joint] * elapsed);
            // The command's own digits end somewhere.
            if step > limit * (1.0 + ROUNDING) + f64::EPSILON * before.abs() {
                return Err(Violation::Acceleration { joint: joint + 1, step, limit });
            }
            if standing && speed.abs() > before.abs() {
                return Err(Violation::NotStanding { joint: joint + 1, speed: *speed, before: *before });
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::servo::PositionLimits;

    const PERIOD: Duration = Duration::from_millis(2);

    /// One joint: 1 rad/s, 10 rad/s², between −1 and 1 rad. After a command of 0.5 rad/s.
    fn moving() -> Invariants {
        let limits = Limits {
            joint_velocity: vec![1.0],
            joint_acceleration: vec![10.0],
            linear_speed: 1.0,
            angular_speed: 1.0,
            position: PositionLimits { lower: vec![-1.0], upper: vec![1.0], margin: 0.1 },
        };
        let mut invariants = Invariants::new(limits, PERIOD);
        invariants.check(PERIOD, &[0.5], false).unwrap();
        invariants
    }

    #[test]
    fn each_violation_is_found() {
        let check = |time: u32, command: &[f64], standing| moving().check(PERIOD * time, command, standing);
        assert_eq!(check(2, &[0.52], false), Ok(()));
        assert!(matches!(check(2, &[0.53], false), Err(Violation::Acceleration { joint: 1, .. })));
        assert_eq!(check(3, &[0.53], false), Ok(()), "a command was lost between");
        assert_eq!(
            check(2, &[0.52], true),
            Err(Violation::NotStanding { joint: 1, speed: 0.52, before: 0.5 })
        );
        assert_eq!(check(2, &[0.48], true), Ok(()));
        assert!(matches!(check(2, &[f64::NAN], false), Err(Violation::NonFinite { joint: 1, .. })));
        assert_eq!(check(2, &[0.5; 2], false), Err(Violation::WrongLength { expected: 1, got: 2 }));
        assert!(matches!(check(1000, &[1.01], false), Err(Violation::Velocity { joint: 1, .. })));
    }

    #[test]
    fn a_limit_that_was_lowered_is_come_down_to() {
        let mut invariants = moving();
        let lower = Limits { joint_velocity: vec![0.1], ..invariants.limits.clone() };
        invariants.set_limits(lower);
        assert_eq!(invariants.check(PERIOD * 2, &[0.49], false), Ok(()));
        let faster = invariants.check(PERIOD * 3, &[0.495], false);
        assert_eq!(faster, Err(Violation::Velocity { joint: 1, speed: 0.495, limit: 0.49 }));
    }

    #[test]
    fn a_joint_found_outside_may_come_back_but_not_go_on() {
        let mut invariants = moving();
        assert_eq!(invariants.check_positions(&[-1.5]), Ok(()));
        assert_eq!(invariants.check_positions(&[-1.2]), Ok(()));
        let on = Violation::Position { joint: 1, position: -1.6, beyond: 0.6000000000000001 };
        assert_eq!(invariants.check_positions(&[-1.6]), Err(on));
        let mut inside = moving();
        assert_eq!(inside.check_positions(&[0.9]), Ok(()));
        assert_eq!(inside.check_positions(&[1.0005]), Ok(()));
        assert!(inside.check_positions(&[1.002]).is_err());
    }
}
