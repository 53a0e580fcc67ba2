//! Measures how punctual the servo's cycle is, and how punctual a bare loop is that only waits for the same deadlines. Run `cargo
//! bench --bench cycle [-- SECONDS]`, for each rate and load, 20 s by default. Servos and loops, each without and with a priority,
//! run at the same time, so that other work of the machine affects all of them. Priorities need root.

#[path = "../dds/host.rs"]
mod host;

use dq_bags::Bag;
use dq_messages::messages::DiagnosticArray;
use dq_wire::{CycleTiming, SpreadFigures, TimingFigures};
use host::{Host, assert_success, wait_for_line};
use rustix::thread::{ClockId, clock_nanosleep_absolute};
use rustix::time::{Timespec, clock_gettime};
use std::collections::BTreeMap;
use std::process::{Child, Command};
use std::time::Duration;
use thread_priority::{
    RealtimeThreadSchedulePolicy, ThreadPriority, ThreadSchedulePolicy, set_thread_priority_and_policy,
    thread_native_id,
};

/// The path of the peer program, which this bench does not use.
const PEER: &str = "";

/// A goal that takes the arm across its space [m; quaternion x y z w].
const GOAL: [&str; 7] = ["-0.125", "0.2", "0.2", "0", "0", "0", "1"];

/// The priority in the rows that have one.
const PRIORITY: u8 = 40;

fn main() {
    let seconds = std::env::args().find_map(|argument| argument.parse().ok()).unwrap_or(20);
    println!("{seconds} s for each rate and load; load of the machine before: {}\n", load());
    println!(
        "| rate [Hz] | others | priority | | wake-up late by: median, 99 %, 99.9 %, worst [µs] | work: median, 99 %, worst [µs] | cycles missed |"
    );
    println!("|---|---|---|---|---|---|---|");
    for rate in [500, 1000] {
        for busy in [false, true] {
            rows(rate, busy, Duration::from_secs(seconds));
        }
    }
    println!("\nload of the machine after: {}", load());
}

fn load() -> String {
    std::fs::read_to_string("/proc/loadavg").unwrap().trim_end().to_owned()
}

/// Prints the rows of this rate \[Hz\], with or without other load, measured for `time`.
fn rows(rate: u32, busy: bool, time: Duration) {
    let mut hosts: Vec<_> = [(0, Some(Host::new())), (PRIORITY, Host::of_root())]
        .into_iter()
        .filter_map(|(priority, host)| Some((priority, host?)))
        .collect();
    let bags = tempfile::tempdir().unwrap();
    let bag = |priority: u8| bags.path().join(priority.to_string());
    for (priority, host) in &mut hosts {
        start(host, rate, *priority, &bag(*priority));
    }
    let load = Load::new(busy);
    for (_, host) in &mut hosts {
        assert_success(&host.run(&[&["goal"], &GOAL[..]].concat()));
    }
    // The figures of the servos are counted from their goals, some seconds earlier.
    let period = Duration::from_secs(1) / rate;
    let loops: Vec<_> = hosts
        .iter()
        .map(|(priority, _)| *priority)
        .map(|priority| (priority, std::thread::spawn(move || bare(period, priority, time))))
        .collect();
    let loops: Vec<_> =
        loops.into_iter().map(|(priority, thread)| (priority, thread.join().unwrap())).collect();
    drop(load);
    let others = if busy { "both cores busy" } else { "none of ours" };
    for ((priority, host), (_, bare)) in hosts.iter_mut().zip(loops) {
        host.interrupt("recorder");
        println!("| {rate} | {others} | {priority} | servo | {} |", reported(&bag(*priority)));
        println!("| | | | bare loop | {} |", shown(&bare));
    }
}

/// Starts the arm, the servo and a recorder of the servo's figures.
fn start(host: &mut Host, rate: u32, priority: u8, bag: &std::path::Path) {
    let (rate, priority) = (format!("update_rate:={rate}"), format!("realtime_priority:={priority}"));
    let arguments = ["--ros-args", "-p", &rate];
    wait_for_line(host.start("plant", &[&["puma560"], &arguments[..]].concat()), "simulating");
    let servo = [&["servo"], &arguments[..], &["-p", &priority]].concat();
    wait_for_line(host.start("servo", &servo), "waiting_for_state -> holding");
    host.start("recorder", &["record", "--out", bag.to_str().unwrap(), "--topics", "/diagnostics"]);
}

