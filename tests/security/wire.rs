//! Tests that nobody without a key can read or forge packets between nodes.

use crate::host::{PYTHON, assert_success};
use crate::insiders::Site;
use crate::keystore::{Keystore, Variables, unsecured};
use serde_json::Value;
use std::io::{BufRead, BufReader};
use std::process::Stdio;
use std::time::Duration;

/// Runs an eavesdropper on the network of a site. Returns the number of packets with each word, and the largest distance of a joint
/// from its first position \[rad\].
fn somebody_on_the_wire(variables: Variables) -> (Vec<u64>, f64) {
    let site = Site::new(variables);
    let mut wire = site.host.command("timeout");
    wire.args(["60", PYTHON, concat!(env!("CARGO_MANIFEST_DIR"), "/tests/security/wire.py")]);
    let mut wire = wire.stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().unwrap();
    let mut output = BufReader::new(wire.stdout.take().unwrap()).lines();
    assert_eq!(output.next().unwrap().unwrap(), "reading");
    // Discovery and a service should be visible too.
    assert_success(&site.run(&["param", "get", "base_frame"], "/dq_servo_param"));
    drop(wire.stdin.take());
    let read: Value = serde_json::from_str(&output.next().unwrap().unwrap()).unwrap();
    assert!(wire.wait().unwrap().success());
    assert!(read["packets"].as_u64() > Some(100), "{read}");
    let words = read["words"].as_object().unwrap().values().map(|count| count.as_u64().unwrap()).collect();
    // Let the packets arrive.
    std::thread::sleep(Duration::from_millis(500));
    (words, site.summary().motion())
}

#[test]
fn nothing_on_the_wire_can_be_read_or_forged() {
    let (words, motion) = somebody_on_the_wire(Keystore::new().variables());
    assert_eq!((words, motion), (vec![0; 4], 0.0));
}

#[test]
fn everything_on_an_unsecured_wire_can_be_read_and_forged() {
    let (words, motion) = somebody_on_the_wire(unsecured());
    assert!(words.iter().all(|count| *count > 0), "{words:?}");
    assert!(motion > 0.05, "{motion} rad");
}
