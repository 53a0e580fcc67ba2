//! Runs servo, arm and recorder at 1 kHz with changing goals and laws, for ten minutes or for the number of seconds in the argument: `cargo
//! bench --bench soak [-- SECONDS]`. Fails if memory, threads or descriptors grow, or if a command does not replay.

#[path = "../dds/host.rs"]
mod host;
mod usage;

use dq_bags::Bag;
use dq_messages::messages::DiagnosticArray;
use dq_runs::replay;
use host::{Host, assert_success, wait_for_line};
use std::path::Path;
use std::time::{Duration, Instant};
use usage::Usage;

/// The path of the peer program.
const PEER: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/dds/peer.py");

/// The processes, and the allowed variation of their memory [MB]. RustDDS's buffers fill and empty; those of a recorder hold 10 000 samples
/// of each topic, which are full after a quarter of an hour.
const PROCESSES: [(&str, f64); 3] = [("servo", 3.0), ("plant", 3.0), ("recorder", 25.0)];

/// Goals that the arm reaches from each other: position \[m\] and quaternion (x, y, z, w).
const GOALS: [[&str; 7]; 3] = [
    ["-0.125", "0.2", "0.2", "0", "0", "0", "1"],
    ["0.2", "0.3", "0.1", "0", "0", "0.38268343236509", "0.92387953251129"],
    ["0.1", "0.4", "-0.1", "0", "0.38268343236509", "0", "0.92387953251129"],
];

const LAWS: [&str; 3] = ["logc", "diffc", "double_geodesic"];

fn main() {
    // Cargo adds its own argument.
    let seconds = std::env::args().find_map(|argument| argument.parse().ok()).unwrap_or(600);
    let directory = tempfile::tempdir().unwrap();
    let bag = directory.path().join("bag");
    let mut host = start(&bag);
    println!("{seconds} s at 1 kHz; memory [MB] / threads / descriptors of servo, plant and recorder");
    let (goals, rows) = drive(&host, Duration::from_secs(seconds));
    let (code, reported) = host.interrupt("recorder");
    print!("{reported}");
    let steady = rows.iter().skip(rows.len() / 10).map(|row| row.1.as_slice()).collect::<Vec<_>>();
    let grown = grown(steady[0], steady[steady.len() - 1]);
    let commands = judge(&bag);
    println!(
        "{goals} goals; {commands} commands recorded, none of which breaks a rule; overruns: {}",
        overruns(&bag)
    );
    assert!(grown.is_empty(), "{grown:?}");
    assert!(code == Some(0) && reported.contains("dropped: 0"));
}

fn start(bag: &Path) -> Host {
    let mut host = Host::new();
    let rate = ["--ros-args", "-p", "update_rate:=1000"];
    wait_for_line(host.start("plant", &[&["puma560"], &rate[..]].concat()), "simulating");
    wait_for_line(host.start("servo", &[&["servo"], &rate[..]].concat()), "waiting_for_state -> holding");
    host.start("recorder", &["record", "--out", bag.to_str().unwrap()]);
    host
}

/// Sends goal after goal. Returns the number of arrivals, and the usage of the processes in each tenth of the time.
fn drive(host: &Host, duration: Duration) -> (usize, Vec<(f64, Vec<Usage>)>) {
    let begin = Instant::now();
    let mut rows = Vec::new();
    let mut goals = 0;
    while begin.elapsed() < duration {
        assert_success(&host.run(&["param", "set", "controller", LAWS[goals / GOALS.len() % LAWS.len()]]));
        assert_success(&host.run(&[&["goal"], &GOALS[goals % GOALS.len()][..]].concat()));
        goals += 1;
        let elapsed = begin.elapsed().as_secs_f64();
        if elapsed > duration.as_secs_f64() / 20.0 * rows.len() as f64 {
            let usage: Vec<_> = PROCESSES.iter().map(|(name, _)| Usage::of(host.pid(name))).collect();
            println!(
                "{elapsed:6.0} s  {}",
                usage.iter().map(Usage::to_string).collect::<Vec<_>>().join("   ")
            );
            rows.push((elapsed, usage));
        }
    }
    (goals, rows)
}

/// Returns a line for each process that has grown by more than noise.
fn grown(first: &[Usage], last: &[Usage]) -> Vec<String> {
    let pairs = PROCESSES.iter().zip(first.iter().zip(last));
    pairs
        .filter(|((_, noise), (first, last))| last.has_outgrown(first, *noise))
        .map(|((name, _), (first, last))| format!("{name}: {first} -> {last}"))
        .collect()
}

/// Replays every recorded command, and returns their number.
fn judge(bag: &Path) -> u64 {
    let servos = replay(&mut Bag::open(bag).unwrap()).unwrap();
    assert_eq!(servos[0].different, 0);
    servos[0].commands
}

/// Returns the last reported overruns of the servo and the plant.
fn overruns(bag: &Path) -> String {
    let mut reported = std::collections::BTreeMap::new();
    for message in Bag::open(bag).unwrap() {
        if let Ok(diagnostics) = message.decode::<DiagnosticArray>() {
            for status in diagnostics.status {
                let value = status.values.iter().find(|value| value.key == "overruns");
                reported.extend(value.map(|value| (status.name, value.value.clone())));
            }
        }
    }
    reported.iter().map(|(name, count)| format!("{name} {count}")).collect::<Vec<_>>().join(", ")
}
