//! Who holds a stick: the publishers of twists, and since when each asks for motion.

use super::arbiter::Arbiter;
use std::time::Duration;

/// So many publishers of twists are remembered; while there are more, no other one is heard.
const MOST: usize = 16;

/// A publisher of twists that holds its stick.
#[derive(Clone, Copy, Debug)]
struct Stick {
    publisher: u32,
    heard: Duration,
    /// When it pushed the stick that it holds.
    pushed: Duration,
}

/// The publishers of twists.
#[derive(Clone, Debug)]
pub(super) struct Sticks {
    sticks: Vec<Stick>,
    arbiter: Arbiter,
}

impl Default for Sticks {
    fn default() -> Self {
        Self { sticks: Vec::with_capacity(MOST), arbiter: Arbiter::default() }
    }
}

impl Sticks {
    /// Hears a twist that is not zero, which was sent at `sent` and came at `now`: since when its publisher pushes the stick. A publisher
    /// that is silent for `released` has let go of it. None where another publisher's twist, younger than `timeout`, is in force.
    pub fn push(
        &mut self,
        publisher: u32,
        (sent, now): (Duration, Duration),
        (released, timeout): (Duration, Duration),
    ) -> Option<Duration> {
        self.sticks.retain(|stick| now.saturating_sub(stick.heard) <= released);
        let is_known = self.sticks.iter().any(|stick| stick.publisher == publisher);
        if !is_known && self.sticks.len() < MOST {
            self.sticks.push(Stick { publisher, heard: now, pushed: sent });
        }
        let stick = self.sticks.iter_mut().find(|stick| stick.publisher == publisher)?;
        stick.heard = now;
        let pushed = stick.pushed;
        self.arbiter.hear(publisher, now, timeout).then_some(pushed)
    }

    /// Hears a twist of zero: its publisher has let go of the stick.
    pub fn release(&mut self, publisher: u32) {
        self.sticks.retain(|stick| stick.publisher != publisher);
    }

    /// Whether the publisher has held its stick, without a silence longer than `released`, until `now`.
    pub fn is_held(&self, publisher: u32, now: Duration, released: Duration) -> bool {
        let held =
            |stick: &Stick| stick.publisher == publisher && now.saturating_sub(stick.heard) <= released;
        self.sticks.iter().any(held)
    }

    /// The two publishers that push at the same time, if there are two.
    pub fn rivals(&mut self, now: Duration) -> Option<(u32, u32)> {
        self.arbiter.rivals(now)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: Duration = Duration::from_millis(1);
    const TIMES: (Duration, Duration) = (Duration::from_secs(1), Duration::from_millis(100));

    #[test]
    fn a_stick_is_pushed_anew_after_a_zero_of_its_own_publisher_or_a_silence() {
        let mut sticks = Sticks::default();
        let push =
            |sticks: &mut Sticks, publisher, ms: u32| sticks.push(publisher, (ms * MS, ms * MS), TIMES);
        assert_eq!(push(&mut sticks, 1, 0), Some(Duration::ZERO));
        assert_eq!(push(&mut sticks, 1, 999), Some(Duration::ZERO), "a hole is no release");
        sticks.release(2);
        assert_eq!(push(&mut sticks, 1, 1500), Some(Duration::ZERO), "another publisher's zero is none");
        sticks.release(1);
        assert_eq!(push(&mut sticks, 1, 1600), Some(1600 * MS));
        assert_eq!(push(&mut sticks, 1, 2601), Some(2601 * MS));
    }

    #[test]
    fn of_two_that_push_the_first_counts_and_both_are_named() {
        let mut sticks = Sticks::default();
        assert!(sticks.push(1, (MS, MS), TIMES).is_some());
        assert_eq!(sticks.push(2, (2 * MS, 2 * MS), TIMES), None);
        assert!(sticks.push(1, (3 * MS, 3 * MS), TIMES).is_some());
        assert_eq!(sticks.rivals(3 * MS), Some((1, 2)));
    }

    #[test]
    fn so_many_publishers_that_no_memory_suffices_push_nothing_anew() {
        let mut sticks = Sticks::default();
        for publisher in 0..100 {
            sticks.push(publisher, (MS, MS), TIMES);
        }
        assert_eq!(sticks.sticks.len(), MOST);
        assert_eq!(sticks.push(0, (2 * MS, 2 * MS), TIMES), Some(MS));
    }
}
