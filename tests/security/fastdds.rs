//! Tests ROS 2 nodes on Fast DDS with keys of the same authority (peer.cpp) as counterparts of our nodes.

use crate::host::assert_success;
use crate::insiders::Site;
use crate::keystore::{Keystore, Variables};
use std::process::Output;

/// Runs a case of the peer with the keys of `enclave`. Runs the case again if the peer found nobody, which happened in 11 of 874
/// starts. If a node on Fast DDS before 3.2 sends the first request, that node and RustDDS 0.15.1 derive different keys once in 256
/// times (`compute_shared_secret`). More rarely, Fast DDS ignores the answer.
pub fn peer(site: &Site, variables: &Variables, case: &str, enclave: &str) -> Output {
    // Built by tests/install.sh.
    let program = concat!(env!("CARGO_MANIFEST_DIR"), "/target/peers/security");
    let run = || {
        let mut peer = site.host.command("timeout");
        peer.args(["60", program, case]).envs(variables.iter().map(|(name, value)| (name, value)));
        peer.env("ROS_SECURITY_ENCLAVE_OVERRIDE", enclave).output().unwrap()
    };
    let first = run();
    match String::from_utf8_lossy(&first.stderr).contains("not within 20 s") {
        true => run(),
        false => first,
    }
}

#[test]
fn services_answer_requests_of_every_length() {
    let keystore = Keystore::new();
    let site = Site::new(keystore.variables());
    assert_success(&peer(&site, &keystore.variables(), "parameters", "/dq_servo_param"));
    assert_success(&peer(&site, &keystore.variables(), "calls", "/dq_servo_call"));
}

#[test]
fn a_goal_moves_the_arm_and_the_status_is_received() {
    let keystore = Keystore::new();
    // Debian's Fast DDS fails an assertion in its statistics if a secured writer has a second reader (of goals, the recorder).
    let site = Site::recording(keystore.variables(), &["--topics", "/dq_servo/status", "/joint_states"]);
    assert_success(&peer(&site, &keystore.variables(), "goal", "/dq_servo_goal"));
    assert!(site.summary().motion() > 0.3);
}

#[test]
fn texts_of_every_length_arrive() {
    let keystore = Keystore::new();
    let site = Site::recording(keystore.variables(), &["--topics", "/robot_description", "/dq_servo/status"]);
    assert_success(&peer(&site, &keystore.variables(), "strings", "/puma560"));
    let texts = site.texts("/robot_description");
    let mut lengths: Vec<_> = texts.iter().map(String::len).filter(|length| *length <= 20).collect();
    lengths.sort();
    assert_eq!(lengths, (0..=20).collect::<Vec<_>>());
}

#[test]
fn nodes_of_ros_2_s_command_line_run_in_the_operators_enclaves() {
    let keystore = Keystore::new();
    let site = Site::new(keystore.variables());
    for enclave in ["/dq_servo_goal", "/dq_servo_call", "/dq_servo_param", "/dq_servo_recorder"] {
        assert_success(&peer(&site, &keystore.variables(), "rclpy", enclave));
    }
}
