//! Tests of rules 8 and 9 of the guide's safety page, at singularities. If a law stands still at a singularity, the servo leads the arm
//! out of the singularity. If the motion stalls, the status gives the right reason.

use crate::reference::puma;
use crate::rig::Rig;
use dq_algebra::UnitDualQuaternion;
use dq_core::servo::{BeyondReach, Stall, State};
use dq_kinematics::arm::{ArmState, Chain, Convention, DhRow, Joint, JointKind};
use dq_kinematics::control::{Aim, Controller, Law, Map};
use dq_plant::Plant;
use nalgebra::{Unit, Vector3, Vector6};
use std::time::Duration;

fn state(theta: &[f64]) -> ArmState {
    let mut state = ArmState::new(&puma());
    puma().evaluate(theta, &mut state).unwrap();
    state
}

/// Returns the angle of joint 3 between `from` and `to` at which the wrist is nearest to the shoulder (`sign` 1) or farthest from
/// it (−1).
fn elbow(sign: f64, from: f64, to: f64) -> f64 {
    let length = |angle: f64| sign * state(&[0.7, 1.0, angle, 0.5, -0.7, 2.0]).tool_point().norm();
    let (mut low, mut high) = (from, to);
    for _ in 0..200 {
        let (a, b) = (low + (high - low) / 3.0, high - (high - low) / 3.0);
        if length(a) < length(b) { high = b } else { low = a }
    }
    0.5 * (low + high)
}

fn folded() -> [f64; 6] {
    [0.7, 1.0, elbow(1.0, 0.5, 2.5), 0.5, -0.7, 2.0]
}

fn stretched() -> [f64; 6] {
    [0.7, 1.0, elbow(-1.0, -2.5, -0.5), 0.5, -0.7, 2.0]
}

/// Returns the smallest singular value at `theta`. Also returns the motion that the arm has lost: a unit twist at the tool, along
/// the base's axes.
fn lost(theta: &[f64]) -> (f64, Vector6<f64>) {
    let state = state(theta);
    let svd = state.body_jacobian().svd(true, false);
    let (i, sigma) = svd.singular_values.argmin();
    let body: Vector6<f64> = svd.u.unwrap().column(i).into_owned();
    let rotation = state.base_from_tool().rotation();
    let part = |row: usize| rotation * Vector3::new(body[row], body[row + 1], body[row + 2]);
    let (angular, linear) = (part(0), part(3));
    (sigma, Vector6::new(angular.x, angular.y, angular.z, linear.x, linear.y, linear.z))
}

/// Returns the pose of the tool at `theta`, moved by `way` \[m, rad\] in the direction of [`lost`].
fn beside(theta: &[f64], way: f64) -> UnitDualQuaternion {
    let pose = state(theta).base_from_tool();
    let (_, twist) = lost(theta);
    let (angular, linear) = (twist.fixed_rows::<3>(0).into_owned(), twist.fixed_rows::<3>(3).into_owned());
    let turn = match Unit::try_new(angular, 1e-6) {
        Some(axis) => {
            UnitDualQuaternion::from_translation_angle_axis(Vector3::zeros(), way * angular.norm(), &axis)
                .rotation()
        }
        None => nalgebra::UnitQuaternion::identity(),
    };
    UnitDualQuaternion::from_parts(turn * pose.rotation(), pose.translation() + way * linear)
}

fn rig(law: Law, theta: &[f64]) -> Rig {
    let mut rig = Rig::with(|settings| settings.controller.law = law);
    rig.plants[0] = Plant::new(theta.to_vec(), Duration::from_millis(100));
    rig.run(0.01);
    rig
}

/// A singular configuration, and a goal in the direction in which the arm cannot move at that configuration.
struct Case {
    name: &'static str,
    theta: [f64; 6],
    /// The joint whose motion leads out of the singularity, counted from 0.
    joint: usize,
    /// The goal, 0.1 m or 0.4 rad from the tool's pose at `theta`.
    goal: UnitDualQuaternion,
}

