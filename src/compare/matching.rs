//! Gains at which laws are fairly compared: each settles in the same time, or moves at the same peak speed.

use super::CompareError;
use super::arm::{Arm, Task};
use super::closed_loop::{ClosedLoop, Outcome, Result as Ended};
use super::conditions::PLANTS;
use crate::control::{Law, Map, named};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

named! {
    /// What of the laws is made equal.
    #[derive(Deserialize, Serialize)]
    #[serde(rename_all = "snake_case")]
    "matched" Matched {
        /// The median settling time; a task that failed took for ever.
        SettlingTime = "settling_time",
        /// The median peak joint speed.
        PeakSpeed = "peak_speed",
    }
}

impl Matched {
    /// Both.
    pub const ALL: [Self; 2] = [Self::SettlingTime, Self::PeakSpeed];
}

/// The law that the others are made equal to, and its gain [1/s].
pub const REFERENCE: (Law, f64) = (Law::Logc, 2.0);
/// Gains are chosen on these tasks, which no comparison uses, whatever the number of tasks that are compared.
const PILOTS: u32 = 32;
/// Apart from the seeds of tasks.
const PILOT_SEED: u64 = 0x0070_696c_6f74;
/// No gain above this is tried [1/s].
const HIGHEST: f64 = 1e4;

/// The gain of a law on an arm.
#[derive(Clone, Debug, Deserialize, PartialEq, Serialize)]
pub struct Gain {
    /// What is equal.
    pub matched: Matched,
    /// The law's name.
    pub law: String,
    /// The arm's name.
    pub arm: String,
    /// The gain [1/s], as `Controller::with_law` takes it.
    pub gain: f64,
    /// What was aimed at: \[s\] or [rad/s].
    pub target: f64,
    /// What this gain gives on the same tasks; nothing where more than half of them fail.
    pub reached: Option<f64>,
}

impl Gain {
    /// Whether the target was reached, to 5 %. A law that goes unstable before has the best gain that was tried.
    pub fn is_matched(&self) -> bool {
        self.reached.is_some_and(|reached| (reached / self.target - 1.0).abs() < 0.05)
    }
}

/// The pilot tasks of an arm.
pub(super) struct Pilots<'a> {
    arm: &'a Arm,
    tasks: Vec<Task>,
}

impl<'a> Pilots<'a> {
    /// The tasks on which gains are chosen.
    pub fn new(arm: &'a Arm) -> std::result::Result<Self, CompareError> {
        let tasks = (0..PILOTS).map(|number| arm.task(PILOT_SEED, number));
        Ok(Self { arm, tasks: tasks.collect::<std::result::Result<_, _>>()? })
    }

    /// All of them in closed loop.
    pub fn run(&self, closed_loop: &ClosedLoop) -> std::result::Result<Vec<Ended>, CompareError> {
        let tasks = self.tasks.par_iter().enumerate();
        tasks.map(|(number, task)| closed_loop.run(task, number as u32)).collect()
    }

    /// The gain at which `law` reaches the reference's median.
    pub fn gain(&self, law: Law, matched: Matched) -> std::result::Result<Gain, CompareError> {
        let target = self.median(REFERENCE.0, REFERENCE.1, matched)?;
        let gain = if law == REFERENCE.0 { REFERENCE.1 } else { self.search(law, matched, target)? };
        let reached = self.median(law, gain, matched)?;
        let reached = reached.is_finite().then_some(reached);
        Ok(Gain { matched, law: law.name().to_owned(), arm: self.arm.name.clone(), gain, target, reached })
    }

    /// Doubles or halves the gain until the target lies between two, then halves that step. Where no gain reaches it, as the
    /// loop goes unstable before, the best of those tried.
    fn search(&self, law: Law, matched: Matched, target: f64) -> std::result::Result<f64, CompareError> {
        let mut tried = Vec::new();
        // True where the gain is high enough.
        let mut enough = |gain: f64| {
            let median = self.median(law, gain, matched)?;
            tried.push((gain, (median - target).abs()));
            Ok::<_, CompareError>(match matched {
                Matched::SettlingTime => median <= target,
                Matched::PeakSpeed => median >= target,
            })
        };
        let mut gain = if law.map() == Map::Transpose { 50.0 } else { REFERENCE.1 };
        let first = enough(gain)?;
        let mut step = if first { 0.5 } else { 2.0 };
        while enough(gain * step)? == first && gain * step < HIGHEST && gain * step > 1.0 / HIGHEST {
            gain *= step;
        }
        for _ in 0..6 {
            step = f64::sqrt(step);
            if enough(gain * step)? == first {
                gain *= step;
            }
        }
        let best = tried.iter().min_by(|a, b| a.1.total_cmp(&b.1));
        Ok(best.map_or(gain, |(gain, _)| *gain))
    }

    fn median(&self, law: Law, gain: f64, matched: Matched) -> std::result::Result<f64, CompareError> {
        let controller = self.arm.parameters.settings.controller.with_law(law, gain);
        let closed_loop = ClosedLoop { arm: self.arm, controller, plant: PLANTS[0], limits: false };
        let value = |ended: &Ended| match matched {
            Matched::SettlingTime if ended.outcome == Outcome::Settled => {
                ended.figures.settling_time().unwrap_or(f64::INFINITY)
            }
            Matched::SettlingTime => f64::INFINITY,
            Matched::PeakSpeed => ended.figures.peak_joint_speed,
        };
        let mut values: Vec<_> = self.run(&closed_loop)?.iter().map(value).collect();
        values.sort_by(f64::total_cmp);
        Ok(values[values.len() / 2])
    }
}
