//! Converts messages to the servo's inputs.

use dq_algebra::UnitDualQuaternion;
use dq_common::text::cut;
use dq_core::servo::{
    GoalReading, JointGoalError, JointGoalReading, JointReading, Rejection, Sent, StateError, TwistReading,
    WrenchReading, stamp_age,
};
use dq_messages::messages::{
    JointState, PoseStamped, Transform, TransformStamped, TwistStamped, Vector3, WrenchStamped,
};
use dq_metrics::GoalError;
use dq_space::frames;
use nalgebra::Vector6;
use std::time::Duration;

/// Converts a goal.
pub fn goal_reading(goal: &PoseStamped) -> GoalReading<'_> {
    let (p, o) = (&goal.pose.position, &goal.pose.orientation);
    GoalReading {
        position: [p.x, p.y, p.z],
        orientation_xyzw: [o.x, o.y, o.z, o.w],
        frame_id: &goal.header.frame_id,
        stamp: goal.header.stamp.nanoseconds(),
        waited: Duration::ZERO,
        sent: Sent::default(),
    }
}

/// Converts a joint goal for a servo with these `joints`: the first arm's joints, then the second arm's. A message without names has
/// a position for each joint, in this order. The function overwrites `positions`, and the returned reading borrows it.
///
/// # Errors
/// A [`Rejection`] for an unknown name, for a name that is repeated, or for lists of different lengths.
pub fn joint_goal_reading<'a>(
    goal: &JointState,
    joints: &[String],
    positions: &'a mut Vec<Option<f64>>,
) -> Result<JointGoalReading<'a>, Rejection> {
    positions.clear();
    if goal.name.is_empty() {
        positions.extend(goal.position.iter().copied().map(Some));
    } else {
        let (names, given) = (goal.name.len(), goal.position.len());
        if names != given {
            return Err(StateError::WrongLength { names, positions: given }.into());
        }
        positions.resize(joints.len(), None);
    }
    for (name, position) in goal.name.iter().zip(&goal.position) {
        let joint = joints.iter().position(|joint| joint == name);
        let unknown =
            || JointGoalError::UnknownJoint { name: cut(name).into_owned(), joints: joints.to_vec() };
        if positions[joint.ok_or_else(unknown)?].replace(*position).is_some() {
            return Err(JointGoalError::NamedTwice(name.clone()).into());
        }
    }
    Ok(JointGoalReading { positions, stamp: goal.header.stamp.nanoseconds(), sent: Sent::default() })
}

fn numbers(v: &Vector3) -> [f64; 3] {
    [v.x, v.y, v.z]
}

/// Converts a twist.
pub fn twist_reading(twist: &TwistStamped) -> TwistReading<'_> {
    TwistReading {
        linear: numbers(&twist.twist.linear),
        angular: numbers(&twist.twist.angular),
        frame_id: &twist.header.frame_id,
        sent: Sent::default(),
    }
}

/// Converts a wrench from the publisher `source`. `clock` is the present time of this host's clock \[ns\], from which the age of the
/// wrench follows.
pub fn wrench_reading(wrench: &WrenchStamped, source: u32, clock: i64) -> WrenchReading<'_> {
    WrenchReading {
        force: numbers(&wrench.wrench.force),
        torque: numbers(&wrench.wrench.torque),
        frame_id: &wrench.header.frame_id,
        sensor: UnitDualQuaternion::identity(),
        source,
        stamp_age: stamp_age(clock, wrench.header.stamp.nanoseconds()),
    }
}

/// Returns the distance from the goal. `screw_log` is the screw logarithm of the pose error, as published on `~/pose_error`.
pub fn error_distance(screw_log: &TwistStamped) -> GoalError {
    let (a, l) = (&screw_log.twist.angular, &screw_log.twist.linear);
    let error = UnitDualQuaternion::screw_exp(&Vector6::new(a.x, a.y, a.z, l.x, l.y, l.z));
    GoalError { position: error.translation().norm(), rotation: nalgebra::Vector3::new(a.x, a.y, a.z).norm() }
}

/// Converts a transform for the tree of frames.
pub fn transform_reading(message: &TransformStamped) -> frames::Transform<'_> {
    let Transform { translation: t, rotation: r } = &message.transform;
    frames::Transform {
        parent: &message.header.frame_id,
        child: &message.child_frame_id,
        stamp: message.header.stamp.nanoseconds(),
        translation: [t.x, t.y, t.z],
        rotation_xyzw: [r.x, r.y, r.z, r.w],
    }
}

/// Converts a joint state from the publisher `source`. `clock` is the present time of this host's clock \[ns\], from which the age
/// of the joint state follows. If `clock` is `None`, the reading has no age.
pub fn joint_reading(state: &JointState, source: u32, clock: Option<i64>) -> JointReading<'_> {
    JointReading {
        names: &state.name,
        positions: &state.position,
        velocities: &state.velocity,
        source,
        stamp_age: clock.and_then(|clock| stamp_age(clock, state.header.stamp.nanoseconds())),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Reads a joint goal with these names and positions for the joints a, b and c. Returns the position of each joint, or the text of
    /// the rejection.
    fn read(names: &[&str], positions: &[f64]) -> Result<Vec<Option<f64>>, String> {
        let joints = ["a", "b", "c"].map(str::to_owned);
        let name = names.iter().map(|name| (*name).to_owned()).collect();
        let goal = JointState { name, position: positions.to_vec(), ..JointState::default() };
        let mut read = vec![Some(9.0); 4];
        let reading = joint_goal_reading(&goal, &joints, &mut read);
        reading.map(|reading| reading.positions.to_vec()).map_err(|why| why.text())
    }

    #[test]
    fn joint_goals_are_read_by_name_or_without_names_in_the_order_of_the_joints() {
        assert_eq!(read(&["c", "a"], &[3.0, 1.0]), Ok(vec![Some(1.0), None, Some(3.0)]));
        assert_eq!(read(&[], &[1.0, 2.0, 3.0]), Ok(vec![Some(1.0), Some(2.0), Some(3.0)]));
        assert_eq!(read(&[], &[]), Ok(vec![]), "the servo rejects it");
        let unknown = "\"x\" is not a joint of the arm, expected a, b, c";
        assert_eq!(read(&["a", "x"], &[1.0, 2.0]), Err(unknown.to_owned()));
        assert_eq!(read(&["a", "a"], &[1.0, 2.0]), Err("joint \"a\" is named twice".to_owned()));
        let lengths = "2 joint names with 1 positions: expected as many of each";
        assert_eq!(read(&["a", "b"], &[1.0]), Err(lengths.to_owned()));
    }
}