fn cases() -> Vec<Case> {
    let wrist = [0.7, 1.0, 2.3, 0.5, 0.0, 2.0];
    let (_, twist) = lost(&wrist);
    let axis = Unit::new_normalize(twist.fixed_rows::<3>(0).into_owned());
    let turned = |angle: f64| {
        let pose = state(&wrist).base_from_tool();
        let turn = UnitDualQuaternion::from_translation_angle_axis(Vector3::zeros(), angle, &axis).rotation();
        UnitDualQuaternion::from_parts(turn * pose.rotation(), pose.translation())
    };
    vec![
        Case { name: "folded elbow", theta: folded(), joint: 2, goal: beside(&folded(), outward(&folded())) },
        Case {
            name: "stretched elbow",
            theta: stretched(),
            joint: 2,
            goal: beside(&stretched(), -outward(&stretched())),
        },
        Case { name: "wrist", theta: wrist, joint: 4, goal: turned(0.4) },
        Case { name: "wrist, the other way", theta: wrist, joint: 4, goal: turned(-0.4) },
        Case { name: "wrist, stuck from the start", theta: wrist, joint: 4, goal: beside(&wrist, 0.4) },
    ]
}

/// Returns 0.1 m or −0.1 m, so that a motion by this distance in the direction of [`lost`] leads away from the base.
fn outward(theta: &[f64]) -> f64 {
    let (_, twist) = lost(theta);
    0.1 * state(theta).tool_point().dot(&twist.fixed_rows::<3>(3)).signum()
}

#[test]
fn rule_8_a_law_that_stands_still_at_a_singularity_is_led_out_and_arrives() {
    for Case { name, theta, joint, goal } in cases() {
        for law in Law::ALL {
            for off in [0.0, 1e-4] {
                let mut start = theta;
                start[joint] += off;
                let mut rig = rig(law, &start);
                rig.goal_pose(&goal);
                rig.run_until(State::Settled, 25.0);
                let settled = (rig.state(), rig.servo.status().leaving_singularity);
                assert_eq!(settled, (State::Settled, false), "{name}, {law}, {off} rad beside it");
            }
        }
    }
}

#[test]
fn rule_8_the_escape_is_the_same_each_time() {
    let way = || {
        let mut rig = rig(Law::Logc, &stretched());
        rig.goal_pose(&beside(&stretched(), -outward(&stretched())));
        rig.run(0.5);
        assert!(rig.servo.status().leaving_singularity || rig.speed() > 0.1);
        rig.plants[0].positions().to_vec()
    };
    assert_eq!(way(), way());
}

#[test]
fn rule_8_what_is_not_stuck_is_not_touched() {
    // At the singular elbow, logc_pd is slower than logc. So the singularity stops the arm under logc_pd, and the escape leads the
    // arm out.
    for law in Law::ALL.into_iter().filter(|law| *law != Law::LogcPd) {
        let mut rig = Rig::with(|settings| settings.controller.law = law);
        rig.goal("theta_desired");
        for _ in 0..6000 {
            rig.cycle();
            assert!(!rig.servo.status().leaving_singularity, "{law}");
        }
    }
}

/// Returns the reason why the motion to `goal` stalls.
fn stall(mut rig: Rig, goal: &UnitDualQuaternion) -> Stall {
    rig.goal_pose(goal);
    rig.run_until(State::Stalled, 20.0);
    rig.servo.status().stall.unwrap()
}

#[test]
fn rule_9_stalls_have_reasons_that_can_be_told_apart() {
    for law in [Law::Logc, Law::DoubleGeodesic, Law::Diffc] {
        // The shoulder's offset makes a hole around the first axis. The wrist is at the edge of the hole.
        let hole = beside(&folded(), -outward(&folded()));
        assert_eq!(stall(rig(law, &folded()), &hole), Stall::Unreachable, "{law}");
        let beyond = beside(&stretched(), outward(&stretched()));
        let mut near = rig(law, &stretched());
        near.change(|settings| settings.beyond_reach = BeyondReach::Approach);
        let Stall::BeyondReach(reach) = stall(near, &beyond) else { panic!("{law}") };
        assert!(reach.goal > reach.longest && reach.longest > 0.8);
        let inside = beside(&stretched(), -outward(&stretched()));
        let mut weak = rig(law, &[0.7, 1.0, 1.0, 0.5, -0.7, 2.0]);
        weak.change(|settings| settings.controller.set_gains(law, [1e-6; 2]));
        assert_eq!(stall(weak, &inside), Stall::NoProgress, "{law}");
    }
}

