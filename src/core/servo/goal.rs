//! Goals that the servo has checked.

use super::Rejection;
use dq_algebra::{UnitDualQuaternion, unit_rotation};
use dq_kinematics::arm::bounds;
use dq_metrics::{GoalError, Tolerance};
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

/// A goal pose that has been checked.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct Goal {
    base_from_goal: UnitDualQuaternion,
}

/// q and −q are equal goals.
impl PartialEq for Goal {
    fn eq(&self, other: &Self) -> bool {
        let (one, other) = (self.base_from_goal, other.base_from_goal);
        one == other || one == -other
    }
}

impl Goal {
    /// Creates a goal from a position \[m\] and an orientation (x, y, z, w) in the frame `frame_id`, which must be `base_frame` or empty.
    ///
    /// # Errors
    /// A [`Rejection`] for another frame, for a number that is not finite or beyond [`bounds`], or for a quaternion whose norm is not 1.
    pub fn new(
        position: [f64; 3],
        orientation_xyzw: [f64; 4],
        frame_id: &str,
        base_frame: &str,
    ) -> Result<Self, Rejection> {
        if !is_own_frame(frame_id, base_frame) {
            return Err(Rejection::unknown_frame(frame_id, [base_frame]));
        }
        bounds::check(|| "position".to_owned(), &position, bounds::LENGTH, "m")?;
        bounds::check(|| "orientation".to_owned(), &orientation_xyzw, f64::MAX, "")?;
        let rotation = unit_rotation(orientation_xyzw)?;
        Ok(Self::of(UnitDualQuaternion::from_parts(rotation, Vector3::from(position))))
    }

    /// Creates the goal with this pose.
    pub fn of(base_from_goal: UnitDualQuaternion) -> Self {
        Self { base_from_goal }
    }

    /// Returns how far `other` is from this goal. q and −q are the same goal.
    pub fn distance(&self, other: &Self) -> GoalError {
        let [position, rotation] = self.base_from_goal.distances(&other.base_from_goal);
        GoalError { position, rotation }
    }

    /// Returns whether `other` equals this goal within `tolerance`.
    pub fn is_same(&self, other: &Self, tolerance: &Tolerance) -> bool {
        let distance = self.distance(other);
        distance.position <= tolerance.linear && distance.rotation <= tolerance.angular
    }

    /// Returns the goal pose, with its original sign.
    pub fn base_from_goal(&self) -> &UnitDualQuaternion {
        &self.base_from_goal
    }
}

/// Returns whether `frame_id` is `base_frame` or empty.
pub fn is_own_frame(frame_id: &str, base_frame: &str) -> bool {
    // ROS 1 wrote frames with a leading slash, and some tools still do.
    let frame = frame_id.trim_start_matches('/');
    frame.is_empty() || frame == base_frame.trim_start_matches('/')
}
