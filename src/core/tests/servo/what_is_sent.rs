//! Tests of the output after missed cycles, and of the output while an external force acts on the arm and the parameter `integral`
//! balances the force.

use crate::reference::{parameters, pose, puma, theta};
use crate::sim::{Random, Sim};
use dq_algebra::UnitDualQuaternion;
use dq_core::servo::{Contact, Reason, Settings, State};
use dq_kinematics::control::Law;
use nalgebra::{UnitQuaternion, Vector3};
use std::time::Duration;

/// A configuration of the arm that is away from singularities \[rad\].
const FREE: [f64; 6] = [0.3, -1.0, 0.0, 0.4, 1.4, 0.1];

fn sim_with(start: &[f64], change: impl FnOnce(&mut Settings)) -> Sim {
    let mut parameters = parameters();
    change(&mut parameters.settings);
    Sim::new(&parameters, start.to_vec())
}

/// Returns `pose`, moved by `by` \[m\].
fn moved(pose: &UnitDualQuaternion, by: [f64; 3]) -> UnitDualQuaternion {
    UnitDualQuaternion::from_parts(pose.rotation(), pose.translation() + Vector3::from(by))
}

#[test]
fn after_a_gap_the_command_begins_at_the_speed_of_the_robot_with_and_without_velocities() {
    for (with_velocities, interval) in [(true, 0.0), (true, 0.01), (false, 0.0), (false, 0.01)] {
        for missed in [0.11, 0.15, 0.2, 0.4, 0.8, 1.5] {
            let mut sim = sim_with(&theta("theta_initial"), |_| {});
            (sim.with_velocities, sim.state_interval) = (with_velocities, interval);
            sim.run(0.1);
            sim.goal(1, &pose("theta_desired")).unwrap();
            sim.run(0.7);
            sim.advance(missed, true);
            let mut before = sim.v.clone();
            for cycle in 0..100 {
                let sent = sim.output.clone().unwrap_or_else(|| vec![0.0; 6]);
                let step =
                    sent.iter().zip(&before).map(|(now, before)| (now - before).abs()).fold(0.0, f64::max);
                assert!(
                    step <= 50.0 * 0.002 + 1e-6,
                    "{with_velocities} {interval} {missed} s, {cycle}: {step} rad/s"
                );
                before = sent;
                sim.cycle();
            }
            assert!(sim.output.is_some(), "{with_velocities} {interval} {missed} s: it goes on");
        }
    }
}

#[test]
fn after_a_gap_nothing_is_sent_before_a_joint_state_that_was_measured_after_it() {
    let mut sim = sim_with(&theta("theta_initial"), |_| {});
    sim.run(0.1);
    sim.goal(1, &pose("theta_desired")).unwrap();
    sim.run(0.7);
    // After a gap, the cycle runs before the threads of DDS do, so its first joint states are from before the gap.
    sim.state_delay = 0.05;
    sim.run(0.06);
    sim.advance(0.4, false);
    for cycle in 0..20 {
        assert_eq!(sim.output, None, "{cycle}");
        assert_eq!(sim.state(), State::StaleState);
        sim.cycle();
    }
    sim.run(0.2);
    assert!(sim.output.is_some() && sim.state().is_driven());
}

#[test]
fn an_arm_that_was_switched_off_where_it_stood_does_not_leap_by_the_integral() {
    for integral in [2.0, 5.0, 10.0] {
        for push in [0.004, 0.03, 0.1] {
            let mut sim = sim_with(&FREE, |settings| settings.integral = integral);
            sim.run(0.1);
            let goal = moved(&sim.tool(), [0.0, 0.05, 0.0]);
            sim.goal(1, &goal).unwrap();
            sim.run(4.0);
            sim.obeys = false;
            sim.push[1] = -push;
            sim.run(5.0);
            (sim.obeys, sim.push[1]) = (true, 0.0);
            let mut fastest = 0.0_f64;
            for _ in 0..1000 {
                sim.cycle();
                fastest = fastest.max(sim.robot_speed());
            }
            assert!(fastest <= 0.06, "{integral} pushed at {push} rad/s: {fastest} rad/s on release");
        }
    }
}

/// Turns the tool by a twist at `speed` [rad/s] for `seconds`. Returns the time at which the arm was first commanded to stand.
fn turn(sim: &mut Sim, speed: f64, seconds: f64) -> Option<f64> {
    let end = sim.time + seconds;
    let mut stood = None;
    while sim.time < end {
        let _ = sim.twist(1, [0.0; 3], [0.0, 0.0, speed], 0.0);
        sim.cycle();
        if sim.speed() < 1e-3 {
            stood.get_or_insert(sim.time);
        }
    }
    stood
}

