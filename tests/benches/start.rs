//! Measures the time from the start of the servo's process to its first command, with a running arm and a goal every 10 ms: `cargo bench
//! --bench start [-- TIMES]`.

#[path = "../dds/host.rs"]
mod host;
mod node;

use host::{Host, wait_for_line};
use node::{GOALS, commands, goal, goals, join};
use std::io::{BufRead, BufReader};
use std::process::Stdio;
use std::time::{Duration, Instant};

/// The path of the peer program, which this bench does not use.
const PEER: &str = "";

/// The time between two goals.
const INTERVAL: Duration = Duration::from_millis(10);

fn main() {
    let arguments: Vec<_> = std::env::args().skip(1).collect();
    if arguments.first().is_some_and(|first| first == "peer") {
        let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build();
        return runtime.unwrap().block_on(peer());
    }
    let times = arguments.iter().find_map(|argument| argument.parse().ok()).unwrap_or(20);
    let mut host = Host::new();
    wait_for_line(host.start("plant", &["puma560"]), "simulating");
    let bench = std::env::current_exe().unwrap().display().to_string();
    let peer = host.start_program("peer", &bench, &["peer"]);
    let mut lines = BufReader::new(peer.stdout.take().unwrap()).lines().map_while(Result::ok);
    assert_eq!(lines.next().as_deref(), Some("ready"));
    let mut taken: Vec<_> = (0..times)
        .map(|_| {
            let begun = Instant::now();
            host.start_logging_to("servo", &["servo"], Stdio::null());
            assert_eq!(lines.next().as_deref(), Some("command"));
            let taken = begun.elapsed().as_secs_f64() * 1e3;
            host.interrupt("servo");
            assert_eq!(lines.next().as_deref(), Some("silence"));
            taken
        })
        .collect();
    taken.sort_by(f64::total_cmp);
    println!(
        "first command after {:.0} ms (median of {times}; {:.0} to {:.0})",
        taken[times / 2],
        taken[0],
        taken[times - 1]
    );
}

/// Sends goals, and prints when commands begin and when they have ceased.
async fn peer() {
    let (mut node, _session) = join("peer");
    let (commands, goals) = (commands(&mut node), goals(&mut node, "/"));
    println!("ready");
    let mut interval = tokio::time::interval(INTERVAL);
    let (mut begun, mut last) = (false, Instant::now());
    loop {
        tokio::select! {
            _ = commands.next() => {
                if !begun {
                    println!("command");
                }
                (begun, last) = (true, Instant::now());
            }
            _ = interval.tick() => {
                goals.publish(goal(GOALS[0]));
                if begun && last.elapsed() > Duration::from_millis(500) {
                    begun = false;
                    println!("silence");
                }
            }
        }
    }
}
