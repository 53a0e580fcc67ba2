//! Conversions of poses to messages.

use dq_algebra::UnitDualQuaternion;
use dq_messages::PoseNumbers;
use dq_messages::messages::{Point, Pose, Transform, Vector3};

/// Returns the position and the quaternion of a pose as numbers.
pub fn pose_numbers(pose: &UnitDualQuaternion) -> PoseNumbers {
    let (t, r) = (pose.translation(), pose.rotation());
    [t.x, t.y, t.z, r.i, r.j, r.k, r.w]
}

/// Converts a pose to a message.
pub fn pose_message(pose: &UnitDualQuaternion) -> Pose {
    pose_numbers(pose).into()
}

/// Converts a pose to a transform message.
pub fn transform_message(pose: &UnitDualQuaternion) -> Transform {
    let Pose { position: Point { x, y, z }, orientation } = pose_message(pose);
    Transform { translation: Vector3 { x, y, z }, rotation: orientation }
}

/// Converts a point to a message.
pub fn point_message(point: &nalgebra::Vector3<f64>) -> Point {
    Point { x: point.x, y: point.y, z: point.z }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::readings::goal_reading;
    use dq_core::servo::GoalReading;
    use dq_messages::messages::PoseStamped;

    #[test]
    fn a_pose_keeps_its_numbers_and_its_sign_over_the_wire() {
        let numbers = [0.1, -0.2, 0.3, 0.5, 0.5, -0.5, -0.5];
        let message = PoseStamped { pose: numbers.into(), ..PoseStamped::default() };
        let GoalReading { position, orientation_xyzw, frame_id, .. } = goal_reading(&message);
        assert_eq!(([position[0], position[1], position[2]], frame_id), ([0.1, -0.2, 0.3], ""));
        assert_eq!(orientation_xyzw, [0.5, 0.5, -0.5, -0.5]);
        let goal = dq_core::servo::Goal::new(position, orientation_xyzw, "", "base").unwrap();
        let back = pose_message(goal.base_from_goal());
        let transform = transform_message(goal.base_from_goal());
        for (ours, theirs) in pose_numbers(goal.base_from_goal()).into_iter().zip(numbers) {
            assert!((ours - theirs).abs() < 1e-15);
        }
        assert_eq!((transform.translation.x, transform.rotation), (back.position.x, back.orientation));
    }
}
