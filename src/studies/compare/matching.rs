//! Gains at which laws are fairly compared: each settles in the same time, or moves at the same peak speed.

use super::CompareError;
use super::arm::{Arm, Task};
use super::closed_loop::{ClosedLoop, Outcome, Result as Ended};
use super::conditions::PLANTS;
use dq_common::named;
use dq_kinematics::control::{Law, Map};
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

/// All laws but the reference.
pub(super) fn others() -> impl Iterator<Item = Law> {
    Law::all().filter(|law| *law != REFERENCE.0)
}

/// On how many tasks gains are chosen, and on how many others the choice is judged: as many as it takes for [`CLOSE`] in the settling times
/// of laws with the damped inverse. Peak speeds differ so much from task to task that it would take ten times as many.
pub(super) const PILOTS: usize = 1024;
/// So many of the pilot tasks are enough to look for the neighbourhood of a gain.
const FEW: usize = 48;
/// Apart from the seeds of tasks, and from each other.
const PILOT_SEED: u64 = 0x0070_696c_6f74;
const JUDGE_SEED: u64 = 0x6a75_6467_6573;
/// Targets are the same where they differ by no more than this part, which is rounding.
const ROUNDING: f64 = 1e-6;
/// A gain is matched where it gives the target to this part of it.
pub(super) const CLOSE: f64 = 0.02;
/// On its own tasks it is chosen to this part; settling times come in cycles of a four hundredth of the target.
const CHOSEN: f64 = 0.003;
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
    /// What the reference gives on tasks on which no gain was chosen: \[s\] or [rad/s].
    pub target: f64,
    /// What this gain gives on the same tasks; nothing where more than half of them fail.
    pub reached: Option<f64>,
}

impl Gain {
    /// Whether the target was reached, to 2 %, on other tasks than the gain was chosen on.
    pub fn is_matched(&self) -> bool {
        self.reached.is_some_and(|reached| (reached / self.target - 1.0).abs() < CLOSE)
    }
}

/// Tasks of an arm that no comparison uses, on which gains are chosen or the choice is judged.
pub(super) struct Tasks<'a> {
    arm: &'a Arm,
    tasks: Vec<Task>,
}

/// What is made equal, on some tasks.
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

/// What is made equal, in each of some tasks, in ascending order.
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

    /// Those on which the choice is judged.
    pub fn judges(arm: &'a Arm) -> Result<Self, CompareError> {
        Self::new(arm, JUDGE_SEED)
    }

    /// What `law` with `gain` gives on the first `count` tasks.
    fn medians(&self, law: Law, gain: f64, count: usize) -> Result<Medians, CompareError> {
        let runs = self.sorted(law, gain, count)?;
        let median = |matched: Matched| runs.of(matched)[count / 2];
        Ok(Medians { settling_time: median(Matched::SettlingTime), peak_speed: median(Matched::PeakSpeed) })
    }

    /// What `law` with `gain` does in each of the first `count` tasks, in ascending order.
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

/// The gain at which a law of any kind, one that is on no list among them, has the median settling time of the reference on an arm, over
/// tasks that no comparison uses: a few of them, as this is for a look.
///
/// # Errors
/// As the loops.
pub fn settling_gain(arm: &Arm, law: Law) -> Result<f64, CompareError> {
    let pilots = Tasks::new(arm, PILOT_SEED)?;
    let matched = Matched::SettlingTime;
    let target = pilots.medians(REFERENCE.0, REFERENCE.1, FEW)?.of(matched);
    let search = Search { pilots: &pilots, law, matched, target, count: FEW };
    search.fine(search.coarse()?)
}

/// Chooses the gains of an arm, each law's for each way to match them.
///
/// # Errors
/// As the loops.
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

/// Whether these are gains of all laws on these arms, and their targets are what this program measures.
///
/// # Errors
/// As the loops.
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

/// A search for the gain at which a law gives `target` on the first `count` pilot tasks.
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

    /// Doubles or halves the gain until the target lies between two, then halves that step. Where no gain reaches it, as the
    /// loop goes unstable before, the best of those tried.
    fn coarse(&self) -> Result<f64, CompareError> {
        let mut tried = Vec::new();
        // True where the gain is high enough.
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

    /// The best of a few gains from `near` on. With k times the gain a law goes the same way k times as fast, but for the cycle and a
    /// limit to the gain: so each step is by the ratio that is missing.
    fn fine(&self, near: f64) -> Result<f64, CompareError> {
        const STEPS: usize = 5;
        let (mut gain, mut best) = (near, (f64::INFINITY, near));
        for _ in 0..STEPS {
            let missing = match (self.matched, self.median(gain)?) {
                (Matched::SettlingTime, median) => median / self.target,
                (Matched::PeakSpeed, median) => self.target / median,
            };
            let off = missing.ln().abs();
            // One that comes no nearer goes unstable before.
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
