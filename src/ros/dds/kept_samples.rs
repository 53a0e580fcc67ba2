//! How many samples RustDDS keeps of a topic that is read.
//!
//! RustDDS 0.15.1 keeps as many samples of a topic as the largest `max_samples` of its descriptions says, whether they have been taken or
//! not, and whatever their size (`dds_cache.rs`). So there are few before the size of the messages is known, and as many as have room then.
//! This goes when it drops what every reader has taken.

use std::collections::VecDeque;

/// It can be made to keep more, but never fewer again.
pub(crate) const FEWEST_SAMPLES: i32 = 128;
const MOST_SAMPLES: i32 = 10_000;

/// The room for the samples of a topic \[bytes\], where messages stay as large as the first ones.
const ROOM: usize = 32 << 20;

/// What the last samples may have at most \[bytes\], where later messages are larger.
const LIMIT: usize = 256 << 20;

/// What RustDDS takes for a sample besides its payload \[bytes\], as measured.
const OVERHEAD: usize = 500;

/// What RustDDS keeps of a topic.
pub(crate) struct Kept {
    samples: i32,
    largest: usize,
    /// Of the last samples, as many as are kept \[bytes\], and their sum.
    sizes: VecDeque<usize>,
    sum: usize,
}

impl Default for Kept {
    fn default() -> Self {
        Self { samples: FEWEST_SAMPLES, largest: 0, sizes: VecDeque::new(), sum: 0 }
    }
}

/// Whether there is room for the samples of a topic.
#[derive(Debug, PartialEq)]
pub(crate) enum Room {
    Enough,
    /// For that many.
    More(i32),
    None,
}

impl Kept {
    /// One more sample of so many bytes.
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
