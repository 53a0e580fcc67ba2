//! Jogging: a twist moves the tool and drops the goal. The arm holds when the twists end.

use crate::rig::{Rig, twist};
use dq_core::servo::{
    Contended, Input, Interface, Reason, Rejection, Revocation, Rivals, Sent, State, TwistReading,
};
use dq_kinematics::arm::{Chain, Convention, DhRow};
use nalgebra::Vector3;
use std::f64::consts::FRAC_PI_2;
use std::time::Duration;

const UP: [f64; 3] = [0.0, 0.0, 0.05];
const NONE: [f64; 3] = [0.0; 3];

/// A configuration of the paper's arm that is far from singularities \[rad\].
const FREE: [f64; 6] = [0.3, -1.0, 0.0, 0.4, 1.4, 0.1];

fn rig(interface: Interface) -> Rig {
    let mut rig = Rig::with(|settings| settings.interface = interface);
    rig.plants[0] = dq_plant::Plant::new(FREE.to_vec(), Duration::from_millis(100));
    let now = rig.now;
    rig.plants[0].step(now);
    rig.run(0.1);
    rig
}

/// Sends a twist every 20 ms for the time `seconds`.
fn hold(rig: &mut Rig, linear: [f64; 3], angular: [f64; 3], frame: &str, seconds: f64) {
    let cycles = (seconds / 0.002) as u32;
    for cycle in 0..cycles {
        if cycle % 10 == 0 {
            rig.twist(linear, angular, frame).unwrap();
        }
        rig.cycle();
    }
}

fn point(rig: &Rig) -> Vector3<f64> {
    rig.servo.pose().unwrap().translation()
}

#[test]
fn a_twist_moves_the_tool_along_the_base_s_axes_and_then_the_arm_holds() {
    for name in ["velocity", "position"] {
        let mut rig = rig(name.parse().unwrap());
        let begin = point(&rig);
        hold(&mut rig, UP, NONE, "base_link", 2.0);
        assert_eq!((rig.state(), rig.servo.status().input), (State::Jogging, Input::Twist));
        let way = point(&rig) - begin;
        // 0.05 m/s for 2 s, less the time of the gentle trial at the beginning.
        assert!((0.08..0.1).contains(&way.z) && way.xy().norm() < 2e-3, "{name}: {way:?}");
        rig.run(0.2);
        assert_eq!((rig.state(), rig.speed(), rig.servo.status().input), (State::Holding, 0.0, Input::None));
        let held = rig.positions();
        rig.run(1.0);
        assert_eq!(rig.positions(), held, "nothing moves that was not asked for");
    }
}

#[test]
fn a_tool_that_must_not_turn_is_moved_straight_and_stopped_without_turning() {
    for [y, z] in [[0.3, 0.3], [0.3, -0.3], [-0.3, 0.3], [-0.1, -0.4]] {
        let mut rig = rig(Interface::Velocity);
        rig.change(|settings| settings.limits.angular_speed = 1e-6);
        // The lowered limit applies from then on. The rig checks the tool's rotation in each cycle.
        rig.run(1.1);
        let begin = point(&rig);
        hold(&mut rig, [0.0, y, z], NONE, "base_link", 1.0);
        rig.run(0.5);
        let moved = point(&rig) - begin;
        assert!(moved.norm() > 1e-3 && moved.dot(&Vector3::new(0.0, y, z)) > 0.0, "{moved:?}");
    }
}

#[test]
fn in_the_tool_s_frame_the_axes_are_its_own_and_no_other_frame_is_known() {
    let mut rig = rig(Interface::Velocity);
    let (begin, rotation) = (point(&rig), rig.servo.pose().unwrap().rotation());
    hold(&mut rig, UP, NONE, "tool0", 1.0);
    let way = point(&rig) - begin;
    assert!(way.normalize().dot(&(rotation * Vector3::z())) > 0.999, "{way:?}");
    let pose = rig.servo.pose().unwrap();
    hold(&mut rig, NONE, [0.0, 0.0, 0.2], "tool0", 1.0);
    let turned = pose.rotation().inverse() * rig.servo.pose().unwrap().rotation();
    let axis = turned.scaled_axis();
    assert!(axis.z > 0.1 && axis.xy().norm() < 0.02 * axis.z, "{axis:?}");
    for (twist, frame) in [([0.0, f64::NAN, 0.0], ""), ([1e9, 0.0, 0.0], ""), (UP, "camera")] {
        assert!(rig.twist(twist, NONE, frame).is_err());
    }
    assert_eq!(rig.servo.rejections().total(), 3);
}

