//! Chooses gains for a fair comparison. With these gains, all laws settle in the same time, or move at the same peak speed.

use super::CompareError;
use super::arm::{Arm, Task};
use super::closed_loop::{ClosedLoop, Outcome, Result as Ended};
use super::conditions::PLANTS;
use dq_common::named;
use dq_kinematics::control::{Law, Map};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

named! {
    /// The quantity that the gains make equal for all laws.
    #[derive(Deserialize, Serialize)]
    #[serde(rename_all = "snake_case")]
    "matched" Matched {
        /// The median settling time. The settling time of a failed task is infinite.
        SettlingTime = "settling_time",
        /// The median peak joint speed.
        PeakSpeed = "peak_speed",
    }
}

impl Matched {
    /// The settling time and the peak speed.
    pub const ALL: [Self; 2] = [Self::SettlingTime, Self::PeakSpeed];
}

/// The reference law and its gain [1/s]. The gains of the other laws are matched to the reference.
pub const REFERENCE: (Law, f64) = (Law::Logc, 2.0);

/// Yields all laws except the reference.
pub(super) fn others() -> impl Iterator<Item = Law> {
    Law::all().filter(|law| *law != REFERENCE.0)
}

/// Number of tasks on which gains are chosen. With this many tasks, the settling times of laws with the damped inverse are accurate
/// to [`CLOSE`]. Peak speeds vary more from task to task, and would need ten times as many tasks.
pub(super) const PILOTS: usize = 1024;
/// Number of tasks for the coarse search of a gain.
const FEW: usize = 48;
/// The seed of the tasks on which gains are chosen. It differs from the seeds of all other tasks.
const PILOT_SEED: u64 = 0x0070_696c_6f74;
/// The seed of the tasks that judge the chosen gains. It differs from the seeds of all other tasks.
const JUDGE_SEED: u64 = 0x6a75_6467_6573;
/// Two measured values of the reference law count as the same up to this relative difference, because of rounding.
const ROUNDING: f64 = 1e-6;
/// A gain counts as matched if its value differs from the reference law's value by at most this fraction.
pub(super) const CLOSE: f64 = 0.02;
/// Relative accuracy of a chosen gain. More accuracy would be of no use, because settling times are multiples of the 5 ms cycle. A
/// cycle is about 1/400 of the reference law's settling time.
const CHOSEN: f64 = 0.003;
/// Largest gain that is tried [1/s].
const HIGHEST: f64 = 1e4;

/// The gain of a law on an arm.
#[derive(Clone, Debug, Deserialize, PartialEq, Serialize)]
pub struct Gain {
    /// The quantity that this gain makes equal for the law and the reference law.
    pub matched: Matched,
    /// The name of the law.
    pub law: String,
    /// The name of the arm.
    pub arm: String,
    /// The gain [1/s], as an argument of `Controller::with_law`.
    pub gain: f64,
    /// The target: the reference law's value of the matched quantity, on tasks that were not used to choose gains [s or rad/s].
    pub target: f64,
    /// The value of the matched quantity with this gain, on the same tasks; `None` if more than half of the tasks fail.
    pub reached: Option<f64>,
}

impl Gain {
    /// Returns whether the gain reaches the target within 2 %, on tasks that were not used to choose gains.
    pub fn is_matched(&self) -> bool {
        self.reached.is_some_and(|reached| (reached / self.target - 1.0).abs() < CLOSE)
    }
}

/// Tasks of an arm on which gains are chosen, or on which the choice is judged. The comparison itself uses other tasks.
pub(super) struct Tasks<'a> {
    arm: &'a Arm,
    tasks: Vec<Task>,
}

/// The median settling time \[s\] and peak joint speed [rad/s] over some tasks.
#[derive(Clone, Copy, Debug)]
struct Medians {
    settling_time: f64,
    peak_speed: f64,
}

impl Medians {
    fn of(self, matched: Matched) -> f64 {
        match matched {
            Matched::SettlingTime => self.settling_time,
            Matched::PeakSpeed => self.peak_speed,
        }
    }
}

/// The settling times \[s\] and the peak joint speeds [rad/s] of some tasks, each list in ascending order.
pub(super) struct Sorted {
    settling_time: Vec<f64>,
    peak_speed: Vec<f64>,
}

