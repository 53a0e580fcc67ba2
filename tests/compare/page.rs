//! Tests the page "What the laws do".

use crate::{CONDITIONS, committed};
use dq_kinematics::control::Law;
use dq_studies::compare::{
    ALL_ARMS, Arm, Findings, Interval, Key, Matched, Part, Peers, Study, Summary, page,
};

#[test]
fn the_committed_page_is_what_the_command_wrote() {
    assert_eq!(page(&committed()), include_str!("../../src/studies/compare/what_the_laws_do.md"));
}

/// Returns the study of the committed run.
fn study(tasks: u32, seed: u64) -> Study {
    let (arms, gains) = (Arm::builtin().unwrap(), committed().gains);
    Study { arms, laws: Law::ALL.to_vec(), tasks, seed, gains }
}

/// Checks one task of each law on each arm under each condition to the last digit, so that the page is what this program computes.
#[test]
fn the_committed_tasks_end_as_they_did() {
    let committed = committed();
    let study = study(committed.tasks, committed.seed);
    let again = study.sample().unwrap();
    assert_eq!(committed.samples.len(), Law::ALL.len() * 5 * CONDITIONS);
    for (again, then) in again.iter().zip(&committed.samples) {
        assert_eq!(again, then);
    }
}

/// The number of standard deviations that a thousand values do not exceed by chance.
const FAR: f64 = 4.5;

#[test]
fn a_small_run_says_the_same_as_the_committed_one() {
    let committed = committed();
    // Use other tasks than the committed run.
    let study = study(3, committed.seed + 1);
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("compare.jsonl");
    study.write(&file, Part::WHOLE, |_| {}).unwrap();
    let small = Summary::read(&study, &file).unwrap().cells(FAR);
    let mut checked = 0;
    for small in small.iter().filter(|cell| cell.key.arm == ALL_ARMS) {
        let large = committed.cells.iter().find(|cell| cell.key == small.key).unwrap();
        assert!(overlap(&small.settled_percent, &large.settled_percent), "{small:?} {large:?}");
        let times = [small.settling_s, large.settling_s].map(Option::unwrap);
        assert!(overlap(&times[0], &times[1]), "{small:?} {large:?}");
        // Only tasks that all laws settle are compared. With few tasks the interval is meaningless.
        if small.common.is_none_or(|common| common < 6) {
            continue;
        }
        for (ours, theirs) in [
            (small.path_ratio, large.path_ratio),
            (small.overshoot_mm, large.overshoot_mm),
            (small.effort, large.effort),
            (small.peak_rad_s, large.peak_rad_s),
        ] {
            let (Some(ours), Some(theirs)) = (ours, theirs) else { continue };
            assert!(overlap(&ours, &theirs), "{ours:?} {theirs:?} of {:?}", small.key);
            checked += 1;
        }
    }
    assert!(checked > Law::ALL.len() * CONDITIONS, "{checked}");
}

fn overlap(one: &Interval, other: &Interval) -> bool {
    // A sample of 15 has no value beyond its extremes, so medians that all agree need a margin.
    let room = 0.1 * one.value.abs() + 0.5;
    one.low - room <= other.high && other.low <= one.high + room
}

/// The gains are judged on other tasks than those on which they were chosen. Medians of a thousand settling times vary little,
/// those of peak speeds more.
#[test]
fn chosen_gains_reach_what_they_were_chosen_for() {
    for gain in committed().gains {
        // With this cycle, a transposed Jacobian becomes unstable before it is as fast as the others.
        let transposed = gain.law == "diffc" || gain.law.ends_with("_transpose");
        let off = gain.reached.map(|reached| (reached / gain.target - 1.0).abs());
        match gain.matched {
            Matched::SettlingTime if transposed => {}
            Matched::SettlingTime => assert!(gain.is_matched(), "{gain:?}"),
            Matched::PeakSpeed => assert!(off.is_some_and(|off| off < 0.1), "{gain:?}"),
        }
    }
}

/// Ages refer to all tasks that settle with fresh joint states, and lie between their bounds. The results of the plants equal those
/// of the cells.
#[test]
fn ages_are_of_all_tasks_and_as_the_plants_show() {
    let committed = committed();
    for ageing in &committed.ageing {
        let cell = |plant: &str| {
            let key = Key::new(Matched::SettlingTime, &ageing.law, ALL_ARMS, ageing.limits, plant);
            committed.cells.iter().find(|cell| cell.key == key).unwrap()
        };
        let fresh = cell("ideal");
        let settled = fresh.runs - fresh.failures.values().sum::<usize>();
        assert_eq!(ageing.tasks, settled, "{ageing:?}");
        assert!(ageing.low_ms <= ageing.holds_up_to_ms, "{ageing:?}");
        assert!(ageing.high_ms.is_none_or(|high| ageing.holds_up_to_ms < high), "{ageing:?}");
        for (age, share) in &ageing.settled_percent {
            assert_eq!(*age <= ageing.holds_up_to_ms, share.value >= 95.0, "{ageing:?}");
        }
    }
}

/// A path cannot be shorter than the straight line between its ends.
#[test]
fn no_path_is_shorter_than_straight() {
    for cell in committed().cells {
        assert!(cell.path_ratio.is_none_or(|ratio| ratio.low >= 1.0), "{cell:?}");
    }
}

/// If there are few tasks, the page says that they are too few, instead of which law is best.
#[test]
fn a_few_tasks_are_too_few_to_tell() {
    let mut study = study(2, 1);
    // The reasons of deviating gains are irrelevant here, and take long to compute.
    study.gains.iter_mut().for_each(|gain| gain.reached = Some(gain.target));
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("compare.jsonl");
    study.write(&file, Part::WHOLE, |_| {}).unwrap();
    let findings = Findings::new(&study, &Summary::read(&study, &file).unwrap(), &Peers::default()).unwrap();
    let page = page(&findings);
    assert!(page.contains("**Too few tasks to tell the laws apart**") && !page.contains("Take"), "{page}");
}

/// Each sentence at the head of the page has an interval or a probability.
#[test]
fn every_sentence_says_how_sure_it_is() {
    let page = page(&committed());
    let head: Vec<_> = page.lines().filter(|line| line.starts_with("- ")).collect();
    assert!(head.len() >= 5, "{page}");
    for sentence in head {
        assert!(sentence.contains('[') || sentence.contains("p <") || sentence.contains("p ="), "{sentence}");
    }
    let law = |law: Law| page.contains(&format!("| {law} |"));
    assert!(Law::ALL.into_iter().all(law));
}
