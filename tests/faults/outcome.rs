//! Checks what must hold at the end of every case.

use crate::host::Host;
use crate::invariants::Invariants;
use dq_config::{NodeParameters, ServoParameters};
use dq_core::servo::Interface;
use dq_params::Value;
use dq_wire::{CycleRecord, Recorded};
use std::time::Duration;

/// Declares a test for each case. The name of a test tells the outcome, and the function runs the case with these arguments.
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

/// The largest memory that a node may use [MB], regardless of the messages that it gets.
const MEMORY: f64 = 100.0;

/// Runs a case (cases_*.py) on `host`, and checks the recorded commands of the servo against the invariants.
pub fn run(host: &Host, case: &str, arguments: &[&str]) {
    run_at(500, host, case, arguments);
}

/// Runs a case with a servo whose cycle runs at `rate` [Hz].
pub fn run_at(rate: u32, host: &Host, case: &str, arguments: &[&str]) {
    let commands = tempfile::NamedTempFile::new().unwrap();
    let path = commands.path().to_str().unwrap();
    host.peer(&[&[case, path], arguments].concat());
    let count = check_commands(&std::fs::read_to_string(path).unwrap(), Duration::from_secs(1) / rate);
    assert!(count > 0 || WITHOUT_COMMANDS.contains(&case), "no commands were checked");
}

/// Runs a case with servo and plant on one host. The memory of both must not grow.
pub fn run_with_both_nodes(case: &str, arguments: &[&str]) {
    let host = Host::with_both_nodes();
    run(&host, case, arguments);
    check_memory(&host, &["servo", "plant"]);
}

/// Checks that these processes still run and have not grown.
pub fn check_memory(host: &Host, names: &[&str]) {
    for name in names {
        let memory = host.memory(name);
        assert!(memory < MEMORY, "{name}: {memory} MB");
    }
}

/// Cases in which the arm is not driven by velocities, or whose servo is started by a script without a recorder.
const WITHOUT_COMMANDS: [&str; 5] =
    ["two_plants", "rival", "guarded_positions", "guarded_reset", "guarded_kill"];

fn check_commands(lines: &str, period: Duration) -> usize {
    let (store, _) = ServoParameters::start("/dq_servo", Vec::new()).unwrap();
    let parameters = ServoParameters::from_store(&store).unwrap();
    let limits = parameters.settings.limits;
    let mut check = CommandCheck::new(Invariants::new(limits.clone(), period));
    let (mut count, mut before) = (0, 0);
    for line in lines.lines() {
        let bytes = hex::decode(line).unwrap();
        for record in CycleRecord::read_all(&bytes).unwrap() {
            if record.number < before {
                check = CommandCheck::new(Invariants::new(limits.clone(), period));
            }
            before = record.number;
            record.events.iter().for_each(|event| check.take(record.now, event));
            if let Some(command) = record.output.as_ref().filter(|_| check.velocities) {
                let checked = check.invariants.check(record.now, command, check.paused || check.stopped);
                checked.unwrap_or_else(|violation| panic!("{violation}, in {record:?}"));
                count += 1;
            }
        }
    }
    count
}

/// A robot that was silent for longer than this counts as new. This is the default of state_timeout.
const SILENCE: Duration = Duration::from_millis(100);

/// The inputs of the servo.
struct CommandCheck {
    invariants: Invariants,
    paused: bool,
    /// Whether the servo was stopped, and no goal has arrived since.
    stopped: bool,
    heard: Duration,
    /// Whether velocities are sent.
    velocities: bool,
}

impl CommandCheck {
    fn new(invariants: Invariants) -> Self {
        Self { invariants, paused: false, stopped: false, heard: Duration::ZERO, velocities: true }
    }

    fn take(&mut self, now: Duration, event: &Recorded) {
        match event {
            Recorded::Begin(_, all) => {
                let velocity = Value::String(Interface::Velocity.name().to_owned());
                self.velocities = all.values.contains(&("interface".to_owned(), velocity));
            }
            Recorded::Pause { paused, .. } => self.paused = *paused,
            Recorded::Stop => self.stopped = true,
            Recorded::Goal(_) => self.stopped = false,
            Recorded::JointState { .. } => {
                if now > self.heard + SILENCE {
                    self.invariants.robot_came();
                }
                self.heard = now;
            }
            _ => {}
        }
    }
}
