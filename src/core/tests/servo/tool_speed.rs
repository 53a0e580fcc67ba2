//! Tests of rule 5: after a limit on the tool's speed is lowered, the tool slows down to the new limit within 1 s. If jerk is limited,
//! the tool may take 1.4 s.

use crate::reference::{parameters, puma};
use crate::sim::{Random, Sim};
use dq_kinematics::control::Law;

const FREE: [f64; 6] = [0.3, -1.0, 0.0, 0.4, 1.4, 0.1];

/// Returns an arm under these limits on jerk [rad/s³] and acceleration [rad/s²].
fn arm(random: &mut Random, jerk: f64, acceleration: f64) -> Sim {
    let mut parameters = parameters();
    let settings = &mut parameters.settings;
    settings.controller.law = random.pick(&[Law::Logc, Law::Diffc, Law::LogcPd]);
    settings.limits.joint_jerk.fill(jerk);
    settings.limits.joint_acceleration.fill(acceleration);
    settings.limits.joint_deceleration.fill(acceleration);
    Sim::new(&parameters, FREE.to_vec())
}

/// Returns the time for which the tool exceeds its speed limits after the limits were lowered \[s\].
fn too_fast_for(seed: u64, jerk: f64) -> f64 {
    let mut random = Random::new(seed);
    let acceleration = random.pick(&[50.0, 10.0, 3.0]);
    let mut sim = arm(&mut random, jerk, acceleration);
    sim.run(0.1);
    let wanted: Vec<f64> = FREE.iter().map(|angle| angle + random.between(-1.5, 1.5)).collect();
    let twist = [(); 3].map(|()| random.between(-0.5, 0.5));
    let jogs = random.is(0.5);
    if !jogs {
        // The servo rejects a goal beyond reach.
        let _ = sim.goal(1, &puma().forward_kinematics(&wanted).unwrap());
    }
    let mut lowered = None;
    let [until, linear, angular] =
        [(0.2, 1.2), (-3.0, -1.0), (-2.5, -0.5)].map(|(a, b)| random.between(a, b));
    let (begin, linear, angular) = (sim.time, 10f64.powf(linear), 10f64.powf(angular));
    let mut last = 0.0;
    while sim.time < begin + until + 3.0 {
        if sim.time >= begin + until && lowered.is_none() {
            sim.change(|settings| {
                (settings.limits.linear_speed, settings.limits.angular_speed) = (linear, angular);
            });
            lowered = Some(sim.time);
        }
        if jogs {
            sim.twist(1, twist, [0.0; 3], 0.0).unwrap();
        }
        sim.cycle();
        sim.truth.evaluate(&sim.q);
        let tool = sim.truth.tool_speed(&sim.command);
        // At the change from one limit to the other, joints under a limit on jerk exceed the limit for some milliseconds.
        let is_fast = tool.linear > 1.3 * linear + 2e-4 || tool.angular > 1.3 * angular + 2e-4;
        // Later, a twist may swing the arm through a singularity. This test does not judge such motions.
        if lowered.is_some_and(|at| sim.time > at + 1.43) && sim.servo.smallest_singular_value() < 0.05 {
            break;
        }
        if let Some(lowered) = lowered.filter(|_| is_fast) {
            last = sim.time - lowered;
        }
    }
    last
}

/// Returns the seeds at which the tool is too fast for longer than `longest` \[s\]. With each seed, returns the jerk limit [rad/s³] and
/// the time for which the tool is too fast \[s\].
fn too_late(seeds: u64, longest: f64, jerk: impl Fn(u64) -> f64) -> Vec<(u64, f64, f64)> {
    let all = (0..seeds).map(|seed| (seed, jerk(seed), too_fast_for(seed, jerk(seed))));
    all.filter(|(.., seconds)| *seconds > longest).collect()
}

#[test]
fn rule_5_a_limit_of_the_tool_that_is_lowered_is_reached_in_time() {
    assert_eq!(too_late(150, 1.02, |_| f64::INFINITY), []);
}

#[test]
fn rule_5_a_limit_of_the_tool_that_is_lowered_is_reached_in_time_under_a_limit_on_jerk() {
    let jerk = |seed| 10f64.powf(Random::new(1000 + seed).between(1.0, 4.5));
    assert_eq!(too_late(400, 1.42, jerk), []);
}