#[test]
fn rule_17_a_joint_that_sticks_in_slow_motion_is_seen_once_it_should_have_gone_2_mrad() {
    for speed in [0.02, 0.05, 0.08, 0.12, 0.3] {
        let mut sim = sim_with(&FREE, |settings| {
            settings.controller.law = Law::Logc;
            settings.progress_timeout = None;
        });
        sim.run(0.2);
        turn(&mut sim, speed, 2.0);
        let command = sim.command.clone();
        let fastest = (0..6).max_by(|a, b| command[*a].abs().total_cmp(&command[*b].abs())).unwrap();
        sim.wires = Box::new(move |_, command| command[fastest] = 0.0);
        let stuck = sim.time;
        let seen = turn(&mut sim, speed, 8.0).map(|time| time - stuck);
        let most = 0.17 + 2.0 * 2e-3 / command[fastest].abs();
        assert!(seen.is_some_and(|seen| seen <= most), "{speed} rad/s: {seen:?} instead of {most} s");
    }
}

/// Events that may happen to an arm while the parameter `integral` balances an external force.
const EVENTS: [&str; 18] = [
    "goal",
    "pause",
    "resume",
    "stop",
    "jump",
    "away",
    "back",
    "rival of commands",
    "rival gone",
    "second driver",
    "tool",
    "integral off",
    "integral on",
    "stick",
    "speed limit",
    "blocked",
    "free",
    "scaling",
];

fn happens(what: &str, sim: &mut Sim, random: &mut Random) {
    let now = sim.now();
    sim.servo.begin(now);
    match what {
        "goal" | "free" => {
            sim.obeys = true;
            let wanted: Vec<f64> = FREE.iter().map(|angle| angle + random.between(-0.7, 0.7)).collect();
            let by = 100 + (sim.time * 500.0) as u32;
            let _ = sim.goal(by, &puma().forward_kinematics(&wanted).unwrap());
        }
        "pause" => sim.servo.pause(true),
        "resume" => sim.servo.pause(false),
        "stop" => sim.servo.stop(),
        "jump" => sim.q[random.below(6)] += 0.8,
        "away" => sim.connected = false,
        "back" => sim.connected = true,
        "rival of commands" => sim.servo.set_rival(0, true),
        "rival gone" => sim.servo.set_rival(0, false),
        "second driver" => sim.other_states(7),
        "tool" => {
            let offset = Vector3::new(0.0, 0.0, random.between(0.0, 0.1));
            sim.change(|settings| {
                settings.tool_offset = UnitDualQuaternion::from_parts(UnitQuaternion::identity(), offset);
            });
        }
        "integral off" => sim.change(|settings| settings.integral = 0.0),
        "integral on" => sim.change(|settings| settings.integral = 5.0),
        "stick" => drop(sim.twist(1, [0.1, 0.1, 0.0], [0.0; 3], 0.0)),
        "speed limit" => {
            let limit = random.between(0.3, 3.0);
            sim.change(|settings| settings.limits.joint_velocity.fill(limit));
        }
        "blocked" => sim.obeys = false,
        _ => sim.servo.set_speed_scaling(0, random.between(0.0, 1.0)),
    }
}

/// Applies random events to an arm on which external forces act. Checks the acceleration and the jerk of the output.
fn keeps_acceleration_and_jerk(seed: u64) {
    let mut random = Random::new(seed);
    let jerk = if random.is(0.5) { 10_f64.powf(random.between(2.5, 4.0)) } else { f64::INFINITY };
    let mut sim = sim_with(&FREE, |settings| {
        settings.integral = random.pick(&[2.0, 5.0, 10.0]);
        settings.controller.law = Law::Logc;
        settings.limits.joint_jerk.fill(jerk);
    });
    for pull in &mut sim.pull {
        *pull = if random.is(0.5) { random.between(-0.15, 0.15) } else { 0.0 };
    }
    sim.run(0.3);
    let (mut before, mut steps, mut what, mut next) = (vec![0.0; 6], vec![0.0; 6], "begin", sim.time);
    for _ in 0..6000 {
        if sim.time >= next {
            next = sim.time + random.between(0.1, 1.5);
            what = random.pick(&EVENTS);
            happens(what, &mut sim, &mut random);
        }
        let came = |sim: &Sim| sim.servo.arm_figures().any(|arm| arm.came);
        let had_come = came(&sim);
        sim.cycle();
        let sent = sim.output.clone().unwrap_or_else(|| vec![0.0; 6]);
        for joint in 0..6 {
            let step = sent[joint] - before[joint];
            let change = (step - steps[joint]).abs();
            steps[joint] = step;
            if had_come || came(&sim) {
                continue;
            }
            assert!(step.abs() <= 50.0 * 0.002 + 1e-7, "seed {seed} after {what}: {} rad/s²", step / 0.002);
            let most = jerk.max(50.0 / 0.2) * 0.002 * 0.002 + 1e-9;
            assert!(
                change <= most * (1.0 + 1e-6),
                "seed {seed} after {what}: {} times the jerk",
                change / most
            );
        }
        before = sent;
    }
}

