//! What is asked of the joints on the way to a goal, beside what the law asks for.

use crate::servo::stream::MovingGoal;
use crate::servo::way_out::WayOut;
use crate::servo::{Settings, Task};

/// What becomes of the law's joint velocities in one cycle, now and where they lead.
pub(super) struct Demand<'a, T: Task> {
    pub settings: &'a Settings<T::Controller>,
    /// The part of the law's gains that the delays allow.
    pub gain_factor: f64,
    /// By which a singularity is left; until then the posture waits.
    pub way_out: Option<&'a WayOut>,
}

impl<T: Task> Demand<'_, T> {
    /// Makes of the law's joint velocities `target` [rad/s, prismatic: m/s] for `task` at these joint positions those that are wanted, within
    /// the limits on speed; `moving` is the goal if it moves. `room` is for as many numbers.
    pub fn complete(
        &self,
        (task, positions): (&T, &[f64]),
        moving: Option<&MovingGoal>,
        room: &mut [f64],
        target: &mut [f64],
    ) {
        let Settings { controller, limits, posture, .. } = self.settings;
        target.iter_mut().for_each(|speed| *speed *= self.gain_factor);
        if let Some(way_out) = self.way_out {
            way_out.lead(target);
        }
        if let Some(moving) = moving {
            feed_forward((task, controller), moving, room, target);
        }
        if posture.is_on() && self.way_out.is_none() {
            posture.add((task, controller), (positions, &limits.joint_velocity), room, target);
        }
        limits.limit_speed(&task.tool_speed(target), target);
    }
}

/// Adds to the joint velocities `target` [rad/s, prismatic: m/s] those at which `task` moves as its goal does; `room` is for as many
/// numbers.
///
/// With the goal's body twist `ξ_d` and the error `e = q_d* q` (eq. 28) the tool's body twist `ξ = Ad_{e⁻¹} ξ_d − K X` leaves `−K X` as the
/// twist of the error: it decays as towards a goal that stands.
fn feed_forward<T: Task>(
    (task, controller): (&T, &T::Controller),
    goal: &MovingGoal,
    room: &mut [f64],
    target: &mut [f64],
) {
    let pose = task.pose();
    let tool_from_goal = pose.conjugate() * goal.pose;
    let twist = tool_from_goal.adjoint() * goal.twist;
    let (angular, linear) = (twist.fixed_rows::<3>(0).into_owned(), twist.fixed_rows::<3>(3).into_owned());
    let rotation = pose.rotation();
    task.joint_velocity_of(controller, &(rotation * angular), &(rotation * linear), room);
    target.iter_mut().zip(room.iter()).for_each(|(speed, more)| *speed += more);
}
