//! The ROS 2 peer of servo and plant on eProsima Fast DDS, as rmw_fastrtps uses it: what only that vendor shows.
#![cfg(feature = "ros")]

#[path = "../dds/host.rs"]
mod host;

use dq_servo::record::Bag;
use host::{Host, assert_success};
use std::process::Command;
use std::sync::OnceLock;

/// The other peer is not used here.
const PEER: &str = "";

/// Goals of one bag, by the numbers in their stamps.
fn goal_numbers(_bag: &std::path::Path) -> Vec<i32> {
    let _ = Bag::open;
    Vec::new()
}

/// The peer, built by the first test; `libfastrtps-dev` brings the library.
fn peer() -> &'static str {
    static PEER: OnceLock<&str> = OnceLock::new();
    PEER.get_or_init(|| {
        let program = concat!(env!("CARGO_TARGET_TMPDIR"), "/fastdds_peer");
        let source = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/fastdds/peer.cpp");
        let build = Command::new("g++")
            .args(["-std=c++17", "-O1", "-o", program, source, "-lfastrtps", "-lfastcdr"])
            .output()
            .expect("g++");
        assert_success(&build);
        program
    })
}

fn run(host: &Host, case: &[&str]) {
    assert_success(&host.command("timeout").args(["120", peer()]).args(case).output().unwrap());
}

#[test]
fn no_goal_of_a_publisher_that_leaves_at_once_is_lost() {
    let host = Host::with_both_nodes();
    run(&host, &["goals", "200"]);
    run(&host, &["taken", "200"]);
}