impl Sorted {
    pub fn of(&self, matched: Matched) -> &[f64] {
        match matched {
            Matched::SettlingTime => &self.settling_time,
            Matched::PeakSpeed => &self.peak_speed,
        }
    }
}

impl<'a> Tasks<'a> {
    fn new(arm: &'a Arm, seed: u64) -> Result<Self, CompareError> {
        let tasks = (0..PILOTS as u32).map(|number| arm.task(seed, number));
        Ok(Self { arm, tasks: tasks.collect::<Result<_, _>>()? })
    }

    /// Creates the tasks on which the choice is judged.
    pub fn judges(arm: &'a Arm) -> Result<Self, CompareError> {
        Self::new(arm, JUDGE_SEED)
    }

    /// Returns the medians for `law` with `gain` over the first `count` tasks.
    fn medians(&self, law: Law, gain: f64, count: usize) -> Result<Medians, CompareError> {
        let runs = self.sorted(law, gain, count)?;
        let median = |matched: Matched| runs.of(matched)[count / 2];
        Ok(Medians { settling_time: median(Matched::SettlingTime), peak_speed: median(Matched::PeakSpeed) })
    }

    /// Runs `law` with `gain` on the first `count` tasks. Returns the settling times and the peak speeds, each in ascending order.
    pub fn sorted(&self, law: Law, gain: f64, count: usize) -> Result<Sorted, CompareError> {
        let controller = self.arm.parameters.settings.controller.with_law(law, gain);
        let closed_loop = ClosedLoop { arm: self.arm, controller, plant: PLANTS[0], limits: false };
        let tasks = self.tasks[..count].par_iter().enumerate();
        let ended = tasks.map(|(number, task)| closed_loop.run(task, number as u32));
        let ended = ended.collect::<Result<Vec<Ended>, _>>()?;
        let settling_time = |ended: &Ended| {
            let settled = ended.outcome == Outcome::Settled;
            ended.figures.settling_time().filter(|_| settled).unwrap_or(f64::INFINITY)
        };
        let sorted = |value: &dyn Fn(&Ended) -> f64| {
            let mut values: Vec<_> = ended.iter().map(value).collect();
            values.sort_by(f64::total_cmp);
            values
        };
        Ok(Sorted {
            settling_time: sorted(&settling_time),
            peak_speed: sorted(&|ended| ended.figures.peak_joint_speed),
        })
    }
}

/// Returns the gain at which a law has the reference's median settling time on an arm. Also accepts a law that is not registered.
/// The gain is approximate, because it comes from only a few tasks.
///
/// # Errors
/// [`CompareError::NeverSettles`] if the law settles in less than half of the tasks at every gain.
pub fn settling_gain(arm: &Arm, law: Law) -> Result<f64, CompareError> {
    let pilots = Tasks::new(arm, PILOT_SEED)?;
    let matched = Matched::SettlingTime;
    let target = pilots.medians(REFERENCE.0, REFERENCE.1, FEW)?.of(matched);
    let search = Search { pilots: &pilots, law, matched, target, count: FEW };
    let gain = search.fine(search.coarse()?)?;
    match search.median(gain)?.is_finite() {
        true => Ok(gain),
        false => Err(CompareError::NeverSettles { law: law.name().to_owned(), arm: arm.name.clone() }),
    }
}

/// Chooses the gain of each law on an arm, once for equal settling time and once for equal peak speed.
///
/// # Errors
/// The first error of a simulated run. In practice, no simulated run fails.
pub(super) fn gains(arm: &Arm, chosen: impl Fn()) -> Result<Vec<Gain>, CompareError> {
    let (pilots, judges) = (Tasks::new(arm, PILOT_SEED)?, Tasks::judges(arm)?);
    let (few, all, judged) = (
        pilots.medians(REFERENCE.0, REFERENCE.1, FEW)?,
        pilots.medians(REFERENCE.0, REFERENCE.1, PILOTS)?,
        judges.medians(REFERENCE.0, REFERENCE.1, PILOTS)?,
    );
    let gain = |matched: Matched, law: Law| {
        let gain = if law == REFERENCE.0 {
            REFERENCE.1
        } else {
            let near =
                Search { pilots: &pilots, law, matched, target: few.of(matched), count: FEW }.coarse()?;
            Search { pilots: &pilots, law, matched, target: all.of(matched), count: PILOTS }.fine(near)?
        };
        let reached = judges.medians(law, gain, PILOTS)?.of(matched);
        chosen();
        Ok(Gain {
            matched,
            law: law.name().to_owned(),
            arm: arm.name.clone(),
            gain,
            target: judged.of(matched),
            reached: reached.is_finite().then_some(reached),
        })
    };
    Matched::ALL.into_iter().flat_map(|matched| Law::all().map(move |law| gain(matched, law))).collect()
}