/// Processes that use all available time, one per core.
struct Load(Vec<Child>);

impl Load {
    fn new(busy: bool) -> Self {
        let cores = if busy { std::thread::available_parallelism().unwrap().get() } else { 0 };
        let spin = |_| Command::new("sh").args(["-c", "while :; do :; done"]).spawn().unwrap();
        Self((0..cores).map(spin).collect())
    }
}

impl Drop for Load {
    fn drop(&mut self) {
        for child in &mut self.0 {
            let _ = child.kill();
            let _ = child.wait();
        }
    }
}

/// Runs a loop that only waits for its deadlines, with this priority, for `time`.
fn bare(period: Duration, priority: u8, time: Duration) -> TimingFigures {
    if priority > 0 {
        let fifo = ThreadSchedulePolicy::Realtime(RealtimeThreadSchedulePolicy::Fifo);
        let value = ThreadPriority::try_from(priority).unwrap();
        set_thread_priority_and_policy(thread_native_id(), value, fifo).unwrap();
    }
    let (begun, mut timing) = (now(), CycleTiming::default());
    let mut deadline = begun;
    while deadline < begun + time {
        sleep_until(deadline);
        let woken = now();
        deadline += period;
        let missed = woken.saturating_sub(deadline).as_nanos().div_ceil(period.as_nanos());
        timing.add((woken + period).saturating_sub(deadline), missed as u64);
        timing.add_work(now().saturating_sub(woken));
        deadline += period * missed as u32;
    }
    timing.figures()
}

fn now() -> Duration {
    let time = clock_gettime(rustix::time::ClockId::Monotonic);
    Duration::new(time.tv_sec.unsigned_abs(), u32::try_from(time.tv_nsec).unwrap())
}

fn sleep_until(deadline: Duration) {
    let seconds = i64::try_from(deadline.as_secs()).unwrap();
    let request = Timespec { tv_sec: seconds, tv_nsec: i64::from(deadline.subsec_nanos()) };
    while clock_nanosleep_absolute(ClockId::Monotonic, &request).is_err() {}
}

fn us(time: Duration) -> f64 {
    time.as_secs_f64() * 1e6
}

fn shown(figures: &TimingFigures) -> String {
    let SpreadFigures { median, p99, p999, max } = figures.lateness;
    let work = figures.work;
    let late = [median, p99, p999, max].map(|time| format!("{:.0}", us(time))).join(", ");
    let work = [work.median, work.p99, work.max].map(|time| format!("{:.1}", us(time))).join(", ");
    format!("{late} | {work} | {}", figures.overruns)
}

/// Returns the servo's last report, and the number of cycles that the servo missed since its first report.
fn reported(bag: &std::path::Path) -> String {
    let mut reports: Vec<BTreeMap<String, String>> = Vec::new();
    for message in Bag::open(bag).unwrap() {
        let Ok(diagnostics) = message.decode::<DiagnosticArray>() else { continue };
        let of_cycle = diagnostics.status.into_iter().filter(|status| status.name.ends_with(": cycle"));
        reports.extend(of_cycle.map(|it| it.values.into_iter().map(|pair| (pair.key, pair.value)).collect()));
    }
    let (first, last) = (&reports[0], &reports[reports.len() - 1]);
    let number = |report: &BTreeMap<String, String>, key: &str| report[key].parse::<f64>().unwrap();
    let list =
        |keys: [&str; 4], digits: usize| keys.map(|key| format!("{:.digits$}", number(last, key))).join(", ");
    let late = ["median", "p99", "p999", "max"].map(|part| format!("cycle_jitter_{part}_us"));
    let late = list(late.each_ref().map(String::as_str), 0);
    let work = ["median", "p99", "max"].map(|part| number(last, &format!("cycle_time_{part}_us")));
    let work = work.map(|time| format!("{time:.1}")).join(", ");
    format!("{late} | {work} | {:.0}", number(last, "overruns") - number(first, "overruns"))
}
