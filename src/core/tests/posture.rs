//! Tests of the posture of arms with more than six joints. The joints move toward the posture as far as the tool's pose allows. This
//! motion never disturbs the tool.

use crate::arms::{servo, start};
use crate::rig::Rig;
use dq_core::servo::{Posture, State};

const ARM: &str = "panda";

/// Moves the arm eight times through three poses. Returns the largest difference of a joint's position between the end of the first
/// round and the end of the last round \[rad\].
fn drift(gain: f64) -> f64 {
    let (mut parameters, start) = (servo(ARM), start(ARM));
    parameters.settings.posture.gain = gain;
    let chain = parameters.arms.chain().clone();
    let turns = [[0.4, 0.2, -0.3, 0.3, 0.2, -0.3, 0.5], [-0.5, 0.4, 0.3, -0.2, 0.4, 0.3, -0.4], [0.0; 7]];
    let poses = turns.map(|turns| {
        let there: Vec<_> = start.iter().zip(turns).map(|(angle, turn)| angle + turn).collect();
        chain.forward_kinematics(&there).unwrap()
    });
    let mut rig = Rig::of(parameters, start);
    rig.run(0.1);
    let mut first = Vec::new();
    for round in 0..8 {
        for pose in &poses {
            rig.goal_pose(pose);
            rig.run_until(State::Tracking, 1.0);
            rig.run_until(State::Settled, 30.0);
            rig.run(1.0);
        }
        if round == 0 {
            first = rig.plants[0].positions().to_vec();
        }
    }
    let moved = rig.plants[0].positions().iter().zip(&first).map(|(one, other)| (one - other).abs());
    moved.fold(0.0, f64::max)
}

#[test]
fn the_posture_of_the_start_comes_back_by_itself() {
    let (without, with) = (drift(0.0), drift(servo(ARM).settings.posture.gain));
    eprintln!("DRIFT {without} {with}");
    assert!(without > 0.1 && with < 0.02, "{without} rad, with the default {with} rad");
}

/// Moves to a goal and waits ten seconds. Returns how far the joints then are from the posture \[rad\], the time until the arm
/// settled \[s\], and how far the tool strays from the goal in the last five seconds \[m\].
fn moved(gain: f64) -> (f64, f64, f64) {
    let (mut parameters, start) = (servo(ARM), start(ARM));
    // The goal allows many postures; this is one of them.
    let turns = [0.5, -0.2, -0.5, 0.2, 0.3, 0.2, -0.3];
    let posture: Vec<_> = start.iter().zip(turns).map(|(angle, turn)| angle + turn).collect();
    parameters.settings.posture = Posture { positions: posture.clone(), gain };
    let chain = parameters.arms.chain().clone();
    let pose = chain.forward_kinematics(&posture).unwrap();
    let mut rig = Rig::of(parameters, start);
    rig.run(0.1);
    rig.goal_pose(&pose);
    rig.run_until(State::Tracking, 1.0);
    let begun = rig.now;
    rig.run_until(State::Settled, 30.0);
    let time = (rig.now - begun).as_secs_f64();
    rig.run(5.0);
    let mut astray: f64 = 0.0;
    for _ in 0..10 {
        rig.run(0.5);
        let tool = chain.forward_kinematics(rig.plants[0].positions()).unwrap();
        astray = astray.max((tool.translation() - pose.translation()).norm());
        assert_eq!(rig.state(), State::Settled);
    }
    let distance = rig.plants[0].positions().iter().zip(&posture).map(|(one, other)| (one - other).powi(2));
    (distance.sum::<f64>().sqrt(), time, astray)
}

#[test]
fn a_posture_is_gone_to_while_the_tool_stays() {
    let ((without, time_without, _), (with, time_with, astray)) = (moved(1e-9), moved(1.0));
    assert!(with < 0.02 && without > 0.1, "{with} {without}");
    assert!(astray < 1e-4, "{astray} m");
    assert!((time_with - time_without).abs() < 0.1 * time_without, "{time_with} s, without {time_without} s");
    // The gain drives the joints far faster than their limits; the rig checks the limits in each cycle.
    moved(10.0);
}
