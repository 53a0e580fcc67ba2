//! Other programs that run the tasks of the comparison. `tests/benches/compare_peers.py` runs these programs.

use super::matching::gain_range;
use super::pairs::{Comparison, FIGURES, Quantity, compared};
use super::record::Record;
use super::summary::{ALL_ARMS, Cell, Key, Summary, Z};
use super::{CompareError, Matched, Study};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::Path;

/// The results of another program, or of the study's baseline law, on the tasks that the other programs have run. The joint states
/// are exact and have no delay. The gains give all of them the same median settling time.
#[derive(Clone, Debug, Deserialize, PartialEq, Serialize)]
pub struct Peer {
    /// The results on all arms together. The name of the program replaces the name of the law.
    #[serde(flatten)]
    pub cell: Cell,
    /// The smallest and the largest gain on the arms [1/s].
    pub gains: [f64; 2],
}

/// The runs of other programs, and the runs of the study's baseline on the same tasks. These are the first tasks of each arm.
#[derive(Clone, Debug, Default)]
pub struct Peers {
    summary: Summary,
    gains: BTreeMap<Key, [f64; 2]>,
    /// The law of the study with which the programs are compared.
    baseline: &'static str,
}

impl Peers {
    /// Reads `peers.jsonl`, if it exists. Takes the runs of the study's baseline from `summary`.
    ///
    /// # Errors
    /// [`CompareError::File`]; [`CompareError::Damaged`]; [`CompareError::OtherPeers`] if the programs have not run the same tasks, or
    /// if these are not the first tasks of each arm of the study.
    pub fn read(study: &Study, summary: &Summary, file: &Path) -> Result<Self, CompareError> {
        let mut peers = Self::default();
        let mut tasks: BTreeMap<Key, Vec<(String, u32)>> = BTreeMap::new();
        for record in Record::read_all(file)? {
            let key = peers.add(&record);
            tasks.entry(key).or_default().push((record.arm, record.task));
        }
        let Some(count) = tasks.values().next().map(|tasks| tasks.len() / study.arms.len()) else {
            return Ok(peers);
        };
        peers.baseline = study.baseline().name();
        let each =
            |arm: &super::Arm| (0..count as u32).map(|task| (arm.name.clone(), task)).collect::<Vec<_>>();
        let expected: Vec<_> = study.arms.iter().flat_map(each).collect();
        if count > study.tasks as usize || tasks.values().any(|tasks| *tasks != expected) {
            return Err(CompareError::OtherPeers { file: file.display().to_string() });
        }
        for limits in [false, true] {
            let key = |arm: &str| Key::fresh(Matched::SettlingTime, peers.baseline, arm, limits);
            let (all, gains) =
                (key(ALL_ARMS), gain_range(&study.gains, Matched::SettlingTime, peers.baseline));
            let of = |arm: &super::Arm| summary.rows(&key(&arm.name)).iter().take(count);
            let rows = study.arms.iter().flat_map(of).copied().collect();
            peers.summary.set(all.clone(), rows);
            peers.gains.insert(all, gains);
        }
        Ok(peers)
    }

    /// Adds a run to its program's cell for all arms together. Returns the key of the cell.
    fn add(&mut self, record: &Record) -> Key {
        let key = Key::of(record, ALL_ARMS);
        self.summary.add_to(key.clone(), record);
        let [least, greatest] = self.gains.entry(key.clone()).or_insert([f64::INFINITY, 0.0]);
        (*least, *greatest) = (least.min(record.gain), greatest.max(record.gain));
        key
    }

    /// Returns the results of every program and of the study's baseline; empty if no other program has run.
    pub(super) fn cells(&self) -> Vec<Peer> {
        let gains = |cell: &Cell| self.gains.get(&cell.key).copied().unwrap_or_default();
        self.summary.cells(Z).into_iter().map(|cell| Peer { gains: gains(&cell), cell }).collect()
    }

    /// Compares each program with the study's baseline, on the tasks that both the program and the baseline have run. The
    /// probabilities are not adjusted yet.
    pub(super) fn comparisons(&self) -> Vec<Comparison> {
        let mut all = Vec::new();
        for key in self.gains.keys().filter(|key| key.law != self.baseline) {
            let baseline = Key { law: self.baseline.to_owned(), ..key.clone() };
            let both = [key, &baseline].map(|key| (key, self.summary.rows(key)));
            let quantities = [&[Quantity::Settled][..], &FIGURES].concat();
            all.extend(quantities.into_iter().filter_map(|it| compared(it, Matched::SettlingTime, both)));
        }
        all
    }
}