/// Returns whether `kept` has the gains of all laws on these arms, with the same targets as this program measures.
///
/// # Errors
/// The first error of a simulated run. In practice, no simulated run fails.
pub(super) fn are_gains_of(arms: &[Arm], kept: &[Gain]) -> Result<bool, CompareError> {
    let mut kept = kept.iter();
    for arm in arms {
        let judged = Tasks::judges(arm)?.medians(REFERENCE.0, REFERENCE.1, PILOTS)?;
        for (matched, law) in
            Matched::ALL.into_iter().flat_map(|matched| Law::all().map(move |law| (matched, law)))
        {
            let is = |gain: &Gain| {
                (gain.matched, &*gain.law, &*gain.arm) == (matched, law.name(), &*arm.name)
                    && (gain.target / judged.of(matched) - 1.0).abs() < ROUNDING
            };
            if !kept.next().is_some_and(is) {
                return Ok(false);
            }
        }
    }
    Ok(kept.next().is_none())
}

/// A search for the gain at which a law has the value `target` on the first `count` tasks.
struct Search<'a> {
    pilots: &'a Tasks<'a>,
    law: Law,
    matched: Matched,
    target: f64,
    count: usize,
}

impl Search<'_> {
    fn median(&self, gain: f64) -> Result<f64, CompareError> {
        Ok(self.pilots.medians(self.law, gain, self.count)?.of(self.matched))
    }

    /// Doubles or halves the gain until the target lies between the values of two gains. Then halves the interval between these
    /// gains. If no gain reaches the target, because the loop becomes unstable first, returns the best gain that was tried.
    fn coarse(&self) -> Result<f64, CompareError> {
        let mut tried = Vec::new();
        // Returns whether the gain is high enough.
        let mut enough = |gain: f64| {
            let median = self.median(gain)?;
            tried.push((gain, (median - self.target).abs()));
            Ok::<_, CompareError>(match self.matched {
                Matched::SettlingTime => median <= self.target,
                Matched::PeakSpeed => median >= self.target,
            })
        };
        let mut gain = if self.law.map() == Map::Transpose { 50.0 } else { REFERENCE.1 };
        let first = enough(gain)?;
        let mut step = if first { 0.5 } else { 2.0 };
        while enough(gain * step)? == first && gain * step < HIGHEST && gain * step > 1.0 / HIGHEST {
            gain *= step;
        }
        for _ in 0..4 {
            step = f64::sqrt(step);
            if enough(gain * step)? == first {
                gain *= step;
            }
        }
        let best = tried.iter().min_by(|a, b| a.1.total_cmp(&b.1));
        Ok(best.map_or(gain, |(gain, _)| *gain))
    }

    /// Returns the best of a few gains, starting from `near`. With k times the gain, a law follows the same path k times as fast,
    /// apart from the effects of the control period and of gain limits. So each step multiplies the gain by a ratio: the measured
    /// value divided by the target for a settling time, the target divided by the measured value for a peak speed.
    fn fine(&self, near: f64) -> Result<f64, CompareError> {
        const STEPS: usize = 5;
        let (mut gain, mut best) = (near, (f64::INFINITY, near));
        for _ in 0..STEPS {
            let missing = match (self.matched, self.median(gain)?) {
                (Matched::SettlingTime, median) => median / self.target,
                (Matched::PeakSpeed, median) => self.target / median,
            };
            let off = missing.ln().abs();
            // If the result does not improve, the gain is unstable.
            if off >= best.0 {
                break;
            }
            best = (off, gain);
            if off < CHOSEN {
                break;
            }
            gain = (gain * missing).min(HIGHEST);
        }
        Ok(best.1)
    }
}
