//! How old joint states may be.

use super::closed_loop::{ClosedLoop, Outcome};
use super::conditions::{PERIOD, PLANTS, Plant};
use super::matching::Matched;
use super::summary::{Interval, Key, Summary, Z};
use super::{CompareError, Study};
use crate::control::Law;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Ages that are tried, in cycles: half octaves from 5 ms to 0.32 s.
const AGES: [usize; 12] = [1, 2, 3, 4, 6, 8, 11, 16, 23, 32, 45, 64];
/// An age holds where so many of the tasks that settle with fresh joint states settle \[%\].
const HOLDS: f64 = 95.0;
/// At each age that is tried at most so many tasks of each arm are run.
pub(super) const AGED: u32 = 400;

/// A law at the age of joint states at which it begins to fail.
#[derive(Clone, Debug, Deserialize, PartialEq, Serialize)]
pub struct Ageing {
    /// The law's name.
    pub law: String,
    /// Whether the servo's limits held.
    pub limits: bool,
    /// How many tasks of all arms settle with fresh joint states.
    pub tasks: usize,
    /// Age \[ms\], and of these tasks the share \[%\] that settles with joint states so old: of the ages that were tried.
    pub settled_percent: Vec<(f64, Interval)>,
    /// The greatest age \[ms\] at which at least 95 % of them settle; 0 for none.
    pub holds_up_to_ms: f64,
    /// The greatest age \[ms\] at which that is sure: the share's interval lies above.
    pub low_ms: f64,
    /// The least age \[ms\] at which it is sure not to be so; none where the tried ages end before.
    pub high_ms: Option<f64>,
}

impl Ageing {
    /// Whether it holds at every age that was tried, and maybe beyond.
    pub fn holds_to_the_end(&self) -> bool {
        let oldest = AGES.last().map_or(0.0, |age| age_ms(*age));
        self.holds_up_to_ms >= oldest
    }
}

/// \[ms\]
fn age_ms(cycles: usize) -> f64 {
    1e3 * PERIOD.as_secs_f64() * cycles as f64
}

/// Every law, with its gain for equal settling time, without and with limits.
///
/// # Errors
/// As the loops.
pub(super) fn ageing(study: &Study, summary: &Summary) -> Result<Vec<Ageing>, CompareError> {
    let each = Law::all().flat_map(|law| [false, true].map(|limits| (law, limits)));
    each.map(|(law, limits)| Ages { study, summary, law, limits, tried: BTreeMap::new() }.find()).collect()
}

/// A law at the ages that were tried.
struct Ages<'a> {
    study: &'a Study,
    summary: &'a Summary,
    law: Law,
    limits: bool,
    /// By their places in [`AGES`].
    tried: BTreeMap<usize, Interval>,
}

impl Ages<'_> {
    /// Looks for the age by halves, as fewer tasks settle the older joint states are, and from there for where that is sure.
    fn find(mut self) -> Result<Ageing, CompareError> {
        let (mut holds, mut fails) = (0, AGES.len());
        // Before the place `holds` it holds, from `fails` on it does not.
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
            tasks: self.settling().count(),
            settled_percent: self.tried.iter().map(|(place, share)| (ms(*place), *share)).collect(),
            holds_up_to_ms: before(holds),
            low_ms: before(sure),
            high_ms: (never < AGES.len()).then(|| ms(never)),
        })
    }

    /// The tasks that settle with fresh joint states, each by its arm's place and its number.
    fn settling(&self) -> impl Iterator<Item = (usize, u32)> + '_ {
        let tasks = |arm| (0..AGED).map(move |task| (arm, task));
        let tasks = (0..self.study.arms.len()).flat_map(tasks);
        tasks.filter(|task| self.settles(*task, "ideal") == Some(true))
    }

    /// Whether a task settles behind one of the comparison's plants.
    fn settles(&self, (arm, task): (usize, u32), plant: &str) -> Option<bool> {
        let arm = &self.study.arms[arm].name;
        let key = Key::new(Matched::SettlingTime, self.law, arm, self.limits, plant);
        self.summary.rows(&key).get(task as usize).map(Option::is_some)
    }

    /// Of these the share that settles with joint states of that age.
    fn share(&mut self, place: usize) -> Result<Interval, CompareError> {
        if let Some(share) = self.tried.get(&place) {
            return Ok(*share);
        }
        let plant = Plant { name: "latency", latency: AGES[place], noise: 0.0 };
        // Of some ages it is known.
        let known = PLANTS.iter().find(|known| (known.latency, known.noise) == (plant.latency, plant.noise));
        let settles = |(arm, task): (usize, u32)| {
            if let Some(settles) = known.and_then(|known| self.settles((arm, task), known.name)) {
                return Ok(settles);
            }
            let arm = &self.study.arms[arm];
            let gain = self.study.gain(Matched::SettlingTime, &arm.name, self.law);
            let controller = arm.parameters.settings.controller.with_law(self.law, gain);
            let closed_loop = ClosedLoop { arm, controller, plant, limits: self.limits };
            let ended = closed_loop.run(&arm.task(self.study.seed, task)?, task)?;
            Ok::<_, CompareError>(ended.outcome == Outcome::Settled)
        };
        let tasks: Vec<_> = self.settling().collect();
        let settled = tasks.into_par_iter().map(settles).collect::<Result<Vec<_>, _>>()?;
        let share = Interval::share(settled.iter().filter(|settled| **settled).count(), settled.len(), Z);
        self.tried.insert(place, share);
        Ok(share)
    }
}
