//! Joint states that arrive in parts: some joints in one message, others in another. For example, a rail and the arm on it may have
//! separate drivers.

use crate::joint_order::check;
use crate::{JointOrder, JointReading, StateError};
use serde::{Deserialize, Serialize};
use std::time::Duration;

/// The newest reading of each joint of an arm.
#[derive(Default, Serialize, Deserialize)]
pub(crate) struct Parts {
    heard: Vec<Option<Part>>,
}

/// The newest reading of one joint.
#[derive(Clone, Copy, Serialize, Deserialize)]
pub(crate) struct Part {
    pub position: f64,
    pub velocity: Option<f64>,
    pub source: u32,
    at: Duration,
    stamp_age: Option<Duration>,
    /// Whether the reading arrived since the last complete joint state.
    is_new: bool,
}

impl Part {
    /// Returns the age of the reading at `now` by its stamp; `None` if the stamp is unusable.
    pub fn age(&self, now: Duration) -> Option<Duration> {
        self.stamp_age.map(|age| age + now.saturating_sub(self.at))
    }

    fn is_there(&self, now: Duration, timeout: Duration) -> bool {
        now.saturating_sub(self.at) <= timeout
    }
}

impl Parts {
    /// Drops all readings, because a single message contained all joints of the arm.
    pub fn clear(&mut self) {
        self.heard.clear();
    }

    /// Returns whether another publisher has sent a reading of one of the joints in `reading` within the last `timeout`.
    pub fn is_of_another(
        &self,
        order: &JointOrder,
        reading: &JointReading,
        now: Duration,
        timeout: Duration,
    ) -> bool {
        let known = order.names().iter().zip(&self.heard);
        let mut known = known.filter_map(|(name, part)| Some((name, part.as_ref()?)));
        known.any(|(name, part)| {
            part.source != reading.source && part.is_there(now, timeout) && reading.names.contains(name)
        })
    }

    /// Takes the readings of the arm's joints from `reading`.
    ///
    /// # Errors
    /// A [`StateError`] if a position is not finite or beyond its bounds. Then no reading is taken.
    pub fn take(
        &mut self,
        order: &JointOrder,
        reading: &JointReading,
        now: Duration,
    ) -> Result<(), StateError> {
        let places = order.names().iter().map(|name| reading.names.iter().position(|other| other == name));
        for (name, place) in order.names().iter().zip(places.clone()) {
            place.map_or(Ok(()), |place| check(name, reading.positions[place]))?;
        }
        self.heard.resize(order.names().len(), None);
        for (part, place) in self.heard.iter_mut().zip(places) {
            let Some(place) = place else { continue };
            *part = Some(Part {
                position: reading.positions[place],
                velocity: reading.velocities.get(place).copied().filter(|speed| speed.is_finite()),
                source: reading.source,
                at: now,
                stamp_age: reading.stamp_age,
                is_new: true,
            });
        }
        Ok(())
    }

    /// Returns the first joint without a reading within the last `timeout`; `None` if there is no such joint.
    pub fn missing(&self, now: Duration, timeout: Duration) -> Option<usize> {
        self.heard.iter().position(|part| !part.is_some_and(|part| part.is_there(now, timeout)))
    }

    /// Returns the readings of all joints if each of them is newer than the last complete joint state; otherwise `None`.
    pub fn whole(&mut self) -> Option<impl Iterator<Item = Part> + Clone + '_> {
        if !self.heard.iter().flatten().all(|part| part.is_new) {
            return None;
        }
        self.heard.iter_mut().flatten().for_each(|part| part.is_new = false);
        Some(self.heard.iter().flatten().copied())
    }
}
