//! Determines how old joint states may be.

use super::closed_loop::{ClosedLoop, Outcome};
use super::conditions::{FRESH, PERIOD, PLANTS, Plant};
use super::matching::Matched;
use super::summary::{Interval, Key, Summary, Z};
use super::{CompareError, Study};
use dq_kinematics::control::Law;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::ops::Range;

/// The ages of the joint states that the search can try, in cycles: half octaves from 5 ms to 0.32 s.
const AGES: [usize; 12] = [1, 2, 3, 4, 6, 8, 11, 16, 23, 32, 45, 64];
/// An age of the joint states is acceptable for a law if at least this percentage of tasks settles. Only the tasks that settle
/// without delay are counted.
const HOLDS: f64 = 95.0;
/// Number of tasks of each arm on which an age is tried first. If their result is in doubt (see [`NO_DOUBT`]), all tasks are tried.
pub(super) const FIRST: u32 = 400;
/// The result of the [`FIRST`] tasks is in doubt if its confidence interval contains 95 %. This is the quantile of the normal
/// distribution for that interval (p < 1e-4).
const NO_DOUBT: f64 = 4.0;

/// The largest acceptable age of joint states for a law. An age is acceptable if at least 95 % of the tasks still settle.
#[derive(Clone, Debug, Deserialize, PartialEq, Serialize)]
pub struct Ageing {
    /// The name of the law.
    pub law: String,
    /// Whether the servo's limits were on.
    pub limits: bool,
    /// Number of tasks of all arms that settle with joint states without delay.
    pub tasks: usize,
    /// The tried ages \[ms\], each with the percentage of the `tasks` that settle with joint states of this age.
    pub settled_percent: Vec<(f64, Interval)>,
    /// The largest age at which at least 95 % of the `tasks` settle \[ms\]; 0 if there is no such age.
    pub holds_up_to_ms: f64,
    /// The lower confidence limit of `holds_up_to_ms` \[ms\]: the largest tried age at which the lower end of the interval in
    /// `settled_percent` is at least 95 %. 0 if there is no such age.
    pub low_ms: f64,
    /// The upper confidence limit of `holds_up_to_ms` \[ms\]: the smallest tried age at which the upper end of the interval in
    /// `settled_percent` is below 95 %. `None` if there is no such age.
    pub high_ms: Option<f64>,
}

impl Ageing {
    /// Returns whether the oldest joint states of the search, 0.32 s, are acceptable.
    pub fn holds_to_the_end(&self) -> bool {
        let oldest = AGES.last().map_or(0.0, |age| age_ms(*age));
        self.holds_up_to_ms >= oldest
    }
}

/// Converts cycles to milliseconds.
fn age_ms(cycles: usize) -> f64 {
    1e3 * PERIOD.as_secs_f64() * cycles as f64
}

/// Returns the plant of the comparison whose joint states have this age \[cycles\] and no other imperfection; `None` if there is no
/// such plant.
fn known(age: usize) -> Option<&'static Plant> {
    PLANTS.iter().find(|plant| plant.latency == age && plant.noise == 0.0)
}

/// Determines the largest acceptable age for every law, once without and once with the servo's limits. Each law has its gain for
/// equal settling time.
///
/// # Errors
/// The first error of a simulated run. In practice, no simulated run fails.
pub(super) fn ageing(study: &Study, summary: &Summary) -> Result<Vec<Ageing>, CompareError> {
    let each = study.laws.iter().flat_map(|law| [false, true].map(|limits| (*law, limits)));
    each.map(|(law, limits)| Ages { study, summary, law, limits, tried: BTreeMap::new() }.find()).collect()
}

/// A task, given by the index of its arm and by its number.
#[derive(Clone, Copy)]
struct ArmTask {
    arm: usize,
    number: u32,
}

/// The number of tasks that settle, and the number of tasks in total.
struct Count {
    settled: usize,
    of: usize,
}

/// A search for the largest acceptable age of the joint states for a law.
struct Ages<'a> {
    study: &'a Study,
    summary: &'a Summary,
    law: Law,
    limits: bool,
    /// The percentage of tasks that settle at each tried age, by the index of the age in [`AGES`].
    tried: BTreeMap<usize, Interval>,
}

