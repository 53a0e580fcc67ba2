//! A rig for goals that move: streams of goals on paths, and how the tool follows them.

use crate::reference::{parameters, puma};
use crate::rig::{PERIOD, Rig, reading};
use dq_algebra::UnitDualQuaternion;
use dq_config::ServoParameters;
use dq_core::servo::State;
use dq_kinematics::control::Law;
use nalgebra::{UnitQuaternion, Vector3};
use std::time::Duration;

/// The time of the first stamps \[ns\]. The clock of the stamps is not the servo's clock.
pub(super) const EPOCH: i64 = 1_795_242_920_000_000_000;

/// A generator of pseudorandom numbers from −1 to 1. The numbers are the same in each run.
pub(super) struct Random(pub(super) u64);

impl Random {
    /// Creates a generator with the seed `seed`. Discards the first eight numbers, so that neighboring seeds give different numbers.
    fn of(seed: u64) -> Self {
        let mut random = Self(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15));
        for _ in 0..8 {
            random.next();
        }
        random
    }

    pub(super) fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }

    pub(super) fn vector(&mut self) -> Vector3<f64> {
        Vector3::new(self.next(), self.next(), self.next())
    }
}

/// A path: a function that returns the pose of a goal from its start pose, its speed [m/s], and the time \[s\].
pub(super) type Path = fn(&UnitDualQuaternion, f64, f64) -> UnitDualQuaternion;

pub(super) fn moved(start: &UnitDualQuaternion, by: Vector3<f64>) -> UnitDualQuaternion {
    UnitDualQuaternion::from_parts(UnitQuaternion::identity(), by) * *start
}

/// Returns the start pose moved along y for `time` \[s\] at `speed` \[m/s\].
pub(super) fn line(start: &UnitDualQuaternion, speed: f64, time: f64) -> UnitDualQuaternion {
    moved(start, Vector3::new(0.0, speed * time, 0.0))
}

pub(super) const RADIUS: f64 = 0.1;

pub(super) fn circle(start: &UnitDualQuaternion, speed: f64, time: f64) -> UnitDualQuaternion {
    let (sin, cos) = (speed * time / RADIUS).sin_cos();
    moved(start, RADIUS * Vector3::new(0.0, sin, 1.0 - cos))
}

/// Returns the parameters and joint positions of an arm whose tool points down. The tool is 0.45 m in front of the base, at `y`
/// \[m\] to the side.
pub(super) fn start_of(y: f64) -> (ServoParameters, Vec<f64>) {
    let parameters = parameters();
    let mut rig = Rig::new();
    let down = UnitQuaternion::from_scaled_axis(Vector3::new(std::f64::consts::PI - 0.3, 0.0, 0.0));
    rig.goal_pose(&UnitDualQuaternion::from_parts(down, Vector3::new(0.45, y, 0.1)));
    rig.run_until(State::Settled, 60.0);
    rig.run(10.0);
    (parameters, rig.positions())
}

/// A stream of goals on a path.
#[derive(Clone, Copy)]
pub(super) struct Stream {
    pub(super) path: Path,
    pub(super) speed: f64,
    pub(super) rate: f64,
    pub(super) seconds: f64,
    /// Whether the stream resembles a real stream: uneven intervals of sending and receiving, and noisy poses.
    pub(super) real: bool,
    pub(super) stamped: bool,
    /// The seed of the uneven intervals and of the measurement noise.
    pub(super) seed: u64,
}

/// A rig for goals that move, with a record of the tool's motion. For each cycle, the record contains the tool's offset from the goal
/// and the tool's position \[m\].
pub(super) struct Follow {
    pub(super) rig: Rig,
    pub(super) start: UnitDualQuaternion,
    pub(super) begin: Duration,
    pub(super) errors: Vec<Vector3<f64>>,
    pub(super) points: Vec<Vector3<f64>>,
    /// The bit patterns of all commanded speeds so far. Tests use them to check that two runs are exactly equal.
    pub(super) commands: Vec<u64>,
}

impl Follow {
    pub(super) fn begin(arm: &(ServoParameters, Vec<f64>), feed_forward: bool) -> Self {
        let mut parameters = arm.0.clone();
        parameters.settings.feed_forward = feed_forward;
        parameters.settings.controller.set_gains(Law::Logc, [4.0; 2]);
        let mut rig = Rig::of(parameters, arm.1.clone());
        rig.run(0.02);
        let (start, begin) = (rig.servo.pose().unwrap(), rig.now);
        Self { rig, start, begin, errors: Vec::new(), points: Vec::new(), commands: Vec::new() }
    }

