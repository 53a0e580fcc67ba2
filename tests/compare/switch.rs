//! Tests the comparison of two values of a servo parameter on the same tasks.

use crate::arm;
use dq_kinematics::control::Law;
use dq_studies::compare::{
    Arm, Counts, End, Gain, Matched, Paired, Study, Switch, SwitchFindings, sign_test,
};
use std::path::Path;
use std::sync::atomic::{AtomicU64, Ordering};

/// Returns a study of one arm with arbitrary gains.
fn study(name: &str, tasks: u32) -> Study {
    let gain = |law: Law| Gain {
        matched: Matched::SettlingTime,
        law: law.name().to_owned(),
        arm: name.to_owned(),
        gain: if law == Law::Diffc { 185.0 } else { 2.0 },
        target: 2.0,
        reached: None,
    };
    let laws: Vec<_> = Law::all().collect();
    Study { gains: laws.iter().copied().map(gain).collect(), arms: vec![arm(name)], laws, tasks, seed: 1 }
}

fn switched(study: &Study, switch: Switch) -> Vec<Paired> {
    let done = AtomicU64::new(0);
    let rows = study.switched(switch, || _ = done.fetch_add(1, Ordering::Relaxed)).unwrap();
    assert_eq!(done.into_inner(), study.switched_count());
    assert_eq!(rows.len(), Law::all().count());
    rows
}

fn logc(rows: &[Paired]) -> &Paired {
    rows.iter().find(|row| row.law == Law::Logc.name()).unwrap()
}

/// With permission to reconfigure, more tasks settle and none fewer.
#[test]
fn tasks_that_stall_at_a_limit_settle_where_the_arm_may_go_round() {
    let rows = switched(&study("panda", 8), Switch::Reconfigure);
    let logc = logc(&rows);
    assert_eq!((logc.tasks.len(), logc.settled()[1], logc.alone()[0]), (8, 8, 0), "{logc:?}");
    let [never, always] = [logc.settled()[0], logc.alone()[1]];
    assert!(always > 1 && never + always == 8 && logc.rest().is_empty(), "{logc:?}");
    let later = logc.later().unwrap();
    assert_eq!(later.value, 0.0, "what settles by itself does so in the same time");
    let table = Paired::table(&rows, &Switch::Reconfigure.names()).markdown();
    assert_eq!(table.lines().count(), 2 + Law::all().count());
    assert!(table.contains("| settled, never [%] | settled, always [%] |"), "{table}");
    assert!(table.contains("| logc | panda | 8 | "), "{table}");
}

/// An arm of seven joints settles more tasks with constraints, and none of its paths leads through itself. A task that does not settle has
/// a reason.
#[test]
fn constraints_are_compared_on_the_same_tasks() {
    let rows = switched(&study("iiwa14", 24), Switch::Constraints);
    let logc = logc(&rows);
    let ([off, on], [_, only_on]) = (logc.settled(), logc.alone());
    assert!(on > off && only_on > 1, "{logc:?}");
    assert_eq!(logc.rest().values().sum::<usize>(), 24 - on);
    assert!(logc.rest().keys().all(|end| !end.contains(',')), "nothing else was looked for: {logc:?}");
    let through =
        |way: usize| rows.iter().flat_map(|row| &row.tasks).filter(move |both| both[way].through_itself);
    assert!(through(0).count() > 0 && through(1).count() == 0);
    assert_eq!(logc.past_itself().settled()[1], on);
    let table = Paired::table(&rows, &Switch::Constraints.names()).markdown();
    assert!(table.contains("only false, only true"));
}

fn end(settled: Option<f64>, through_itself: bool) -> End {
    End { settled, through_itself, words: "joint_limit".to_owned() }
}

#[test]
fn a_way_through_the_arm_itself_may_be_left_out() {
    let tasks = vec![
        [end(Some(1.0), true), end(Some(2.0), false)],
        [end(Some(1.0), false), end(Some(1.5), true)],
        [end(None, true), end(None, true)],
    ];
    let all = Paired { law: "logc".to_owned(), arm: "ur5e".to_owned(), tasks };
    assert_eq!((all.settled(), all.alone()), ([2, 2], [0, 0]));
    assert_eq!(all.rest().into_iter().collect::<Vec<_>>(), [("joint_limit", 1)]);
    assert_eq!(all.later().unwrap().value, 1.0);
    let past = all.past_itself();
    assert_eq!((past.settled(), past.alone()), ([1, 1], [1, 1]));
    assert_eq!(past.rest().into_iter().collect::<Vec<_>>(), [("joint_limit", 1), ("through itself", 1)]);
    let table = Paired::table(&[past], &["off", "on"].map(str::to_owned)).markdown();
    let row = "| logc | ur5e | 3 | 33.3 [6.1, 79.2] | 33.3 [6.1, 79.2] | 1, 1 | p = 1.000 | - | 1 joint_limit; 1 through itself |\n";
    assert!(table.ends_with(row), "{table}");
}

const RECONFIGURE: &str = include_str!("../data/reconfigure.json");
const CONSTRAINTS: &str = include_str!("../data/constraints.json");
const POSTURE: &str = include_str!("../data/posture.gain.json");

