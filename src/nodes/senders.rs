//! Gives a number to each publisher of one input, and computes the age of the publishers' messages.

use super::sender_clock::SenderClock;
use dq_core::servo::Sent;
use dq_messages::messages::Time;
use dq_ros::ros::{EndpointId, Origin};
use std::time::Duration;

/// The largest number of publishers that are remembered. The publisher that was silent longest is forgotten first.
const MOST: usize = 16;

/// The start of a cycle, by the cycle's own clock and by the clock of this host \[ns since 1970\].
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Clocks {
    pub now: Duration,
    pub wall: i64,
}

impl Clocks {
    /// Returns the clocks at the cycle time `now`, with the present time of this host.
    pub fn at(now: Duration) -> Self {
        Self { now, wall: Time::now().nanoseconds() }
    }
}

struct Sender {
    number: u32,
    publisher: EndpointId,
    clock: SenderClock,
}

/// Publishers, numbered in the order of their first messages.
#[derive(Default)]
pub(super) struct Senders {
    /// The publishers, in the order of their last messages. The publisher of the latest message is at the end.
    known: Vec<Sender>,
    count: u32,
}

impl Senders {
    /// Returns the number of `publisher`.
    pub fn number(&mut self, publisher: EndpointId) -> u32 {
        self.sender(publisher).number
    }

    /// Returns the number of the sender of a message, and the age of the message.
    pub fn hear(&mut self, origin: &Origin, clocks: Clocks) -> Sent {
        let sender = self.sender(origin.publisher);
        let offset = origin.sent.map(|sent| clocks.wall.saturating_sub(sent));
        let found = || origin.known_for().and_then(|found| i64::try_from(found.as_nanos()).ok());
        let ago = offset.map_or(Duration::ZERO, |offset| sender.clock.age(offset, clocks.now, found));
        Sent { by: sender.number, ago }
    }

    /// Returns the publisher with this number.
    pub fn publisher(&self, number: u32) -> Option<EndpointId> {
        self.known.iter().find(|sender| sender.number == number).map(|sender| sender.publisher)
    }

    fn sender(&mut self, publisher: EndpointId) -> &mut Sender {
        match self.known.iter().position(|sender| sender.publisher == publisher) {
            Some(place) => self.known[place..].rotate_left(1),
            None => {
                if self.known.len() >= MOST {
                    self.known.remove(0);
                }
                self.known.push(Sender { number: self.count, publisher, clock: SenderClock::default() });
                self.count = self.count.wrapping_add(1);
            }
        }
        let last = self.known.len() - 1;
        &mut self.known[last]
    }
}