    pub(super) fn send(&mut self, goal: &UnitDualQuaternion, stamp: i64) {
        self.rig.take_goal(&reading(goal, stamp)).unwrap();
    }

    pub(super) fn cycle(&mut self, goal: &UnitDualQuaternion) {
        self.rig.cycle();
        let tool = puma().forward_kinematics(&self.rig.positions()).unwrap();
        self.errors.push(tool.translation() - goal.translation());
        self.points.push(tool.translation());
        self.commands.extend(self.rig.command.iter().map(|speed| speed.to_bits()));
    }

    pub(super) fn time(&self) -> f64 {
        (self.rig.now - self.begin).as_secs_f64()
    }

    pub(super) fn run(&mut self, stream: &Stream) {
        let Stream { path, speed, rate, seconds, real, stamped, seed } = *stream;
        let mut random = Random::of(seed);
        let (mut due, mut number) = (Vec::new(), 0.0);
        while number / rate < seconds {
            // A message is sent up to a fifth of an interval early or late, and takes up to 4 ms.
            let (shift, delay) = (0.2 * random.next() / rate, 0.002 + 0.002 * random.next());
            let (taken, under_way) = if real { (number / rate + shift, delay) } else { (number / rate, 0.0) };
            let (point, turn) = (1e-4 * random.vector(), 5e-4 * random.vector());
            let noise = UnitDualQuaternion::from_parts(UnitQuaternion::from_scaled_axis(turn), point);
            let mut goal = path(&self.start, speed, taken.max(0.0));
            if real {
                goal *= noise;
            }
            due.push((taken.max(0.0) + under_way, EPOCH + (taken * 1e9) as i64, goal));
            number += 1.0;
        }
        due.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut due = due.into_iter().peekable();
        while self.time() < seconds {
            while let Some((_, stamp, goal)) = due.next_if(|(at, ..)| *at <= self.time()) {
                self.send(&goal, if stamped { stamp } else { 0 });
            }
            // The tool is now at the position that the next cycle measures.
            let goal = path(&self.start, speed, self.time() + 2.0 * PERIOD.as_secs_f64());
            self.cycle(&goal);
        }
    }

    /// Runs `cycles` cycles, and sends a goal every `every` cycles. The function `goal` takes the start pose of the tool and the number
    /// of the cycle, and returns the goal and its stamp \[ns\].
    pub(super) fn goals(
        arm: &(ServoParameters, Vec<f64>),
        feed_forward: bool,
        (cycles, every): (i64, i64),
        mut goal: impl FnMut(&UnitDualQuaternion, i64) -> (UnitDualQuaternion, i64),
    ) -> Self {
        let mut follow = Self::begin(arm, feed_forward);
        for cycle in 0..cycles {
            if cycle % every == 0 {
                let (goal, stamp) = goal(&follow.start, cycle);
                follow.send(&goal, stamp);
            }
            let start = follow.start;
            follow.cycle(&start);
        }
        follow
    }

    /// Runs until `until` \[s\]. Every 20 ms it calls `send` for a goal that moves along a line at `speed` [m/s].
    pub(super) fn along_line(
        &mut self,
        speed: f64,
        until: f64,
        mut send: impl FnMut(&mut Self, i64, &UnitDualQuaternion),
    ) {
        let mut sent = 0;
        while self.time() < until {
            while 0.02 * f64::from(sent) <= self.time() {
                let goal = line(&self.start, speed, 0.02 * f64::from(sent));
                send(self, i64::from(sent), &goal);
                sent += 1;
            }
            let goal = line(&self.start, speed, self.time());
            self.cycle(&goal);
        }
    }

    /// Returns the mean distance of the tool from the goal over the second half of the run \[mm\].
    pub(super) fn lag(&self) -> f64 {
        let half = &self.errors[self.errors.len() / 2..];
        1e3 * half.iter().map(Vector3::norm).sum::<f64>() / half.len() as f64
    }

    /// Returns the tool's velocities over the second half of the run [mm/s].
    pub(super) fn velocities(&self) -> Vec<Vector3<f64>> {
        let half = &self.points[self.points.len() / 2..];
        half.windows(2).map(|pair| 1e3 * (pair[1] - pair[0]) / PERIOD.as_secs_f64()).collect()
    }
}
