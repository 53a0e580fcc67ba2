//! Chooses gains for a fair comparison. With these gains, all laws settle in the same time, or move at the same peak speed.

use super::CompareError;
use super::arm::{Arm, Task};
use super::closed_loop::{ClosedLoop, Result as Ended};
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

    /// Returns the values of this quantity in the `loops`, in ascending order.
    pub(super) fn sorted(self, loops: &[Ended]) -> Vec<f64> {
        let value = |ended: &Ended| match self {
            Self::SettlingTime => ended.settled().unwrap_or(f64::INFINITY),
            Self::PeakSpeed => ended.figures.peak_joint_speed,
        };
        let mut values: Vec<_> = loops.iter().map(value).collect();
        values.sort_by(f64::total_cmp);
        values
    }

    fn median(self, loops: &[Ended]) -> f64 {
        self.sorted(loops)[loops.len() / 2]
    }
}

/// The reference law and its gain [1/s]. The gains of the other laws are matched to the reference.
pub const REFERENCE: (Law, f64) = (Law::Logc, 2.0);

/// Number of tasks on which gains are chosen. With this many tasks, the settling times of laws with the damped inverse are accurate
/// to [`CLOSE`]. Peak speeds vary more from task to task, and would need ten times as many tasks.
pub(super) const PILOTS: usize = 1024;
/// Number of tasks for the coarse search of a gain.
const FEW: usize = 48;
/// The seed of the tasks on which gains are chosen. It differs from the seeds of all other tasks.
const PILOT_SEED: u64 = 0x0070_696c_6f74;
/// The seed of the tasks that judge the chosen gains. It differs from the seeds of all other tasks.
const JUDGE_SEED: u64 = 0x6a75_6467_6573;
/// Two medians of the reference law count as equal if their relative difference is below this number. The difference comes from
/// rounding.
const ROUNDING: f64 = 1e-6;
/// A chosen gain counts as matched if the law's median differs from the reference law's median by less than this fraction. The
/// medians are those of the matched quantity: settling time or peak speed.
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
    /// The value of the matched quantity with this gain, on the same tasks as `target`; `None` if more than half of these tasks
    /// fail.
    pub reached: Option<f64>,
}

impl Gain {
    /// Returns whether the gain reaches the target within 2 %, on tasks that were not used to choose gains.
    pub fn is_matched(&self) -> bool {
        self.reached.is_some_and(|reached| (reached / self.target - 1.0).abs() < CLOSE)
    }
}

/// Returns the smallest and the largest gain of a law on the arms [1/s].
pub(super) fn gain_range(gains: &[Gain], matched: Matched, law: &str) -> [f64; 2] {
    let gains = gains.iter().filter(|gain| gain.matched == matched && gain.law == law);
    gains.fold([f64::INFINITY, 0.0], |[low, high], gain| [low.min(gain.gain), high.max(gain.gain)])
}

/// Tasks of an arm on which gains are chosen, or on which the choice is judged. The comparison itself uses other tasks.
pub(super) struct Tasks<'a> {
    arm: &'a Arm,
    tasks: Vec<Task>,
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

    /// Runs `law` with `gain` on the first `count` tasks.
    pub fn run(&self, law: Law, gain: f64, count: usize) -> Result<Vec<Ended>, CompareError> {
        let controller = self.arm.parameters.settings.controller.with_law(law, gain);
        let closed_loop = ClosedLoop { arm: self.arm, controller, plant: PLANTS[0], limits: false };
        let tasks = self.tasks[..count].par_iter().enumerate();
        tasks.map(|(number, task)| closed_loop.run(task, number as u32)).collect()
    }

    /// Runs the reference law on the first `count` tasks.
    fn run_reference(&self, count: usize) -> Result<Vec<Ended>, CompareError> {
        self.run(REFERENCE.0, REFERENCE.1, count)
    }
}

/// Returns the gain with which a law has the reference law's median settling time on an arm. The law need not be registered by name.
/// The gain is approximate, because it comes from only a few tasks.
///
/// # Errors
/// [`CompareError::NeverSettles`] if the law settles in less than half of the tasks at every gain.
pub fn settling_gain(arm: &Arm, law: Law) -> Result<f64, CompareError> {
    let pilots = Tasks::new(arm, PILOT_SEED)?;
    let matched = Matched::SettlingTime;
    let target = matched.median(&pilots.run_reference(FEW)?);
    let search = Search { pilots: &pilots, law, matched, target, count: FEW };
    let gain = search.fine(search.coarse()?)?;
    match search.median(gain)?.is_finite() {
        true => Ok(gain),
        false => Err(CompareError::NeverSettles { law: law.name().to_owned(), arm: arm.name.clone() }),
    }
}

