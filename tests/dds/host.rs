//! A separate host for a test: a network namespace with loopback only, and its processes. The tests `dds`, `faults` and others use
//! it.
#![allow(dead_code, reason = "each of the two uses a part of it")]

use std::collections::BTreeMap;
use std::io::{BufRead, BufReader, Read};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

/// The longest time of a process in a test \[s\].
const LIMIT: &str = "120";

/// Arguments of a servo for tests that are not about its law: its motions take a second or two, and the recorder gets all inputs.
pub const FAST: [&str; 3] = ["--ros-args", "-p", "gains.logc:=[4.0, 4.0]"];

/// A goal half a meter away from the start of the arm.
pub const FAR: [&str; 8] = ["goal", "-0.125", "0.2", "0.2", "0", "0", "0", "1"];

/// A network namespace, which a process keeps alive, and the processes that a test started in this namespace. All processes end
/// when this value is dropped.
pub struct Host {
    holder: Child,
    children: BTreeMap<String, Child>,
    files: Vec<PathBuf>,
    /// Whether root in this host is root of the machine.
    of_root: bool,
}

impl Host {
    /// Creates a host with loopback.
    pub fn new() -> Self {
        Self::hold("ip link set lo up && ip link set lo multicast on && ip route add 224.0.0.0/4 dev lo")
    }

    /// Creates a host in which root keeps the rights of the machine's root; `None` if the user is not root.
    pub fn of_root() -> Option<Self> {
        let id = Command::new("id").arg("-u").output().unwrap();
        let set_up = "ip link set lo up && ip link set lo multicast on && ip route add 224.0.0.0/4 dev lo";
        (id.stdout == b"0\n").then(|| {
            let mut host = Self::hold_by(Command::new("unshare"), set_up);
            host.of_root = true;
            host
        })
    }

    /// Creates a host whose only interface is down.
    pub fn without_network() -> Self {
        Self::hold("true")
    }

    /// Creates a host with a servo that waits for joint states.
    pub fn with_servo() -> Self {
        let mut host = Self::new();
        wait_for_line(host.start("servo", &[&["servo"], &FAST[..]].concat()), "waiting for joint states");
        host
    }

    /// Creates a host with servo and plant; the servo has received its first joint state.
    pub fn with_both_nodes() -> Self {
        Self::with_nodes(&[], &FAST)
    }

    /// Creates a host with plant and servo. Each starts with these arguments. The servo has received its first joint state.
    pub fn with_nodes(plant: &[&str], servo: &[&str]) -> Self {
        let mut host = Self::new();
        host.start("plant", &[&["puma560"], plant].concat());
        host.start_servo("servo", servo);
        host
    }

    /// Starts a servo called `name`, and waits for its first joint state.
    pub fn start_servo(&mut self, name: &str, arguments: &[&str]) {
        wait_for_line(self.start(name, &[&["servo"], arguments].concat()), "waiting_for_state -> holding");
    }

    fn hold(set_up: &str) -> Self {
        let mut command = Command::new("unshare");
        command.arg("--map-root-user");
        Self::hold_by(command, set_up)
    }

    /// Creates another host. Root of this host may connect the two.
    pub fn beside(&self) -> Self {
        let mut command = Command::new("nsenter");
        let holder = self.holder.id().to_string();
        command.args(["--target", &holder, "--user", "--preserve-credentials", "unshare"]);
        Self::hold_by(command, "true")
    }

    fn hold_by(mut unshare: Command, set_up: &str) -> Self {
        let script = format!("{set_up} && echo up && exec sleep 1000");
        let mut holder = unshare
            .args(["--net", "sh", "-c", &script])
            .stdout(Stdio::piped())
            .spawn()
            .expect("util-linux's unshare and nsenter");
        let mut line = String::new();
        BufReader::new(holder.stdout.as_mut().unwrap()).read_line(&mut line).unwrap();
        assert_eq!(line, "up\n", "the namespace could not be set up: {set_up}");
        Self { holder, children: BTreeMap::new(), files: Vec::new(), of_root: false }
    }

