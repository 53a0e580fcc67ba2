//! Chooses the publisher of an input that may have only one publisher, such as the joint states of an arm.

use serde::{Deserialize, Serialize};
use std::time::Duration;

/// A publisher counts as present for this time after its last message.
const PRESENCE: Duration = Duration::from_secs(1);

/// The publishers of one input, of which it uses only one at a time. The node assigns a number to each publisher.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
pub struct Arbiter {
    current: Option<Heard>,
    /// Another publisher that has sent a message since the current publisher was chosen.
    other: Option<Heard>,
    /// Whether the publishers `current` and `other` are both present. Becomes true when the current publisher sends a message within
    /// [`PRESENCE`] after a message of the other publisher.
    both: bool,
}

#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
struct Heard {
    source: u32,
    at: Duration,
}

impl Arbiter {
    /// Notes a message from `source` at `now`. Returns whether to use the message. Another publisher takes over only after the
    /// current publisher has been silent for `silence`, for example because a driver was restarted.
    pub fn hear(&mut self, source: u32, now: Duration, silence: Duration) -> bool {
        let heard = Heard { source, at: now };
        match &self.current {
            Some(current) if current.source == source => {
                self.both |= self.other.is_some_and(|other| now.saturating_sub(other.at) <= PRESENCE);
                self.current = Some(heard);
                true
            }
            Some(current) if now.saturating_sub(current.at) <= silence => {
                self.other = Some(heard);
                false
            }
            _ => {
                self.other = self.current.replace(heard).filter(|old| self.both && old.source != source);
                true
            }
        }
    }

    /// Returns the numbers of the current publisher and of the other publisher while both are present; otherwise `None`. A
    /// publisher is present until it has been silent for a second.
    pub fn rivals(&mut self, now: Duration) -> Option<[u32; 2]> {
        let there = |heard: &Heard| now.saturating_sub(heard.at) <= PRESENCE;
        self.other = self.other.filter(there);
        match (self.current.filter(there), self.other) {
            (Some(current), Some(other)) if self.both => Some([current.source, other.source]),
            _ => {
                self.both = false;
                None
            }
        }
    }
}
