//! Compares the runs of other programs under the arms' limits with the runs of a law. `Switch` runs a law with two values of a servo
//! parameter. This module uses the law's runs with the second value.

use super::paired::{End, Paired};
use super::record::Record;
use super::{CompareError, Study};
use std::collections::{BTreeMap, HashSet};
use std::path::Path;

/// The settling times of other programs under the arms' limits \[s\], for each pair of a program and an arm. The times are in the
/// order of the tasks, from the first task on; `None` for a failed task.
#[derive(Clone, Debug, Default)]
pub struct PeerRuns(BTreeMap<(String, String), Vec<Option<f64>>>);

impl PeerRuns {
    /// Reads `peers.jsonl` in the folder, if the file exists. The runs are of the tasks in `tasks.jsonl`.
    ///
    /// # Errors
    /// [`CompareError::File`]; [`CompareError::Damaged`]; [`CompareError::OtherPeers`] if a program has not run the first tasks of
    /// an arm, or if the study has other tasks.
    pub fn read(study: &Study, folder: &Path) -> Result<Self, CompareError> {
        let file = folder.join("peers.jsonl");
        let records = Record::read_all(&file)?;
        if records.is_empty() {
            return Ok(Self::default());
        }
        let other = || CompareError::OtherPeers { file: file.display().to_string() };
        let mut runs = Self::default();
        for record in records {
            if record.limits {
                let of_arm = (record.law, record.arm);
                let tasks = runs.0.entry(of_arm).or_default();
                if record.task as usize != tasks.len() {
                    return Err(other());
                }
                tasks.push(record.settling_s);
            }
        }
        let tasks = folder.join("tasks.jsonl");
        let theirs = std::fs::read_to_string(&tasks).map_err(|why| CompareError::file(&tasks, why))?;
        if runs.are_of(study, &theirs.lines().collect())? { Ok(runs) } else { Err(other()) }
    }

    /// Returns whether the programs have run the study's tasks. Compares the first tasks of each arm, as many as both the programs
    /// and the study have. `theirs` has the lines of the programs' tasks.
    fn are_of(&self, study: &Study, theirs: &HashSet<&str>) -> Result<bool, CompareError> {
        for arm in &study.arms {
            let counts = self.0.iter().filter(|((_, of), _)| *of == arm.name).map(|(_, tasks)| tasks.len());
            let most = counts.max().unwrap_or(0).min(study.tasks as usize);
            for number in 0..most as u32 {
                if !theirs.contains(&*study.task_line(arm, number)?) {
                    return Ok(false);
                }
            }
        }
        Ok(true)
    }

    /// Compares the runs of `law` under the second condition of `rows` with the runs of each program, task by task. Returns the
    /// name of each program with one [`Paired`] for each arm: the first condition is the law, the second is the program.
    pub fn beside(&self, law: &str, rows: &[Paired]) -> Vec<(String, Vec<Paired>)> {
        let mut tables: BTreeMap<&str, Vec<Paired>> = BTreeMap::new();
        for row in rows.iter().filter(|row| row.law == law) {
            for ((program, _), theirs) in self.0.iter().filter(|((_, arm), _)| *arm == row.arm) {
                let end = |settled| End { settled, through_itself: false, words: "failed".to_owned() };
                let both = row.tasks.iter().zip(theirs);
                let tasks = both.map(|([_, ours], theirs)| [ours.clone(), end(*theirs)]).collect();
                tables.entry(program).or_default().push(Paired { tasks, ..row.clone() });
            }
        }
        tables.into_iter().map(|(program, rows)| (program.to_owned(), rows)).collect()
    }
}
