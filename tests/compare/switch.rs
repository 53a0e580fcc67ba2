//! Tests the comparison of two values of a servo parameter on the same tasks.

use crate::arm;
use dq_kinematics::control::Law;
use dq_studies::compare::{CompareError, End, Gain, Matched, Paired, PeerRuns, REFERENCE, Study, Switch};
use std::fs;
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
    assert_eq!((logc.tasks.len(), logc.counts()[1], logc.alone()[0]), (8, 8, 0), "{logc:?}");
    let [never, always] = [logc.counts()[0], logc.alone()[1]];
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
    let ([off, on], [_, only_on]) = (logc.counts(), logc.alone());
    assert!(on > off && only_on > 1, "{logc:?}");
    assert_eq!(logc.rest().values().sum::<usize>(), 24 - on);
    assert!(logc.rest().keys().all(|end| !end.contains(',')), "nothing else was looked for: {logc:?}");
    let through =
        |way: usize| rows.iter().flat_map(|row| &row.tasks).filter(move |both| both[way].through_itself);
    assert!(through(0).count() > 0 && through(1).count() == 0);
    assert_eq!(logc.past_itself().counts()[1], on);
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
    assert_eq!((all.counts(), all.alone()), ([2, 2], [0, 0]));
    assert_eq!(all.rest().into_iter().collect::<Vec<_>>(), [("joint_limit", 1)]);
    assert_eq!(all.later().unwrap().value, 1.0);
    let past = all.past_itself();
    assert_eq!((past.counts(), past.alone()), ([1, 1], [1, 1]));
    assert_eq!(past.rest().into_iter().collect::<Vec<_>>(), [("joint_limit", 1), ("through itself", 1)]);
    let table = Paired::table(&[past], &["off", "on"].map(str::to_owned)).markdown();
    let row = "| logc | ur5e | 3 | 33.3 [6.1, 79.2] | 33.3 [6.1, 79.2] | 1, 1 | p = 1.000 | - | 1 joint_limit; 1 through itself |\n";
    assert!(table.ends_with(row), "{table}");
}

/// Returns a line of `peers.jsonl`.
fn line(program: &str, limits: bool, task: u32, settled: Option<f64>) -> String {
    let settled = settled.map_or("null".to_owned(), |time| time.to_string());
    format!(
        "{{\"matched\":\"settling_time\",\"law\":\"{program}\",\"arm\":\"iiwa14\",\"limits\":{limits},\"plant\":\"ideal\",\"task\":{task},\
         \"gain\":2.0,\"outcome\":\"failed\",\"settling_s\":{settled},\"path_ratio\":null,\"overshoot_mm\":0.0,\"effort\":1.0,\
         \"peak_rad_s\":1.0}}\n"
    )
}

#[test]
fn other_programs_are_beside_the_second_way_on_the_tasks_that_both_have_run() {
    let (study, folder) = (study("iiwa14", 4), tempfile::tempdir().unwrap());
    let beside = |peers: &str| {
        fs::write(folder.path().join("peers.jsonl"), peers).unwrap();
        PeerRuns::read(&study, folder.path())
    };
    let mut row = Paired {
        law: REFERENCE.0.name().to_owned(),
        arm: "iiwa14".to_owned(),
        tasks: [[None, Some(2.0)], [Some(1.0), None], [Some(1.0), Some(3.0)], [None, Some(1.0)]]
            .map(|both| both.map(|settled| end(settled, false)))
            .into(),
    };
    // Results without limits do not count here. The program has not run the fourth task.
    let peers = [(false, 0, None), (true, 0, None), (true, 1, None), (true, 2, Some(2.5))];
    let peers: String = peers.map(|(limits, task, settled)| line("pink", limits, task, settled)).concat();
    study.write_tasks(&folder.path().join("tasks.jsonl")).unwrap();
    let tables = beside(&peers).unwrap().beside("logc", std::slice::from_ref(&row));
    let [(program, rows)] = &tables[..] else { panic!("{tables:?}") };
    assert_eq!((program.as_str(), rows.len()), ("pink", 1));
    let settled: Vec<_> = rows[0].tasks.iter().map(|both| both.each_ref().map(|end| end.settled)).collect();
    assert_eq!(settled, [[Some(2.0), None], [None, None], [Some(3.0), Some(2.5)]]);
    assert_eq!((rows[0].alone(), rows[0].rest()["failed"]), ([1, 0], 2));
    row.law = Law::Diffc.name().to_owned();
    assert!(beside(&peers).unwrap().beside("logc", &[row]).is_empty(), "only beside the reference");
    for other in [line("pink", true, 1, None), peers.clone() + &line("pink", true, 2, None)] {
        assert!(matches!(beside(&other), Err(CompareError::OtherPeers { .. })));
    }
    assert!(beside("{}\n").unwrap_err().to_string().contains("peers.jsonl: line 1 is damaged"));
    beside(&peers).unwrap();
    let other = Study { seed: 2, ..study.clone() };
    assert!(matches!(PeerRuns::read(&other, folder.path()), Err(CompareError::OtherPeers { .. })));
}
