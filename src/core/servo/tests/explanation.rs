//! Tests of [`Explanation`].

use crate::servo::explanation::*;
use dq_algebra::UnitDualQuaternion;
use dq_metrics::{GoalError, Tolerance};
use nalgebra::Vector3;
use std::time::Duration;

fn at(x: f64, angle: f64) -> UnitDualQuaternion {
    UnitDualQuaternion::from_translation_angle_axis(Vector3::new(x, 0.0, 0.0), angle, &Vector3::z_axis())
}

/// Moves the tool and the goal for 2 s as the two functions say. Returns whether the goal's position and rotation ever count as
/// moving independently of the tool. Also returns whether the tool ever counts as carrying the goal.
fn found(
    tool: impl Fn(f64) -> UnitDualQuaternion,
    goal: impl Fn(f64) -> UnitDualQuaternion,
) -> ([bool; 2], bool) {
    let (mut explanation, mut found) = (Explanation::default(), ([false; 2], false));
    for cycle in 0..1000 {
        let time = 0.002 * f64::from(cycle);
        let (now, tool, goal) = (Duration::from_secs_f64(time), tool(time), goal(time));
        explanation.note(now, tool);
        if cycle % 10 > 0 {
            continue;
        }
        let [position, rotation] = tool.distances(&goal);
        let tolerance = Tolerance { linear: 1e-3, angular: 1e-2 };
        let error = GoalError { position, rotation };
        let nearness = Nearness { error, tolerance, rates: [4.0; 2] };
        explanation.compare(now, &goal, true, &nearness);
        let [moves, turns] = explanation.moves_by_itself();
        found.0 = [found.0[0] | moves, found.0[1] | turns];
        found.1 |= explanation.is_carried(&tool, &nearness);
    }
    found
}

/// Returns the position of a tool that moves at 0.5 m/s from 0.2 s on.
fn straight(time: f64) -> UnitDualQuaternion {
    at(0.5 * (time - 0.2).max(0.0), 0.0)
}

#[test]
fn a_goal_that_keeps_its_distance_is_carried_at_any_lag() {
    for late in [0.0, 0.02, 0.4, 1.3] {
        let goal = move |time: f64| at(1.0, 0.0) * straight(time - late);
        assert_eq!(found(straight, goal), ([false; 2], true), "{late} s");
    }
    assert!(!found(straight, |_| at(1.0, 0.0)).1, "one that is approached");
    assert!(!found(|_| at(0.0, 0.0), |_| at(0.2, 0.0)).1, "the tool stands");
}

#[test]
fn a_goal_that_moves_differently_from_the_tool_moves_independently() {
    assert_eq!(found(straight, |time| at(0.3 * time + 0.4, 0.0)), ([true, false], false));
    assert_eq!(found(|_| at(0.0, 0.0), |time| at(0.1 * time, 0.0)), ([true, false], false));
    let followed = |time: f64| at(0.1 * time - 0.02 * (1.0 - (-4.0 * time).exp()), 0.0);
    assert_eq!(found(followed, |time| at(0.1 * time, 0.0)), ([true, false], false));
}

#[test]
fn position_and_rotation_are_judged_separately() {
    let goal = |time: f64| at(0.01 + straight(time).translation().x, time);
    assert_eq!(found(straight, goal).0, [false, true]);
}

#[test]
fn a_goal_that_turns_with_the_tool_is_carried_and_a_fixed_goal_near_a_turning_tool_is_not() {
    let turning = |time: f64| at(0.0, (time - 0.2).max(0.0));
    assert_eq!(found(turning, |time| turning(time) * at(0.2, 0.5)), ([false; 2], true));
    assert!(!found(turning, |_| at(0.2, 1.0)).1);
}

#[test]
fn a_tool_that_trembles_carries_nothing() {
    let tremble = |time: f64| at(0.005 * (300.0 * time).sin(), 0.0);
    assert_eq!(found(tremble, |_| at(0.1, 0.0)), ([false; 2], false));
}
