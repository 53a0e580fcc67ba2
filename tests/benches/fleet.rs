//! Measures the cost of one more arm: 1 to 32 pairs of a servo and a simulated arm on one host, as processes and all in one process.
//! `cargo bench --bench fleet [-- RATE [MOST]]` \[Hz\]: each servo moves between two goals while it is measured.

#[path = "../dds/host.rs"]
mod host;
mod node;

use dq_config::{PlantParameters, ServoParameters};
use dq_core::servo::State;
use dq_messages::Direction;
use dq_messages::messages::{DiagnosticStatus, PoseStamped};
use dq_nodes::{PlantNode, Prepared, ServoNode};
use dq_ros::ros::{Environment, Node, Publisher, RosArgs, Session, Subscription, args};
use dq_wire::StatusReport;
use host::Host;
use node::{GOALS, goal, join};
use std::io::{BufRead, BufReader};
use std::time::{Duration, Instant};

/// The path of the peer program, which this bench does not use.
const PEER: &str = "";

/// The time for which a fleet is measured.
const WINDOW: Duration = Duration::from_secs(15);
/// The longest time that all nodes may take to find each other.
const PATIENCE: Duration = Duration::from_secs(120);
/// The time between two goals.
const MOTION: Duration = Duration::from_secs(3);

fn main() {
    let arguments: Vec<_> = std::env::args().skip(1).collect();
    let number =
        |at: usize, default: usize| arguments.get(at).and_then(|text| text.parse().ok()).unwrap_or(default);
    let runtime = tokio::runtime::Builder::new_multi_thread().worker_threads(1).enable_all().build().unwrap();
    match arguments.first().map(String::as_str) {
        Some("watch") => runtime.block_on(watch(number(1, 1))),
        Some("together") => runtime.block_on(together(number(1, 1), &arguments[2])),
        _ => table(&number(0, 100).to_string(), number(1, 32)),
    }
}

fn table(rate: &str, most: usize) {
    println!("{rate} Hz, each arm moving; a pair is servo and arm\n");
    println!(
        "| pairs | as | all found [s] | CPU a pair [% of a core] | memory a pair [MB] | latency median, worst arm [ms] | jitter p99, worst arm [µs] |"
    );
    println!("|---|---|---|---|---|---|---|");
    for count in [1, 2, 4, 8, 16, 32].into_iter().filter(|count| *count <= most) {
        for apart in [true, false] {
            row(count, rate, apart);
        }
    }
}

/// Starts a fleet and measures it.
fn row(count: usize, rate: &str, apart: bool) {
    let mut host = Host::new();
    let bench = std::env::current_exe().unwrap().display().to_string();
    let number = count.to_string();
    let watcher = host.start_program("watch", &bench, &["watch", &number]);
    let mut lines = BufReader::new(watcher.stdout.take().unwrap()).lines().map_while(Result::ok);
    assert_eq!(lines.next().as_deref(), Some("ready"));
    let begun = Instant::now();
    let names = if apart {
        start_apart(&mut host, count, rate)
    } else {
        start_together(&mut host, &bench, &number, rate)
    };
    let answer = lines.next().unwrap_or_default();
    let found = begun.elapsed().as_secs_f64();
    if answer != "found" {
        println!("| {count} | {} | not within {} s: {answer} | | | | |", kind(apart), PATIENCE.as_secs());
        return;
    }
    let pids: Vec<_> = names.iter().map(|name| host.pid(name)).collect();
    let (before, begun) = (cpu(&pids), Instant::now());
    // The watcher prints its figures at the end of the measured time.
    let figures = lines.next().unwrap_or_default();
    let share = 100.0 * (cpu(&pids) - before) / begun.elapsed().as_secs_f64() / count as f64;
    let memory = names.iter().map(|name| host.memory(name)).sum::<f64>() / count as f64;
    println!("| {count} | {} | {found:.1} | {share:.1} | {memory:.1} | {figures} |", kind(apart));
}

fn kind(apart: bool) -> &'static str {
    if apart { "processes" } else { "one process" }
}

fn start_apart(host: &mut Host, count: usize, rate: &str) -> Vec<String> {
    let mut names = Vec::new();
    for number in 0..count {
        for command in ["puma560", "servo"] {
            let name = format!("{command}{number}");
            let arguments = ros_arguments(number, rate);
            let arguments: Vec<_> =
                [command].into_iter().chain(arguments.iter().map(String::as_str)).collect();
            host.start_logging_to(&name, &arguments, std::process::Stdio::null());
            names.push(name);
        }
    }
    names
}

fn start_together(host: &mut Host, bench: &str, count: &str, rate: &str) -> Vec<String> {
    host.start_program("together", bench, &["together", count, rate]);
    vec!["together".to_owned()]
}

fn ros_arguments(number: usize, rate: &str) -> Vec<String> {
    let [namespace, rate] = [format!("__ns:=/r{number}"), format!("update_rate:={rate}")];
    ["--ros-args", "-r", &namespace, "-p", &rate, "--log-level", "error"].map(str::to_owned).to_vec()
}

