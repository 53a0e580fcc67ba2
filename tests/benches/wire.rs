//! Measures the latency over DDS at a peer of the servo: from a joint state to the command that was computed from it, and from a
//! goal to the first command that takes the goal into account. For comparison, the same joint state is also echoed by Eclipse
//! Cyclone DDS in C, and by a UDP socket. Run `cargo bench --bench wire [-- TIMES [PRIORITY]]`; the echo needs Debian's
//! cyclonedds-dev, cyclonedds-tools and a C compiler.

#[path = "../dds/host.rs"]
mod host;
mod node;

use dq_messages::Direction;
use dq_messages::messages::{Float64MultiArray, JointState, PoseStamped, Time, UInt8MultiArray};
use dq_ros::ros::{Publisher, Session, Subscription};
use dq_wire::{Contract, CycleRecord, Recorded};
use host::{Host, assert_success, wait_for_line};
use node::{GOALS, commands, goal, goals, join};
use rustix::time::{ClockId, clock_gettime};
use std::net::UdpSocket;
use std::path::Path;
use std::process::Command;
use std::time::Duration;

/// The path of the peer program, which this bench does not use.
const PEER: &str = "";

const RATE: f64 = 500.0;

/// The address of the echo of datagrams.
const ECHO: &str = "127.0.0.1:40123";

fn main() {
    let arguments: Vec<_> = std::env::args().skip(1).collect();
    let numbers: Vec<usize> = arguments.iter().filter_map(|argument| argument.parse().ok()).collect();
    let times = numbers.first().copied().unwrap_or(1000);
    match arguments.first().map(String::as_str) {
        Some("peer") => {
            let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().unwrap();
            runtime.block_on(peer(times));
        }
        Some("datagrams") => echo_datagrams(),
        _ => measure(times, numbers.get(1).copied().unwrap_or(0)),
    }
}

fn measure(times: usize, priority: usize) {
    let directory = tempfile::tempdir().unwrap();
    let echo = cyclone(directory.path());
    let mut host = if priority > 0 { Host::of_root().expect("root") } else { Host::new() };
    let bench = std::env::current_exe().unwrap().display().to_string();
    host.start_program("datagrams", &bench, &["datagrams"]);
    host.start_program("echo", &echo, &[]);
    let priority = format!("realtime_priority:={priority}");
    let servo = host.start("servo", &["servo", "--ros-args", "-p", "update_rate:=500", "-p", &priority]);
    wait_for_line(servo, "waiting for joint states");
    let load = || std::fs::read_to_string("/proc/loadavg").unwrap().trim_end().to_owned();
    println!("{times} of each, in turn; {priority}; load of the machine before: {}\n", load());
    let mut peer = host.command("timeout");
    let output = peer.args(["600", &bench, "peer", &times.to_string()]).output().unwrap();
    assert_success(&output);
    print!("{}", String::from_utf8_lossy(&output.stdout));
    println!("\nload of the machine after: {}", load());
}

/// Builds the echo in C in this folder.
fn cyclone(folder: &Path) -> String {
    let sources = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/benches/wire");
    let script = format!(
        "idlc -l c {sources}/joint_state.idl && cc -O2 -I. -o echo {sources}/echo.c joint_state.c -lddsc"
    );
    let built = Command::new("sh").args(["-c", &script]).current_dir(folder).output().unwrap();
    assert_success(&built);
    folder.join("echo").display().to_string()
}

fn echo_datagrams() {
    let socket = UdpSocket::bind(ECHO).unwrap();
    let mut datagram = [0; 2048];
    loop {
        let (length, from) = socket.recv_from(&mut datagram).unwrap();
        socket.send_to(&datagram[..length], from).unwrap();
    }
}

fn now() -> Duration {
    let time = clock_gettime(ClockId::Monotonic);
    Duration::new(time.tv_sec.unsigned_abs(), u32::try_from(time.tv_nsec).unwrap())
}

/// The robot, and the publisher of goals.
struct Peer {
    states: Publisher<JointState>,
    commands: Subscription<Float64MultiArray>,
    /// The inputs of the servo in each cycle.
    events: Subscription<UInt8MultiArray>,
    goals: Publisher<PoseStamped>,
    ping: Publisher<JointState>,
    pong: Subscription<JointState>,
    state: JointState,
    moved: Duration,
    random: u64,
}

impl Peer {
    /// Waits up to 8 ms, so that nothing synchronizes with the servo's cycle. During this time the arm moves, and its state is
    /// stamped.
    fn pause(&mut self) {
        self.random = self.random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
        // The sleep of Tokio has a resolution of a millisecond, and would synchronize.
        std::thread::sleep(Duration::from_micros(2000 + (self.random >> 33) % 6000));
        if let Some(command) = self.commands.newest().message {
            self.state.velocity = command.data;
        }
        let passed = (now() - std::mem::replace(&mut self.moved, now())).as_secs_f64();
        for (position, speed) in self.state.position.iter_mut().zip(&self.state.velocity) {
            *position += passed * speed;
        }
        self.state.header.stamp = Time::now();
    }

