//! Converts messages to the servo's inputs.

use dq_algebra::UnitDualQuaternion;
use dq_core::servo::{GoalReading, JointReading, Sent, TwistReading, stamp_age};
use dq_messages::messages::{JointState, PoseStamped, Transform, TransformStamped, TwistStamped, Vector3};
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

/// Converts a twist.
pub fn twist_reading(twist: &TwistStamped) -> TwistReading<'_> {
    let numbers = |v: &Vector3| [v.x, v.y, v.z];
    TwistReading {
        linear: numbers(&twist.twist.linear),
        angular: numbers(&twist.twist.angular),
        frame_id: &twist.header.frame_id,
        sent: Sent::default(),
    }
}

/// Returns the distance from the goal. `screw_log` is the screw log of the error, as in `~/pose_error`.
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

/// Converts a joint state from the publisher `source`. `clock` is the time of this host's clock \[ns\]; without it, the stamp is
/// ignored.
pub fn joint_reading(state: &JointState, source: u32, clock: Option<i64>) -> JointReading<'_> {
    JointReading {
        names: &state.name,
        positions: &state.position,
        velocities: &state.velocity,
        source,
        stamp_age: clock.and_then(|clock| stamp_age(clock, state.header.stamp.nanoseconds())),
    }
}
