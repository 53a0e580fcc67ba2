//! The wall clock.

use crate::host::{Host, wait_for_line};
use crate::outcome::run;

/// Debian's libfaketime; the loader puts the machine's own directory for `$LIB`.
const FAKETIME: &str = "/usr/$LIB/faketime/libfaketime.so.1";

#[test]
fn a_servo_whose_wall_clock_is_set_back_in_motion_arrives() {
    let mut host = Host::new();
    host.start("plant", &["puma560"]);
    // The servo's own clock alone: the machine's would be set back for everybody.
    let offset = host.file("clock", "+0\n");
    let variables = [
        ("LD_PRELOAD", FAKETIME),
        ("FAKETIME_TIMESTAMP_FILE", offset.as_str()),
        ("FAKETIME_CACHE_DURATION", "1"),
        ("FAKETIME_DONT_FAKE_MONOTONIC", "1"),
    ];
    let servo = host.start_with("servo", &["servo"], &variables);
    wait_for_line(servo, "waiting_for_state -> holding");
    run(&host, "clock_back", &[&offset]);
}