fn committed(file: &str) -> SwitchFindings {
    serde_json::from_str(file).unwrap()
}

/// Runs the first task of each law on each arm with both values of the parameter, and checks that it ends to the last digit as in the
/// committed run. So the tables of the guide are what this program computes.
#[test]
fn the_first_task_of_each_committed_cell_ends_as_it_did() {
    for (switch, file) in
        [(Switch::Reconfigure, RECONFIGURE), (Switch::Constraints, CONSTRAINTS), (Switch::Posture, POSTURE)]
    {
        let committed = committed(file);
        let of_first_law = committed.cells.iter().filter(|cell| cell.law == Law::ALL[0].name());
        let names: Vec<_> = of_first_law.map(|cell| &*cell.arm).collect();
        let arms = names.iter().map(|name| Arm::named(Path::new(name)).unwrap()).collect();
        let (laws, gains) = (Law::ALL.to_vec(), committed.gains.clone());
        let study = Study { arms, laws, tasks: 1, seed: committed.seed, gains };
        let again = SwitchFindings::new(&study, &study.switched(switch, || ()).unwrap());
        assert_eq!(committed.cells.len(), Law::ALL.len() * names.len());
        for (again, then) in again.cells.iter().zip(&committed.cells) {
            assert_eq!(again.sample, then.sample, "{} on {} with {switch:?}", then.law, then.arm);
            assert_eq!(then.tasks as u32, committed.tasks);
        }
    }
}

/// The arms in the tables of the guide.
const ARMS: [&str; 5] = ["puma560", "ur5e", "panda", "iiwa14", "xarm6"];

/// Returns a row of a table of the guide with this head. `cell` writes the part of the row for the results of all laws on one arm.
fn row(head: &str, findings: &SwitchFindings, cell: impl Fn(&[&Counts]) -> String) -> String {
    let of = |arm: &str| findings.cells.iter().filter(|cell| cell.arm == arm).collect::<Vec<_>>();
    let cells = ARMS.map(|arm| cell(&of(arm)));
    format!("| {head} | {} |", cells.join(" | "))
}

fn percent(count: usize, of: usize) -> String {
    format!("{:.1}", 100.0 * count as f64 / of as f64)
}

#[test]
fn the_guide_prints_the_committed_counts() {
    let page = include_str!("../../src/guide/laws.md");
    let shows = |text: &str| assert!(page.contains(text), "the page lacks {text}");
    let findings = committed(RECONFIGURE);
    for (way, name) in ["never", "always"].into_iter().enumerate() {
        let range = |laws: &[&Counts]| {
            let counts = || laws.iter().map(|cell| cell.settled[way]);
            let (least, most) = (counts().min().unwrap(), counts().max().unwrap());
            let [low, high] = [least, most].map(|count| percent(count, laws[0].tasks));
            if low == high { format!("{low} %") } else { format!("{low} to {high} %") }
        };
        shows(&row(&format!("`{name}`"), &findings, range));
    }
    // McNemar's test for every law on the last four arms.
    let on_others = findings.cells.iter().filter(|cell| cell.arm != "puma560");
    let p = on_others.map(|cell| sign_test(cell.alone[0], cell.alone[1])).fold(0.0, f64::max);
    assert!(p < 1e-10, "{p}");
    let findings = committed(CONSTRAINTS);
    let total = |laws: &[&Counts], of: fn(&Counts) -> [usize; 2]| {
        let tasks = laws.iter().map(|cell| cell.tasks).sum();
        [0, 1].map(|way| percent(laws.iter().map(|cell| of(cell)[way]).sum(), tasks))
    };
    let both = |laws: &[&Counts], of| {
        let [off, on] = total(laws, of);
        format!("{off} → {on} %")
    };
    for law in ["diffc", "logc"] {
        let of_law = |laws: &[&Counts]| {
            let cell: Vec<_> = laws.iter().copied().filter(|cell| cell.law == law).collect();
            both(&cell, |cell| cell.settled)
        };
        shows(&row(law, &findings, of_law));
    }
    shows(&row("all laws", &findings, |laws| both(laws, |cell| cell.settled)));
    shows(&row("all laws, past itself", &findings, |laws| both(laws, |cell| cell.past_itself)));
    let all: Vec<_> = findings.cells.iter().collect();
    let ([off, on], [past_off, past_on]) =
        (total(&all, |cell| cell.settled), total(&all, |cell| cell.past_itself));
    shows(&format!("Over all arms {on} % settle instead of {off} %"));
    shows(&format!("If ways through the arm do not count, it is {past_on} %\n  instead of {past_off} %"));
    let findings = committed(POSTURE);
    let only = |way: usize| findings.cells.iter().map(|cell| cell.alone[way]).sum::<usize>();
    let runs = findings.cells.iter().map(|cell| cell.tasks).sum::<usize>();
    let sentence =
        format!("Of {runs} runs, {} settle only with the posture, {} only without", only(1), only(0));
    assert!(include_str!("../../src/guide/ros2.md").contains(&sentence), "{sentence}");
}