impl Ages<'_> {
    /// Finds the largest acceptable age.
    ///
    /// 1. Tries the ages of the comparison's plants, because their results are known.
    /// 2. Bisects the ages that remain. The bisection assumes that fewer tasks settle with older joint states.
    /// 3. Finds the confidence limits of the result.
    fn find(mut self) -> Result<Ageing, CompareError> {
        let (mut holds, mut fails) = (0, AGES.len());
        for place in (0..AGES.len()).filter(|place| known(AGES[*place]).is_some()) {
            if self.share(place)?.value < HOLDS {
                fails = place;
                break;
            }
            holds = place + 1;
        }
        // Ages before the index `holds` are acceptable; ages from the index `fails` on are not.
        while holds < fails {
            let middle = usize::midpoint(holds, fails);
            if self.share(middle)?.value >= HOLDS { holds = middle + 1 } else { fails = middle }
        }
        let (mut sure, mut never) = (holds, holds);
        while sure > 0 && self.share(sure - 1)?.low < HOLDS {
            sure -= 1;
        }
        while never < AGES.len() && self.share(never)?.high >= HOLDS {
            never += 1;
        }
        let ms = |place: usize| age_ms(AGES[place]);
        let before = |place: usize| if place == 0 { 0.0 } else { ms(place - 1) };
        Ok(Ageing {
            law: self.law.name().to_owned(),
            limits: self.limits,
            tasks: self.settling(0..self.study.tasks).count(),
            settled_percent: self.tried.iter().map(|(place, share)| (ms(*place), *share)).collect(),
            holds_up_to_ms: before(holds),
            low_ms: before(sure),
            high_ms: (never < AGES.len()).then(|| ms(never)),
        })
    }

    /// Yields the tasks with these `numbers`, of all arms, that settle with joint states without delay.
    fn settling(&self, numbers: Range<u32>) -> impl Iterator<Item = ArmTask> + '_ {
        let tasks = move |arm| numbers.clone().map(move |number| ArmTask { arm, number });
        let tasks = (0..self.study.arms.len()).flat_map(tasks);
        tasks.filter(|task| self.settles(*task, FRESH) == Some(true))
    }

    /// Returns whether a task settles with the plant `plant` of the comparison; `None` if the comparison has no such run.
    fn settles(&self, task: ArmTask, plant: &str) -> Option<bool> {
        let arm = &self.study.arms[task.arm].name;
        let key = Key::new(Matched::SettlingTime, self.law.name(), arm, self.limits, plant);
        self.summary.rows(&key).get(task.number as usize).map(Option::is_some)
    }

    /// Returns the percentage of tasks that settle with joint states of the age `AGES[place]`, among the tasks that settle without
    /// delay.
    fn share(&mut self, place: usize) -> Result<Interval, CompareError> {
        if let Some(share) = self.tried.get(&place) {
            return Ok(*share);
        }
        let (first, all) = (FIRST.min(self.study.tasks), self.study.tasks);
        let Count { mut settled, mut of } = self.count(AGES[place], 0..first)?;
        let wide = Interval::share(settled, of, NO_DOUBT);
        if known(AGES[place]).is_some() || (wide.low..=wide.high).contains(&HOLDS) {
            let rest = self.count(AGES[place], first..all)?;
            (settled, of) = (settled + rest.settled, of + rest.of);
        }
        let share = Interval::share(settled, of, Z);
        self.tried.insert(place, share);
        Ok(share)
    }

    /// Counts the tasks that settle with joint states of the age `age` \[cycles\], among the tasks of [`settling`](Self::settling).
    /// Runs only the tasks whose result is not known yet.
    fn count(&self, age: usize, numbers: Range<u32>) -> Result<Count, CompareError> {
        let plant = Plant { name: "latency", latency: age, noise: 0.0 };
        let settles = |task: ArmTask| {
            if let Some(settles) = known(age).and_then(|known| self.settles(task, known.name)) {
                return Ok(settles);
            }
            let arm = &self.study.arms[task.arm];
            let gain = self.study.gain(Matched::SettlingTime, &arm.name, self.law);
            let controller = arm.parameters.settings.controller.with_law(self.law, gain);
            let closed_loop = ClosedLoop { arm, controller, plant, limits: self.limits };
            let ended = closed_loop.run(&arm.task(self.study.seed, task.number)?, task.number)?;
            Ok::<_, CompareError>(ended.outcome == Outcome::Settled)
        };
        let tasks: Vec<_> = self.settling(numbers).collect();
        let settled = tasks.into_par_iter().map(settles).collect::<Result<Vec<_>, _>>()?;
        Ok(Count { settled: settled.iter().filter(|settled| **settled).count(), of: settled.len() })
    }
}
