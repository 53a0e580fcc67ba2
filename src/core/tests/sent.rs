//! Checks the output against the limits. Each output must continue from the last output or, if the robot may have stopped since
//! then, from the robot's present motion.

use crate::invariants::Invariants;
use crate::opinion::Truth;
use dq_core::servo::Limits;
use std::time::Duration;

/// The largest rounding error of positions in the output \[rad\].
const ROUNDING: f64 = 1e-12;

/// A possible step of the output: the speeds before the step and the speeds after it [rad/s]. `None` stands for the speeds of the
/// last output.
pub type Step<'a> = (Option<&'a [f64]>, &'a [f64]);

/// Checks the output of each cycle against the limits.
pub struct Sent {
    invariants: Invariants,
    period: Duration,
    /// The number of cycles so far. The checks use this number as their clock. So a late cycle may change the speed by no more than
    /// a punctual cycle.
    cycles: u32,
    last: Option<Duration>,
}

impl Sent {
    pub fn new(limits: &Limits, period: Duration) -> Self {
        Self { invariants: Invariants::new(limits.clone(), period), period, cycles: 1, last: None }
    }

    pub fn invariants(&mut self) -> &mut Invariants {
        &mut self.invariants
    }

    /// Returns the command timeout of the robots in these tests: how long they continue to move after the last command.
    pub fn timeout(&self) -> Duration {
        Duration::from_millis(100)
    }

    /// Returns whether the robot has stopped since the last command because no command arrived within its command timeout. `late` is
    /// the delay of commands on the way to the robot.
    pub fn is_after_gap(&self, now: Duration, late: Duration) -> Truth {
        let gap = self.last.map_or(Duration::MAX, |last| now.saturating_sub(last));
        Truth::between(gap > self.timeout() + self.period + late, gap > self.timeout())
    }

    /// Returns the speeds of a step between the positions `from` and `to` [rad/s]. If a speed differs from the speed in `command`
    /// only by rounding, returns the speed in `command`.
    pub fn speeds(&self, from: &[f64], to: &[f64], command: &[f64]) -> Vec<f64> {
        let period = self.period.as_secs_f64();
        let speeds = to.iter().zip(from).map(|(to, from)| (to - from) / period);
        let rounded = |(speed, command): (f64, &f64)| {
            if (speed - command).abs() < ROUNDING / period { *command } else { speed }
        };
        speeds.zip(command).map(rounded).collect()
    }

    /// Checks that at least one of these steps keeps the limits. Returns the speeds after that step.
    pub fn check<'a>(
        &mut self,
        steps: &[Step<'a>],
        now: Duration,
        standing: bool,
    ) -> Result<&'a [f64], String> {
        self.cycles += 1;
        self.last = Some(now);
        let time = self.period * (self.cycles + 2);
        let mut result = Err("nothing to go on from".into());
        let mut after = None;
        for (before, speeds) in steps {
            let mut invariants = self.invariants.clone();
            if let Some(before) = before {
                invariants.robot_came();
                // The robot's speed is constant before the step. Whether that speed exceeds a limit is not checked.
                (1..=2).rev().for_each(|ago| drop(invariants.check(time - self.period * ago, before, false)));
            }
            let checked = invariants.check(time, speeds, standing);
            let checked = checked.map(|()| *speeds).map_err(|why| why.to_string());
            if checked.is_ok() || after.is_none() {
                (result, after) = (checked, Some(invariants));
            }
            if result.is_ok() {
                break;
            }
        }
        self.invariants = after.unwrap_or_else(|| self.invariants.clone());
        result
    }
}