/// Returns two arms: one with a single revolute joint, the other with a single prismatic joint.
fn single_joints() -> [(&'static str, Chain); 2] {
    let row = DhRow { alpha: 0.0, a: 0.5, d: 0.1, theta_offset: 0.0 };
    let (origin, axis) = (UnitDualQuaternion::identity(), Vector3::x_axis());
    let slide = Joint { kind: JointKind::Prismatic, parent_from_joint: origin, axis };
    [
        ("turning", Chain::new(Convention::StandardDh, &[row]).unwrap()),
        ("sliding", Chain::from_joints(&[slide], &origin).unwrap()),
    ]
}

#[test]
fn rule_9_one_joint_whose_goal_is_off_its_path_is_as_near_as_it_comes() {
    let goal = UnitDualQuaternion::from_translation_angle_axis(
        Vector3::new(0.3, 0.2, 0.15),
        0.0,
        &Vector3::z_axis(),
    );
    for (kind, chain) in single_joints() {
        for law in Law::ALL {
            let mut rig = Rig::of_arm(chain.clone(), vec![0.1]);
            rig.change(|settings| {
                (settings.controller.law, settings.controller.aim) = (law, Aim::Position);
                settings.beyond_reach = BeyondReach::Approach;
            });
            rig.run(0.01);
            rig.goal_pose(&goal);
            rig.run_until(State::Stalled, 30.0);
            let status = rig.servo.status();
            let expected = match status.stall {
                // At any position of the prismatic joint, the goal is farther from the joint than the tool is.
                Some(Stall::BeyondReach(reach)) => kind == "sliding" && reach.longest < reach.goal,
                other => kind == "turning" && other == Some(Stall::Unreachable),
            };
            assert!(expected && !status.leaving_singularity, "{kind} {law}: {:?}", status.stall);
            assert_eq!(rig.servo.replaced().count, 0, "{kind} {law}");
        }
    }
}

/// Only a program that uses the library can set a gain of 0. With a gain of 0 the arm stands, although there is no singularity.
#[test]
fn rule_9_a_gain_of_zero_makes_no_progress() {
    let mut rig = rig(Law::Logc, &stretched());
    rig.check_moves = false;
    rig.change(|settings| {
        settings.controller.set_gains(Law::Logc, [0.0; 2]);
    });
    assert_eq!(stall(rig, &beside(&stretched(), -outward(&stretched()))), Stall::NoProgress);
}

#[test]
fn rule_9_an_escape_that_position_limits_bar_names_the_joint() {
    let start = stretched();
    let mut rig = rig(Law::Logc, &start);
    rig.change(|settings| {
        settings.limits.position.lower[2] = start[2] - 0.01;
        settings.limits.position.upper[2] = start[2] + 0.01;
    });
    let stall = stall(rig, &beside(&start, -outward(&start)));
    assert_eq!(stall, Stall::AtLimit { joint: 3 });
    assert!(stall.explain(|joint| format!("joint{joint}")).starts_with("joint3 is at its position limit"));
}

/// Both arms are stretched toward a goal beyond their reach. The next goal is nearer, in the direction in which stretched arms cannot
/// move.
#[test]
fn rule_8_two_arms_are_led_out_too() {
    for map in [Map::Transpose, Map::DampedInverse] {
        for aim in [Aim::Position, Aim::Distance] {
            let mut rig = Rig::two_arms();
            let damping = rig.servo.settings().controller.damping;
            let law = |map, gain| Controller::of_two_arms(map, aim, gain, damping);
            rig.change(|settings| {
                settings.controller = law(Map::Transpose, 10.0);
                settings.progress_timeout = None;
                settings.beyond_reach = BeyondReach::Approach;
            });
            rig.run(0.01);
            let scaled = |rig: &Rig, factor: f64| {
                let pose = rig.servo.pose().unwrap();
                UnitDualQuaternion::from_parts(pose.rotation(), factor * pose.translation())
            };
            let beyond = scaled(&rig, 4.0);
            rig.goal_pose(&beyond);
            rig.run(40.0);
            assert!(rig.servo.smallest_singular_value() < 1e-6, "{aim} {map}");
            rig.change(|settings| {
                settings.controller = law(map, if map == Map::Transpose { 10.0 } else { 1.0 })
            });
            let nearer = scaled(&rig, 0.9);
            rig.goal_pose(&nearer);
            let mut led = false;
            for _ in 0..150 {
                rig.cycle();
                led |= rig.servo.status().leaving_singularity;
            }
            // With the inverse, a squared distance is such a large error that the law needs no escape.
            assert!(led || rig.speed() > 0.05, "{aim} {map}");
            rig.run_until(State::Settled, 20.0);
        }
    }
}
