//! Detects a sensor that reports the wrench with the wrong sign.
//!
//! A wall pushes back against the motion that touched it. If the sensor's sign is wrong, the force seems to help the motion, the goal
//! yields toward the wall, and the force grows. A person who pushes an arm that stands gives no such evidence.

use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

/// A contact begins when the force reaches `TOUCH` \[N\] or `DEAD_BANDS` times the dead band, whichever is larger. The contact ends
/// when the force falls below half of this threshold.
const TOUCH: f64 = 3.0;
const DEAD_BANDS: f64 = 3.0;

/// A tool that is slower than this when a contact begins counts as standing [m/s].
const MOVES: f64 = 2e-3;

/// The time after the start of a contact in which the force is monitored \[s\].
const TIME: f64 = 0.5;

/// The force has grown if it is at least this many times the force at the start of the contact.
const GROWN: f64 = 2.0;

/// The force helps the motion if its component along the motion is at least this fraction of the force.
const ALONG: f64 = 0.7;

/// The contact in progress, with its first force \[N\] and its duration so far \[s\].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
struct Touch {
    /// The unit vector along the tool's motion when the contact began; zero if the tool stood.
    motion: Vector3<f64>,
    force: f64,
    since: f64,
}

/// Monitors the force at the start of a contact.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(crate) struct SignWatch {
    touch: Option<Touch>,
    /// The velocity of the tool [m/s] when the force was last within the dead band or below a third of [`TOUCH`]. At such a force the
    /// tool hardly yields, so this motion comes from the goal.
    velocity: Vector3<f64>,
}

impl SignWatch {
    /// Takes the `force` on the tool \[N\] and the tool's `velocity` [m/s], both along the tool's axes. `dead_band` is the force to
    /// which the goal does not yield \[N\], and `dt` is the time since the last call \[s\]. Returns whether the sign of the force is
    /// wrong.
    pub fn update(&mut self, force: &Vector3<f64>, velocity: &Vector3<f64>, dead_band: f64, dt: f64) -> bool {
        let (size, touches) = (force.norm(), TOUCH.max(DEAD_BANDS * dead_band));
        if size <= dead_band.max(TOUCH / 3.0) {
            self.velocity = *velocity;
        }
        if size < touches / 2.0 {
            self.touch = None;
        } else if size >= touches && self.touch.is_none() {
            self.touch = Some(Touch { motion: self.motion(), force: size, since: 0.0 });
        }
        let Some(touch) = &mut self.touch else { return false };
        touch.since += dt;
        touch.since <= TIME && size >= GROWN * touch.force && self.helps(force)
    }

    /// Returns the unit vector along the tool's motion before a contact; zero if the tool stood.
    fn motion(&self) -> Vector3<f64> {
        if self.velocity.norm() >= MOVES { self.velocity.normalize() } else { Vector3::zeros() }
    }

    /// Returns whether the `force` helps the motion that began the contact.
    pub fn helps(&self, force: &Vector3<f64>) -> bool {
        let motion = self.touch.map_or(self.motion(), |touch| touch.motion);
        motion != Vector3::zeros() && force.dot(&motion) >= ALONG * force.norm()
    }
}