/// Chooses the gains of `laws` on an arm, once for equal settling time and once for equal peak speed. Calls `chosen` after each
/// gain.
///
/// # Errors
/// The first error of a simulated run. In practice, no simulated run fails.
pub(super) fn gains(arm: &Arm, laws: &[Law], chosen: impl Fn()) -> Result<Vec<Gain>, CompareError> {
    let (pilots, judges) = (Tasks::new(arm, PILOT_SEED)?, Tasks::judges(arm)?);
    let (few, all, judged) =
        (pilots.run_reference(FEW)?, pilots.run_reference(PILOTS)?, judges.run_reference(PILOTS)?);
    let gain = |(matched, law): (Matched, Law)| {
        let search = |loops: &[Ended], count| Search {
            pilots: &pilots,
            law,
            matched,
            target: matched.median(loops),
            count,
        };
        let gain = match law == REFERENCE.0 {
            true => REFERENCE.1,
            false => search(&all, PILOTS).fine(search(&few, FEW).coarse()?)?,
        };
        let reached = matched.median(&judges.run(law, gain, PILOTS)?);
        chosen();
        Ok(Gain {
            matched,
            law: law.name().to_owned(),
            arm: arm.name.clone(),
            gain,
            target: matched.median(&judged),
            reached: reached.is_finite().then_some(reached),
        })
    };
    each(laws).map(gain).collect()
}

/// Yields every pair of a quantity and a law, in the order in which [`gains`] returns the gains of an arm.
fn each(laws: &[Law]) -> impl Iterator<Item = (Matched, Law)> {
    Matched::ALL.into_iter().flat_map(move |matched| laws.iter().map(move |law| (matched, *law)))
}

/// Returns whether `kept` has the gains of all `laws` on these arms, with the same targets as this program measures.
///
/// # Errors
/// The first error of a simulated run. In practice, no simulated run fails.
pub(super) fn are_gains_of(arms: &[Arm], laws: &[Law], kept: &[Gain]) -> Result<bool, CompareError> {
    let mut kept = kept.iter();
    for arm in arms {
        let judged = Tasks::judges(arm)?.run_reference(PILOTS)?;
        let targets = Matched::ALL.map(|matched| matched.median(&judged));
        for (matched, law) in each(laws) {
            let is = |gain: &Gain| {
                (gain.matched, &*gain.law, &*gain.arm) == (matched, law.name(), &*arm.name)
                    && (gain.target / targets[matched as usize] - 1.0).abs() < ROUNDING
            };
            if !kept.next().is_some_and(is) {
                return Ok(false);
            }
        }
    }
    Ok(kept.next().is_none())
}

/// Returns the gain at which the search for the gain of a law starts [1/s].
pub(super) fn first_gain(law: Law) -> f64 {
    if law.map() == Map::Transpose { 50.0 } else { REFERENCE.1 }
}

/// A search for the gain of a law at which the median of the quantity `matched` on the first `count` tasks is `target`.
struct Search<'a> {
    pilots: &'a Tasks<'a>,
    law: Law,
    matched: Matched,
    target: f64,
    count: usize,
}

impl Search<'_> {
    fn median(&self, gain: f64) -> Result<f64, CompareError> {
        Ok(self.matched.median(&self.pilots.run(self.law, gain, self.count)?))
    }

    /// Doubles or halves the gain until the target lies between the medians with two successive gains. Then halves the ratio of these
    /// gains four times. Returns the tried gain whose median is nearest to the target. If no gain reaches the target because the loop
    /// becomes unstable, this is the nearest stable gain.
    fn coarse(&self) -> Result<f64, CompareError> {
        let mut tried = Vec::new();
        // Returns whether the law is at least as fast with this gain as the target requires.
        let mut enough = |gain: f64| {
            let median = self.median(gain)?;
            tried.push((gain, (median - self.target).abs()));
            Ok::<_, CompareError>(match self.matched {
                Matched::SettlingTime => median <= self.target,
                Matched::PeakSpeed => median >= self.target,
            })
        };
        let mut gain = first_gain(self.law);
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

    /// Improves the gain `near` in a few steps, and returns the best gain.
    ///
    /// With k times the gain, a law follows the same path k times as fast, apart from the effects of the control period and of gain
    /// limits. So each step multiplies the gain by a ratio. For a settling time, the ratio is the measured median divided by the target.
    /// For a peak speed, it is the target divided by the measured median.
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
