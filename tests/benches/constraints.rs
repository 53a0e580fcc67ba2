//! What `constraints` does at joint limits: how many random reachable tasks settle with it and without, on the same ones:
//! `cargo bench --bench constraints -- 400`.

use dq_servo::config::{NodeParameters, ServoParameters, arm_file};
use dq_servo::control::Law;
use dq_servo::params::FileParameters;
use dq_servo::servo::{Event, GoalReading, JointReading, Reconfigure, Sent, Servo, State};
use dq_servo::space::{Body, Scene};
use std::sync::Arc;
use std::time::Duration;

const PERIOD: Duration = Duration::from_millis(5);
/// Cycles in which a task must settle, and stay so.
const HORIZON: usize = 2000;
const DWELL: usize = 100;
const GAIN: f64 = 2.0;

/// A multiplicative congruential generator (Lehmer 1951), from 0 to 1.
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 = self.0 * 48271 % 0x7fff_ffff;
        self.0 as f64 / f64::from(0x7fff_ffff)
    }
}

/// When the arm settles on its way from one configuration to the pose of another \[s\].
fn settled(parameters: &ServoParameters, from: &[f64], to: &[f64]) -> Option<f64> {
    let ServoParameters { arms, joints, goal_frame, settings, .. } = parameters.clone();
    let pose = arms.chain().forward_kinematics(to).unwrap();
    let names = joints[0].names().to_vec();
    let mut servo = Servo::new(arms, joints, &goal_frame, settings, PERIOD).unwrap();
    let (mut theta, mut now, mut since) = (from.to_vec(), Duration::ZERO, 0);
    let (t, r) = (pose.translation(), pose.rotation());
    let goal = GoalReading {
        position: t.into(),
        orientation_xyzw: [r.i, r.j, r.k, r.w],
        frame_id: "",
        stamp: 0,
        waited: Duration::ZERO,
        sent: Sent::default(),
    };
    for cycle in 0..HORIZON {
        now += PERIOD;
        let stamp_age = Some(Duration::ZERO);
        let reading =
            JointReading { names: &names, positions: &theta, velocities: &[], source: 0, stamp_age };
        servo.begin(now);
        servo.take(Event::JointState(0, reading)).unwrap();
        if cycle == 0 {
            servo.take(Event::Goal(goal)).unwrap();
        }
        let command = servo.step(now);
        theta.iter_mut().zip(command).for_each(|(angle, speed)| *angle += PERIOD.as_secs_f64() * speed);
        since = if servo.status().state == State::Settled { since + 1 } else { 0 };
        if since > DWELL {
            return Some(PERIOD.as_secs_f64() * (cycle - DWELL) as f64);
        }
    }
    None
}

/// The parameters of an arm under a law, with nothing to keep out of.
fn parameters(arm: &str, law: Law) -> ServoParameters {
    let (name, text) = arm_file(arm).unwrap();
    let given = FileParameters::read(text, name, "/dq_servo").unwrap().given;
    let (store, _) = ServoParameters::start("/dq_servo", given).unwrap();
    let mut parameters = ServoParameters::from_store(&store).unwrap();
    let settings = &mut parameters.settings;
    settings.controller = settings.controller.with_law(law, GAIN);
    settings.progress_timeout = None;
    settings.reconfigure = Reconfigure::Never;
    parameters
}

fn main() {
    let tasks: u32 = std::env::args().find_map(|word| word.parse().ok()).unwrap_or(100);
    println!(
        "| arm | law | off | on | only off | only on | time of both off, on (s) |\n|---|---|---|---|---|---|---|"
    );
    for arm in ["ur5e", "xarm6", "panda", "fr3", "iiwa14", "xarm7"] {
        for law in [Law::Logc, Law::DoubleGeodesic, Law::DiffcInverse] {
            let off = parameters(arm, law);
            let mut on = off.clone();
            let ranges: Vec<_> = on.settings.limits.position.ranges().collect();
            let nothing =
                Scene::new(Body { capsules: Vec::new() }, Vec::new(), &[on.arms.chain().clone()], &ranges);
            on.settings.scene = Some(Arc::new(nothing));
            let mut random = Random(1);
            let (mut counts, mut times) = ([[0_u32; 2]; 2], [0.0; 2]);
            for _ in 0..tasks {
                let mut place = || -> Vec<f64> {
                    let pi = std::f64::consts::PI;
                    let within = |(lower, upper): &(f64, f64)| {
                        let (lower, upper) = (lower.max(-pi) + 0.1, upper.min(pi) - 0.1);
                        lower + random.next() * (upper - lower)
                    };
                    ranges.iter().map(within).collect()
                };
                let (from, to) = (place(), place());
                let (without, with) = (settled(&off, &from, &to), settled(&on, &from, &to));
                counts[usize::from(without.is_some())][usize::from(with.is_some())] += 1;
                if let (Some(without), Some(with)) = (without, with) {
                    times = [times[0] + without, times[1] + with];
                }
            }
            let [[_, only_on], [only_off, both]] = counts;
            let percent = |count: u32| 100.0 * f64::from(count) / f64::from(tasks);
            let [without, with] = times.map(|time| time / f64::from(both.max(1)));
            println!(
                "| {arm} | {law} | {:.1} % | {:.1} % | {only_off} | {only_on} | {without:.2}, {with:.2} |",
                percent(both + only_off),
                percent(both + only_on)
            );
        }
    }
}
