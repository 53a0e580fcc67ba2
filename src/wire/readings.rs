//! Messages as the servo takes them, and poses as messages have them.

use super::messages::{
    JointState, Point, Pose, PoseStamped, Quaternion, Transform, TransformStamped, TwistStamped, Vector3,
};
use crate::dq::UnitDualQuaternion;
use crate::frames;
use crate::servo::{GoalError, GoalReading, JointReading, Sent, TwistReading, stamp_age};
use nalgebra::Vector6;
use std::time::Duration;

/// A pose in numbers: x y z \[m\], then qx qy qz qw.
pub type PoseNumbers = [f64; 7];

/// The numbers of a pose.
pub fn pose_numbers(pose: &UnitDualQuaternion) -> PoseNumbers {
    let (t, r) = (pose.translation(), pose.rotation());
    [t.x, t.y, t.z, r.i, r.j, r.k, r.w]
}

impl From<PoseNumbers> for Pose {
    fn from([x, y, z, qx, qy, qz, qw]: PoseNumbers) -> Self {
        Self { position: Point { x, y, z }, orientation: Quaternion { x: qx, y: qy, z: qz, w: qw } }
    }
}

impl From<&nalgebra::Vector3<f64>> for Point {
    fn from(point: &nalgebra::Vector3<f64>) -> Self {
        Self { x: point.x, y: point.y, z: point.z }
    }
}

impl From<&UnitDualQuaternion> for Pose {
    fn from(pose: &UnitDualQuaternion) -> Self {
        pose_numbers(pose).into()
    }
}

impl From<&UnitDualQuaternion> for Transform {
    fn from(pose: &UnitDualQuaternion) -> Self {
        let Pose { position: Point { x, y, z }, orientation } = pose.into();
        Self { translation: Vector3 { x, y, z }, rotation: orientation }
    }
}

impl PoseStamped {
    /// The goal as the servo takes it.
    pub fn reading(&self) -> GoalReading<'_> {
        let (p, o) = (&self.pose.position, &self.pose.orientation);
        GoalReading {
            position: [p.x, p.y, p.z],
            orientation_xyzw: [o.x, o.y, o.z, o.w],
            frame_id: &self.header.frame_id,
            stamp: self.header.stamp.nanoseconds(),
            waited: Duration::ZERO,
            sent: Sent::default(),
        }
    }
}

impl TwistStamped {
    /// The twist as the servo takes it.
    pub fn reading(&self) -> TwistReading<'_> {
        let numbers = |v: &Vector3| [v.x, v.y, v.z];
        TwistReading {
            linear: numbers(&self.twist.linear),
            angular: numbers(&self.twist.angular),
            frame_id: &self.header.frame_id,
            sent: Sent::default(),
        }
    }
}

impl TwistStamped {
    /// How far the pose is from the goal whose error's screw log this is, as `~/pose_error` has it.
    pub fn distance(&self) -> GoalError {
        let (a, l) = (&self.twist.angular, &self.twist.linear);
        let error = UnitDualQuaternion::screw_exp(&Vector6::new(a.x, a.y, a.z, l.x, l.y, l.z));
        GoalError {
            position: error.translation().norm(),
            rotation: nalgebra::Vector3::new(a.x, a.y, a.z).norm(),
        }
    }
}

impl TransformStamped {
    /// The transform as the tree of frames takes it.
    pub fn reading(&self) -> frames::Transform<'_> {
        let Transform { translation: t, rotation: r } = &self.transform;
        frames::Transform {
            parent: &self.header.frame_id,
            child: &self.child_frame_id,
            stamp: self.header.stamp.nanoseconds(),
            translation: [t.x, t.y, t.z],
            rotation_xyzw: [r.x, r.y, r.z, r.w],
        }
    }
}

impl JointState {
    /// The joint state as the servo takes it, from the publisher of number `source`, at the time `clock` \[ns\] of this host's clock;
    /// without one its stamp says nothing.
    pub fn reading(&self, source: u32, clock: Option<i64>) -> JointReading<'_> {
        JointReading {
            names: &self.name,
            positions: &self.position,
            velocities: &self.velocity,
            source,
            stamp_age: clock.and_then(|clock| stamp_age(clock, self.header.stamp.nanoseconds())),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pose_keeps_its_numbers_and_its_sign_over_the_wire() {
        let numbers = [0.1, -0.2, 0.3, 0.5, 0.5, -0.5, -0.5];
        let message = PoseStamped { pose: numbers.into(), ..PoseStamped::default() };
        let GoalReading { position, orientation_xyzw, frame_id, .. } = message.reading();
        assert_eq!(([position[0], position[1], position[2]], frame_id), ([0.1, -0.2, 0.3], ""));
        assert_eq!(orientation_xyzw, [0.5, 0.5, -0.5, -0.5]);
        let goal = crate::servo::Goal::new(position, orientation_xyzw, "", "base").unwrap();
        let back = Pose::from(goal.base_from_goal());
        let transform = Transform::from(goal.base_from_goal());
        for (ours, theirs) in pose_numbers(goal.base_from_goal()).into_iter().zip(numbers) {
            assert!((ours - theirs).abs() < 1e-15);
        }
        assert_eq!((transform.translation.x, transform.rotation), (back.position.x, back.orientation));
    }
}
