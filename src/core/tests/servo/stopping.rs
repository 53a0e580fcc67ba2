//! A stop always stops the arm, whatever limit is changed during the motion.

use crate::rig::{PERIOD, Rig};
use dq_core::servo::State;
use dq_kinematics::control::Law;

/// Returns an arm in the fast part of its motion.
fn in_motion() -> Rig {
    let mut rig = Rig::new();
    rig.set_law(Law::Diffc);
    rig.goal("theta_desired");
    rig.run(0.25);
    assert!(rig.speed() > 1.0, "{}", rig.speed());
    rig
}

/// A cause for the arm to stand: its name, the function that causes it, and the state that follows.
type Reason = (&'static str, fn(&mut Rig), State);

const REASONS: [Reason; 4] = [
    ("pause", |rig| rig.pause(true), State::Paused),
    ("stop", |rig| rig.stop(), State::Holding),
    ("stale joint states", |rig| rig.connect(false), State::StaleState),
    ("a silent stream", |rig| rig.change(|settings| settings.goal_timeout = Some(PERIOD)), State::StaleGoal),
];

#[test]
fn rule_13_acceleration_and_velocity_lowered_in_motion_leave_the_stop_as_it_was() {
    for (reason, stop, state) in REASONS {
        for (acceleration, velocity) in [(1e-6, 5.0), (1e-6, 1e-6), (50.0, 1e-6)] {
            let mut rig = in_motion();
            rig.change(|settings| {
                settings.limits.joint_acceleration = vec![acceleration; 6];
                settings.limits.joint_deceleration = vec![acceleration; 6];
                settings.limits.joint_velocity = vec![velocity; 6];
            });
            stop(&mut rig);
            // The time to brake from 5 rad/s at 50 rad/s², after the timeout of the joint state.
            rig.run(0.21);
            let end = (rig.state(), rig.speed());
            assert_eq!(end, (state, 0.0), "{reason}, {acceleration} rad/s^2, {velocity} rad/s");
        }
    }
}

#[test]
fn rule_13_a_deceleration_that_is_never_given_stops_within_a_second() {
    let mut rig = Rig::with(|settings| {
        settings.limits.joint_acceleration = vec![2.0; 6];
        settings.limits.joint_deceleration = vec![1e-6; 6];
    });
    rig.goal("theta_desired");
    rig.run(1.0);
    assert!(rig.speed() > 0.3, "{}", rig.speed());
    rig.stop();
    rig.run(1.002);
    assert_eq!(rig.speed(), 0.0);
}

#[test]
fn rule_13_each_joint_stops_by_its_own_deceleration() {
    let mut rig = Rig::with(|settings| {
        settings.limits.joint_deceleration = vec![10.0, 20.0, 30.0, 40.0, 50.0, 60.0];
    });
    rig.set_law(Law::Diffc);
    rig.goal("theta_desired");
    rig.run(0.25);
    rig.pause(true);
    let before = rig.command.clone();
    rig.cycle();
    for (joint, (before, now)) in before.iter().zip(&rig.command).enumerate() {
        let step = 10.0 * (joint + 1) as f64 * PERIOD.as_secs_f64();
        assert!((before.abs() - now.abs() - step.min(before.abs())).abs() < 1e-12, "joint {}", joint + 1);
    }
}

#[test]
fn rule_13_a_joint_that_may_hardly_accelerate_does_not_hold_up_the_others() {
    let mut rig = in_motion();
    rig.change(|settings| settings.limits.joint_acceleration[0] = 1e-6);
    // The law still commands the arm, which must not pass its goal at its present speed.
    rig.run(1.1);
    assert!(rig.speed() < 0.1, "{:?}", rig.command);
}

#[test]
fn rule_13_a_velocity_limit_lowered_in_motion_is_reached_within_a_second() {
    for acceleration in [1e-6, 1.0, 50.0] {
        let mut rig = in_motion();
        rig.change(|settings| {
            settings.limits.joint_velocity = vec![0.05; 6];
            settings.limits.joint_acceleration = vec![acceleration; 6];
        });
        rig.run(0.2);
        assert!(rig.speed() <= 0.05, "{acceleration} rad/s^2: {}", rig.speed());
    }
}

#[test]
fn rule_13_a_tool_speed_lowered_in_motion_is_reached_within_a_second() {
    let mut rig = in_motion();
    rig.change(|settings| {
        settings.limits.linear_speed = 0.01;
        settings.limits.joint_acceleration = vec![1e-6; 6];
    });
    // The rig checks the limit from then on.
    rig.run(2.0);
}

#[test]
fn rule_13_a_position_limit_is_kept_with_the_deceleration_that_was_counted_on() {
    let mut rig = Rig::with(|settings| {
        settings.limits.position.lower[2] = 1.8;
        settings.limits.position.margin = 0.0;
    });
    rig.set_law(Law::Diffc);
    rig.goal("theta_desired");
    while rig.plants[0].positions()[2] > 2.0 {
        rig.cycle();
    }
    // At 5 rad/s², the least deceleration that the joint's velocity limit demands, the joint could not stop in time.
    let speed = rig.command[2];
    assert!(speed * speed / (2.0 * 5.0) > 0.2, "{speed}");
    rig.change(|settings| {
        settings.limits.joint_acceleration = vec![1e-6; 6];
        settings.limits.joint_deceleration = vec![1e-6; 6];
    });
    rig.run(5.0);
    assert!(rig.plants[0].positions()[2] >= 1.8 - 1e-6);
}
