//! The clock for a node's stamps: the system's clock, or the simulated clock on `/clock`.

use super::error::RosError;
use super::node::Node;
use dq_messages::NodeContract;
use dq_messages::messages::{ClockMessage, Header, Time};
use std::sync::Arc;
use std::sync::atomic::{AtomicI64, Ordering};

/// The clock of a node. Only stamps use it; a simulated clock does not affect deadlines or cycles.
#[derive(Clone, Debug, Default)]
pub struct Clock {
    /// The latest time on `/clock` \[ns\]; 0 before the first message; `None` for the system's clock.
    simulated: Option<Arc<AtomicI64>>,
}

impl Clock {
    /// Creates the clock of `node`. The clock follows `/clock` if `simulated` is true.
    ///
    /// # Errors
    /// [`RosError`].
    pub fn new(node: &mut Node, contract: &NodeContract, simulated: bool) -> Result<Self, RosError> {
        if !simulated {
            return Ok(Self::default());
        }
        let (clock, time) =
            (node.subscription::<ClockMessage>(contract, "/clock")?, Arc::new(AtomicI64::new(0)));
        let newest = time.clone();
        node.run(async move {
            loop {
                newest.store(clock.next().await.clock.nanoseconds(), Ordering::Relaxed);
            }
        });
        Ok(Self { simulated: Some(time) })
    }

    /// Returns whether the clock is simulated. Stamps of a simulated clock do not show how late a message is.
    pub fn is_simulated(&self) -> bool {
        self.simulated.is_some()
    }

    /// Returns the time; 0 before the first message on `/clock`.
    pub fn now(&self) -> Time {
        match &self.simulated {
            None => Time::now(),
            Some(time) => Time::from_nanoseconds(time.load(Ordering::Relaxed)),
        }
    }

    /// Returns a header with the current time.
    pub fn header(&self, frame_id: &str) -> Header {
        Header { stamp: self.now(), frame_id: frame_id.to_owned() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stamps_follow_a_simulated_clock_including_its_jumps() {
        let time = Arc::new(AtomicI64::new(0));
        let clock = Clock { simulated: Some(time.clone()) };
        assert!(clock.is_simulated() && clock.now().is_zero());
        for nanoseconds in [5_000_000_001, 5_000_000_001, 900_000_000_000, 7] {
            time.store(nanoseconds, Ordering::Relaxed);
            assert_eq!(clock.header("base").stamp.nanoseconds(), nanoseconds);
        }
        assert!(!Clock::default().is_simulated() && Clock::default().now().sec > 1_790_000_000);
    }
}