    /// Returns a command that runs in this host's namespace, with its own ROS domain.
    pub fn command(&self, program: &str) -> Command {
        let mut command = Command::new("nsenter");
        let holder = self.holder.id().to_string();
        command.args(["--target", &holder, "--net"]);
        if !self.of_root {
            command.args(["--user", "--preserve-credentials"]);
        }
        // The caller may ignore signals, like `nohup`.
        command.args(["env", "--default-signal=HUP,INT,QUIT,TERM"]).arg(program);
        command
            .env("ROS_DOMAIN_ID", "77")
            .env_remove("ROS_LOCALHOST_ONLY")
            .env_remove("ROS_AUTOMATIC_DISCOVERY_RANGE");
        command
    }

    /// Starts `dq_servo` with `arguments` as `name`.
    pub fn start(&mut self, name: &str, arguments: &[&str]) -> &mut Child {
        self.start_with(name, arguments, &[])
    }

    /// Starts `dq_servo` with `arguments` as `name`, with these environment variables.
    pub fn start_with(&mut self, name: &str, arguments: &[&str], variables: &[(&str, &str)]) -> &mut Child {
        let mut command = self.command(env!("CARGO_BIN_EXE_dq_servo"));
        command.args(arguments).envs(variables.iter().copied()).stderr(Stdio::piped());
        self.spawn(name, command)
    }

    /// Starts `dq_servo` with `arguments`, without these capabilities, as `name`.
    pub fn start_without(&mut self, name: &str, capabilities: &str, arguments: &[&str]) -> &mut Child {
        let mut command = self.command("setpriv");
        command.args(["--inh-caps", capabilities, "--bounding-set", capabilities]);
        command.arg(env!("CARGO_BIN_EXE_dq_servo")).args(arguments).stderr(Stdio::piped());
        self.spawn(name, command)
    }

    /// Starts `dq_servo` with `arguments` as `name`. Its log goes to `log`.
    pub fn start_logging_to(&mut self, name: &str, arguments: &[&str], log: impl Into<Stdio>) -> &mut Child {
        let mut command = self.command(env!("CARGO_BIN_EXE_dq_servo"));
        command.args(arguments).stderr(log);
        self.spawn(name, command)
    }

    /// Starts `dq_servo` with `arguments` as `name`. Its results go to `results`.
    pub fn start_writing_to(&mut self, name: &str, arguments: &[&str], results: impl Into<Stdio>) {
        let mut command = self.command(env!("CARGO_BIN_EXE_dq_servo"));
        command.args(arguments).stdout(results).stderr(Stdio::piped());
        self.children.insert(name.to_owned(), command.spawn().expect("util-linux's nsenter"));
    }

    /// Starts a program that becomes `dq_servo`.
    pub fn start_program(&mut self, name: &str, program: &str, arguments: &[&str]) -> &mut Child {
        let mut command = self.command(program);
        command.args(arguments).stderr(Stdio::piped());
        self.spawn(name, command)
    }

    fn spawn(&mut self, name: &str, mut command: Command) -> &mut Child {
        let child = command.stdout(Stdio::piped()).spawn().expect("util-linux's nsenter");
        self.children.insert(name.to_owned(), child);
        self.children.get_mut(name).unwrap()
    }

    /// Starts a launch script of this checkout with this build of the program. The process is called "script".
    pub fn start_script(&mut self, script: &str, arguments: &[&str]) {
        let mut command = self.command(&format!("{}/{script}", env!("CARGO_MANIFEST_DIR")));
        command.args(arguments).env("DQ_SERVO", env!("CARGO_BIN_EXE_dq_servo")).stderr(Stdio::null());
        self.children.insert("script".to_owned(), command.spawn().unwrap());
    }

    /// Runs `dq_servo` with `arguments` until it ends.
    pub fn run(&self, arguments: &[&str]) -> Output {
        let mut command = self.command("timeout");
        command.args([LIMIT, env!("CARGO_BIN_EXE_dq_servo")]).args(arguments).output().unwrap()
    }