    /// Returns the time from `sent` to the wake-up of the first cycle whose record satisfies `knew`, and the time from this wake-up
    /// to the cycle's command.
    async fn command(&self, sent: Duration, knew: impl Fn(&Recorded) -> bool) -> (Duration, Duration) {
        let mut commands = Vec::new();
        loop {
            tokio::select! {
                _ = self.commands.next() => commands.push(now()),
                record = self.events.next() => {
                    let cycles = CycleRecord::read_all(&record.data).unwrap();
                    let mut cycles = cycles.iter();
                    let knows = |record: &&CycleRecord| record.output.is_some() && record.events.iter().any(&knew);
                    if let Some(record) = cycles.find(knows) {
                        // The command is sent just after its cycle, the record later.
                        let came = commands.iter().find(|came| **came > record.now).copied();
                        let came = match came {
                            Some(came) => came,
                            None => {
                                self.commands.next().await;
                                now()
                            }
                        };
                        return (record.now.saturating_sub(sent), came.saturating_sub(record.now));
                    }
                }
            }
        }
    }

    async fn echo(&self) -> Duration {
        let sent = now();
        self.ping.publish(self.state.clone());
        while self.pong.next().await.header.stamp != self.state.header.stamp {}
        now() - sent
    }
}

fn peer_of(joints: usize) -> (Peer, Session) {
    let (mut node, session) = join("peer");
    let plant = Contract::builtin().unwrap().plant;
    let state = plant.topic::<JointState>("joint_states", Direction::Out).unwrap();
    let servo = Contract::builtin().unwrap().servo;
    let events = servo.topic::<UInt8MultiArray>("~/events", Direction::Out).unwrap().clone();
    let peer = Peer {
        states: node.publisher_as(state, "/joint_states").unwrap(),
        commands: commands(&mut node),
        events: node.subscription_as(&events, "/dq_servo/events").unwrap(),
        goals: goals(&mut node, "/"),
        ping: node.publisher_as(state, "/ping").unwrap(),
        pong: node.subscription_as(state, "/pong").unwrap(),
        state: JointState {
            name: (1..=joints).map(|i| format!("joint{i}")).collect(),
            position: vec![0.3, -1.0, 0.0, 0.4, 1.4, 0.1],
            velocity: vec![0.0; joints],
            ..JointState::default()
        },
        moved: now(),
        random: 1,
    };
    // The node lives as long as the process.
    std::mem::forget(node);
    (peer, session)
}

async fn peer(times: usize) {
    let (mut peer, _session) = peer_of(6);
    for publisher in [&peer.states, &peer.ping] {
        publisher.wait_for_readers(Duration::from_secs(20)).await.unwrap();
    }
    peer.goals.wait_for_readers(Duration::from_secs(20)).await.unwrap();
    let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
    socket.connect(ECHO).unwrap();
    // Commands begin with the first goal.
    for _ in 0..200 {
        peer.pause();
        peer.states.publish(peer.state.clone());
    }
    peer.goals.publish(goal(GOALS[1]));
    peer.echo().await;
    let [mut states, mut goals] = [(); 2].map(|()| Split::default());
    let [mut echoes, mut datagrams] = [(); 2].map(|()| Vec::new());
    for i in 0..times {
        peer.pause();
        let (sent, at) = (now(), peer.state.position.clone());
        peer.states.publish(peer.state.clone());
        let is_it =
            |event: &Recorded| matches!(event, Recorded::JointState { positions, .. } if **positions == *at);
        states.add(peer.command(sent, is_it).await);
        peer.pause();
        peer.states.publish(peer.state.clone());
        peer.random = peer.random.wrapping_add(i as u64);
        std::thread::sleep(Duration::from_micros((peer.random >> 20) % 2000));
        let sent = now();
        peer.goals.publish(goal(GOALS[i % 2]));
        goals.add(peer.command(sent, |event| matches!(event, Recorded::Goal(_))).await);
        peer.pause();
        peer.states.publish(peer.state.clone());
        echoes.push(peer.echo().await);
        let sent = now();
        let mut datagram = [0; 512];
        socket.send(&datagram[..320]).unwrap();
        socket.recv(&mut datagram).unwrap();
        datagrams.push(now() - sent);
    }
    println!("| | median [µs] | 99 % [µs] |\n|---|---|---|");
    states.print("joint state");
    goals.print("goal");
    print("round trip by Cyclone in C", echoes);
    print("round trip of a datagram of 320 bytes", datagrams);
}

/// Latencies, split into their parts.
#[derive(Default)]
struct Split {
    whole: Vec<Duration>,
    until_woken: Vec<Duration>,
    from_there: Vec<Duration>,
}

impl Split {
    fn add(&mut self, (until_woken, from_there): (Duration, Duration)) {
        self.whole.push(until_woken + from_there);
        self.until_woken.push(until_woken);
        self.from_there.push(from_there);
    }

    fn print(self, what: &str) {
        let mean =
            self.until_woken.iter().map(Duration::as_secs_f64).sum::<f64>() / self.until_woken.len() as f64;
        let transit = 1e6 * (mean - 0.5 / RATE);
        print(&format!("{what} → command"), self.whole);
        print("… until the cycle wakes that has it", self.until_woken);
        println!(
            "| … of that on the way, the rest (half a period) waits for the tick | {transit:.0} (mean) | |"
        );
        print("… from that wake-up until the command is at the peer", self.from_there);
    }
}

fn print(what: &str, mut times: Vec<Duration>) {
    times.sort_unstable();
    let at = |part: f64| times[((times.len() - 1) as f64 * part).round() as usize].as_secs_f64() * 1e6;
    println!("| {what} | {:.0} | {:.0} |", at(0.5), at(0.99));
}
