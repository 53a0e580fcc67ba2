//! Tests faults of the wall clock.

use crate::host::{FAR, FAST, Host, wait_for_line, wait_until};
use crate::outcome::run;
use std::time::Duration;

/// Debian's libfaketime. The loader replaces `$LIB` by the machine's library directory.
const FAKETIME: &str = "/usr/$LIB/faketime/libfaketime.so.1";

/// A publisher that appears while the servo runs cannot have sent anything before. A publisher that appears together with the servo
/// may have, so it is obeyed after 5 s.
#[test]
fn a_sender_whose_clock_is_a_minute_behind_is_obeyed() {
    let mut host = Host::with_both_nodes();
    std::thread::sleep(Duration::from_millis(5500));
    let variables = [("LD_PRELOAD", FAKETIME), ("FAKETIME", "-60"), ("FAKETIME_DONT_FAKE_MONOTONIC", "1")];
    host.start_with("sender", &FAR, &variables);
    wait_until(|| host.output(&["status"]).contains("tracking").then_some(()));
}

#[test]
fn a_servo_whose_wall_clock_is_set_back_in_motion_arrives() {
    let mut host = Host::new();
    host.start("plant", &["puma560"]);
    // Only the servo's clock is changed: setting the machine's clock would affect everything.
    let offset = host.file("clock", "+0\n");
    let variables = [
        ("LD_PRELOAD", FAKETIME),
        ("FAKETIME_TIMESTAMP_FILE", offset.as_str()),
        ("FAKETIME_CACHE_DURATION", "1"),
        ("FAKETIME_DONT_FAKE_MONOTONIC", "1"),
    ];
    let servo = host.start_with("servo", &[&["servo"], &FAST[..]].concat(), &variables);
    wait_for_line(servo, "waiting_for_state -> holding");
    run(&host, "clock_back", &[&offset]);
}