/// Returns the CPU time that these processes have used \[s\].
fn cpu(pids: &[u32]) -> f64 {
    let of = |pid: &u32| {
        let stat = std::fs::read_to_string(format!("/proc/{pid}/stat")).unwrap();
        // The preceding name may have spaces. User and system time are fields 14 and 15, in hundredths of a second.
        let fields = stat.rsplit_once(')').unwrap().1.split_whitespace().skip(11).take(2);
        fields.map(|ticks| ticks.parse::<f64>().unwrap()).sum::<f64>() / 100.0
    };
    pids.iter().map(of).sum()
}

/// Runs this many pairs in this process, as one participant, until it is killed.
async fn together(count: usize, rate: &str) {
    let session = Session::open(&Environment::from_process(&RosArgs::default()).unwrap()).unwrap();
    let mut nodes = Vec::new();
    for number in 0..count {
        let (_, ros_args) = args::split(ros_arguments(number, rate)).unwrap();
        let plant = Prepared::<PlantParameters>::new(&ros_args).unwrap();
        let servo = Prepared::<ServoParameters>::new(&ros_args).unwrap();
        nodes.push((PlantNode::start(&session, plant).unwrap(), ServoNode::start(&session, servo).unwrap()));
    }
    std::future::pending::<()>().await;
}

/// A servo that is observed.
struct Watched {
    statuses: Subscription<DiagnosticStatus>,
    goals: Publisher<PoseStamped>,
}

impl Watched {
    fn new(node: &mut Node, number: usize) -> Self {
        let servo = node::servo();
        let status = servo.topic::<DiagnosticStatus>("~/status", Direction::Out).unwrap();
        Self {
            statuses: node.subscription_as(status, &format!("/r{number}/dq_servo/status")).unwrap(),
            goals: node::goals(node, &format!("/r{number}/")),
        }
    }

    /// Waits until the servo receives from its arm, and would receive a goal.
    async fn is_found(&self) {
        self.is_heard().await;
        self.hears().await;
    }

    /// Waits until the servo reports that it receives from its arm.
    async fn is_heard(&self) {
        while StatusReport::from_message(&self.statuses.next().await)
            .is_none_or(|it| it.state == State::WaitingForState)
        {}
    }

    /// Waits until the servo would receive a goal.
    async fn hears(&self) {
        self.goals.wait_for_readers(PATIENCE).await.unwrap();
    }

    /// Returns what is missing at present, in words.
    async fn missing(&self) -> Option<&'static str> {
        let moment = Duration::from_millis(500);
        let heard = tokio::time::timeout(moment, self.is_heard()).await.is_ok();
        let hears = tokio::time::timeout(moment, self.hears()).await.is_ok();
        match (heard, hears) {
            (true, true) => None,
            (false, true) => Some("does not hear its arm, or is not heard"),
            (true, false) => Some("hears its arm, but not a goal"),
            (false, false) => Some("is not there"),
        }
    }

    /// Returns the median of the latency that the servo reports \[ms\], and its last jitter [µs].
    async fn figures(&self, end: Instant) -> (f64, f64) {
        let (mut latencies, mut jitter, mut number) = (Vec::new(), 0.0, 0);
        let mut next = Instant::now();
        while Instant::now() < end {
            if Instant::now() >= next {
                self.goals.publish(goal(GOALS[number % GOALS.len()]));
                (next, number) = (next + MOTION, number + 1);
            }
            let Ok(status) = tokio::time::timeout(MOTION, self.statuses.next()).await else { break };
            let value =
                |key: &str| status.values.iter().find(|pair| pair.key == key)?.value.parse::<f64>().ok();
            latencies.extend(value("latency_ms"));
            jitter = value("cycle_jitter_p99_us").unwrap_or(jitter);
        }
        latencies.sort_by(f64::total_cmp);
        (latencies.get(latencies.len() / 2).copied().unwrap_or(f64::NAN), jitter)
    }
}

/// Prints when all servos receive from their arms. Then sends goals to each, and prints the figures that the servos report during
/// this time.
async fn watch(count: usize) {
    let (mut node, _session) = join("watch");
    let servos: Vec<_> = (0..count).map(|number| Watched::new(&mut node, number)).collect();
    println!("ready");
    let all = futures::future::join_all(servos.iter().map(Watched::is_found));
    if tokio::time::timeout(PATIENCE, all).await.is_err() {
        let missing = futures::future::join_all(servos.iter().map(Watched::missing)).await;
        let words = missing
            .iter()
            .enumerate()
            .filter_map(|(number, why)| Some(format!("servo {number} {}", (*why)?)));
        return println!("{}", words.collect::<Vec<_>>().join("; "));
    }
    println!("found");
    let end = Instant::now() + WINDOW;
    let figures = futures::future::join_all(servos.iter().map(|servo| servo.figures(end))).await;
    let worst = |figure: fn(&(f64, f64)) -> f64| figures.iter().map(figure).fold(f64::NAN, f64::max);
    println!("{:.1} | {:.0}", worst(|it| it.0), worst(|it| it.1));
}
