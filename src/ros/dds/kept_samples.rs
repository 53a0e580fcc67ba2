//! Chooses how many samples of a topic RustDDS stores for its readers.
//!
//! The number of samples that RustDDS 0.15.1 stores for a topic is the largest `max_samples` among all descriptions of the topic in
//! this process. RustDDS keeps the samples even after they were taken, and regardless of their size (`dds_cache.rs`). So this
//! module keeps `max_samples` small until it knows the size of the messages. Then it makes the number as large as the memory budget
//! allows. Delete this module when RustDDS drops samples that every reader has taken.

use std::collections::VecDeque;

/// The number of samples that RustDDS stores at first. RustDDS can increase the number, but never decrease it.
pub(crate) const FEWEST_SAMPLES: i32 = 128;
/// The largest number of stored samples.
const MOST_SAMPLES: i32 = 10_000;

/// The memory budget for the stored samples of a topic \[bytes\]. The number of stored samples is the budget divided by the size of
/// the largest sample so far. The number never decreases. If later messages are larger, the samples need more than the budget.
const ROOM: usize = 32 << 20;

/// The limit for the memory of a topic's stored samples \[bytes\]. If the samples need more, the subscription ends.
const LIMIT: usize = 256 << 20;

/// The memory that RustDDS needs for a sample in addition to its payload \[bytes\], measured.
const OVERHEAD: usize = 500;

/// The sizes of the samples that RustDDS stores for a topic.
pub(crate) struct Kept {
    samples: i32,
    largest: usize,
    /// The sizes of the stored samples \[bytes\].
    sizes: VecDeque<usize>,
    /// The sum of `sizes`.
    sum: usize,
}

impl Default for Kept {
    fn default() -> Self {
        Self { samples: FEWEST_SAMPLES, largest: 0, sizes: VecDeque::new(), sum: 0 }
    }
}

/// Whether there is memory for further samples of a topic.
#[derive(Debug, PartialEq)]
pub(crate) enum Room {
    Enough,
    /// There is memory for more samples: RustDDS may store this many samples of the topic.
    More(i32),
    None,
}

impl Kept {
    /// Adds one sample with a payload of this size, and returns whether there is memory for more.
    pub fn take(&mut self, bytes: usize) -> Room {
        let size = bytes + OVERHEAD;
        self.sizes.push_back(size);
        self.sum += size;
        while self.sizes.len() > usize::try_from(self.samples).unwrap_or(0) {
            self.sum -= self.sizes.pop_front().unwrap_or(0);
        }
        if self.sum > LIMIT {
            return Room::None;
        }
        self.largest = self.largest.max(size);
        let fit = i32::try_from(ROOM / self.largest).unwrap_or(MOST_SAMPLES).min(MOST_SAMPLES);
        if fit <= self.samples {
            return Room::Enough;
        }
        self.samples = fit;
        Room::More(fit)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn as_many_samples_are_kept_as_have_room() {
        let mut small = Kept::default();
        assert_eq!(small.take(200), Room::More(MOST_SAMPLES));
        assert!((0..100_000).all(|_| small.take(200) == Room::Enough));
        let mut large = Kept::default();
        assert!(
            (0..100_000).all(|_| large.take(1 << 20) == Room::Enough),
            "FEWEST_SAMPLES of 1 MB are 128 MB"
        );
        let until_full = (0..).take_while(|_| small.take(1 << 20) == Room::Enough).count();
        assert!((200..=256).contains(&until_full), "{until_full}");
    }
}
