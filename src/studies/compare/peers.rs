//! Other programs that run the tasks of the comparison. `tests/benches/compare_peers.py` runs these programs.

use super::pairs::{Comparison, FIGURES, Quantity, compared};
use super::record::Record;
use super::summary::{ALL_ARMS, Cell, Key, Row, Summary, Z};
use super::{CompareError, Matched, REFERENCE, Study};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::Path;

/// The results of another program, or of the reference law, on the same tasks. Joint states are fresh, and gains are for equal
/// settling time.
#[derive(Clone, Debug, Deserialize, PartialEq, Serialize)]
pub struct Peer {
    /// The results on all arms together. The name of the program replaces the name of the law.
    #[serde(flatten)]
    pub cell: Cell,
    /// The smallest and the largest gain on the arms [1/s].
    pub gains: [f64; 2],
}

/// The runs of other programs and of the reference law on the first tasks of each arm.
#[derive(Clone, Debug, Default)]
pub struct Peers {
    summary: Summary,
    gains: BTreeMap<Key, [f64; 2]>,
}

impl Peers {
    /// Reads `peers.jsonl`, if it exists. Takes the runs of the reference law from `summary`.
    ///
    /// # Errors
    /// [`CompareError::File`]; [`CompareError::Damaged`]; [`CompareError::OtherPeers`] unless all programs have run the same number
    /// of tasks of each arm of the study, from the first task on.
    pub fn read(study: &Study, summary: &Summary, file: &Path) -> Result<Self, CompareError> {
        let mut peers = Self::default();
        let mut tasks: BTreeMap<Key, Vec<(String, u32)>> = BTreeMap::new();
        for record in Record::read_all(file)? {
            let key = peers.add(&record);
            tasks.entry(key).or_default().push((record.arm.into_owned(), record.task));
        }
        let Some(count) = tasks.values().next().map(|tasks| tasks.len() / study.arms.len()) else {
            return Ok(peers);
        };
        let each =
            |arm: &super::Arm| (0..count as u32).map(|task| (arm.name.clone(), task)).collect::<Vec<_>>();
        let expected: Vec<_> = study.arms.iter().flat_map(each).collect();
        if count > study.tasks as usize || tasks.values().any(|tasks| *tasks != expected) {
            return Err(CompareError::OtherPeers { file: file.display().to_string() });
        }
        for limits in [false, true] {
            let gain = REFERENCE.1;
            let key = |arm: &str| Key::new(Matched::SettlingTime, REFERENCE.0, arm, limits, "ideal");
            let of = |arm: &super::Arm| summary.rows(&key(&arm.name)).iter().take(count);
            peers.summary.set(key(ALL_ARMS), study.arms.iter().flat_map(of).copied().collect());
            peers.gains.insert(key(ALL_ARMS), [gain, gain]);
        }
        Ok(peers)
    }

    /// Adds a run. Returns the key of its cell for all arms together.
    fn add(&mut self, record: &Record) -> Key {
        let key = Key::of(record, ALL_ARMS);
        self.summary.add_to(key.clone(), record);
        let [least, greatest] = self.gains.entry(key.clone()).or_insert([f64::INFINITY, 0.0]);
        (*least, *greatest) = (least.min(record.gain), greatest.max(record.gain));
        key
    }

    /// Returns the results of every program and of the reference law; empty if no other program has run.
    pub(super) fn cells(&self) -> Vec<Peer> {
        let gains = |cell: &Cell| self.gains.get(&cell.key).copied().unwrap_or_default();
        self.summary.cells(Z).into_iter().map(|cell| Peer { gains: gains(&cell), cell }).collect()
    }

    /// Compares each program with the reference law, on the tasks that both the program and the law have run. The probabilities are
    /// not adjusted yet.
    pub(super) fn comparisons(&self) -> Vec<Comparison> {
        let reference = |limits| Key::new(Matched::SettlingTime, REFERENCE.0, ALL_ARMS, limits, "ideal");
        let rows = |key: &Key| -> &[Option<Row>] { self.summary.rows(key) };
        let others = self.gains.keys().filter(|key| key.law != REFERENCE.0.name());
        let each = others.flat_map(|key| {
            let both = [rows(key), rows(&reference(key.limits))];
            let quantities = [&[Quantity::Settled][..], &FIGURES].concat();
            quantities.into_iter().filter_map(move |quantity| {
                let laws = [key.law.clone(), REFERENCE.0.name().to_owned()];
                compared(quantity, Matched::SettlingTime, ALL_ARMS, key.limits, laws, both)
            })
        });
        each.collect()
    }
}
