//! Tests of goals that wait for their frames. Some events drop the goal in force, or request that goal again. Such an event supersedes
//! each goal that arrived before the event but gets its frame only after the event.

use crate::reference::pose;
use crate::rig::{Rig, reading, state_of};
use dq_core::servo::{Contended, GoalReading, Interface, Rejection, Revocation, Sent, State};
use dq_kinematics::control::{Aim, Law};
use std::time::Duration;

/// Returns a goal at the pose theta_third that has waited `seconds` for its frame.
fn found(seconds: f64) -> GoalReading<'static> {
    let pose = pose("theta_third");
    GoalReading { waited: Duration::from_secs_f64(seconds), ..reading(&pose, 0) }
}

/// Simulates a goal that waits at least 2 s for its frame. The event `what` happens after 0.5 s. When the goal has its frame, the
/// servo must reject the goal. Returns the reason for the rejection. Also checks that the arm moves to a goal that arrived after
/// `what`.
fn refusal(rig: &mut Rig, what: impl FnOnce(&mut Rig)) -> Rejection {
    let came = rig.now;
    rig.run(0.5);
    what(rig);
    rig.run(1.5);
    let waited = (rig.now - came).as_secs_f64();
    let why = rig.take_single(&found(waited)).unwrap_err();
    let before = rig.positions();
    rig.run(1.0);
    assert_eq!(rig.positions(), before, "{why}");
    rig.take_single(&found(0.5)).unwrap();
    rig.run(0.1);
    assert!(rig.speed() > 0.0, "{} after {why}", rig.state());
    why
}

fn standing() -> Rig {
    let mut rig = Rig::with(|settings| settings.controller.law = Law::Logc);
    rig.goal("theta_desired");
    rig.run_until(State::Settled, 30.0);
    rig
}

#[test]
fn a_goal_that_waits_for_its_frame_goes_on_waiting_through_what_drops_none() {
    let mut rig = standing();
    rig.run(0.5);
    rig.pause(true);
    rig.twist([0.0; 3], [0.0; 3], "").unwrap();
    rig.run(0.5);
    rig.pause(false);
    rig.change(|settings| settings.goal_tolerance.linear *= 2.0);
    rig.run(0.5);
    rig.take_single(&found(1.5)).unwrap();
    rig.run_until(State::Settled, 30.0);
}

#[test]
fn a_twist_overtakes_a_goal_that_waits_for_its_frame() {
    let twist = |rig: &mut Rig| {
        rig.twist([0.0, 0.0, 0.05], [0.0; 3], "").unwrap();
    };
    assert_eq!(refusal(&mut standing(), twist), Rejection::Superseded(Revocation::Jogged));
    // A goal that arrived with the twist, or while the twist was obeyed, is rejected, too.
    let mut rig = standing();
    twist(&mut rig);
    rig.run(0.3);
    assert_eq!(rig.take_single(&found(0.3)), Err(Rejection::Superseded(Revocation::Jogged)));
}

#[test]
fn a_stop_and_another_aim_overtake_a_goal_that_waits_for_its_frame() {
    let stopped = refusal(&mut standing(), |rig| rig.stop());
    assert_eq!(stopped, Rejection::Superseded(Revocation::Stopped));
    let aim = |rig: &mut Rig| rig.change(|settings| settings.controller.aim = Aim::Position);
    assert_eq!(refusal(&mut standing(), aim), Rejection::Superseded(Revocation::AnotherAim));
}

#[test]
fn rule_15_a_goal_that_waits_for_its_frame_does_not_outlive_the_robot_s_absence_or_jump() {
    let why = refusal(&mut standing(), |rig| {
        rig.connect(false);
        rig.run(1.2);
        rig.connect(true);
    });
    assert!(matches!(why, Rejection::Superseded(Revocation::WasAway(_))), "{why}");
    assert!(why.to_string().contains("the robot was away for 1.2 s: let it send nothing"), "{why}");
    let why = refusal(&mut standing(), |rig| rig.plants[0].reset());
    assert!(matches!(why, Rejection::Superseded(Revocation::IsElsewhere(..))), "{why}");
    // The goal's frame is found in the cycle in which the robot jumps.
    let mut rig = standing();
    rig.run(0.5);
    rig.plants[0].reset();
    rig.take_single(&found(0.5)).unwrap();
    rig.run(1.0);
    assert_eq!((rig.state(), rig.speed()), (State::Holding, 0.0));
}

/// The goal arrives before a call of `~/pause` (false), but gets its frame after the call. So the call remains the latest request.
#[test]
fn a_goal_that_is_set_going_while_the_robot_is_away_stays_so_when_an_older_one_is_found() {
    let mut rig = standing();
    rig.connect(false);
    rig.run(0.8);
    rig.pause(false);
    rig.run(0.2);
    let goal = pose("theta_desired");
    rig.take_single(&GoalReading { waited: Duration::from_millis(900), ..reading(&goal, 0) }).unwrap();
    rig.run(0.5);
    rig.connect(true);
    rig.run(0.1);
    assert_eq!((rig.state(), rig.servo.status().reason), (State::Settled, None));
}

#[test]
fn rule_15_a_goal_that_waits_for_its_frame_does_not_move_a_robot_that_starts_later() {
    for (age, taken) in [(0.9, true), (1.1, false)] {
        let mut rig = Rig::new();
        rig.connect(false);
        rig.run(2.0);
        rig.connect(true);
        rig.run(0.1);
        assert_eq!(rig.take_single(&found(age + 0.1)).is_ok(), taken, "{age} s before the robot came");
    }
}

#[test]
fn two_publishers_and_a_blocked_arm_overtake_a_goal_that_waits_for_its_frame() {
    let rivals = |rig: &mut Rig| {
        for _ in 0..10 {
            let (names, positions) = (&rig.names, &[0.3; 6]);
            let other = state_of(names, positions, 7);
            rig.servo.take_joint_state(0, &other, rig.now).unwrap();
            rig.cycle();
        }
    };
    assert_eq!(
        refusal(&mut standing(), rivals),
        Rejection::Superseded(Revocation::Rivals(Contended::JointStates(0)))
    );
    let mut rig = Rig::with(|settings| {
        settings.controller.law = Law::Logc;
        settings.interface = Interface::Position;
    });
    rig.goal("theta_desired");
    rig.run_until(State::Settled, 30.0);
    let pushed = |rig: &mut Rig| {
        rig.jump(3, 0.22);
        rig.following = false;
        rig.run(0.1);
        rig.following = true;
    };
    assert!(matches!(refusal(&mut rig, pushed), Rejection::Superseded(Revocation::FellBehind(..))));
}

#[test]
fn a_goal_that_comes_late_is_rejected_and_one_sent_before_a_stop_too() {
    let mut rig = standing();
    let sent = |seconds| Sent { by: 0, ago: Duration::from_secs_f64(seconds) };
    let goal = |seconds| GoalReading { sent: sent(seconds), ..found(0.0) };
    let late = rig.take_single(&goal(5.9)).unwrap_err();
    assert!(
        matches!(late, Rejection::Late(_)) && late.to_string().contains("5.9 s after it was sent"),
        "{late}"
    );
    rig.stop();
    rig.run(0.3);
    assert_eq!(rig.take_single(&goal(0.4)), Err(Rejection::Superseded(Revocation::Stopped)));
    rig.run(0.2);
    assert_eq!(rig.speed(), 0.0);
    rig.take_single(&goal(0.4)).unwrap();
    rig.run(0.2);
    assert!(rig.speed() > 0.0);
}
