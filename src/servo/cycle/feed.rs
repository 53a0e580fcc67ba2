//! The motion of a goal that moves, added to what the law asks for.

use crate::servo::Task;
use crate::servo::stream::MovingGoal;

/// Adds to the joint velocities `target` [rad/s, prismatic: m/s] those at which `task` moves as its goal does; `room` is for as many
/// numbers.
///
/// With the goal's body twist `ξ_d` and the error `e = q_d* q` (eq. 28) the tool's body twist `ξ = Ad_{e⁻¹} ξ_d − K X` leaves `−K X` as the
/// twist of the error: it decays as towards a goal that stands.
pub(super) fn feed_forward<T: Task>(
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
