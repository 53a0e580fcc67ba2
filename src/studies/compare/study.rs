//! All runs of a comparison, in a fixed order.

use super::CompareError;
use super::arm::Arm;
use super::closed_loop::{ClosedLoop, Result as Ended};
use super::conditions::{PLANTS, Plant};
use super::matching::{Gain, Matched, REFERENCE, are_gains_of, first_gain, gains};
use super::record::{Record, Run};
use dq_kinematics::control::Law;
use rayon::prelude::*;
use serde_json::json;
use std::fs::File;
use std::io::{BufWriter, ErrorKind, Write};
use std::path::Path;
use tempfile::NamedTempFile;

/// A study: the arms, laws, tasks and gains to compare.
#[derive(Clone, Debug)]
pub struct Study {
    /// The arms.
    pub arms: Vec<Arm>,
    /// The laws, in the order of [`Law::all`].
    pub laws: Vec<Law>,
    /// The number of tasks per arm.
    pub tasks: u32,
    /// The seed of the tasks.
    pub seed: u64,
    /// The gain of each law on each arm, for each quantity that the gains make equal.
    pub gains: Vec<Gain>,
}

/// Writes the file completely or not at all, because other machines may be reading it.
fn keep(file: &Path, text: &str) -> std::io::Result<()> {
    let mut kept = NamedTempFile::new_in(file.parent().unwrap_or(Path::new(".")))?;
    kept.write_all(text.as_bytes())?;
    kept.persist(file)?;
    Ok(())
}

/// Yields the conditions under which every law runs every task. The runs with gains for equal peak speed only show whether the
/// results depend on the quantity that the gains make equal. So these runs use only the first plant, which is exact.
fn conditions() -> impl Iterator<Item = (Matched, bool, Plant)> {
    Matched::ALL.into_iter().flat_map(|matched| {
        let plants = if matched == Matched::SettlingTime { &PLANTS[..] } else { &PLANTS[..1] };
        [false, true]
            .into_iter()
            .flat_map(move |limits| plants.iter().map(move |plant| (matched, limits, *plant)))
    })
}

impl Study {
    /// Creates a study without gains.
    ///
    /// # Errors
    /// [`CompareError::SameName`] for two arms with the same name.
    pub fn new(arms: Vec<Arm>, laws: Vec<Law>, tasks: u32, seed: u64) -> Result<Self, CompareError> {
        let is_twice = |(i, arm): &(usize, &Arm)| arms[..*i].iter().any(|other| other.name == arm.name);
        match arms.iter().enumerate().find(is_twice) {
            Some((_, arm)) => Err(CompareError::SameName(arm.name.clone())),
            None => Ok(Self { arms, laws, tasks, seed, gains: Vec::new() }),
        }
    }

    /// Reads the gains from `file`, if it exists.
    ///
    /// # Errors
    /// [`CompareError::File`]; [`CompareError::OtherGains`] if the file has gains that this program would not choose for these arms
    /// and laws.
    pub fn read_gains(&mut self, file: &Path) -> Result<(), CompareError> {
        let text = match std::fs::read(file) {
            Err(why) if why.kind() == ErrorKind::NotFound => return Ok(()),
            text => text.map_err(|why| CompareError::file(file, why))?,
        };
        let kept: Vec<Gain> = serde_json::from_slice(&text).unwrap_or_default();
        if !are_gains_of(&self.arms, &self.laws, &kept)? {
            return Err(CompareError::OtherGains { file: file.display().to_string() });
        }
        self.gains = kept;
        Ok(())
    }

    /// Chooses the gains and writes them to `file`. Calls `chosen` after each gain.
    ///
    /// # Errors
    /// [`CompareError::File`]; the first error of a simulated run. In practice, no simulated run fails.
    pub fn choose_gains(&mut self, file: &Path, chosen: impl Fn() + Sync) -> Result<(), CompareError> {
        let each = self.arms.par_iter().map(|arm| gains(arm, &self.laws, &chosen));
        self.gains = each.collect::<Result<Vec<_>, _>>()?.concat();
        keep(file, &(serde_json::to_string(&self.gains)? + "\n")).map_err(|why| CompareError::file(file, why))
    }

    /// Returns how many gains [`choose_gains`](Self::choose_gains) chooses.
    pub fn gain_count(&self) -> u64 {
        (Matched::ALL.len() * self.arms.len() * self.laws.len()) as u64
    }

    /// Returns the number of runs.
    pub fn run_count(&self) -> u64 {
        let cells = self.laws.len() * self.arms.len() * conditions().count();
        cells as u64 * u64::from(self.tasks)
    }

