//! Messages as the servo takes them.

use dq_algebra::UnitDualQuaternion;
use dq_core::servo::{GoalError, GoalReading, JointReading, Sent, TwistReading, stamp_age};
use dq_messages::messages::{JointState, PoseStamped, Transform, TransformStamped, TwistStamped, Vector3};
use dq_space::frames;
use nalgebra::Vector6;
use std::time::Duration;

/// A goal as the servo takes it.
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

/// A twist as the servo takes it.
pub fn twist_reading(twist: &TwistStamped) -> TwistReading<'_> {
    let numbers = |v: &Vector3| [v.x, v.y, v.z];
    TwistReading {
        linear: numbers(&twist.twist.linear),
        angular: numbers(&twist.twist.angular),
        frame_id: &twist.header.frame_id,
        sent: Sent::default(),
    }
}

/// How far the pose is from the goal whose error's screw log this is, as `~/pose_error` has it.
pub fn error_distance(screw_log: &TwistStamped) -> GoalError {
    let (a, l) = (&screw_log.twist.angular, &screw_log.twist.linear);
    let error = UnitDualQuaternion::screw_exp(&Vector6::new(a.x, a.y, a.z, l.x, l.y, l.z));
    GoalError { position: error.translation().norm(), rotation: nalgebra::Vector3::new(a.x, a.y, a.z).norm() }
}

/// A transform as the tree of frames takes it.
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

/// A joint state as the servo takes it, from the publisher of number `source`, at the time `clock` \[ns\] of this host's clock; without
/// one its stamp says nothing.
pub fn joint_reading(state: &JointState, source: u32, clock: Option<i64>) -> JointReading<'_> {
    JointReading {
        names: &state.name,
        positions: &state.position,
        velocities: &state.velocity,
        source,
        stamp_age: clock.and_then(|clock| stamp_age(clock, state.header.stamp.nanoseconds())),
    }
}
