//! Tests the page of a secured servo, and of a secured demo.

use crate::host::{Host, assert_success, wait_for_line};
use crate::insiders::start;
use crate::keystore::{Keystore, Variables};
use std::io::{BufRead, BufReader};

const PLACE: &str = "http://127.0.0.1:8123/?token=";

/// Waits for the link of `name`, and drives the arm from a browser.
fn drive(host: &mut Host, name: &str) {
    let mut link = String::new();
    BufReader::new(host.child(name).stdout.take().unwrap()).read_line(&mut link).unwrap();
    let token = link.trim_end().strip_prefix(PLACE).unwrap_or_else(|| panic!("{link}"));
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/security/viewer.py");
    assert_success(
        &host.command("timeout").args(["100", "python3", script, "8123", token]).output().unwrap(),
    );
    host.signal(name, "INT");
    assert_eq!(host.wait(name), Some(0));
}

fn site(variables: &Variables) -> Host {
    let mut host = Host::new();
    start(&mut host, variables, "plant", &["puma560"], "/puma560");
    let servo = start(&mut host, variables, "servo", &["servo"], "/dq_servo");
    wait_for_line(servo, "waiting_for_state -> holding");
    host
}

#[test]
fn the_secured_page_watches_and_drives_a_secured_arm() {
    let keystore = Keystore::new();
    let mut host = site(&keystore.variables());
    start(&mut host, &keystore.variables(), "view", &["view"], "/dq_servo_view");
    drive(&mut host, "view");
}

#[test]
fn the_secured_demo_shows_its_page() {
    let (keystore, mut host) = (Keystore::new(), Host::new());
    start(&mut host, &keystore.variables(), "demo", &["demo", "--view"], "/dq_servo_demo");
    drive(&mut host, "demo");
}

/// Removes topics from the permissions of an enclave, as they are missing in enclaves of earlier versions.
fn without(keystore: &Keystore, enclave: &str, topics: &str) {
    let file = format!("enclaves/{enclave}/permissions");
    keystore.shell(&format!(
        "sed -i -E '\\|<topic>({topics})<|d' {file}.xml; openssl smime -sign -text -signer public/ca.cert.pem \
         -inkey private/ca.key.pem -in {file}.xml -out {file}.p7s"
    ));
}

#[test]
fn an_enclave_of_an_earlier_version_is_replaced_as_the_message_explains() {
    let keystore = Keystore::new();
    without(&keystore, "dq_servo_view", "rt/dq_servo/target_twist");
    let mut host = site(&keystore.variables());
    start(&mut host, &keystore.variables(), "view", &["view"], "/dq_servo_view");
    assert_eq!(host.wait("view"), Some(1));
    let errors = host.errors("view");
    let line =
        errors.lines().find(|line| line.contains("target_twist")).unwrap_or_else(|| panic!("{errors}"));
    assert!(line.contains("dq_servo_keystore.sh") && errors.lines().count() == 1, "{errors}");
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/launch_scripts/dq_servo_keystore.sh");
    keystore.shell(&format!("rm -r enclaves/dq_servo_view; {script} ."));
    start(&mut host, &keystore.variables(), "view", &["view"], "/dq_servo_view");
    drive(&mut host, "view");
}

/// The arm is driven without pictures, which are only for viewers.
#[test]
fn a_servo_whose_enclave_lacks_its_pictures_drives_the_arm_without() {
    let keystore = Keystore::new();
    without(&keystore, "dq_servo", "rt/dq_servo/markers");
    let mut host = Host::new();
    start(&mut host, &keystore.variables(), "plant", &["puma560"], "/puma560");
    let servo = start(&mut host, &keystore.variables(), "servo", &["servo"], "/dq_servo");
    wait_for_line(servo, "no pictures: ");
    start(&mut host, &keystore.variables(), "view", &["view"], "/dq_servo_view");
    drive(&mut host, "view");
}
