//! Tests of joint states that are late or rare, and commands that take effect late.

use crate::reference::puma;
use crate::rig::Rig;
use dq_core::servo::{Stall, State};
use dq_kinematics::control::Law;
use dq_plant::Realism;
use std::time::Duration;

const MS: Duration = Duration::from_millis(1);

/// A lower limit of joint 3 that keeps the arm from its goal \[rad\]: on the way there, the joint would go from 2.36 to 1.05 rad.
const LOWEST: f64 = 1.6;

#[test]
fn rule_18_position_limits_hold_with_late_states() {
    for (delay, stamped, command_delay) in
        [(20, true, 0), (50, true, 0), (20, false, 0), (50, false, 0), (0, true, 20), (20, true, 20)]
    {
        for law in [Law::Logc, Law::Diffc] {
            let mut rig = Rig::with(|settings| settings.limits.position.lower[2] = LOWEST);
            (rig.state_delay, rig.command_delay, rig.stamped) = (delay * MS, command_delay * MS, stamped);
            rig.set_law(law);
            rig.run(0.5);
            rig.goal("theta_desired");
            // The rig checks the limit, to 1 mrad, in every cycle.
            rig.run(6.0);
            let reached = rig.plants[0].positions()[2];
            assert!(reached < LOWEST + 0.1, "{law}, {delay} ms: {reached}");
        }
    }
}

#[test]
fn rule_18_position_limits_hold_for_an_arm_that_follows_with_a_lag() {
    for lag in [20, 50, 100, 200] {
        for law in [Law::Logc, Law::Diffc] {
            let mut rig = Rig::with(|settings| settings.limits.position.lower[2] = LOWEST);
            rig.plants[0].set_realism(Realism { velocity_time_constant: lag * MS, ..Realism::default() });
            rig.set_law(law);
            let beside: Vec<_> = rig.positions().iter().map(|angle| angle + 0.2).collect();
            rig.goal_pose(&puma().forward_kinematics(&beside).unwrap());
            // The servo needs this time to measure the latency.
            rig.run(3.0);
            rig.goal("theta_desired");
            let mut least = f64::INFINITY;
            for _ in 0..4000 {
                rig.cycle();
                least = least.min(rig.positions()[2]);
            }
            let latency = rig.servo.status().latency;
            assert!(
                (-0.1..5e-3).contains(&(LOWEST - least)),
                "{law}, {lag} ms: {least}, latency {latency:.4} s"
            );
        }
    }
}

/// Runs until the arm settles, which must happen within `seconds`. Returns how often joints change their direction meanwhile.
/// Changes at speeds below 0.05 rad/s do not count.
fn turns_to_the_goal(rig: &mut Rig, seconds: f64) -> usize {
    let (mut turns, end) = (0, rig.now + Duration::from_secs_f64(seconds));
    let mut last = [0.0; 6];
    while rig.state() != State::Settled {
        assert!(rig.now < end, "{} {:?}", rig.state(), rig.servo.status());
        rig.cycle();
        for (last, speed) in last.iter_mut().zip(&rig.command) {
            if speed.abs() > 0.05 {
                turns += usize::from(speed * *last < 0.0);
                *last = *speed;
            }
        }
    }
    turns
}

#[test]
fn rule_18_diffc_at_its_default_gain_neither_oscillates_nor_fails_to_arrive() {
    let late = |delay: u32, interval: u32, stamped: bool| {
        let mut rig = Rig::new();
        (rig.state_delay, rig.state_interval, rig.stamped) = (delay * MS, interval * MS, stamped);
        rig
    };
    let mut with_slow_commands = Rig::new();
    with_slow_commands.command_delay = 16 * MS;
    let slow = Rig::at_rate(50, |_| {});
    let benches = [
        ("16 ms", late(16, 0, true)),
        ("16 ms, not stamped", late(16, 0, false)),
        ("16 ms, in the commands", with_slow_commands),
        ("100 Hz", late(0, 10, true)),
        ("125 Hz", late(0, 8, true)),
        ("100 Hz, 10 ms", late(10, 10, true)),
        ("50 Hz cycle", slow),
    ];
    for (name, mut rig) in benches {
        rig.set_law(Law::Diffc);
        rig.run(0.5);
        rig.goal("theta_desired");
        let turns = turns_to_the_goal(&mut rig, 90.0);
        assert!(turns <= 12, "{name}: {turns} turns");
        assert!(rig.servo.status().gain_factor < 0.9, "{name}: {}", rig.servo.status().gain_factor);
        let figures = rig.servo.status().figures;
        assert!(figures.path_length < 1.6 * figures.straight_line, "{name}: {figures:?}");
        rig.run(1.0);
        assert_eq!(rig.state(), State::Settled, "{name}");
    }
}

