//! The page "What the laws do".

use crate::committed;
use dq_servo::compare::{ALL_ARMS, Arm, Cell, Interval, PLANTS, Study, Summary, page};

#[test]
fn the_committed_page_is_what_the_command_wrote() {
    assert_eq!(page(&committed()), include_str!("../../src/compare/what_the_laws_do.md"));
}

/// Far enough out that of a thousand numbers none is there by chance.
const FAR: f64 = 4.5;

#[test]
fn a_small_run_says_the_same_as_the_committed_one() {
    let committed = committed();
    let study = Study {
        arms: Arm::builtin().unwrap(),
        tasks: 3,
        // Other tasks than the committed run's.
        seed: committed.seed + 1,
        gains: committed.gains.clone(),
    };
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("compare.jsonl");
    study.write(&file, study.part(1, 1), |_| {}).unwrap();
    let summary = Summary::read(&study, &file).unwrap();
    let mut checked = 0;
    for (key, values) in summary.values.iter().filter(|(key, _)| key.arm == ALL_ARMS) {
        let small = values.cell(key, FAR);
        let large = committed.cells.iter().find(|cell| cell.key == *key).unwrap();
        assert!(overlap(&small.settled_percent, &large.settled_percent), "{small:?} {large:?}");
        for of in [
            |cell: &Cell| cell.settling_s,
            |cell: &Cell| cell.path_ratio,
            |cell: &Cell| cell.overshoot_mm,
            |cell: &Cell| cell.effort,
            |cell: &Cell| cell.peak_rad_s,
        ] {
            let (Some(ours), Some(theirs)) = (of(&small), of(large)) else { continue };
            assert!(overlap(&ours, &theirs), "{ours:?} {theirs:?} of {key:?}");
            checked += 1;
        }
    }
    assert!(checked > 2 * 11 * 2 * PLANTS.len() * 4, "{checked}");
}

fn overlap(one: &Interval, other: &Interval) -> bool {
    // A sample of 15 has no value beyond its extremes: a little room for medians that all agree.
    let room = 0.1 * one.value.abs() + 0.5;
    one.low - room <= other.high && other.low <= one.high + room
}
