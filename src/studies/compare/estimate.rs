//! Estimates how long a comparison takes on this machine.

use super::latency::FIRST;
use super::matching::PILOTS;
use super::{CompareError, Gain, Matched, Part, Study, Switch};
use rayon::prelude::*;
use std::time::{Duration, Instant};

/// How long loops are run to measure their speed.
const SAMPLE: Duration = Duration::from_millis(1500);
/// Number of loops that are started together.
const BATCH: u64 = 64;
/// The usual number of loops that are run to choose a gain and to judge it.
const PER_GAIN: f64 = 4500.0;
/// The usual fraction of gains that miss their targets.
const MISSING: f64 = 0.4;
/// The usual number of ages of the joint states that are tried for a law, in addition to the ages of the plants.
const AGES: f64 = 3.0;

impl Study {
    /// Estimates how long the rest of the study takes: the choice of the gains if the study has none, the runs of `part`, and their
    /// evaluation. `done` of the runs exist already. The estimate comes from the speed of some of the runs.
    ///
    /// # Errors
    /// The first error of a simulated run. In practice, no simulated run fails.
    pub fn estimate(&self, part: Part, done: u64) -> Result<Duration, CompareError> {
        let count = self.run_count();
        let run = |number| {
            self.record(number)?;
            Ok(self.run(number).limits)
        };
        let [free, limited] = seconds_each(count, run)?;
        let runs = part.runs(count);
        let both = f64::midpoint(free, limited);
        let cells = (self.laws.len() * self.arms.len()) as f64;
        let ages = 2.0 * AGES * cells * f64::from(self.tasks.min(FIRST));
        let evaluation =
            if part == Part::WHOLE { both * ages + free * self.loops_of_unmatched() } else { 0.0 };
        let seconds = both * (runs.end - runs.start).saturating_sub(done) as f64
            + evaluation
            + free * self.loops_of_gains();
        Ok(Duration::from_secs_f64(seconds))
    }

    /// Estimates how long [`switched`](Self::switched) takes, with the choice of the gains if the study has none.
    ///
    /// # Errors
    /// The first error of a simulated run. In practice, no simulated run fails.
    pub fn estimate_switched(&self, switch: Switch) -> Result<Duration, CompareError> {
        let cells = self.switched_cells(switch)?;
        let both = |number| {
            let (cell, task) = (number % cells.len() as u64, number / cells.len() as u64);
            self.both_ends(&cells[cell as usize], task as u32, switch)?;
            Ok(true)
        };
        let count = self.switched_count() / 2;
        let [_, pair] = seconds_each(count, both)?;
        let [free, _] = match self.gains.is_empty() {
            true => seconds_each(self.run_count(), |number| {
                let run = super::record::Run { limits: false, ..self.run(number) };
                self.ended(&run)?;
                Ok(false)
            })?,
            false => [0.0; 2],
        };
        Ok(Duration::from_secs_f64(pair * count as f64 + free * self.loops_of_gains()))
    }

    /// Returns the approximate number of loops that the choice of the gains runs.
    fn loops_of_gains(&self) -> f64 {
        if self.gains.is_empty() { PER_GAIN * self.gain_count() as f64 } else { 0.0 }
    }

    /// Returns the approximate number of loops that the study runs to find out why some gains miss their targets.
    fn loops_of_unmatched(&self) -> f64 {
        let loops = |gain: &Gain| if gain.matched == Matched::SettlingTime { 3.0 } else { 1.0 };
        let known = self.gains.iter().filter(|gain| !gain.is_matched()).map(loops).sum();
        PILOTS as f64 * if self.gains.is_empty() { 2.0 * MISSING * self.gain_count() as f64 } else { known }
    }
}

/// Runs loops on all cores for about [`SAMPLE`]. The numbers of the loops are below `count` and spread evenly. Returns the mean
/// time per loop \[s\] with all cores at work: first of the loops for which `run` returns false, then of the loops for which it
/// returns true.
fn seconds_each(
    count: u64,
    run: impl Fn(u64) -> Result<bool, CompareError> + Sync,
) -> Result<[f64; 2], CompareError> {
    /// The golden ratio minus 1. The fractional parts of its multiples are spread evenly over [0, 1).
    const GOLDEN: f64 = 0.618_033_988_749_895;
    let (begin, mut next, mut all) = (Instant::now(), 0, Vec::new());
    let timed = |k: u64| {
        let (begin, number) = (Instant::now(), ((k as f64 * GOLDEN).fract() * count as f64) as u64);
        run(number).map(|class| (class, begin.elapsed().as_secs_f64()))
    };
    while next < count && begin.elapsed() < SAMPLE {
        let batch = (next..count.min(next + BATCH)).into_par_iter().map(timed);
        all.extend(batch.collect::<Result<Vec<_>, _>>()?);
        next += BATCH;
    }
    Ok([false, true].map(|class| {
        let times: Vec<_> = all.iter().filter(|(of, _)| *of == class).map(|(_, time)| time).collect();
        let sum: f64 = times.iter().copied().sum();
        sum / (times.len().max(1) * rayon::current_num_threads()) as f64
    }))
}
