//! Tests nodes with keys of one authority: permitted actions work, and others do not.

use crate::host::{FAR, Host, assert_success, wait_for_line, wait_until};
use crate::keystore::{Keystore, PROGRAM, Variables};
use dq_bags::{Bag, BagMessage};
use dq_messages::messages::{DiagnosticStatus, JointState, StringMessage};
use dq_messages::{Direction, NodeContract, TopicContract, decode};
use dq_wire::Contract;
use std::collections::BTreeSet;
use std::path::Path;
use std::process::{Command, Output, Stdio};

/// A host with servo and plant, and a recorder of everything that they publish.
pub struct Site {
    pub host: Host,
    variables: Variables,
    bag: std::path::PathBuf,
    _directory: tempfile::TempDir,
}

/// Returns the arguments that choose an enclave. They have no effect for unsecured processes.
pub fn arguments<'a>(command: &[&'a str], enclave: &'a str) -> Vec<&'a str> {
    [command, &["--ros-args", "--enclave", enclave]].concat()
}

/// Starts `command` of dq_servo with the keys of `enclave`. The process is called `name`.
pub fn start<'a>(
    host: &'a mut Host,
    variables: &Variables,
    name: &str,
    command: &[&str],
    enclave: &str,
) -> &'a mut std::process::Child {
    let variables: Vec<_> = variables.iter().map(|(name, value)| (*name, value.as_str())).collect();
    host.start_with(name, &arguments(command, enclave), &variables)
}

/// Runs `command` of dq_servo with the keys of `enclave` until it ends.
pub fn run(host: &Host, variables: &Variables, command: &[&str], enclave: &str) -> Output {
    let mut process = host.command("timeout");
    process.args(["60", env!("CARGO_BIN_EXE_dq_servo")]).args(arguments(command, enclave));
    process.envs(variables.iter().map(|(name, value)| (name, value))).output().unwrap()
}

impl Site {
    /// Creates a site whose processes have these variables.
    pub fn new(variables: Variables) -> Self {
        Self::recording(variables, &[])
    }

    /// Creates a site whose processes have these variables, and whose recorder records these topics.
    pub fn recording(variables: Variables, topics: &[&str]) -> Self {
        let directory = tempfile::tempdir().unwrap();
        let bag = directory.path().join("seen");
        let mut host = Host::new();
        start(&mut host, &variables, "plant", &["puma560"], "/puma560");
        let recording = [&["record", "--out", bag.to_str().unwrap()], topics].concat();
        start(&mut host, &variables, "recorder", &recording, "/dq_servo_recorder");
        let servo = start(&mut host, &variables, "servo", &["servo"], "/dq_servo");
        wait_for_line(servo, "waiting_for_state -> holding");
        let site = Self { host, variables, bag, _directory: directory };
        site.wait_for("/dq_servo/status");
        site
    }

    fn wait_for(&self, topic: &str) {
        wait_until(|| messages(&self.bag, topic).pop());
    }

    /// Runs a command with the keys of `enclave`.
    pub fn run(&self, command: &[&str], enclave: &str) -> Output {
        run(&self.host, &self.variables, command, enclave)
    }

    /// Returns the texts that the recorder has received on a topic.
    pub fn texts(mut self, topic: &str) -> Vec<String> {
        assert_eq!(self.host.interrupt("recorder").0, Some(0));
        let text = |message: &BagMessage| decode::<StringMessage>(&message.cdr).unwrap().data;
        messages(&self.bag, topic).iter().map(text).collect()
    }

    /// Returns the names of the topics that the recorder has received so far.
    fn heard(&self) -> BTreeSet<String> {
        Bag::open(&self.bag).unwrap().map(|message| message.topic.to_string()).collect()
    }

    /// Returns a summary of what the recorder has received.
    pub fn summary(mut self) -> BagSummary {
        // Code 3 means that messages were lost. Forged sequence numbers look like lost messages.
        let code = self.host.interrupt("recorder").0;
        assert!(matches!(code, Some(0 | 3)), "{code:?}");
        BagSummary::read(&self.bag)
    }
}

