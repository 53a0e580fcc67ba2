//! The joint positions of the last 100 ms.

use dq_kinematics::arm::JointKind;
use serde::{Deserialize, Serialize};
use std::collections::VecDeque;
use std::ops::Range;
use std::time::Duration;

/// The time over which commands and motion are compared.
const WINDOW: Duration = Duration::from_millis(100);

/// Least time between two samples.
const SPACING: Duration = Duration::from_millis(10);

/// Longest time between two samples. If it is exceeded, the earlier samples are dropped, because the motion between the two samples
/// is unknown.
const LONGEST_GAP: Duration = Duration::from_millis(300);

/// Number of samples that are kept. It suffices for one sample per [`SPACING`] in a [`WINDOW`], and for the last sample before the
/// window.
const CAPACITY: usize = 12;

/// The joint positions of one arm at one time.
#[derive(Serialize, Deserialize)]
struct JointSample {
    time: Duration,
    /// Time since the previous sample.
    after: Duration,
    positions: Vec<f64>,
}

/// The displacement of the joints `joints` between two times. `joints` are indices among the joints of all arms.
pub(crate) struct Displacement<'a> {
    pub joints: Range<usize>,
    pub from: Duration,
    pub to: Duration,
    /// The time from the end of the previous displacement to the end of this one \[s\].
    pub after: f64,
    /// The displacement of each joint \[rad, prismatic: m\].
    pub moved: &'a [f64],
}

/// The latest samples of one arm, the oldest first.
#[derive(Serialize, Deserialize)]
pub(crate) struct Samples {
    joints: Range<usize>,
    samples: VecDeque<JointSample>,
    /// Unused samples, which are kept to avoid allocations.
    spare: Vec<JointSample>,
    /// Displacement over the window \[rad, prismatic: m\].
    moved: Vec<f64>,
}

impl Samples {
    /// Creates the samples of an arm. `joints` are the indices of its joints among the joints of all arms.
    pub fn new(joints: Range<usize>) -> Self {
        let zeros = vec![0.0; joints.len()];
        let room = || JointSample { time: Duration::ZERO, after: Duration::ZERO, positions: zeros.clone() };
        let spare = std::iter::repeat_with(room).take(CAPACITY).collect();
        Self { samples: VecDeque::with_capacity(CAPACITY), spare, moved: zeros, joints }
    }

    /// Drops all samples, for example because the robot or the clock has changed.
    pub fn clear(&mut self) {
        self.spare.extend(self.samples.drain(..));
    }

    /// Adds `positions` \[rad, prismatic: m\] at `time` unless the last sample is too recent. Returns whether it added a sample.
    pub fn add(&mut self, time: Duration, positions: &[f64], kinds: &[JointKind]) -> bool {
        if self.samples.back().is_some_and(|last| time > last.time + LONGEST_GAP) {
            self.clear();
        }
        let after = match self.samples.back() {
            Some(last) if time < last.time + SPACING => return false,
            Some(last) => time.saturating_sub(last.time),
            None => Duration::ZERO,
        };
        let Some(mut sample) = self.spare.pop().or_else(|| self.samples.pop_front()) else { return false };
        (sample.time, sample.after) = (time, after);
        sample.positions.copy_from_slice(positions);
        self.samples.push_back(sample);
        self.measure(kinds);
        true
    }

    /// Returns the displacement over the last window; `None` until the samples span a window.
    pub fn displacement(&self) -> Option<Displacement<'_>> {
        let (from, to) = self.ends()?;
        let after = to.after.as_secs_f64();
        Some(Displacement {
            joints: self.joints.clone(),
            from: from.time,
            to: to.time,
            after,
            moved: &self.moved,
        })
    }

    fn ends(&self) -> Option<(&JointSample, &JointSample)> {
        let to = self.samples.back()?;
        let from = self.samples.iter().rev().find(|it| to.time.saturating_sub(it.time) >= WINDOW)?;
        Some((from, to))
    }

    fn measure(&mut self, kinds: &[JointKind]) {
        let mut moved = std::mem::take(&mut self.moved);
        if let Some((from, to)) = self.ends() {
            let pairs = from.positions.iter().zip(&to.positions).zip(kinds);
            for (slot, ((from, to), kind)) in moved.iter_mut().zip(pairs) {
                *slot = kind.displacement(*from, *to);
            }
        }
        self.moved = moved;
    }
}
