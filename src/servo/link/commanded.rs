//! What has been commanded lately: with it, what a late joint state cannot show yet is known.

use std::collections::VecDeque;
use std::ops::Range;
use std::time::Duration;

/// How far back commands are remembered: the window in which motion is compared and the longest delay, twice over.
const MEMORY: Duration = Duration::from_millis(700);

/// No robot is expected to hold a command longer than this without another.
const LONGEST_HOLD: Duration = Duration::from_millis(100);

/// The way that the commands of the last moments should have taken each joint.
pub(super) struct Commanded {
    /// Oldest first; between two entries the speed is constant.
    entries: VecDeque<Entry>,
    capacity: usize,
    /// Sum of all commands up to the last entry \[rad\].
    travel: Vec<f64>,
    /// In force since the last entry [rad/s].
    speed: Vec<f64>,
}

struct Entry {
    time: Duration,
    travel: Vec<f64>,
}

impl Commanded {
    /// Nothing commanded yet to `joint_count` joints, by a cycle of `period`.
    pub fn new(joint_count: usize, period: Duration) -> Self {
        let cycles = MEMORY.as_nanos() / period.as_nanos().max(1) + 2;
        let capacity = usize::try_from(cycles).unwrap_or(usize::MAX).min(2000);
        let zeros = vec![0.0; joint_count];
        Self { entries: VecDeque::with_capacity(capacity), capacity, travel: zeros.clone(), speed: zeros }
    }

    /// Joint velocities [rad/s] that are in force from `now` on.
    pub fn hold(&mut self, now: Duration, command: &[f64]) {
        let last = self.entries.back().map_or(now, |entry| entry.time);
        if now < last {
            // The clock went back: what was when is not known any more.
            self.entries.clear();
        }
        let held = now.saturating_sub(last).min(LONGEST_HOLD).as_secs_f64();
        self.travel.iter_mut().zip(&self.speed).for_each(|(sum, speed)| *sum += speed * held);
        self.speed.copy_from_slice(command);
        let full = self.entries.len() >= self.capacity;
        let mut entry = match full.then(|| self.entries.pop_front()).flatten() {
            Some(oldest) => oldest,
            None => Entry { time: now, travel: self.travel.clone() },
        };
        entry.time = now;
        entry.travel.copy_from_slice(&self.travel);
        self.entries.push_back(entry);
    }

    /// How far the joints of `range` should have gone from one time to another \[rad\], written to `into`.
    pub fn travel(&self, range: Range<usize>, from: Duration, to: Duration, into: &mut [f64]) {
        let (from, to) = (self.locate(from), self.locate(to));
        for (slot, joint) in into.iter_mut().zip(range) {
            *slot = self.at(joint, &to) - self.at(joint, &from);
        }
    }

    /// The entry before `time`, and how long before \[s\].
    fn locate(&self, time: Duration) -> Option<(usize, f64)> {
        let after = self.entries.partition_point(|entry| entry.time <= time);
        let index = after.checked_sub(1)?;
        let since = time.saturating_sub(self.entries[index].time).min(LONGEST_HOLD);
        Some((index, since.as_secs_f64()))
    }

    fn at(&self, joint: usize, place: &Option<(usize, f64)>) -> f64 {
        let Some((index, since)) = place else {
            return self.entries.front().map_or(0.0, |entry| entry.travel[joint]);
        };
        let entry = &self.entries[*index];
        let speed = match self.entries.get(index + 1) {
            Some(next) => {
                let held = next.time.saturating_sub(entry.time).min(LONGEST_HOLD).as_secs_f64();
                if held > 0.0 { (next.travel[joint] - entry.travel[joint]) / held } else { 0.0 }
            }
            None => self.speed[joint],
        };
        entry.travel[joint] + speed * since
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: Duration = Duration::from_millis(1);

    fn travel(commanded: &Commanded, from: u32, to: u32) -> f64 {
        let mut out = [0.0];
        commanded.travel(0..1, from * MS, to * MS, &mut out);
        out[0]
    }

    #[test]
    fn the_way_between_two_times_is_the_sum_of_the_commands_between() {
        let mut commanded = Commanded::new(1, 2 * MS);
        for cycle in 0..10 {
            commanded.hold(cycle * 2 * MS, &[f64::from(cycle)]);
        }
        // 3 rad/s from 6 to 8 ms, 4 from 8 to 10; half of the first.
        assert!((travel(&commanded, 7, 10) - (0.003 + 0.008)).abs() < 1e-15);
        assert_eq!(travel(&commanded, 7, 7), 0.0);
        // The last one goes on, but for ever it does not.
        assert!((travel(&commanded, 18, 20) - 0.018).abs() < 1e-15);
        assert!((travel(&commanded, 18, 1000) - 0.9).abs() < 1e-12);
    }

    #[test]
    fn memory_is_bounded_and_a_clock_that_goes_back_forgets() {
        let mut commanded = Commanded::new(1, 2 * MS);
        for cycle in 1000..5000 {
            commanded.hold(cycle * 2 * MS, &[1.0]);
        }
        assert_eq!(commanded.entries.len(), commanded.capacity);
        assert!((travel(&commanded, 9000, 10000) - 0.7).abs() < 0.01, "as far back as it goes");
        commanded.hold(MS, &[1.0]);
        assert_eq!(travel(&commanded, 0, 1), 0.0);
        assert!((travel(&commanded, 1, 3) - 0.002).abs() < 1e-15);
    }
}
