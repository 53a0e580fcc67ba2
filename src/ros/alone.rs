//! Helpers for tests whose participants must not meet those of other tests.
#![allow(clippy::unwrap_used, clippy::expect_used, missing_docs)]

use crate::ros::{Environment, LogLevel, Logging, Node, Reach, Resolver, RosArgs, Session};

/// Runs the test called `test` again, in a process whose network namespace has only loopback. Returns true after that run has
/// passed. Returns false inside the namespace, where the test must do its work.
pub fn outside(test: &str) -> bool {
    const INSIDE: &str = "DQ_SERVO_TEST_IN_A_NAMESPACE";
    if std::env::var_os(INSIDE).is_some() {
        return false;
    }
    let set_up = "ip link set lo up && ip link set lo multicast on && ip route add 224.0.0.0/4 dev lo";
    let mut command = std::process::Command::new("unshare");
    command.args(["--map-root-user", "--net", "sh", "-c", &format!("{set_up} && exec \"$@\"")]);
    command.arg("sh").arg(std::env::current_exe().unwrap()).args(["--exact", test, "--nocapture"]);
    let output = command.env(INSIDE, "yes").output().expect("util-linux's unshare");
    let log = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success(), "{log}\n{}", String::from_utf8_lossy(&output.stdout));
    assert!(String::from_utf8_lossy(&output.stdout).contains("1 passed"), "the test has another name");
    true
}

pub fn node(name: &str) -> (Session, Node) {
    let session = session();
    let names = Resolver::new(name, &RosArgs::default()).unwrap();
    let node = session.node(names, Logging::new(&RosArgs::default(), LogLevel::Info)).unwrap();
    (session, node)
}

/// Opens a session, with a participant of its own, in domain 7 on this host only.
pub fn session() -> Session {
    let environment = Environment::new(7, Reach::Localhost);
    Session::open(&environment).unwrap()
}