/// A summary of the recorded messages.
pub struct BagSummary {
    pub positions: Vec<Vec<f64>>,
    pub states: Vec<String>,
    pub goals: usize,
    pub commands: usize,
}

impl BagSummary {
    pub fn read(bag: &Path) -> Self {
        let positions =
            |message: &BagMessage| decode::<JointState>(&message.cdr).map(|state| state.position).unwrap();
        let state = |message: &BagMessage| {
            decode::<DiagnosticStatus>(&message.cdr).map_or("undecodable".to_owned(), |status| status.message)
        };
        Self {
            positions: messages(bag, "/joint_states").iter().map(positions).collect(),
            states: messages(bag, "/dq_servo/status").iter().map(state).collect(),
            goals: messages(bag, "/goal_pose").len(),
            commands: messages(bag, "/forward_velocity_controller/commands").len(),
        }
    }

    /// Returns the largest distance of any joint from its first position \[rad\].
    pub fn motion(&self) -> f64 {
        let first = &self.positions[0];
        let from_first =
            |now: &Vec<f64>| now.iter().zip(first).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        self.positions.iter().map(from_first).fold(0.0, f64::max)
    }
}

fn messages(bag: &Path, topic: &str) -> Vec<BagMessage> {
    let bag = Bag::open(bag).ok().into_iter().flatten();
    bag.filter(|message| &*message.topic == topic).collect()
}

#[test]
fn a_secured_servo_and_plant_move_the_arm_and_accept_parameters_and_goals() {
    let keystore = Keystore::new();
    let site = Site::new(keystore.variables());
    assert_success(&site.run(&["param", "set", "controller", "diffc"], "/dq_servo_param"));
    let arrived = site.run(&FAR, "/dq_servo_goal");
    assert_success(&arrived);
    assert!(String::from_utf8_lossy(&arrived.stdout).starts_with("arrived with diffc"));
    let seen = site.summary();
    assert!(seen.motion() > 0.3 && seen.commands > 100, "{} rad, {} commands", seen.motion(), seen.commands);
    assert!(seen.states.iter().any(|state| state == "settled"));
}

#[test]
fn the_launch_script_starts_secured_nodes() {
    let (keystore, host) = (Keystore::new(), Host::new());
    let mut script = host.command(concat!(env!("CARGO_MANIFEST_DIR"), "/launch_scripts/dq_servo.sh"));
    script.env("DQ_SERVO", env!("CARGO_BIN_EXE_dq_servo")).stderr(Stdio::piped()).envs(keystore.variables());
    let mut script = script.spawn().unwrap();
    wait_for_line(&mut script, "waiting_for_state -> holding");
    let arrived = run(&host, &keystore.variables(), &FAR, "/dq_servo_goal");
    assert_success(&Command::new("kill").args(["-TERM", &script.id().to_string()]).output().unwrap());
    assert_eq!(script.wait().unwrap().code(), Some(143));
    assert_success(&arrived);
}

#[test]
fn the_launch_script_starts_secured_nodes_in_a_namespace() {
    let (keystore, host) = (Keystore::new(), Host::new());
    keystore.shell(concat!(env!("CARGO_MANIFEST_DIR"), "/launch_scripts/dq_servo_keystore.sh . /cell"));
    let mut script = host.command(concat!(env!("CARGO_MANIFEST_DIR"), "/launch_scripts/dq_servo.sh"));
    script.args(["guard:=true", "--ros-args", "-r", "__ns:=/cell"]).envs(keystore.variables());
    let mut script = script.env("DQ_SERVO", PROGRAM).stderr(Stdio::piped()).spawn().unwrap();
    wait_for_line(&mut script, "waiting_for_state -> holding");
    let goal = [&FAR[..], &["--ros-args", "-r", "__ns:=/cell"]].concat();
    let arrived = run(&host, &keystore.variables(), &goal, "/cell/dq_servo_goal");
    assert_success(&Command::new("kill").args(["-TERM", &script.id().to_string()]).output().unwrap());
    script.wait().unwrap();
    assert_success(&arrived);
}

