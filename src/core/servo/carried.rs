//! Whether the arm itself carries the goal: a frame on the tool, or on what the tool has grasped.
//!
//! The law would drive the arm towards a goal that recedes as fast as the arm comes, for ever. Where the frames are connected by TF, TF
//! knows; but who publishes one in the world, as a camera's, moves it with the tool too. So it is judged by the motion: a goal that the
//! tool has not reached, and that stands still as seen from the tool while the tool travels, is carried. So is a goal that moves by
//! itself, steadily, and is followed without feed-forward: the tool does not get nearer to it either.

use crate::servo::{GoalError, Tolerance};
use dq_algebra::UnitDualQuaternion;
use serde::{Deserialize, Serialize};
use std::time::Duration;

/// The tool must travel so far [m, rad] ...
const TRAVEL: [f64; 2] = [0.1, 0.3];

/// ... while the goal, as seen from the tool, moves by less than this part of that: what TF is late by, and noise.
const STILL: f64 = 0.15;

/// The tool has reached a goal that is within so many tolerances ...
const REACHED: f64 = 10.0;

/// ... and one that moves it follows, where its error is less than this part of what it goes while the law takes effect.
const FOLLOWED: f64 = 0.15;

/// Compares the motion of a goal with that of the tool.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
pub(super) struct Carried {
    since: Option<Since>,
}

/// Where both were since when the goal has stood still as seen from the tool.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
struct Since {
    tool_from_goal: UnitDualQuaternion,
    tool: UnitDualQuaternion,
    at: Duration,
}

/// How far the tool is from its goal, and what counts as near.
#[derive(Clone, Copy, Debug)]
pub(super) struct Nearness {
    pub error: GoalError,
    pub tolerance: Tolerance,
    /// The law's rates of position and rotation [1/s].
    pub rates: [f64; 2],
}

impl Carried {
    /// Looks at `now` where tool and goal are, in one frame; true where the tool carries the goal.
    pub fn look(
        &mut self,
        now: Duration,
        tool: &UnitDualQuaternion,
        goal: &UnitDualQuaternion,
        nearness: &Nearness,
    ) -> bool {
        let tool_from_goal = tool.conjugate() * *goal;
        let here = Since { tool_from_goal, tool: *tool, at: now };
        let since = *self.since.get_or_insert(here);
        let (travelled, moved) =
            (since.tool.distances(tool), since.tool_from_goal.distances(&tool_from_goal));
        // A turn of the tool moves a goal that stands by its lever too.
        let seen = [travelled[0] + tool_from_goal.translation().norm() * travelled[1], travelled[1]];
        let stands = (0..2).all(|part| moved[part] <= STILL * seen[part].max(TRAVEL[part]));
        let travels = travelled.iter().zip(TRAVEL).any(|(travelled, travel)| *travelled >= travel);
        if !stands || travels {
            self.since = Some(here);
        }
        let seconds = now.saturating_sub(since.at).as_secs_f64();
        let Nearness { error, tolerance, rates } = nearness;
        let (errors, tolerances) = ([error.position, error.rotation], [tolerance.linear, tolerance.angular]);
        let is_carried = |part: usize| {
            let followed = FOLLOWED * travelled[part] / (rates[part] * seconds);
            travelled[part] >= TRAVEL[part]
                && errors[part] > REACHED * tolerances[part]
                && errors[part] >= followed
        };
        stands && (0..2).any(is_carried)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector3;

    fn at(x: f64, angle: f64) -> UnitDualQuaternion {
        UnitDualQuaternion::from_translation_angle_axis(Vector3::new(x, 0.0, 0.0), angle, &Vector3::z_axis())
    }

    /// Whether the goal is found to be carried within 1 s, by a law of 4 1/s.
    fn is_carried(
        tool: impl Fn(f64) -> UnitDualQuaternion,
        goal: impl Fn(f64) -> UnitDualQuaternion,
    ) -> bool {
        is_carried_by([4.0; 2], tool, goal)
    }

    /// The same of a law of these rates [1/s].
    fn is_carried_by(
        rates: [f64; 2],
        tool: impl Fn(f64) -> UnitDualQuaternion,
        goal: impl Fn(f64) -> UnitDualQuaternion,
    ) -> bool {
        let mut carried = Carried::default();
        (0..=100).any(|i| {
            let time = 0.01 * f64::from(i);
            let (tool, goal) = (tool(time), goal(time));
            let [position, rotation] = tool.distances(&goal);
            let tolerance = Tolerance { linear: 1e-3, angular: 1e-2 };
            let nearness = Nearness { error: GoalError { position, rotation }, tolerance, rates };
            carried.look(Duration::from_secs_f64(time), &tool, &goal, &nearness)
        })
    }

    #[test]
    fn a_goal_that_keeps_its_distance_is_carried_and_one_that_is_approached_is_not() {
        let straight = |s: f64| at(0.5 * s, 0.0);
        assert!(is_carried(straight, |s| at(0.5 * s + 0.2, 0.0)));
        assert!(is_carried(straight, |s| at((0.5 * s - 0.02).max(0.0) + 0.2, 0.0)), "as late as TF may be");
        assert!(!is_carried(straight, |_| at(0.6, 0.0)));
        assert!(!is_carried(straight, |s| at(0.3 * s + 0.4, 0.0)), "one that moves by itself");
        assert!(!is_carried(straight, |s| at(0.5 * s + 0.015, 0.0)), "one that is followed");
        assert!(!is_carried(|_| at(0.0, 0.0), |_| at(0.2, 0.0)), "the tool stands");
    }

    #[test]
    fn a_goal_that_turns_with_the_tool_is_carried_and_one_beside_a_tool_that_turns_is_not() {
        let turning = |s: f64| at(0.0, s);
        assert!(is_carried(turning, |s| at(0.0, s) * at(0.2, 0.5)));
        assert!(!is_carried(turning, |_| at(0.2, 1.0)));
        assert!(!is_carried(turning, |_| at(0.0, 1.5)));
    }

    #[test]
    fn each_part_is_judged_by_its_own_rate() {
        let (straight, near) = (|s: f64| at(0.2 * s, 0.0), |s: f64| at(0.2 * s + 0.03 * (-s).exp(), 0.0));
        assert!(!is_carried_by([1.0, 10.0], straight, near), "it is approached at 1 1/s");
        assert!(is_carried_by([10.0, 1.0], straight, |s| at(0.2 * s + 0.03, 0.0)));
    }

    #[test]
    fn a_tool_that_trembles_carries_nothing() {
        let tremble = |s: f64| at(0.005 * (300.0 * s).sin(), 0.0);
        assert!(!is_carried(tremble, |_| at(0.1, 0.0)));
    }
}
