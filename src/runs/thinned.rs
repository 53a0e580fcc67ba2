//! A time series whose length is limited to what a figure can show.

use std::ops::{Deref, DerefMut};

/// A time series of limited length. Whenever the series is full, it drops every second entry. Of the entries that are added later, it
/// keeps only every second, then every fourth, and so on. It always keeps the first and the last entry.
#[derive(Clone, Debug)]
pub struct Thinned<T> {
    /// The entries that are kept: every `stride`th one, and the last one.
    kept: Vec<T>,
    stride: usize,
    came: usize,
    most: usize,
    merge: fn(&mut T, &T),
}

impl<T> Thinned<T> {
    /// Creates an empty series of at most `most` entries. When an entry is dropped, `merge(next, dropped)` copies into the next
    /// entry the information that must not be lost.
    pub(super) fn new(most: usize, merge: fn(&mut T, &T)) -> Self {
        Self { kept: Vec::new(), stride: 1, came: 0, most, merge }
    }

    /// Adds the next entry.
    pub(super) fn push(&mut self, mut next: T) {
        let stays = self.came.saturating_sub(1).is_multiple_of(self.stride);
        if !stays && let Some(last) = self.kept.pop() {
            (self.merge)(&mut next, &last);
        }
        if self.kept.len() >= self.most {
            self.halve(&mut next);
        }
        self.kept.push(next);
        self.came += 1;
    }

    /// Drops every other entry, and merges each dropped entry into the entry after it. `next` is the entry to be added afterwards.
    fn halve(&mut self, next: &mut T) {
        let mut going = None;
        for (i, mut entry) in std::mem::take(&mut self.kept).into_iter().enumerate() {
            if i % 2 == 1 {
                going = Some(entry);
                continue;
            }
            going.take().iter().for_each(|going| (self.merge)(&mut entry, going));
            self.kept.push(entry);
        }
        going.iter().for_each(|going| (self.merge)(next, going));
        self.stride *= 2;
    }
}

impl<T> Deref for Thinned<T> {
    type Target = [T];
    fn deref(&self) -> &[T] {
        &self.kept
    }
}

impl<T> DerefMut for Thinned<T> {
    fn deref_mut(&mut self) -> &mut [T] {
        &mut self.kept
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_long_list_keeps_both_ends_and_what_must_not_be_lost() {
        let mut list = Thinned::new(8, |next: &mut (usize, bool), gone| next.1 |= gone.1);
        for number in 0..1000 {
            list.push((number, number % 100 == 37));
            assert_eq!(list.last().map(|last| last.0), Some(number));
            assert!(list.len() <= 8 + 1 && list[0].0 == 0);
            assert!(list.windows(2).all(|pair| pair[0].0 < pair[1].0), "{list:?}");
        }
        assert!(list.len() > 4 && list.iter().filter(|(_, marked)| *marked).count() > 3, "{list:?}");
        let mut short = Thinned::new(8, |_, _| {});
        (0..8).for_each(|number| short.push(number));
        assert_eq!(*short, [0, 1, 2, 3, 4, 5, 6, 7]);
    }
}