/// Returns the topics that these nodes publish without a request, on an arm whose controller takes velocities.
fn published(nodes: &[&NodeContract]) -> Vec<String> {
    let is_published = |(name, topic): &(&str, &TopicContract)| {
        let is_command = name.starts_with("forward_position") || name.starts_with("joint_trajectory");
        topic.direction == Direction::Out && !is_command
    };
    let topics = nodes.iter().flat_map(|node| node.topics().filter(is_published));
    topics.map(|(name, _)| name.trim_start_matches(['~', '/']).to_owned()).collect()
}

#[test]
fn every_node_of_the_contract_starts_secured_with_all_of_its_topics() {
    let keystore = Keystore::new();
    let mut site = Site::new(keystore.variables());
    let guard = start(&mut site.host, &keystore.variables(), "guard", &["guard"], "/dq_servo_guard");
    wait_for_line(guard, "watching");
    // Other nodes run for some seconds, until they are interrupted.
    let others: Vec<_> = [
        (&["dual"][..], "/dq_dual_servo"),
        (&["arm", "--arm", "ur5e", "--ros-args", "-r", "__ns:=/left"], "/left/arm"),
        (&["guard", "--ros-args", "-r", "__ns:=/right"], "/right/dq_servo_guard"),
        (&["view"], "/dq_servo_view"),
    ]
    .map(|(command, enclave)| {
        let mut process = site.host.command("timeout");
        process.args(["--signal", "INT", "8", PROGRAM]).args(arguments(command, enclave));
        process.envs(keystore.variables()).stdout(Stdio::null()).stderr(Stdio::piped());
        (enclave, process.spawn().unwrap())
    })
    .into();
    for (enclave, process) in others {
        let log = String::from_utf8(process.wait_with_output().unwrap().stderr).unwrap();
        assert!(log.contains("[INFO]") || enclave == "/dq_servo_view", "{enclave}: {log}");
        assert!(!log.contains("permissions of its enclave"), "{enclave}: {log}");
    }
    // Joining nodes hold up the samples of a secured graph, so the arm moves only now.
    assert_success(&site.run(&FAR, "/dq_servo_goal"));
    let contract = Contract::builtin().unwrap();
    let expected = published(&[&contract.servo, &contract.plant, &contract.guard]);
    assert!(expected.len() > 12);
    for topic in expected {
        println!("waiting for {topic}");
        wait_until(|| site.heard().into_iter().find(|name| name.ends_with(&topic)));
    }
    assert_eq!(site.host.interrupt("recorder").0, Some(0));
}

fn assert_moves(demo: &[&str]) {
    let keystore = Keystore::new();
    assert_success(&run(&Host::new(), &keystore.variables(), demo, "/dq_servo_demo"));
}

#[test]
fn the_secured_demo_moves_there_and_back() {
    assert_moves(&["demo"]);
}

#[test]
fn the_secured_demo_of_two_arms_moves_there_and_back() {
    assert_moves(&["demo", "--dual"]);
}

#[test]
fn a_member_may_do_no_more_than_its_permissions_allow() {
    let keystore = Keystore::new();
    let site = Site::new(keystore.variables());
    for (command, enclave, forbidden) in [
        (&FAR[..], "/dq_servo_recorder", "rt/goal_pose"),
        (&["param", "set", "controller", "diffc"], "/dq_servo_goal", "set_parameters"),
        (&["servo"], "/dq_servo_goal", "rt/forward_velocity_controller/commands"),
        (&["puma560"], "/dq_servo", "rq/puma560/resetRequest"),
    ] {
        let output = site.run(command, enclave);
        let message = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{command:?} as {enclave}: {message}");
        assert!(message.to_lowercase().contains("not allowed") && message.contains(forbidden), "{message}");
    }
    assert!(site.summary().motion() < 1e-9);
}
