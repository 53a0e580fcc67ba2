//! The recent transforms of one frame relative to its parent.

use dq_algebra::UnitDualQuaternion;
use nalgebra::{UnitQuaternion, Vector3};
use std::collections::VecDeque;

/// How long transforms are kept, as in tf2 \[ns\].
const LONGEST: i64 = 10_000_000_000;

/// Largest number of transforms that are kept per frame: 10 s at 200 Hz, or 2 s at 1 kHz.
pub(super) const MOST: usize = 2000;

/// The rotation between two quaternions has a unique shortest arc if its angle differs from half a turn by more than this \[rad\].
const HALF_TURN: f64 = 1e-9;

/// The transform of a frame at a time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Place {
    pub stamp: i64,
    pub rotation: UnitQuaternion<f64>,
    pub translation: Vector3<f64>,
}

impl Place {
    fn pose(&self) -> UnitDualQuaternion {
        UnitDualQuaternion::from_parts(self.rotation, self.translation)
    }

    /// Interpolates the pose at the fraction `s` of the motion to `next`. If the rotation between the two poses is a half turn,
    /// takes the rotation of the nearer pose.
    fn towards(&self, next: &Self, s: f64) -> UnitDualQuaternion {
        let nearer = if s < 0.5 { self.rotation } else { next.rotation };
        let rotation = self.rotation.try_slerp(&next.rotation, s, HALF_TURN).unwrap_or(nearer);
        UnitDualQuaternion::from_parts(rotation, self.translation.lerp(&next.translation, s))
    }
}

/// The requested time is outside the times of the transforms that are kept, by this many nanoseconds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Outside {
    Before(i64),
    After(i64),
}

/// The transforms of one frame, the oldest first.
#[derive(Clone, Debug)]
pub(super) struct History {
    places: VecDeque<Place>,
    pub is_static: bool,
}

impl History {
    pub fn new(place: Place, is_static: bool) -> Self {
        Self { places: VecDeque::from([place]), is_static }
    }

    /// Returns the stamp \[ns\] of the newest transform; `None` if the frame never moves.
    pub fn newest(&self) -> Option<i64> {
        self.places.back().filter(|_| !self.is_static).map(|place| place.stamp)
    }

    pub fn len(&self) -> usize {
        self.places.len()
    }

    /// Adds a transform, and replaces a transform with the same stamp. Removes transforms that are too old, and the oldest transforms
    /// while there are more than `room`. A stamp that is older than the newest stamp by more than `LONGEST` shows that the clock was
    /// reset. Then only the new transform remains.
    pub fn add(&mut self, place: Place, room: usize) {
        let newest = self.places.back().map_or(place.stamp, |newest| newest.stamp);
        if self.is_static || place.stamp < newest.saturating_sub(LONGEST) {
            self.places.clear();
        }
        let after = self.places.iter().rposition(|known| known.stamp <= place.stamp);
        match after {
            Some(same) if self.places[same].stamp == place.stamp => self.places[same] = place,
            Some(before) => self.places.insert(before + 1, place),
            None => self.places.push_front(place),
        }
        let oldest = self.places.back().map_or(0, |newest| newest.stamp.saturating_sub(LONGEST));
        while self.places.len() > room.clamp(1, MOST)
            || self.places.front().is_some_and(|place| place.stamp < oldest)
        {
            self.places.pop_front();
        }
    }

    /// Returns the pose of the frame at `stamp` \[ns\], or how far `stamp` is outside the times of the transforms that are kept.
    pub fn at(&self, stamp: i64) -> Result<UnitDualQuaternion, Outside> {
        let (Some(first), Some(last)) = (self.places.front(), self.places.back()) else {
            return Err(Outside::After(0));
        };
        if self.is_static {
            return Ok(last.pose());
        }
        if stamp < first.stamp {
            return Err(Outside::Before(first.stamp.saturating_sub(stamp)));
        }
        if stamp > last.stamp {
            return Err(Outside::After(stamp.saturating_sub(last.stamp)));
        }
        let next = self.places.partition_point(|place| place.stamp <= stamp);
        let before = self.places.get(next.saturating_sub(1)).unwrap_or(first);
        let Some(next) = self.places.get(next).filter(|_| before.stamp != stamp) else {
            return Ok(before.pose());
        };
        let share =
            stamp.saturating_sub(before.stamp) as f64 / next.stamp.saturating_sub(before.stamp) as f64;
        Ok(before.towards(next, share))
    }
}
