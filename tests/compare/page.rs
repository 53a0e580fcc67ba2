//! The page "What the laws do".

use crate::{CONDITIONS, committed};
use dq_servo::compare::{ALL_ARMS, Arm, Cell, Interval, Matched, Part, Study, Summary, page};

#[test]
fn the_committed_page_is_what_the_command_wrote() {
    assert_eq!(page(&committed()), include_str!("../../src/compare/what_the_laws_do.md"));
}

/// Far enough out that of a thousand numbers none is there by chance.
const FAR: f64 = 4.5;

/// Medians are compared from so many runs on that settled.
const FEWEST: f64 = 6.0;

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
    study.write(&file, Part::WHOLE, |_| {}).unwrap();
    let summary = Summary::read(&study, &file).unwrap();
    let mut checked = 0;
    for (key, values) in summary.values.iter().filter(|(key, _)| key.arm == ALL_ARMS) {
        let small = values.cell(key, FAR);
        let large = committed.cells.iter().find(|cell| cell.key == *key).unwrap();
        assert!(overlap(&small.settled_percent, &large.settled_percent), "{small:?} {large:?}");
        // A few runs have no interval worth its name.
        if small.settled_percent.value * (small.runs as f64) < 100.0 * FEWEST {
            continue;
        }
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
    assert!(checked > 11 * CONDITIONS * 3, "{checked}");
}

fn overlap(one: &Interval, other: &Interval) -> bool {
    // A sample of 15 has no value beyond its extremes: a little room for medians that all agree.
    let room = 0.1 * one.value.abs() + 0.5;
    one.low - room <= other.high && other.low <= one.high + room
}

#[test]
fn chosen_gains_reach_what_they_were_chosen_for() {
    for gain in committed().gains {
        // A transposed Jacobian goes unstable at this cycle before it is as fast as the others.
        let transposed = gain.law == "diffc" || gain.law.ends_with("_transpose");
        let unstable_before = transposed && gain.matched == Matched::SettlingTime;
        assert!(gain.is_matched() || unstable_before, "{gain:?}");
    }
}
