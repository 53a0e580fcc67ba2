//! All runs of a comparison in one order, written in that order: so a part can be resumed, and parts put together are the whole.

use super::CompareError;
use super::arm::Arm;
use super::closed_loop::ClosedLoop;
use super::conditions::{PLANTS, Plant};
use super::matching::{Gain, Matched, Pilots};
use super::record::Record;
use crate::control::Law;
use rayon::prelude::*;
use serde_json::json;
use std::fs::{File, OpenOptions};
use std::io::{BufRead, BufReader, BufWriter, Seek, Write};
use std::ops::Range;
use std::path::Path;

/// So many runs are done at once, then written: what a kill costs at most.
const BATCH: u64 = 2048;

/// What is compared.
#[derive(Clone, Debug)]
pub struct Study {
    /// The arms.
    pub arms: Vec<Arm>,
    /// Tasks for each arm.
    pub tasks: u32,
    /// Which tasks.
    pub seed: u64,
    /// The gain of each law on each arm, for each way to match them.
    pub gains: Vec<Gain>,
}

/// One run.
#[derive(Clone, Copy)]
pub(super) struct Run<'a> {
    pub matched: Matched,
    pub law: Law,
    pub arm: &'a Arm,
    pub limits: bool,
    pub plant: Plant,
    pub task: u32,
    pub gain: f64,
}

impl Study {
    /// Chooses the gains.
    ///
    /// # Errors
    /// [`CompareError::SameName`] for two arms with one name.
    pub fn new(
        arms: Vec<Arm>,
        tasks: u32,
        seed: u64,
        chosen: impl Fn() + Sync,
    ) -> Result<Self, CompareError> {
        if let Some(twice) =
            arms.iter().enumerate().find(|(i, arm)| arms[..*i].iter().any(|a| a.name == arm.name))
        {
            return Err(CompareError::SameName(twice.1.name.clone()));
        }
        let gains = |(matched, arm): (Matched, &Arm)| {
            let pilots = Pilots::new(arm)?;
            let gain = |law: &Law| {
                let gain = pilots.gain(*law, matched);
                chosen();
                gain
            };
            Law::ALL.iter().map(gain).collect::<Result<Vec<_>, _>>()
        };
        let each: Vec<_> =
            Matched::ALL.iter().flat_map(|matched| arms.iter().map(|arm| (*matched, arm))).collect();
        let gains = each.into_par_iter().map(gains).collect::<Result<Vec<_>, _>>()?.concat();
        Ok(Self { arms, tasks, seed, gains })
    }

    /// How many gains [`new`](Self::new) chooses for so many arms.
    pub fn gain_count(arms: usize) -> u64 {
        (Matched::ALL.len() * arms * Law::ALL.len()) as u64
    }

    /// How many runs there are.
    pub fn run_count(&self) -> u64 {
        let cells = Matched::ALL.len() * Law::ALL.len() * self.arms.len() * 2 * PLANTS.len();
        cells as u64 * u64::from(self.tasks)
    }

    /// The runs of part number `part` of `parts`, counted from 1: all parts together are all runs.
    pub fn part(&self, part: u64, parts: u64) -> Range<u64> {
        let bound = |part: u64| (u128::from(self.run_count()) * u128::from(part) / u128::from(parts)) as u64;
        bound(part - 1)..bound(part)
    }

    /// The gain [1/s] that was chosen for a law on an arm; 0 for an arm that is not compared.
    pub fn gain(&self, matched: Matched, arm: &str, law: Law) -> f64 {
        let chosen = |gain: &&Gain| gain.matched == matched && gain.arm == arm && gain.law == law.name();
        self.gains.iter().find(chosen).map_or(0.0, |gain| gain.gain)
    }

    /// A line for each task of each arm: joint angles \[rad\] and tool at the start, the tool's goal \[m\], orientation (x, y, z, w).
    ///
    /// # Errors
    /// [`CompareError::File`].
    pub fn write_tasks(&self, file: &Path) -> Result<(), CompareError> {
        let error = |why| CompareError::file(file, why);
        let mut writer = BufWriter::new(File::create(file).map_err(error)?);
        for arm in &self.arms {
            for number in 0..self.tasks {
                let task = arm.task(self.seed, number)?;
                let tool = arm.parameters.task.chain().forward_kinematics(&task.start)?;
                let (goal, r) = (task.base_from_goal.translation(), task.base_from_goal.rotation());
                let line = json!({
                    "arm": arm.name,
                    "task": number,
                    "start": task.start,
                    "start_position": tool.translation().as_slice(),
                    "goal_position": goal.as_slice(),
                    "goal_orientation": [r.i, r.j, r.k, r.w],
                });
                writeln!(writer, "{line}").map_err(error)?;
            }
        }
        writer.flush().map_err(error)
    }

