//! Tests of rule 7 of the guide's safety page: joint position limits.

use crate::rig::Rig;
use dq_core::servo::{PositionLimits, State};
use dq_kinematics::arm::JointKind;
use dq_kinematics::control::Law;

/// A lower limit of joint 3 that keeps the arm from the goal theta_desired \[rad\]: on the way there from theta_initial, the joint
/// would go from 2.36 to 1.05 rad.
const LOWEST: f64 = 1.6;

fn with_lowest(lowest: f64) -> Rig {
    Rig::with(|settings| settings.limits.position.lower[2] = lowest)
}

#[test]
fn rule_7_a_joint_slows_inside_its_margin_goes_no_further_than_its_limit_and_the_others_go_on() {
    // double_geodesic takes another path.
    for law in [Law::Logc, Law::Diffc] {
        let mut rig = with_lowest(LOWEST);
        rig.set_law(law);
        rig.goal("theta_desired");
        rig.run_until(State::JointLimit, 10.0);
        assert_eq!(rig.servo.status().joint_at_limit, Some(3), "{law}");
        let others = rig.command.iter().enumerate().filter(|(i, _)| *i != 2).map(|(_, speed)| speed.abs());
        assert!(others.sum::<f64>() > 0.05, "{law}: {:?}", rig.command);
        rig.run(2.0);
        let angle = rig.plants[0].positions()[2];
        assert!((LOWEST..LOWEST + 0.1).contains(&angle), "{law}: {angle}");
    }
}

#[test]
fn rule_7_started_outside_the_arm_does_not_snap_and_outward_is_forbidden() {
    // Joint 3 is outside its limit by 0.14 rad.
    let mut rig = with_lowest(2.5);
    let before = rig.positions();
    rig.run(1.0);
    assert_eq!((rig.state(), rig.positions()), (State::Holding, before));
    let start = rig.plants[0].positions()[2];
    rig.goal("theta_desired");
    for _ in 0..1000 {
        rig.cycle();
        // The law moves joint 3 downward.
        assert!(rig.command[2] >= 0.0 && rig.plants[0].positions()[2] >= start);
    }
    assert_eq!(rig.servo.status().joint_at_limit, Some(3));
}

#[test]
fn rule_7_started_outside_inward_is_allowed() {
    // Joint 3 is 0.36 rad above its upper limit; its position at the goal is within the limit.
    let mut rig = Rig::with(|settings| settings.limits.position.upper[2] = 2.0);
    rig.goal("theta_desired");
    rig.run_until(State::Settled, 30.0);
}

/// Moves to theta_desired with the tool's speed limited to 0.05 m/s. Joint `joint` is limited to within 0.2 rad of its start.
/// Returns the tool's largest speed [m/s].
fn fastest_beside_a_limit(law: Law, joint: usize) -> f64 {
    let mut rig = Rig::with(|settings| {
        settings.limits.linear_speed = 0.05;
        settings.progress_timeout = None;
        let start = crate::reference::theta("theta_initial")[joint];
        settings.limits.position.lower[joint] = start - 0.2;
        settings.limits.position.upper[joint] = start + 0.2;
    });
    rig.set_law(law);
    rig.goal("theta_desired");
    let (mut last, mut fastest) = (None, 0.0_f64);
    for _ in 0..6000 {
        rig.cycle();
        let point = rig.servo.pose().unwrap().translation();
        if let Some(last) = last.replace(point) {
            fastest = fastest.max((point - last).norm() / crate::rig::PERIOD.as_secs_f64());
        }
    }
    fastest
}

#[test]
fn rule_5_and_7_a_tool_keeps_its_speed_limit_beside_a_position_limit() {
    for law in [Law::Logc, Law::Diffc, Law::DoubleGeodesic] {
        for joint in 0..5 {
            let fastest = fastest_beside_a_limit(law, joint);
            assert!(fastest < 0.0505, "{law}, joint {}: {fastest} m/s", joint + 1);
        }
    }
}

#[test]
fn what_lies_beside_a_position_lies_inside_the_limits() {
    let (inf, margin) = (f64::INFINITY, 0.1);
    let limits = PositionLimits {
        lower: vec![-inf, -1.0, -1.0, -0.2, 0.0, 0.0],
        upper: vec![inf, 1.0, 1.0, 0.2, 0.1, 0.35],
        margin,
    };
    use JointKind::{Prismatic, Revolute};
    let kinds = [Revolute, Revolute, Revolute, Revolute, Revolute, Prismatic];
    let beside = limits.beside(&[2.0, 0.0, 0.8, 0.05, 0.05, 0.1], &kinds);
    let expected = [2.3, 0.3, 0.5, -0.025, 0.05, 0.2];
    for (beside, expected) in beside.iter().zip(expected) {
        assert!((beside - expected).abs() < 1e-12, "{beside} instead of {expected}");
    }
}

/// Returns how far joint 3 passes its limit \[rad\] if cycles are missed. Before each cycle, the servo misses the number of cycles
/// that `missed` returns.
fn past_its_limit(mut missed: impl FnMut(u32) -> u32) -> f64 {
    let mut past = 0.0_f64;
    for law in [Law::Diffc, Law::Logc] {
        let mut rig = with_lowest(LOWEST);
        rig.check_positions = false;
        rig.change(|settings| settings.progress_timeout = None);
        rig.set_law(law);
        // The arm settles first: the servo cannot foresee a load that begins while it brakes.
        for cycle in 0..200 {
            rig.cycle_late(missed(cycle));
        }
        for motion in 0..6 {
            rig.goal(["theta_desired", "theta_initial"][motion % 2]);
            for cycle in 0..600 {
                rig.cycle_late(missed(cycle));
                past = past.max(LOWEST - rig.plants[0].positions()[2]);
            }
        }
    }
    past
}

#[test]
fn rule_7_the_limits_hold_where_cycles_come_late() {
    for late in [5, 10, 20, 45] {
        for every in [1, 2, 7, 100] {
            let past = past_its_limit(|cycle| if cycle % every == 0 { late } else { 0 });
            assert_eq!(past, 0.0, "{late} cycles late each {every}");
        }
    }
    let mut random = 12345_u64;
    let past = past_its_limit(|_| {
        random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        let part = (random >> 33) as f64 / f64::from(1_u32 << 31);
        // Every fourth cycle is late, by 8 cycles on average.
        if random >> 33 & 3 == 0 { (-8.0 * (1.0 - part).ln()).min(45.0) as u32 } else { 0 }
    });
    assert_eq!(past, 0.0, "at random");
}

#[test]
fn rule_7_what_came_late_is_forgotten() {
    // Returns the position of joint 3 during a motion that begins `seconds` after a late cycle.
    let place = |late, seconds| {
        let mut rig = with_lowest(0.9);
        rig.set_law(Law::Diffc);
        rig.run(0.1);
        rig.cycle_late(late);
        rig.run(seconds);
        rig.goal("theta_desired");
        rig.run(0.3);
        rig.plants[0].positions()[2]
    };
    let slower = |seconds| place(45, seconds) - place(0, seconds);
    assert!(slower(0.5) > 0.005, "{}", slower(0.5));
    assert!(slower(4.1).abs() < 1e-6, "{}", slower(4.1));
}
