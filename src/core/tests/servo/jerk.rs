//! Tests of rule 6 of the guide's safety page with limits on jerk. They check motions, stops, and joints that approach their position
//! limits.

use crate::rig::{PERIOD, Rig};
use dq_config::{ForArm, ServoParameters};
use dq_core::servo::State;
use dq_kinematics::control::Law;

/// Returns a rig with this limit on the jerk of each joint [rad/s³].
fn rig(jerk: f64) -> Rig {
    Rig::with(|settings| settings.limits.joint_jerk = vec![jerk; 6])
}

/// Returns the largest jerk of the commands of all joints during the next `seconds` [rad/s³].
fn largest_jerk(rig: &mut Rig, seconds: f64) -> f64 {
    let period = PERIOD.as_secs_f64();
    let (mut before, mut steps) = (rig.command.clone(), Vec::<f64>::new());
    let mut largest = 0.0_f64;
    for _ in 0..(seconds / period) as u32 {
        rig.cycle();
        let now: Vec<_> = rig.command.iter().zip(&before).map(|(now, before)| now - before).collect();
        let changes = now.iter().zip(&steps).map(|(now, before)| (now - before).abs());
        largest = changes.fold(largest, f64::max);
        (before, steps) = (rig.command.clone(), now);
    }
    largest / (period * period)
}

#[test]
fn rule_6_the_acceleration_changes_no_faster_than_the_jerk_and_a_stop_is_as_short_as_that_allows() {
    for (jerk, longest) in [(f64::INFINITY, 0.1), (5000.0, 0.11), (500.0, 0.3)] {
        let mut rig = rig(jerk);
        rig.set_law(Law::Diffc);
        rig.goal("theta_desired");
        let mut largest = largest_jerk(&mut rig, 0.3);
        assert!(rig.speed() > 1.0, "{}", rig.speed());
        rig.stop();
        let begun = rig.now;
        while rig.speed() > 0.0 {
            assert!((rig.now - begun).as_secs_f64() < longest, "{jerk} rad/s^3");
            largest = largest.max(largest_jerk(&mut rig, 0.02));
        }
        let is_limited = largest <= jerk * (1.0 + 1e-6);
        assert!(is_limited && (jerk > 1e4 || largest > 0.9 * jerk), "{largest} of {jerk} rad/s^3");
    }
}

#[test]
fn rule_6_goals_are_reached_under_a_limit_on_jerk() {
    for jerk in [500.0, 1000.0, 10_000.0] {
        for law in Law::ALL {
            let mut rig = rig(jerk);
            rig.set_law(law);
            rig.goal("theta_desired");
            rig.run_until(State::Settled, 40.0);
        }
    }
}

/// The servo takes into account that braking begins slowly under a limit on jerk. So no joint passes its position limit.
#[test]
fn rule_7_a_joint_stops_before_its_position_limit_under_a_limit_on_jerk() {
    for jerk in [200.0, 1000.0] {
        let mut rig = rig(jerk);
        let (start, mut beyond) = (rig.positions(), rig.positions());
        beyond[0] += 2.0;
        let limit = start[0] + 1.5;
        rig.change(|settings| {
            settings.limits.position.upper[0] = limit;
            settings.limits.joint_acceleration.fill(20.0);
            settings.limits.joint_deceleration.fill(20.0);
        });
        rig.goal_pose(&crate::reference::puma().forward_kinematics(&beyond).unwrap());
        let mut fastest = 0.0_f64;
        for _ in 0..2000 {
            rig.cycle();
            fastest = fastest.max(rig.command[0]);
        }
        let left = limit - rig.positions()[0];
        assert!(fastest > 1.0 && left > -1e-6 && left < 0.02, "{jerk}: {fastest} rad/s, {left} rad left");
    }
}

#[test]
fn a_limit_on_jerk_that_is_lowered_in_motion_holds_from_when_the_joint_stands() {
    let mut rig = rig(5000.0);
    rig.set_law(Law::Diffc);
    rig.goal("theta_desired");
    rig.run(0.25);
    rig.change(|settings| settings.limits.joint_jerk = vec![500.0; 6]);
    rig.stop();
    rig.run(0.11);
    assert_eq!(rig.speed(), 0.0, "what it counted on when it set off");
    rig.goal("theta_initial");
    assert!(largest_jerk(&mut rig, 0.3) <= 500.0 * (1.0 + 1e-6));
}

#[test]
fn the_arms_of_franka_come_with_the_jerks_of_their_maker() {
    let jerks = |arm| ServoParameters::for_arm(arm).unwrap().settings.limits.joint_jerk;
    assert_eq!(jerks("panda"), [7500.0, 3750.0, 5000.0, 6250.0, 7500.0, 10_000.0, 10_000.0]);
    assert_eq!(jerks("fr3"), [5000.0; 7]);
    assert_eq!(jerks("ur5e"), [f64::INFINITY; 6]);
}
