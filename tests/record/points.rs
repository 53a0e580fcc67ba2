//! Tests the memory that drawing needs for long runs and for bags with many changes. This memory depends only on what is drawn.

use crate::bags::{Sample, alter, demo, place, write};
use crate::measured;
use crate::runs::puma560;
use dq_bags::WriterOptions;
use dq_figures::Width;
use dq_messages::messages::{DiagnosticStatus, JointState, KeyValue, Time};
use dq_runs::{RecordedRun, plot, recorded};

/// The limit of memory, including parallel tests \[bytes\].
const LIMIT: usize = 200 << 20;

fn of(topic: &str) -> Sample {
    demo().into_iter().find(|sample| sample.topic == topic).unwrap()
}

/// Returns the run of these messages, and the peak memory to read and draw it.
fn drawn(samples: &[Sample]) -> (RecordedRun, usize) {
    let (_directory, bag) = place("bag");
    write(&bag, WriterOptions::default(), samples);
    measured(|| {
        let mut runs = recorded(&bag, "bag", &puma560()).unwrap().runs;
        plot(&runs).iter().for_each(|figure| drop(figure.svg(Width::Screen)));
        runs.remove(0)
    })
}

#[test]
fn a_long_run_takes_what_its_figures_show() {
    let (state, command) = (of("/joint_states"), of("/forward_velocity_controller/commands"));
    let cycle = |i: i64| {
        let time = state.time + 2_000_000 * i;
        let mut state = Sample { time, ..state.clone() };
        alter(&mut state, |state: &mut JointState| {
            state.header.stamp = Time::from_nanoseconds(time);
            // The positions are as noisy as those of sensors, so that each point differs from the previous one.
            state.position[0] = 0.3 * (1e-3 * i as f64).sin() + 1e-3 * (i % 7) as f64;
        });
        [state, Sample { time: time + 1_000_000, ..command.clone() }]
    };
    let samples: Vec<_> = (0..400_000).flat_map(cycle).collect();
    let (run, memory) = drawn(&samples);
    assert!(memory < LIMIT, "{memory} bytes");
    let (first, last) = (&run.samples[0], run.samples.last().unwrap());
    assert!(run.samples.len() > 10_000 && (last.time - first.time - 799.998).abs() < 1e-3);
    assert!(run.samples.iter().all(|sample| !sample.jumped));
}

#[test]
fn a_bag_of_changes_takes_what_its_figures_show() {
    let (state, status) = (of("/joint_states"), of("/dq_servo/status"));
    for kind in ["message", "law", "goal"] {
        let changed = |i: i64| {
            let time = state.time + 300_000_000 * i;
            let (mut state, mut status) =
                (Sample { time, ..state.clone() }, Sample { time: time + 1, ..status.clone() });
            alter(&mut state, |state: &mut JointState| state.header.stamp = Time::from_nanoseconds(time));
            alter(&mut status, |status: &mut DiagnosticStatus| {
                status.message =
                    if kind == "message" && i % 2 == 0 { "stalled" } else { "tracking" }.to_owned();
                status.values.retain(|pair| pair.key != kind);
                let value = if kind == "law" { format!("law{i}") } else { format!("{} 0 0 0 0 0 1", i % 7) };
                status.values.push(KeyValue { key: kind.to_owned(), value });
            });
            [state, status]
        };
        let servo = Sample { time: state.time - 1, ..of("/dq_servo/parameters") };
        let samples: Vec<_> = [servo].into_iter().chain((0..40_000).flat_map(changed)).collect();
        let (run, memory) = drawn(&samples);
        let changes = (run.changes.len(), run.laws.len(), run.motions.len());
        assert!(memory < LIMIT, "{kind}: {memory} bytes for {changes:?}");
    }
}
