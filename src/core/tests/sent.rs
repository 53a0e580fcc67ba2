//! Checks what is sent to the robot against the limits, from the last output on, or from the robot if that has stood since.

use crate::opinion::Truth;
use dq_check::Invariants;
use dq_core::servo::Limits;
use std::time::Duration;

/// How far positions that are sent may be off by rounding \[rad\].
const ROUNDING: f64 = 1e-12;

/// How the output may go on: at which speeds it was before, if they are not those of the last output, and at which ones it is now [rad/s].
pub type Step<'a> = (Option<&'a [f64]>, &'a [f64]);

/// What was sent, cycle after cycle.
pub struct Sent {
    invariants: Invariants,
    period: Duration,
    /// By count of cycles, not by the clock: a late cycle may do no more than another one.
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

    /// A robot of the tests stands this long after the last velocity.
    pub fn timeout(&self) -> Duration {
        Duration::from_millis(100)
    }

    /// Whether the robot, which hears commands `late`, has stood by its own timeout since it was last sent something.
    pub fn is_after_gap(&self, now: Duration, late: Duration) -> Truth {
        let gap = self.last.map_or(Duration::MAX, |last| now.saturating_sub(last));
        Truth::between(gap > self.timeout() + self.period + late, gap > self.timeout())
    }

    /// The speeds at which positions go on from others [rad/s]: those of the command, as far as rounding lets it be seen.
    pub fn speeds(&self, from: &[f64], to: &[f64], command: &[f64]) -> Vec<f64> {
        let period = self.period.as_secs_f64();
        let speeds = to.iter().zip(from).map(|(to, from)| (to - from) / period);
        let rounded = |(speed, command): (f64, &f64)| {
            if (speed - command).abs() < ROUNDING / period { *command } else { speed }
        };
        speeds.zip(command).map(rounded).collect()
    }

    /// Checks that one of these steps keeps the limits, and returns the speeds that it ends with.
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
                // A robot whose speed does not change: that it may exceed a limit is not checked.
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
