//! Tests of rule 3 of the guide's safety page. If a publisher sends the measured pose plus an offset as the goal, feed-forward makes the
//! arm hardly faster than the law alone. The tests vary the rate, the delay and the noise of the measured poses. They also vary the
//! goals that the publisher sends before the measured poses.

use crate::reference::parameters;
use crate::sim::{Random, Sim};
use dq_algebra::UnitDualQuaternion;
use dq_kinematics::control::Law;
use nalgebra::Vector3;

const START: [f64; 6] = [0.3, -1.0, 0.0, 0.4, 1.4, 0.1];

/// The goals that come before the goals from measured poses.
#[derive(Clone, Copy, PartialEq)]
enum Before {
    Nothing,
    /// The goal stands at the tool for 1 s.
    Stands,
    Leaps,
    /// The goal moves at 0.05 m/s for 1 s, independently of the tool.
    Moves,
}

/// A stream of goals that are measured poses with an offset.
#[derive(Clone, Copy)]
struct Camera {
    offset: Vector3<f64>,
    /// The rate of the goals \[Hz\].
    rate: f64,
    /// The age of a measured pose when it arrives as a goal \[s\].
    lag: f64,
    /// The largest random addition to `lag` \[s\].
    jitter: f64,
    /// The standard deviation of the noise of each coordinate \[m\].
    noise: f64,
    before: Before,
    seed: u64,
}

const CAMERA: Camera = Camera {
    offset: Vector3::new(0.0, 0.005, 0.003),
    rate: 30.0,
    lag: 0.05,
    jitter: 0.0,
    noise: 0.0,
    before: Before::Nothing,
    seed: 0,
};

fn moved(pose: &UnitDualQuaternion, by: Vector3<f64>) -> UnitDualQuaternion {
    UnitDualQuaternion::from_parts(pose.rotation(), pose.translation() + by)
}

impl Camera {
    /// Returns the goal at `time` \[s\] after the beginning of the stream. `poses` are the tool's poses so far, one per cycle.
    fn goal(&self, time: f64, poses: &[UnitDualQuaternion], random: &mut Random) -> UnitDualQuaternion {
        let Self { offset, lag, jitter, noise, before, .. } = *self;
        let aside = match before {
            Before::Leaps => Vector3::new(0.0, 0.02, 0.0),
            Before::Moves => Vector3::new(0.0, 0.0, 0.05 * time),
            Before::Nothing | Before::Stands => Vector3::zeros(),
        };
        if before != Before::Nothing && time < 1.0 {
            return moved(&poses[0], aside);
        }
        let cycles = ((lag + random.between(0.0, jitter)) / 0.002) as usize;
        let measured = poses[poses.len().saturating_sub(1 + cycles)];
        let noise = noise * Vector3::new(random.gauss(), random.gauss(), random.gauss());
        moved(&measured, offset + noise)
    }

    /// Returns the largest speed of the tool [m/s] while the goals are measured poses. Leaves out the first 0.3 s of these goals, or
    /// the first 0.5 s if other goals came before.
    fn fastest(&self, feed_forward: bool) -> f64 {
        let mut parameters = parameters();
        parameters.settings.feed_forward = feed_forward;
        parameters.settings.controller.law = Law::Logc;
        let mut sim = Sim::new(&parameters, START.to_vec());
        sim.run(0.3);
        let (mut random, mut poses) = (Random::new(self.seed), Vec::new());
        let (begin, mut next, mut fastest) = (sim.time, sim.time, 0.0_f64);
        let seconds = if self.before == Before::Nothing { 3.0 } else { 6.0 };
        while sim.time < begin + seconds {
            poses.push(sim.tool());
            if sim.time >= next {
                next += 1.0 / self.rate;
                sim.goal(1, &self.goal(sim.time - begin, &poses, &mut random)).unwrap();
            }
            sim.cycle();
            let speed = (sim.tool().translation() - poses.last().unwrap().translation()).norm() / sim.period;
            let settles = if self.before == Before::Nothing { 0.3 } else { 1.5 };
            if sim.time > begin + settles {
                fastest = fastest.max(speed);
            }
        }
        fastest
    }
}

/// Checks for each stream that the tool's largest speed with feed-forward exceeds the largest speed without it by at most 30 % plus
/// 10 mm/s.
fn are_no_faster(cameras: impl Iterator<Item = Camera>) {
    for camera in cameras {
        let Camera { offset, rate, lag, jitter, noise, seed, .. } = camera;
        let (fed, law) = (camera.fastest(true), camera.fastest(false));
        assert!(
            fed <= 1.3 * law + 0.01,
            "{offset:?} at {rate} Hz, {lag} s and up to {jitter} s old, noise {noise} m, seed {seed}: {fed} m/s, without {law}"
        );
    }
}

#[test]
fn measured_poses_of_any_rate_and_age_are_followed_no_faster() {
    let rates = [3.0, 7.0, 10.0, 13.0, 30.0, 61.0, 100.0, 250.0, 500.0];
    let ages = [0.0, 0.02, 0.05, 0.15, 0.25];
    let all = rates.iter().flat_map(|rate| ages.map(|lag| Camera { rate: *rate, lag, ..CAMERA }));
    are_no_faster(all);
    let old = [0.3, 0.35, 0.4, 0.5, 0.7, 1.0, 1.4];
    let offset = Vector3::new(0.0, 0.02, 0.01);
    are_no_faster(
        [10.0, 30.0].iter().flat_map(|rate| old.map(|lag| Camera { offset, rate: *rate, lag, ..CAMERA })),
    );
}

#[test]
fn measured_poses_with_noise_are_followed_no_faster() {
    for seed in 0..6 {
        let noises = [0.0005, 0.001, 0.002, 0.003, 0.005];
        let camera = Camera { seed, ..CAMERA };
        are_no_faster(
            [10.0, 30.0, 100.0]
                .iter()
                .flat_map(|rate| noises.map(|noise| Camera { rate: *rate, noise, ..camera })),
        );
    }
}

#[test]
fn measured_poses_that_come_unevenly_are_followed_no_faster() {
    for seed in 0..3 {
        for offset in [CAMERA.offset, 4.0 * CAMERA.offset] {
            let camera = Camera { offset, seed, ..CAMERA };
            are_no_faster(
                [10.0, 30.0, 100.0].iter().flat_map(|rate| {
                    [0.005, 0.02, 0.05].map(|jitter| Camera { rate: *rate, jitter, ..camera })
                }),
            );
        }
    }
}

#[test]
fn measured_poses_are_followed_no_faster_whatever_the_stream_was_before() {
    for before in [Before::Stands, Before::Leaps, Before::Moves] {
        for offset in [CAMERA.offset, 4.0 * CAMERA.offset] {
            let camera = Camera { offset, before, ..CAMERA };
            are_no_faster(
                [10.0, 30.0, 100.0]
                    .iter()
                    .flat_map(|rate| [0.0, 0.05, 0.3].map(|lag| Camera { rate: *rate, lag, ..camera })),
            );
        }
    }
}