#[test]
fn rule_18_the_gain_that_is_left_is_stable_from_no_delay_to_twice_what_is_assumed() {
    for delay in [0, 4, 12, 16] {
        let mut rig = Rig::with(|settings| settings.latency = Some(8 * MS));
        (rig.state_delay, rig.stamped) = (delay * MS, false);
        rig.set_law(Law::Diffc);
        rig.goal("theta_desired");
        let turns = turns_to_the_goal(&mut rig, 90.0);
        assert!(turns <= 12 && rig.servo.status().gain_factor < 0.9, "{delay} ms: {turns} turns");
    }
}

#[test]
fn rule_18_an_ideal_robot_limits_no_gain() {
    for law in [Law::Logc, Law::DoubleGeodesic, Law::Diffc] {
        let mut rig = Rig::new();
        rig.set_law(law);
        rig.goal("theta_desired");
        while rig.state() != State::Settled {
            rig.cycle();
            let status = rig.servo.status();
            assert!(status.gain_factor == 1.0 && status.latency < 1e-9, "{law}: {status:?}");
        }
    }
}

#[test]
fn rule_18_the_latency_is_found_by_the_motion_where_stamps_say_nothing() {
    for (state_delay, command_delay) in [(16, 0), (0, 16), (40, 20)] {
        let mut rig = Rig::new();
        (rig.state_delay, rig.command_delay, rig.stamped) = (state_delay * MS, command_delay * MS, false);
        rig.goal("theta_desired");
        rig.run(1.0);
        let expected = f64::from(state_delay + command_delay) * 1e-3;
        let latency = rig.servo.status().latency;
        assert!((latency - expected).abs() < 3e-3, "{latency} instead of {expected}");
    }
}

#[test]
fn rule_18_an_arm_that_oscillates_is_stopped_within_3_s_and_is_never_settled_meanwhile() {
    let mut rig = Rig::with(|settings| settings.latency = Some(MS / 10));
    rig.state_delay = 24 * MS;
    rig.set_law(Law::Diffc);
    rig.goal("theta_desired");
    let begin = rig.now;
    while rig.state() != State::Stalled {
        rig.cycle();
        assert!(rig.state() != State::Settled || rig.speed() < 0.1, "settled at {} rad/s", rig.speed());
        assert!(rig.now < begin + 3500 * MS);
    }
    assert_eq!(rig.servo.status().stall, Some(Stall::Oscillating));
    rig.run(0.5);
    assert_eq!((rig.state(), rig.speed()), (State::Stalled, 0.0));
    rig.change(|settings| settings.latency = None);
    rig.run_until(State::Settled, 90.0);
}

/// Returns the settling time of a motion \[s\]. The robot has the time constant `lag`, which the servo has already measured.
fn settling_time(law: Law, lag: Duration) -> f64 {
    let mut rig = Rig::new();
    rig.plants[0].set_realism(Realism { velocity_time_constant: lag, ..Realism::default() });
    rig.set_law(law);
    let beside = |rig: &Rig, angles: [f64; 6]| {
        let theta: Vec<_> = rig.positions().iter().zip(angles).map(|(angle, more)| angle + more).collect();
        puma().forward_kinematics(&theta).unwrap()
    };
    rig.goal_pose(&beside(&rig, [0.2; 6]));
    rig.run(3.0);
    rig.goal_pose(&beside(&rig, [-0.82, -0.45, 0.48, -0.12, -0.9, -0.1]));
    let began = rig.now;
    rig.cycle();
    rig.run_until(State::Settled, 30.0);
    (rig.now - began).as_secs_f64()
}

#[test]
fn rule_18_a_lag_slows_no_direction_that_is_slow_already() {
    for law in [Law::Diffc, Law::LogcTranspose, Law::DoubleGeodesicTranspose, Law::UnitQuaternionTranspose] {
        // At this lag, the servo leaves a tenth of the law's largest rate.
        let (without, with) = (settling_time(law, Duration::ZERO), settling_time(law, 85 * MS));
        assert!(with < 1.5 * without, "{law}: {without} s, {with} s");
    }
}