    /// The run of that number.
    fn run(&self, number: u64) -> Run<'_> {
        let mut rest = number;
        let mut digit = |base: u64| {
            let digit = rest % base;
            rest /= base;
            digit as usize
        };
        let task = digit(u64::from(self.tasks)) as u32;
        let plant = PLANTS[digit(PLANTS.len() as u64)];
        let limits = digit(2) == 1;
        let (arm, law) = (digit(self.arms.len() as u64), digit(Law::ALL.len() as u64));
        let matched = Matched::ALL[digit(Matched::ALL.len() as u64)];
        let (arm, law) = (&self.arms[arm], Law::ALL[law]);
        Run { matched, law, arm, gain: self.gain(matched, &arm.name, law), limits, plant, task }
    }

    /// The line of the run of that number, with its end.
    fn line(&self, number: u64) -> Result<String, CompareError> {
        let run = self.run(number);
        let controller = run.arm.parameters.settings.controller.with_law(run.law, run.gain);
        let closed_loop = ClosedLoop { arm: run.arm, controller, plant: run.plant, limits: run.limits };
        let ended = closed_loop.run(&run.arm.task(self.seed, run.task)?, run.task)?;
        let mut line = serde_json::to_string(&Record::new(&run, &ended))
            .map_err(|why| CompareError::Damaged { file: "a record".to_owned(), why: why.to_string() })?;
        line.push('\n');
        Ok(line)
    }

    /// Writes the lines of `runs` to the file, going on after those that it has; `done` is called with how many are done.
    ///
    /// # Errors
    /// [`CompareError::File`]; [`CompareError::OtherStudy`] where the file has lines of another study.
    pub fn write(&self, file: &Path, runs: Range<u64>, done: impl Fn(u64)) -> Result<(), CompareError> {
        let error = |why| CompareError::file(file, why);
        let mut lines = OpenOptions::new()
            .read(true)
            .write(true)
            .create(true)
            .truncate(false)
            .open(file)
            .map_err(error)?;
        let have = self.keep_whole_lines(file, &mut lines, &runs)?;
        done(have);
        let mut writer = BufWriter::new(lines);
        let mut next = runs.start + have;
        while next < runs.end {
            let batch = next..runs.end.min(next + BATCH);
            let count = batch.end - batch.start;
            next = batch.end;
            let lines =
                batch.into_par_iter().map(|number| self.line(number)).collect::<Result<Vec<_>, _>>()?;
            lines.iter().try_for_each(|line| writer.write_all(line.as_bytes())).map_err(error)?;
            writer.flush().map_err(error)?;
            done(count);
        }
        Ok(())
    }

    /// Cuts off the half line that a kill may have left, and counts the whole ones. The first and the last must be this study's.
    fn keep_whole_lines(
        &self,
        file: &Path,
        lines: &mut File,
        runs: &Range<u64>,
    ) -> Result<u64, CompareError> {
        let error = |why| CompareError::file(file, why);
        let (mut count, mut bytes, mut last, mut line) = (0, 0, Vec::new(), Vec::new());
        let mut reader = BufReader::new(&mut *lines);
        while reader.read_until(b'\n', &mut line).map_err(error)? > 0 && line.ends_with(b"\n") {
            if count == 0 {
                self.check_line(file, runs, 0, &line)?;
            }
            (count, bytes) = (count + 1, bytes + line.len() as u64);
            std::mem::swap(&mut last, &mut line);
            line.clear();
        }
        if count > 1 {
            self.check_line(file, runs, count - 1, &last)?;
        }
        lines.set_len(bytes).map_err(error)?;
        lines.seek(std::io::SeekFrom::End(0)).map_err(error)?;
        Ok(count)
    }

    fn check_line(
        &self,
        file: &Path,
        runs: &Range<u64>,
        index: u64,
        line: &[u8],
    ) -> Result<(), CompareError> {
        let number = runs.start + index;
        let same = number < runs.end && self.line(number)?.as_bytes() == line;
        let other = || CompareError::OtherStudy { file: file.display().to_string(), line: index + 1 };
        same.then_some(()).ok_or_else(other)
    }
}
