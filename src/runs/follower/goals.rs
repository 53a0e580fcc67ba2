//! What a follower makes of goals.

use super::Follower;
use crate::config::{CycleParameters, NodeParameters};
use crate::control::nearer_goal;
use crate::dq::UnitDualQuaternion;
use crate::runs::What;
use crate::runs::motions::Came;
use crate::servo::{Goal, GoalError, GoalReading};
use crate::wire::messages::PoseStamped;
use crate::wire::{PoseNumbers, Wiring};

impl<T: Wiring> Follower<T>
where
    CycleParameters<T>: NodeParameters,
{
    pub(super) fn take_goal(&mut self, time: f64, message: &PoseStamped) {
        let GoalReading { position, orientation_xyzw, frame_id, .. } = message.reading();
        let taken = Goal::new(position, orientation_xyzw, frame_id, &self.parameters.goal_frame);
        // The servo takes none while a twist rules.
        if let Some(goal) = taken.ok().filter(|_| !self.jogged) {
            self.motions.hear(time, goal);
            self.pursue(time, goal);
        }
    }

    /// A goal that the servo has for `elapsed` \[s\], maybe without a message of it in the bag: `ros2 bag record` subscribes late. Where
    /// it has none, or this is its first status, the motion may have begun before what the bag has of it. A servo that `holds` moves to none.
    pub(super) fn take_goal_in_force(
        &mut self,
        time: f64,
        [x, y, z, orientation @ ..]: PoseNumbers,
        (elapsed, holds): (f64, bool),
    ) {
        let Ok(goal) = Goal::new([x, y, z], orientation, "", &self.parameters.goal_frame) else { return };
        let was_held = self.motions.is_held();
        if was_held && holds {
            return self.motions.move_aim(time, goal);
        }
        let is_in_force = self.motions.is_in_force(&goal);
        let is_new = !is_in_force && self.motions.is_news(time, &goal);
        let begins = is_new && self.pursue(time, goal) == Came::Another;
        if (begins && !was_held) || (is_in_force && self.state.is_none()) {
            self.motions.was_taken(time - elapsed);
        }
    }

    fn pursue(&mut self, time: f64, goal: Goal) -> Came {
        let came = self.motions.pursue(time, goal, &self.parameters.settings.goal_tolerance);
        if came != Came::Again {
            self.run.goals.push((time, *goal.base_from_goal()));
        }
        if came == Came::Another {
            self.change(time, What::Goal, "goal".to_owned());
            self.measure(time);
        }
        came
    }

    /// The goal, with the sign that is nearer to the pose.
    pub(super) fn signed_goal(&self) -> Option<UnitDualQuaternion> {
        Some(nearer_goal(self.motions.goal()?.base_from_goal(), &self.parameters.task.pose()))
    }

    pub(super) fn goal_error(&self, goal: &UnitDualQuaternion) -> GoalError {
        self.parameters.task.goal_error(&self.parameters.settings.controller, goal)
    }
}
