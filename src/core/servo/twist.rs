//! Twists that the servo has checked.

use super::Rejection;
use dq_kinematics::arm::bounds;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

/// A twist that the servo has checked: a desired motion of the tool.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Twist {
    /// Velocity of the tool point [m/s].
    pub linear: Vector3<f64>,
    /// Angular velocity of the tool [rad/s].
    pub angular: Vector3<f64>,
    /// Whether both velocities are along the tool's axes. Otherwise they are along the base's axes.
    pub in_tool: bool,
}

impl Twist {
    /// Creates a twist from its velocities and the name of their frame. `frames` are the names of the base frame and of the tool's
    /// own frame. An empty name stands for the base frame.
    ///
    /// # Errors
    /// A [`Rejection`] for another frame, or for a number that is not finite or beyond [`bounds`].
    pub fn new(
        linear: [f64; 3],
        angular: [f64; 3],
        frame_id: &str,
        frames: [&str; 2],
    ) -> Result<Self, Rejection> {
        let [base, tool] = frames.map(|frame| frame.trim_start_matches('/'));
        let frame = frame_id.trim_start_matches('/');
        let in_tool = !frame.is_empty() && frame == tool && frame != base;
        if !(in_tool || frame.is_empty() || frame == base) {
            return Err(Rejection::unknown_frame(frame_id, [base, tool]));
        }
        for (field, values, unit) in [("linear", &linear, "m/s"), ("angular", &angular, "rad/s")] {
            bounds::check(|| field.to_owned(), values, bounds::SPEED, unit)?;
        }
        Ok(Self { linear: linear.into(), angular: angular.into(), in_tool })
    }

    /// Returns whether the twist requests no motion.
    pub fn is_zero(&self) -> bool {
        self.linear == Vector3::zeros() && self.angular == Vector3::zeros()
    }
}
