//! Tests of rule 18 of the guide's safety page: if the commands oscillate, the motion stalls within 3 s. This also holds if a stream of
//! noisy goals keeps restarting the servo's other monitors. If the law is stable, noisy goals do not stall the motion.

use super::follow::{Follow, Stream, circle, line, start_of};
use crate::reference::{parameters, pose, theta};
use crate::sim::{Random, Sim};
use dq_algebra::UnitDualQuaternion;
use dq_core::servo::{Stall, State};
use dq_kinematics::control::Law;
use nalgebra::Vector3;
use std::time::Duration;

/// A noisy stream of goals around one place.
#[derive(Clone, Copy)]
struct Noisy {
    /// The standard deviation of the noise of each coordinate \[m\].
    noise: f64,
    /// The rate of the goals \[Hz\]; 0: a single goal.
    rate: f64,
    seed: u64,
}

impl Noisy {
    /// Streams goals around `goal` for `seconds`. Returns the time after which the arm stalls \[s\]; `None` if it does not stall.
    fn stalls(&self, sim: &mut Sim, goal: &UnitDualQuaternion, seconds: f64) -> Option<f64> {
        let Self { noise, rate, seed } = *self;
        let mut random = Random::new(seed);
        let (begin, mut next) = (sim.time, sim.time);
        while sim.time < begin + seconds {
            if sim.time >= next {
                let off = noise * Vector3::new(random.gauss(), random.gauss(), random.gauss());
                let goal = UnitDualQuaternion::from_parts(goal.rotation(), goal.translation() + off);
                sim.goal(1, &goal).unwrap();
                next = if rate > 0.0 { next + 1.0 / rate } else { f64::INFINITY };
            }
            sim.cycle();
            if sim.state() == State::Stalled {
                assert_eq!(sim.servo.status().stall, Some(Stall::Oscillating));
                return Some(sim.time - begin);
            }
        }
        None
    }
}

/// Returns an arm whose law is too fast for the delays of its robot. The servo does not know these delays.
fn unstable() -> Sim {
    let mut parameters = parameters();
    parameters.settings.controller.set_gains(Law::Diffc, [1000.0; 2]);
    parameters.settings.controller.law = Law::Diffc;
    parameters.settings.latency = Some(Duration::from_micros(100));
    let mut sim = Sim::new(&parameters, theta("theta_initial"));
    (sim.command_delay, sim.state_delay, sim.stamped) = (0.04, 0.04, false);
    sim.run(0.1);
    sim
}

#[test]
fn rule_18_an_oscillation_is_seen_under_a_stream_that_shakes() {
    for noise in [0.0, 0.0005, 0.002, 0.005] {
        for rate in [0.0, 10.0, 30.0, 100.0] {
            for seed in 0..2 {
                let noisy = Noisy { noise, rate, seed };
                let seen = noisy.stalls(&mut unstable(), &pose("theta_third"), 15.0);
                assert!(seen.is_some_and(|seconds| seconds < 3.0), "{noise} m, {rate} Hz, {seed}: {seen:?}");
            }
        }
    }
}

#[test]
fn a_stream_that_shakes_does_not_stall_an_arm_whose_law_is_stable() {
    for (law, gain) in [(Law::Logc, 2.0), (Law::Logc, 8.0), (Law::Diffc, 185.0), (Law::DoubleGeodesic, 4.0)] {
        for noise in [0.0005, 0.005] {
            for (rate, delay) in
                [(10.0, 0.0), (30.0, 0.0), (100.0, 0.0), (10.0, 0.03), (30.0, 0.03), (100.0, 0.03)]
            {
                let mut parameters = parameters();
                parameters.settings.controller.set_gains(law, [gain; 2]);
                parameters.settings.controller.law = law;
                let mut sim = Sim::new(&parameters, theta("theta_initial"));
                (sim.command_delay, sim.state_delay) = (delay, delay);
                sim.run(0.1);
                let noisy = Noisy { noise, rate, seed: 3 };
                let stalled = noisy.stalls(&mut sim, &pose("theta_third"), 8.0);
                assert_eq!(stalled, None, "{law} {gain}: {noise} m, {rate} Hz, {delay} s");
            }
        }
    }
}

#[test]
fn a_stream_that_moves_and_shakes_does_not_stall_the_arm() {
    let arm = start_of(-0.3);
    for path in [line, circle] {
        for rate in [10.0, 50.0, 500.0] {
            for feed_forward in [false, true] {
                let mut follow = Follow::begin(&arm, feed_forward);
                let stream =
                    Stream { path, speed: 0.1, rate, seconds: 6.0, real: true, stamped: true, seed: 1 };
                follow.run(&stream);
                assert_eq!(follow.rig.state(), State::Tracking, "{rate} Hz, {feed_forward}");
            }
        }
    }
}
