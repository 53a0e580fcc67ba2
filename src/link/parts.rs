//! Joint states that come in parts, as of a rail from one driver and of the arm on it from another.

use crate::joint_order::check;
use crate::{JointOrder, JointReading, StateError};
use serde::{Deserialize, Serialize};
use std::time::Duration;

/// What came of each of the arm's joints since their last whole state.
#[derive(Default, Serialize, Deserialize)]
pub(crate) struct Parts {
    heard: Vec<Option<Part>>,
}

/// The newest that is known of a joint.
#[derive(Clone, Copy, Serialize, Deserialize)]
pub(crate) struct Part {
    pub position: f64,
    pub velocity: Option<f64>,
    pub source: u32,
    at: Duration,
    stamp_age: Option<Duration>,
    /// It came since the last whole state.
    is_new: bool,
}

impl Part {
    /// How old it is at `now` by its stamp.
    pub fn age(&self, now: Duration) -> Option<Duration> {
        self.stamp_age.map(|age| age + now.saturating_sub(self.at))
    }

    fn is_there(&self, now: Duration, timeout: Duration) -> bool {
        now.saturating_sub(self.at) <= timeout
    }
}

impl Parts {
    /// Forgets all parts: a message had the whole arm.
    pub fn clear(&mut self) {
        self.heard.clear();
    }

    /// Whether another publisher has named one of the joints of `reading` within `timeout`.
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

    /// Takes the joints that `reading` has.
    ///
    /// # Errors
    /// A [`StateError`] where the position of one is no number or beyond its bounds; then none is taken.
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

    /// The first joint of which nothing came within `timeout`.
    pub fn missing(&self, now: Duration, timeout: Duration) -> Option<usize> {
        self.heard.iter().position(|part| !part.is_some_and(|part| part.is_there(now, timeout)))
    }

    /// Every joint, once each of them came since the last time.
    pub fn whole(&mut self) -> Option<impl Iterator<Item = Part> + Clone + '_> {
        if !self.heard.iter().flatten().all(|part| part.is_new) {
            return None;
        }
        self.heard.iter_mut().flatten().for_each(|part| part.is_new = false);
        Some(self.heard.iter().flatten().copied())
    }
}
