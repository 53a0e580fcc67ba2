//! Goals as they come over the wire.

use super::Rejection;
use crate::dq::UnitDualQuaternion;
use crate::text::cut;
use nalgebra::{Quaternion, UnitQuaternion, Vector3};

/// A quaternion whose norm is off 1 by more than this is a mistake, not rounding; one that is closer is normalised.
const UNIT_TOLERANCE: f64 = 1e-3;

/// A goal pose that has been checked.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Goal {
    base_from_goal: UnitDualQuaternion,
}

impl Goal {
    /// From position \[m\], orientation (x, y, z, w) and the frame they are in, which is `base_frame` or empty.
    ///
    /// # Errors
    /// A [`Rejection`] for another frame, a non-finite number, or a quaternion that is not unit.
    pub fn new(
        position: [f64; 3],
        orientation_xyzw: [f64; 4],
        frame_id: &str,
        base_frame: &str,
    ) -> Result<Self, Rejection> {
        // ROS 1 wrote frames with a leading slash, and some tools still do.
        let frame = frame_id.trim_start_matches('/');
        if !frame.is_empty() && frame != base_frame.trim_start_matches('/') {
            return Err(Rejection::UnknownFrame {
                got: cut(frame_id).into_owned(),
                expected: base_frame.to_owned(),
            });
        }
        check_finite("position", &position)?;
        check_finite("orientation", &orientation_xyzw)?;
        let [x, y, z, w] = orientation_xyzw;
        let quaternion = Quaternion::new(w, x, y, z);
        let norm = quaternion.norm();
        if (norm - 1.0).abs() > UNIT_TOLERANCE {
            return Err(Rejection::NotUnit { norm, tolerance: UNIT_TOLERANCE });
        }
        let rotation = UnitQuaternion::new_normalize(quaternion);
        Ok(Self { base_from_goal: UnitDualQuaternion::from_parts(rotation, Vector3::from(position)) })
    }

    /// The goal pose, with the sign it came with.
    pub fn base_from_goal(&self) -> &UnitDualQuaternion {
        &self.base_from_goal
    }
}

fn check_finite(field: &str, values: &[f64]) -> Result<(), Rejection> {
    match values.iter().find(|value| !value.is_finite()) {
        None => Ok(()),
        Some(value) => Err(Rejection::NonFinite { field: field.to_owned(), value: *value }),
    }
}
