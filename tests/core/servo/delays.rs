//! Joint states that are late or rare, and commands that take their time.

use crate::bench::Bench;
use dq_servo::control::Law;
use dq_servo::servo::{OneArm, Stall, State};
use std::time::Duration;

const MS: Duration = Duration::from_millis(1);

/// Joint 3 goes from 2.36 to 1.05 rad; here it may not.
const LOWEST: f64 = 1.6;

#[test]
fn rule_18_position_limits_hold_with_late_states() {
    for (delay, stamped, command_delay) in
        [(20, true, 0), (50, true, 0), (20, false, 0), (50, false, 0), (0, true, 20), (20, true, 20)]
    {
        for law in [Law::Logc, Law::Diffc] {
            let mut bench = Bench::with(|settings| settings.limits.position.lower[2] = LOWEST);
            (bench.state_delay, bench.command_delay, bench.stamped) =
                (delay * MS, command_delay * MS, stamped);
            bench.set_law(law);
            bench.run(0.5);
            bench.goal("theta_desired");
            // The bench checks the limit, to 1 mrad, in every cycle.
            bench.run(6.0);
            let reached = bench.plants[0].positions()[2];
            assert!(reached < LOWEST + 0.1, "{law}, {delay} ms: {reached}");
        }
    }
}

/// Turns of a joint's direction while it moves faster than 0.05 rad/s, from now to the goal.
fn turns_to_the_goal(bench: &mut Bench<OneArm>, seconds: f64) -> usize {
    let (mut turns, end) = (0, bench.now + Duration::from_secs_f64(seconds));
    let mut last = [0.0; 6];
    while bench.state() != State::Settled {
        assert!(bench.now < end, "{} {:?}", bench.state(), bench.servo.status());
        bench.cycle();
        for (last, speed) in last.iter_mut().zip(&bench.command) {
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
        let mut bench = Bench::new();
        (bench.state_delay, bench.state_interval, bench.stamped) = (delay * MS, interval * MS, stamped);
        bench
    };
    let mut with_slow_commands = Bench::new();
    with_slow_commands.command_delay = 16 * MS;
    let slow = Bench::at_rate(50, |_| {});
    let benches = [
        ("16 ms", late(16, 0, true)),
        ("16 ms, not stamped", late(16, 0, false)),
        ("16 ms, in the commands", with_slow_commands),
        ("100 Hz", late(0, 10, true)),
        ("125 Hz", late(0, 8, true)),
        ("100 Hz, 10 ms", late(10, 10, true)),
        ("50 Hz cycle", slow),
    ];
    for (name, mut bench) in benches {
        bench.set_law(Law::Diffc);
        bench.run(0.5);
        bench.goal("theta_desired");
        let turns = turns_to_the_goal(&mut bench, 90.0);
        assert!(turns <= 12, "{name}: {turns} turns");
        assert!(bench.servo.status().gain_factor < 0.9, "{name}: {}", bench.servo.status().gain_factor);
        let figures = bench.servo.status().figures;
        assert!(figures.path_length < 1.6 * figures.straight_line, "{name}: {figures:?}");
        bench.run(1.0);
        assert_eq!(bench.state(), State::Settled, "{name}");
    }
}

#[test]
fn rule_18_the_gain_that_is_left_is_stable_from_no_delay_to_twice_what_is_assumed() {
    for delay in [0, 4, 12, 16] {
        let mut bench = Bench::with(|settings| settings.latency = Some(8 * MS));
        (bench.state_delay, bench.stamped) = (delay * MS, false);
        bench.set_law(Law::Diffc);
        bench.goal("theta_desired");
        let turns = turns_to_the_goal(&mut bench, 90.0);
        assert!(turns <= 12 && bench.servo.status().gain_factor < 0.9, "{delay} ms: {turns} turns");
    }
}

#[test]
fn rule_18_an_ideal_robot_limits_no_gain() {
    for law in [Law::Logc, Law::DoubleGeodesic, Law::Diffc] {
        let mut bench = Bench::new();
        bench.set_law(law);
        bench.goal("theta_desired");
        while bench.state() != State::Settled {
            bench.cycle();
            let status = bench.servo.status();
            assert!(status.gain_factor == 1.0 && status.latency < 1e-9, "{law}: {status:?}");
        }
    }
}

#[test]
fn rule_18_the_latency_is_found_by_the_motion_where_stamps_say_nothing() {
    for (state_delay, command_delay) in [(16, 0), (0, 16), (40, 20)] {
        let mut bench = Bench::new();
        (bench.state_delay, bench.command_delay, bench.stamped) =
            (state_delay * MS, command_delay * MS, false);
        bench.goal("theta_desired");
        bench.run(1.0);
        let expected = f64::from(state_delay + command_delay) * 1e-3;
        let latency = bench.servo.status().latency;
        assert!((latency - expected).abs() < 3e-3, "{latency} instead of {expected}");
    }
}

#[test]
fn rule_18_an_arm_that_oscillates_is_stopped_within_3_s_and_is_never_settled_meanwhile() {
    let mut bench = Bench::with(|settings| settings.latency = Some(MS / 10));
    bench.state_delay = 24 * MS;
    bench.set_law(Law::Diffc);
    bench.goal("theta_desired");
    let begin = bench.now;
    while bench.state() != State::Stalled {
        bench.cycle();
        assert!(bench.state() != State::Settled || bench.speed() < 0.1, "settled at {} rad/s", bench.speed());
        assert!(bench.now < begin + 3500 * MS);
    }
    assert_eq!(bench.servo.status().stall, Some(Stall::Oscillating));
    bench.run(0.5);
    assert_eq!((bench.state(), bench.speed()), (State::Stalled, 0.0));
    bench.change(|settings| settings.latency = None);
    bench.run_until(State::Settled, 90.0);
}
