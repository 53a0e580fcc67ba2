//! ROS 2 nodes on Fast DDS with keys of the same authority (peer.cpp), to our nodes and from them.

use crate::compile::compile;
use crate::host::assert_success;
use crate::insiders::Site;
use crate::keystore::{Keystore, Variables};
use std::process::Output;
use std::sync::OnceLock;

/// Runs a case of the peer with the keys of `enclave`.
fn peer(site: &Site, variables: &Variables, case: &str, enclave: &str) -> Output {
    static PEER: OnceLock<String> = OnceLock::new();
    let program = PEER.get_or_init(|| compile("tests/security/peer.cpp"));
    let mut peer = site.host.command("timeout");
    peer.args(["60", program, case]).envs(variables.iter().map(|(name, value)| (name, value)));
    peer.env("ROS_SECURITY_ENCLAVE_OVERRIDE", enclave).output().unwrap()
}

#[test]
fn services_answer_requests_of_every_length() {
    let keystore = Keystore::new();
    let site = Site::new(keystore.variables());
    assert_success(&peer(&site, &keystore.variables(), "parameters", "/dq_servo_param"));
    assert_success(&peer(&site, &keystore.variables(), "calls", "/dq_servo_call"));
}

#[test]
fn a_goal_moves_the_arm_and_the_status_is_heard() {
    let keystore = Keystore::new();
    let site = Site::new(keystore.variables());
    assert_success(&peer(&site, &keystore.variables(), "goal", "/dq_servo_goal"));
    assert!(site.seen().motion() > 0.3);
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

/// What sros2 writes; for this test's domain.
const AS_SROS2: &str =
    "cd enclaves; sed -i 's/<data_protection_kind>NONE/<data_protection_kind>ENCRYPT/' governance.xml";

#[test]
fn a_governance_under_which_calls_hang_is_named_with_a_remedy_that_works() {
    let keystore = Keystore::new();
    let sign = |script: &str, command: &str| keystore.shell(&format!("{script}; {command}"));
    let own = "openssl smime -sign -text -md sha256 -in governance.xml -out governance.p7s \
               -signer ../public/permissions_ca.cert.pem -inkey ../private/permissions_ca.key.pem";
    sign(AS_SROS2, own);
    let variables = keystore.variables();
    let warned = |site: &Site| {
        let output = site.run(&["param", "get", "controller"], "/dq_servo_param");
        assert_success(&output);
        String::from_utf8(output.stderr).unwrap()
    };
    let site = Site::new(variables.clone());
    let text = warned(&site);
    let file = keystore.path("enclaves/governance.p7s").canonicalize().unwrap();
    assert!(
        text.lines().count() == 1 && text.contains(file.to_str().unwrap()) && text.contains("topics *"),
        "{text}"
    );
    assert!(
        !peer(&site, &variables, "stop", "/dq_servo_call").status.success(),
        "then the warning is needless"
    );
    drop(site);
    // The remedy, as the warning has it.
    let lines = ["metadata_protection_kind", "data_protection_kind"].map(|kind| {
        let from = text.find(&format!("<{kind}>")).unwrap();
        let line = &text[from..from + text[from..].find(' ').unwrap()];
        format!("sed -i 's|.*<{kind}>.*|{line}|' enclaves/governance.xml; ")
    });
    let command = &text[text.find("openssl").unwrap()..];
    sign(&format!("{} cd enclaves", lines.concat()), command.trim());
    let site = Site::new(variables.clone());
    assert_eq!(warned(&site), "");
    assert_success(&peer(&site, &variables, "stop", "/dq_servo_call"));
}