#[test]
fn a_twist_drops_the_goal_and_goals_are_not_taken_before_it_has_ceased() {
    let mut rig = rig(Interface::Velocity);
    rig.goal("theta_desired");
    rig.run(0.5);
    rig.twist(NONE, NONE, "").unwrap();
    rig.cycle();
    assert_eq!(
        (rig.state(), rig.servo.status().input),
        (State::Tracking, Input::Goal),
        "zero asks for nothing"
    );
    hold(&mut rig, UP, NONE, "", 0.5);
    assert!(rig.state() == State::Jogging && rig.servo.status().goal.is_none());
    let identity = [0.0, 0.0, 0.0, 1.0];
    let refused = rig.take_point([0.3, 0.2, 0.2], identity, "").unwrap_err();
    assert!(refused.to_string().contains("twist"), "{refused}");
    rig.run(1.0);
    assert_eq!((rig.state(), rig.speed()), (State::Holding, 0.0), "the goal of before is gone");
    rig.goal("theta_desired");
    rig.run_until(State::Settled, 20.0);
}

#[test]
fn a_stick_that_is_released_rules_no_more_though_it_sends_zeros_for_ever() {
    let mut rig = rig(Interface::Velocity);
    hold(&mut rig, UP, NONE, "", 0.5);
    hold(&mut rig, NONE, NONE, "", 0.5);
    assert_eq!((rig.state(), rig.servo.status().input), (State::Holding, Input::None));
    rig.goal("theta_desired");
    hold(&mut rig, NONE, NONE, "", 0.5);
    assert_eq!(rig.state(), State::Tracking);
}

#[test]
fn limits_hold_for_a_twist_that_asks_for_too_much() {
    let mut rig = Rig::with(|settings| {
        settings.limits.linear_speed = 0.1;
        settings.limits.position.upper[0] = 1.0;
    });
    // The rig checks each command against the limits of the joints, the tool and the positions.
    for direction in
        [[9.0, 0.0, 0.0], [0.0, -900.0, 0.0], [0.0, 900.0, 3.0], [0.0, 0.0, 1e3], [0.0, 0.0, -1e3]]
    {
        hold(&mut rig, direction, [0.0, 50.0, 0.0], "", 3.0);
    }
    rig.run(0.5);
    assert_eq!(rig.speed(), 0.0);
}

#[test]
fn singularities_are_damped_for_a_twist_too() {
    let mut rig = rig(Interface::Velocity);
    // Straight outward, until the elbow is stretched, and further.
    let outward = point(&rig).normalize() * 0.4;
    hold(&mut rig, outward.into(), NONE, "", 8.0);
    assert!(rig.servo.smallest_singular_value() < 0.05);
    rig.run(0.5);
    assert_eq!(rig.speed(), 0.0);
}

/// Stops the servo while a publisher sends a twist every `every` cycles, with one pause of `hole` cycles. Returns whether the arm
/// moves within 3 s after the stop. If `idle`, another publisher sends zero twists during this time.
fn moves_after_a_stop(every: usize, idle: bool, hole: usize) -> bool {
    let mut rig = rig(Interface::Velocity);
    let send = |rig: &mut Rig, cycles: usize| {
        (0..cycles).any(|cycle| {
            if cycle % every == 0 && !(100..100 + hole).contains(&cycle) {
                rig.twist(UP, NONE, "").unwrap();
            }
            if idle && cycle % 10 == 5 {
                let zero = TwistReading { sent: Sent { by: 1, ..Sent::default() }, ..twist(NONE, NONE, "") };
                rig.take_twist(&zero).unwrap();
            }
            rig.cycle();
            rig.state() == State::Jogging
        })
    };
    assert!(send(&mut rig, 500), "{every}");
    rig.stop();
    rig.run_until(State::Holding, 1.0);
    send(&mut rig, 1500)
}

#[test]
fn a_held_stick_does_not_outlive_a_stop() {
    // At 50, 10, 8 and 5 Hz; at 50 Hz with an idle joystick; at 50 Hz with a pause of 0.12 s.
    for (every, idle, hole) in
        [(10, false, 0), (50, false, 0), (62, false, 0), (100, false, 0), (10, true, 0), (10, false, 60)]
    {
        assert!(!moves_after_a_stop(every, idle, hole), "{every} {idle} {hole}");
    }
}

#[test]
fn after_a_stop_a_zero_of_the_same_publisher_or_its_silence_releases_the_stick() {
    for zeros in [true, false] {
        let mut rig = rig(Interface::Velocity);
        hold(&mut rig, UP, NONE, "", 0.5);
        rig.stop();
        hold(&mut rig, UP, NONE, "", 1.0);
        assert_eq!((rig.state(), rig.speed()), (State::Holding, 0.0));
        assert_eq!(rig.servo.status().reason, Some(Reason::Release(Revocation::Stopped)));
        match zeros {
            true => hold(&mut rig, NONE, NONE, "", 0.02),
            false => rig.run(1.52),
        }
        hold(&mut rig, UP, NONE, "", 0.3);
        assert_eq!(rig.state(), State::Jogging, "{zeros}");
    }
}

#[test]
fn twists_that_come_late_are_rejected_and_the_stick_is_held_all_the_same() {
    let mut rig = rig(Interface::Velocity);
    hold(&mut rig, UP, NONE, "", 0.5);
    rig.stop();
    let ago = Duration::from_millis(101);
    let late = TwistReading { sent: Sent { by: 0, ago }, ..twist(UP, NONE, "") };
    for _ in 0..150 {
        assert_eq!(rig.take_twist(&late), Err(Rejection::Late(ago)));
        rig.run(0.01);
    }
    hold(&mut rig, UP, NONE, "", 0.3);
    assert_eq!((rig.state(), rig.speed()), (State::Holding, 0.0));
}