    /// Returns the law with which all other laws are compared: the reference law, or the first law if the study does not have the
    /// reference law.
    pub fn baseline(&self) -> Law {
        let reference = REFERENCE.0;
        if self.laws.contains(&reference) {
            reference
        } else {
            self.laws.first().copied().unwrap_or(reference)
        }
    }

    /// Returns the gain of a law on an arm [1/s]. If the study has not chosen this gain yet, returns the
    /// gain at which its choice starts.
    pub fn gain(&self, matched: Matched, arm: &str, law: Law) -> f64 {
        let chosen = |gain: &&Gain| gain.matched == matched && gain.arm == arm && gain.law == law.name();
        self.gains.iter().find(chosen).map_or(first_gain(law), |gain| gain.gain)
    }

    /// Writes a line for each task of each arm. The line has the joint positions \[rad\] and the tool pose at the start, and the
    /// position \[m\] and orientation (x, y, z, w) of the goal.
    ///
    /// # Errors
    /// [`CompareError::File`] if the file cannot be written.
    pub fn write_tasks(&self, file: &Path) -> Result<(), CompareError> {
        let error = |why| CompareError::file(file, why);
        let mut writer = BufWriter::new(File::create(file).map_err(error)?);
        for arm in &self.arms {
            for number in 0..self.tasks {
                writeln!(writer, "{}", self.task_line(arm, number)?).map_err(error)?;
            }
        }
        writer.flush().map_err(error)
    }

    /// Returns the line that [`write_tasks`](Self::write_tasks) writes for a task.
    fn task_line(&self, arm: &Arm, number: u32) -> Result<String, CompareError> {
        let task = arm.task(self.seed, number)?;
        let tool = arm.parameters.arms.chain().forward_kinematics(&task.start)?;
        let (goal, r) = (task.base_from_goal.translation(), task.base_from_goal.rotation());
        let line = json!({
            "arm": arm.name,
            "task": number,
            "start": task.start,
            "start_position": tool.translation().as_slice(),
            "goal_position": goal.as_slice(),
            "goal_orientation": [r.i, r.j, r.k, r.w],
        });
        Ok(line.to_string())
    }

    /// Returns the run with the number `number`.
    pub(super) fn run(&self, number: u64) -> Run<'_> {
        let mut rest = number;
        let mut digit = |base: u64| {
            let digit = rest % base;
            rest /= base;
            digit as usize
        };
        let task = digit(u64::from(self.tasks)) as u32;
        let condition = digit(conditions().count() as u64);
        let (arm, law) = (digit(self.arms.len() as u64), digit(self.laws.len() as u64));
        let (arm, law) = (&self.arms[arm], self.laws[law]);
        let condition = conditions().nth(condition);
        let (matched, limits, plant) = condition.unwrap_or((Matched::SettlingTime, false, PLANTS[0]));
        Run { matched, law, arm, gain: self.gain(matched, &arm.name, law), limits, plant, task }
    }

    /// Yields the number of one run of each cell. If there are enough tasks, no two of these runs are of the same task.
    pub(super) fn sampled(&self) -> impl Iterator<Item = u64> + '_ {
        /// The distance between the task numbers of successive cells. This distance is prime, so that it has no common factor with
        /// usual numbers of tasks.
        const STRIDE: u64 = 7919;
        let tasks = u64::from(self.tasks);
        (0..self.run_count() / tasks).map(move |cell| cell * tasks + cell * STRIDE % tasks)
    }

    /// Simulates one run of each cell, that is, of each law on each arm under each of the conditions.
    ///
    /// # Errors
    /// The first error of a simulated run. In practice, no simulated run fails.
    pub fn sample(&self) -> Result<Vec<Record>, CompareError> {
        let numbers: Vec<_> = self.sampled().collect();
        numbers.into_par_iter().map(|number| self.record(number)).collect()
    }

    /// Simulates the run with the number `number`, and returns its record.
    pub(super) fn record(&self, number: u64) -> Result<Record, CompareError> {
        let run = self.run(number);
        Ok(Record::new(&run, &self.ended(&run)?))
    }

    /// Simulates a run, and returns its result.
    pub(super) fn ended(&self, run: &Run) -> Result<Ended, CompareError> {
        let controller = run.arm.parameters.settings.controller.with_law(run.law, run.gain);
        let closed_loop = ClosedLoop { arm: run.arm, controller, plant: run.plant, limits: run.limits };
        closed_loop.run(&run.arm.task(self.seed, run.task)?, run.task)
    }
}