    /// Runs `dq_servo` with `arguments`, which must succeed, and returns the text that it printed.
    #[track_caller]
    pub fn output(&self, arguments: &[&str]) -> String {
        let output = self.run(arguments);
        assert_success(&output);
        String::from_utf8(output.stdout).unwrap()
    }

    /// Returns the value of a parameter of the servo.
    #[track_caller]
    pub fn parameter(&self, name: &str) -> String {
        self.output(&["param", "get", name]).trim_end().to_owned()
    }

    /// Records all topics. The process is called "recorder".
    pub fn record(&mut self, bag: &Path) {
        self.start("recorder", &["record", "--out", bag.to_str().unwrap()]);
    }

    /// Runs a shell command in the namespace, which must succeed.
    pub fn shell(&self, script: &str) {
        assert_success(&self.command("sh").args(["-c", script]).output().unwrap());
    }

    /// Returns the process that keeps the namespace alive.
    pub fn namespace_pid(&self) -> u32 {
        self.holder.id()
    }

    /// Starts a case of the peer, which runs until the host ends.
    pub fn start_peer(&mut self, case: &[&str]) {
        let child = self.command(PYTHON).arg(crate::PEER).args(case).spawn().unwrap();
        self.children.insert("peer".to_owned(), child);
    }

    /// Runs a case of the peer, which uses another vendor's DDS.
    pub fn peer(&self, case: &[&str]) {
        self.peer_with(&[], case);
    }

    /// Runs a case of the peer in a changed environment.
    pub fn peer_with(&self, environment: &[(&str, &str)], case: &[&str]) {
        let mut peer = self.command("timeout");
        peer.args([LIMIT, PYTHON, crate::PEER]).args(case).envs(environment.iter().copied());
        assert_success(&peer.output().unwrap());
    }

    /// Returns the process id of `name`: nsenter becomes the program that it runs.
    pub fn pid(&self, name: &str) -> u32 {
        self.children[name].id()
    }

    /// Returns the process that runs `dq_servo` with this subcommand as a child of `name`, once it exists. A process that only checks the
    /// arguments does not count.
    pub fn child_of(&self, name: &str, subcommand: &str) -> u32 {
        let children = format!("/proc/{0}/task/{0}/children", self.pid(name));
        let runs = |child: &u32| {
            let line = std::fs::read(format!("/proc/{child}/cmdline")).unwrap_or_default();
            let mut words = line.split(|byte| *byte == 0).skip(1);
            words.next() == Some(subcommand.as_bytes()) && !words.any(|word| word == b"--help")
        };
        wait_until(|| {
            let children = std::fs::read_to_string(&children).unwrap();
            children.split_whitespace().map(|child| child.parse().unwrap()).find(runs)
        })
    }

    /// Waits for the end of `name`, and returns its exit code.
    #[track_caller]
    pub fn wait(&mut self, name: &str) -> Option<i32> {
        let child = self.children.get_mut(name).unwrap();
        wait_until(|| child.try_wait().unwrap()).code()
    }

    /// Returns the process `name`.
    pub fn child(&mut self, name: &str) -> &mut Child {
        self.children.get_mut(name).unwrap()
    }

    /// Returns the rest of the log of `name`, which has ended.
    pub fn errors(&mut self, name: &str) -> String {
        let mut log = String::new();
        self.children.get_mut(name).unwrap().stderr.as_mut().unwrap().read_to_string(&mut log).unwrap();
        log
    }

    /// Interrupts `name` as ctrl-C does. Returns the exit code and the printed text.
    pub fn interrupt(&mut self, name: &str) -> (Option<i32>, String) {
        self.signal(name, "INT");
        let code = self.wait(name);
        let mut printed = String::new();
        let child = self.children.get_mut(name).unwrap();
        child.stdout.as_mut().unwrap().read_to_string(&mut printed).unwrap();
        (code, printed)
    }

