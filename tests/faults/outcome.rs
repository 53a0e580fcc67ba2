//! What must hold at the end of every case.

use crate::host::Host;
use dq_servo::check::Invariants;
use dq_servo::config::{NodeParameters, ServoParameters};
use dq_servo::wire::CycleLabel;
use std::time::Duration;

/// A test for each case: its name says the outcome, and the function runs the case with these arguments.
macro_rules! cases {
    ($run:ident: $($name:ident => $case:literal $arguments:expr;)*) => {
        $(
            #[test]
            fn $name() {
                $run($case, &$arguments);
            }
        )*
    };
}
pub(crate) use cases;

/// No node takes more memory than this [MB], whatever is sent to it.
const MEMORY: f64 = 100.0;

/// Runs a case (cases_*.py) on `host`, and holds the servo's commands against the invariants.
pub fn run(host: &Host, case: &str, arguments: &[&str]) {
    run_at(500, host, case, arguments);
}

/// The same with a servo whose cycle runs at `rate` [Hz].
pub fn run_at(rate: u32, host: &Host, case: &str, arguments: &[&str]) {
    let commands = tempfile::NamedTempFile::new().unwrap();
    let path = commands.path().to_str().unwrap();
    host.peer(&[&[case, path], arguments].concat());
    let count = check_commands(&std::fs::read_to_string(path).unwrap(), Duration::from_secs(1) / rate);
    assert!(count > 0 || WITHOUT_COMMANDS.contains(&case), "no commands were seen");
}

/// The same with servo and plant on this host, which must not have grown.
pub fn run_with_both_nodes(case: &str, arguments: &[&str]) {
    let host = Host::with_both_nodes();
    run(&host, case, arguments);
    check_memory(&host, &["servo", "plant"]);
}

/// That these processes still run and have not grown.
pub fn check_memory(host: &Host, names: &[&str]) {
    for name in names {
        let memory = host.memory(name);
        assert!(memory < MEMORY, "{name}: {memory} MB");
    }
}

/// Cases in which nobody has reason to drive the arm by velocities.
const WITHOUT_COMMANDS: [&str; 4] = ["two_plants", "rival", "guarded_positions", "guarded_reset"];

fn check_commands(lines: &str, period: Duration) -> usize {
    let (store, _) = ServoParameters::start("/dq_servo", Vec::new()).unwrap();
    let parameters = ServoParameters::from_store(&store).unwrap();
    let mut invariants = Invariants::new(parameters.settings.limits, period);
    // The first command follows the first goal: whatever stops there were came before it.
    let (mut before, mut goals_at_stop) = (None::<CycleLabel>, None);
    let mut count = 0;
    for line in lines.lines() {
        let (label, velocities) = line.split_once('\t').unwrap();
        let command: Vec<f64> = velocities.split(' ').map(|text| text.parse().unwrap()).collect();
        // The final zeros of a servo that ends have no label.
        let Ok(label) = label.parse::<CycleLabel>() else { continue };
        if before.as_ref().is_some_and(|before| label.stops > before.stops) {
            goals_at_stop = Some(label.goals);
        }
        if label.arms.iter().any(|arm| arm.figures.came) {
            invariants.robot_came();
        }
        let stopped = goals_at_stop == Some(label.goals);
        let checked = invariants.check(label.now, &command, label.paused || stopped);
        checked.unwrap_or_else(|violation| panic!("{violation}, in {label}"));
        before = Some(label);
        count += 1;
    }
    count
}
