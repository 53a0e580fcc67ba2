//! Tests the comparison with other programs: their results are compared pair by pair, and only on the same tasks.

use crate::study;
use dq_kinematics::control::Law;
use dq_studies::compare::{
    ALL_ARMS, CompareError, Findings, Key, Matched, Part, Peers, Quantity, Study, Summary, page,
};
use std::fs;
use std::path::Path;

/// Returns the law's lines for these tasks under settling_time and fresh joint states, in the form that another program would
/// write.
fn as_another_program(lines: &str, name: &str, tasks: u32) -> String {
    let is_meant = |line: &&str| {
        let has = |part: &str| line.contains(part);
        has("\"law\":\"logc\"")
            && has("\"matched\":\"settling_time\"")
            && has("\"plant\":\"ideal\"")
            && (0..tasks).any(|task| has(&format!("\"task\":{task},")))
    };
    let renamed = |line: &str| line.replace("\"logc\"", &format!("\"{name}\"")) + "\n";
    lines.lines().filter(is_meant).map(renamed).collect()
}

fn read(study: &Study, folder: &Path, peers: &str) -> Result<Findings, CompareError> {
    let (runs, file) = (folder.join("compare.jsonl"), folder.join("peers.jsonl"));
    fs::write(&file, peers).unwrap();
    let summary = Summary::read(study, &runs)?;
    Findings::new(study, &summary, &Peers::read(study, &summary, &file)?)
}

#[test]
fn other_programs_are_paired_with_the_law_on_their_tasks() {
    let (study, folder) = (study(4, 3), tempfile::tempdir().unwrap());
    let runs = folder.path().join("compare.jsonl");
    study.write(&runs, Part::WHOLE, |_| {}).unwrap();
    let same = as_another_program(&fs::read_to_string(&runs).unwrap(), "again", 3);
    // This copy is slower by a second in each task, and settles one task less.
    let mut other: Vec<serde_json::Value> =
        same.replace("again", "slower").lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    other.iter_mut().filter(|run| run["settling_s"].is_number()).for_each(|run| {
        run["settling_s"] = (run["settling_s"].as_f64().unwrap() + 1.0).into();
    });
    let settles = |run: &&mut serde_json::Value| run["limits"] == false && run["settling_s"].is_number();
    let failed = other.iter_mut().find(settles).unwrap();
    (failed["settling_s"], failed["outcome"]) = (serde_json::Value::Null, "failed".into());
    let other: String = other.iter().map(|run| format!("{run}\n")).collect();
    let findings = read(&study, folder.path(), &(same + &other)).unwrap();
    let compared = |law: &str, quantity| {
        let other = Law::Logc.name();
        let key = Key::fresh(Matched::SettlingTime, law, ALL_ARMS, false);
        findings.comparison(quantity, &key, other).unwrap()
    };
    let again = compared("again", Quantity::Settled);
    assert_eq!((again.pairs, again.more, again.p_holm), (3, [0, 0], 1.0));
    assert_eq!(compared("again", Quantity::Effort).difference.value, 0.0);
    let settled = findings.peers.iter().find(|peer| peer.cell.key.law == "again").unwrap();
    let slower = compared("slower", Quantity::Settled);
    assert_eq!((slower.pairs, slower.more), (3, [0, 1]));
    let later = compared("slower", Quantity::SettlingTime);
    assert!((later.difference.value - 1.0).abs() < 1e-9 && later.more[1] == 0, "{later:?}");
    assert_eq!((settled.cell.runs, settled.gains), (3, [4.0, 4.0]));
    let page = page(&findings);
    for part in
        ["## Other programs, no limits", "\n| again | 4.00 |", "\n| slower | 4.00 |", "The first 3 tasks"]
    {
        assert!(page.contains(part), "{part}: {page}");
    }
    // The number of comparisons is that of the page, and Holm's method counts each of them.
    let alone = read(&study, folder.path(), "").unwrap();
    assert_eq!(findings.comparisons.len(), alone.comparisons.len() + 2 * 2 * 6);
    assert!(alone.peers.is_empty() && !dq_studies::compare::page(&alone).contains("Other programs"));
}

#[test]
fn runs_of_other_tasks_are_refused() {
    let (study, folder) = (study(3, 3), tempfile::tempdir().unwrap());
    let runs = folder.path().join("compare.jsonl");
    study.write(&runs, Part::WHOLE, |_| {}).unwrap();
    let lines = fs::read_to_string(&runs).unwrap();
    let good = as_another_program(&lines, "again", 2);
    let without_the_last: String = good.lines().take(3).map(|line| format!("{line}\n")).collect();
    let more = as_another_program(&lines.replace("\"task\":0,", "\"task\":3,"), "again", 4);
    for bad in [without_the_last, good.replace("puma560", "ur5e"), more, good.clone() + &good] {
        let why = read(&study, folder.path(), &bad).unwrap_err().to_string();
        assert!(why.contains("peers.jsonl does not have runs of the first tasks"), "{why}");
    }
    let damaged = good.replacen("\"effort\"", "\"eff\"", 1);
    let why = read(&study, folder.path(), &damaged).unwrap_err().to_string();
    assert!(why.contains("peers.jsonl: line 1 is damaged"), "{why}");
}