    /// Sends a signal to `name`.
    pub fn signal(&self, name: &str, signal: &str) {
        let (option, pid) = (format!("-{signal}"), self.pid(name).to_string());
        assert_success(&Command::new("kill").args([&option, &pid]).output().unwrap());
    }

    /// Kills `name`. The process cannot clean up.
    pub fn kill(&mut self, name: &str) {
        let child = self.children.get_mut(name).unwrap();
        child.kill().unwrap();
        child.wait().unwrap();
    }

    /// Returns the memory that `name` uses [MB].
    pub fn memory(&self, name: &str) -> f64 {
        let status = std::fs::read_to_string(format!("/proc/{}/status", self.pid(name))).unwrap();
        let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:")).expect("it runs");
        line.trim().trim_end_matches(" kB").parse::<f64>().unwrap() / 1e3
    }

    /// Runs `dq_servo` with `arguments` until it ends. No file may grow beyond some 50 or 100 kB.
    pub fn run_with_file_limit(&self, arguments: &[&str]) -> Output {
        let mut command = self.command("timeout");
        let limited = "ulimit -f 100; exec \"$0\" \"$@\"";
        command
            .args([LIMIT, "sh", "-c", limited, env!("CARGO_BIN_EXE_dq_servo")])
            .args(arguments)
            .output()
            .unwrap()
    }

    /// Creates a file with this content, which is deleted with the host.
    pub fn file(&mut self, name: &str, content: &str) -> String {
        let path = std::env::temp_dir().join(format!("dq_servo_{}_{name}", self.holder.id()));
        std::fs::write(&path, content).unwrap();
        self.files.push(path.clone());
        path.display().to_string()
    }
}

impl Drop for Host {
    fn drop(&mut self) {
        // The children of a script end with it only if the script is asked to end.
        if let Some(script) = self.children.remove("script") {
            end_kindly(script);
        }
        for child in self.children.values_mut().chain([&mut self.holder]) {
            let _ = child.kill();
            let _ = child.wait();
        }
        self.files.iter().for_each(|file| drop(std::fs::remove_file(file)));
    }
}

fn end_kindly(mut child: Child) {
    let _ = Command::new("kill").args(["-TERM", &child.id().to_string()]).status();
    let end = Instant::now() + Duration::from_secs(5);
    while Instant::now() < end && child.try_wait().is_ok_and(|status| status.is_none()) {
        std::thread::sleep(Duration::from_millis(10));
    }
    let _ = child.kill();
    let _ = child.wait();
}

/// How long a test waits for what must happen. Only a failing test waits so long.
const PATIENCE: Duration = Duration::from_secs(60);

/// Waits until `found` returns a value, and returns that value.
#[track_caller]
pub fn wait_until<T>(mut found: impl FnMut() -> Option<T>) -> T {
    let end = Instant::now() + PATIENCE;
    loop {
        if let Some(found) = found() {
            return found;
        }
        assert!(Instant::now() < end, "not within {PATIENCE:?}");
        std::thread::sleep(Duration::from_millis(10));
    }
}

/// Reads the child's log until `text` appears, and continues reading, so that the child never blocks.
pub fn wait_for_line(child: &mut Child, text: &str) {
    let log = BufReader::new(child.stderr.take().unwrap());
    let (sender, lines) = std::sync::mpsc::channel();
    std::thread::spawn(move || log.lines().map_while(Result::ok).for_each(|line| drop(sender.send(line))));
    let end = Instant::now() + PATIENCE;
    loop {
        match lines.recv_timeout(end.saturating_duration_since(Instant::now())) {
            Ok(line) if line.contains(text) => return,
            Ok(_) => {}
            Err(why) => panic!("{text:?} was not said: {why}"),
        }
    }
}

pub fn assert_success(output: &Output) {
    let (out, err) = (String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    assert!(output.status.success(), "{}\n{out}\n{err}", output.status);
}

/// Python in the environment of tests/install.sh.
pub const PYTHON: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/target/venv/bin/python");