#[test]
fn what_is_sent_with_the_integral_keeps_acceleration_and_jerk() {
    let count = std::env::var("PROPTEST_CASES").ok().and_then(|count| count.parse().ok()).unwrap_or(60);
    (0..count).for_each(keeps_acceleration_and_jerk);
}

#[test]
fn an_arm_that_sinks_faster_than_it_is_tried_arrives_after_any_interruption() {
    for pull in [0.06, 0.1, 0.2] {
        for interruption in ["locked", "one stale state", "locked for long"] {
            let mut sim = sim_with(&FREE, |settings| settings.integral = 5.0);
            sim.pull[1] = pull;
            sim.run(0.1);
            let goal = moved(&sim.tool(), [0.0, 0.05, 0.1]);
            sim.goal(1, &goal).unwrap();
            sim.run(1.0);
            match interruption {
                "one stale state" => {
                    sim.connected = false;
                    sim.run(0.15);
                    sim.connected = true;
                }
                _ => {
                    sim.obeys = false;
                    sim.run(if interruption == "locked" { 0.1 } else { 0.5 });
                    sim.obeys = true;
                }
            }
            sim.run(2.0);
            sim.goal(2, &goal).unwrap();
            sim.run(8.0);
            let status = sim.servo.status();
            assert_eq!(status.state, State::Settled, "{pull} rad/s, {interruption}: {:?}", status.reason);
        }
    }
}

#[test]
fn a_load_that_changes_at_rest_is_no_disobedience() {
    for (pull, integral) in [(0.05, 5.0), (0.15, 5.0), (0.3, 5.0), (-0.15, 2.0), (0.15, 10.0), (0.05, 0.0)] {
        let mut sim = sim_with(&FREE, |settings| {
            settings.integral = integral;
            // A displacement by the load decays under the law, whose gain is 1 1/s.
            settings.progress_timeout = Some(Duration::from_secs(10));
        });
        sim.run(0.1);
        let goal = moved(&sim.tool(), [0.0, 0.05, 0.0]);
        sim.goal(1, &goal).unwrap();
        sim.run(4.0);
        assert_eq!(sim.state(), State::Settled);
        for load in [pull, 0.0] {
            sim.pull[1] = load;
            sim.run(8.0);
            let status = sim.servo.status();
            assert!(
                !matches!(status.reason, Some(Reason::Revoked(_))),
                "{pull} {load} {integral}: {:?}",
                status.reason
            );
            assert!(
                integral == 0.0 || status.state == State::Settled,
                "{pull} {load} {integral}: {:?}",
                (status.state, &status.reason)
            );
        }
    }
}

#[test]
fn an_arm_that_came_to_rest_is_not_judged_by_what_seemed_to_pull_at_it_in_motion() {
    for (lag, delay) in [(0.0, 0.004), (0.02, 0.01), (0.085, 0.0), (0.2, 0.0)] {
        for stamped in [true, false] {
            let mut sim = sim_with(&theta("theta_initial"), |_| {});
            (sim.lag, sim.command_delay, sim.state_delay, sim.stamped) = (lag, delay, delay, stamped);
            sim.run(0.1);
            sim.goal(1, &pose("theta_desired")).unwrap();
            for cycle in 0..3000 {
                if cycle % 500 == 400 {
                    sim.servo.pause(true);
                }
                if cycle % 500 == 0 {
                    sim.servo.pause(false);
                }
                sim.cycle();
                let contact = sim.servo.arm_figures().next().unwrap().contact;
                let is_lost = matches!(contact, Contact::Lost | Contact::Resting);
                assert!(
                    !is_lost,
                    "{lag} s, {delay} s, stamped {stamped}: {cycle} {:?}",
                    sim.servo.status().reason
                );
            }
        }
    }
}