#[test]
fn of_two_sticks_that_are_held_none_moves_the_arm_and_both_are_named() {
    let mut rig = rig(Interface::Velocity);
    let other = TwistReading { sent: Sent { by: 4, ..Sent::default() }, ..twist([0.0, 0.05, 0.0], NONE, "") };
    let mut cycles_held = 0;
    for cycle in 0..1000 {
        if cycle % 10 == 0 {
            rig.twist(UP, NONE, "").unwrap();
        }
        if cycle % 10 == 5 {
            rig.take_twist(&other).unwrap();
        }
        rig.cycle();
        let rivals = Rivals { of: Contended::Twists, first: 0, second: 4 };
        cycles_held += usize::from(rig.servo.status().reason == Some(Reason::Rivals(rivals)));
    }
    assert!(cycles_held > 980 && rig.speed() == 0.0, "{cycles_held}");
    // The remaining publisher must first send a zero twist or pause.
    hold(&mut rig, UP, NONE, "", 2.0);
    assert_eq!((rig.state(), rig.speed()), (State::Holding, 0.0));
    hold(&mut rig, NONE, NONE, "", 0.02);
    hold(&mut rig, UP, NONE, "", 0.3);
    assert_eq!(rig.state(), State::Jogging);
}

#[test]
fn a_pause_holds_and_a_robot_that_comes_back_is_not_moved_by_a_stick_that_was_held_before() {
    let mut rig = rig(Interface::Velocity);
    hold(&mut rig, UP, NONE, "", 0.5);
    rig.pause(true);
    hold(&mut rig, UP, NONE, "", 0.5);
    assert_eq!((rig.state(), rig.speed()), (State::Paused, 0.0));
    rig.pause(false);
    hold(&mut rig, UP, NONE, "", 0.5);
    assert_eq!(rig.state(), State::Jogging);
    rig.connect(false);
    hold(&mut rig, UP, NONE, "", 2.0);
    assert_eq!((rig.state(), rig.speed()), (State::StaleState, 0.0));
    rig.connect(true);
    hold(&mut rig, UP, NONE, "", 0.5);
    assert_eq!((rig.state(), rig.speed()), (State::Holding, 0.0));
    hold(&mut rig, NONE, NONE, "", 0.1);
    hold(&mut rig, UP, NONE, "", 0.5);
    assert_eq!(rig.state(), State::Jogging);
}

#[test]
fn an_arm_that_does_not_follow_a_twist_is_not_run_away_from() {
    let mut rig = rig(Interface::Position);
    rig.change(|settings| settings.following_error = 0.05);
    hold(&mut rig, UP, NONE, "", 0.5);
    rig.following = false;
    hold(&mut rig, UP, NONE, "", 5.0);
    assert!(matches!(rig.state(), State::NotFollowing | State::Holding), "{}", rig.state());
    assert!(rig.servo.status().reason.is_some());
}

#[test]
fn two_arms_are_jogged_relative_to_each_other() {
    let mut rig: Rig = Rig::two_arms();
    rig.run(0.1);
    let begin = rig.servo.pose().unwrap().translation();
    for cycle in 0..500 {
        if cycle % 10 == 0 {
            rig.twist([0.05, 0.0, 0.0], NONE, "left/tool0").unwrap();
        }
        rig.cycle();
    }
    let way = rig.servo.pose().unwrap().translation() - begin;
    assert!(way.x > 0.02 && way.yz().norm() < 0.1 * way.x, "{way:?}");
}

/// The arm has a waist, a shoulder, an elbow and a wrist that pitches, and its tool points forward. So the arm cannot move the tool
/// sideways without turning it.
#[test]
fn a_twist_that_the_arm_cannot_follow_names_the_directions_that_it_has() {
    let rows = [(FRAC_PI_2, 0.0, 0.3), (0.0, 0.4, 0.0), (0.0, 0.35, 0.0), (0.0, 0.1, 0.0)];
    let rows = rows.map(|(alpha, a, d)| DhRow { alpha, a, d, theta_offset: 0.0 });
    let mut rig = Rig::of_arm(Chain::new(Convention::StandardDh, &rows).unwrap(), vec![0.0, 0.6, -1.2, 0.3]);
    let mut explained = |linear, angular| {
        hold(&mut rig, linear, angular, "base_link", 0.5);
        assert_eq!(rig.state(), State::Jogging);
        let text = rig.servo.status().explain(&rig.names);
        rig.run(1.0);
        text
    };
    assert_eq!(explained(UP, NONE), None);
    let has =
        "the arm has no joints for this twist here: it can move along x, z and turn about y of the base";
    assert_eq!(explained(NONE, [0.2, 0.0, 0.0]).as_deref(), Some(has));
    // The waist turns about z, which moves the tool sideways.
    assert_eq!(explained(NONE, [0.0, 0.2, 0.0]), None);
}
