//! Tests that messages to a servo leave no memory allocated.

use crate::host::Host;

/// Sends `count` goals in a frame whose name has `length` bytes. Returns the growth of the servo's memory [MB].
fn growth(host: &Host, count: u32, length: u32) -> f64 {
    let before = host.memory("servo");
    host.peer(&["bulk_goals", &count.to_string(), &length.to_string()]);
    host.memory("servo") - before
}

/// The first messages fill RustDDS's buffers.
#[test]
fn thousands_of_goals_and_goals_in_frames_of_100_kb_leave_nothing_behind() {
    let host = Host::with_both_nodes();
    growth(&host, 30_000, 0);
    let small = growth(&host, 20_000, 0);
    assert!(small < 2.0, "{small} MB for 20 000 goals");
    growth(&host, 300, 100_000);
    let long = growth(&host, 300, 100_000);
    assert!(long < 12.0, "{long} MB for 300 goals of 0.1 MB");
}
