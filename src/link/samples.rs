//! Where the joints were in the last moments.

use dq_kinematics::arm::JointKind;
use serde::{Deserialize, Serialize};
use std::collections::VecDeque;
use std::ops::Range;
use std::time::Duration;

/// Motion is compared over this time.
const WINDOW: Duration = Duration::from_millis(100);

/// Samples are at least so far apart.
const SPACING: Duration = Duration::from_millis(10);

/// Of where the joints were before so long a gap nothing is made: what they did in it is not known.
const LONGEST_GAP: Duration = Duration::from_millis(300);

/// As many as a window has, and the one before it.
const CAPACITY: usize = 12;

/// Where the joints of one arm were at a time.
#[derive(Serialize, Deserialize)]
struct JointSample {
    time: Duration,
    /// How long after the sample before.
    after: Duration,
    positions: Vec<f64>,
}

/// What the joints `joints` of all did between two times.
pub(crate) struct Displacement<'a> {
    pub joints: Range<usize>,
    pub from: Duration,
    pub to: Duration,
    /// Since the motion that was looked at before \[s\].
    pub after: f64,
    /// How far each went \[rad\].
    pub moved: &'a [f64],
}

/// The last samples of one arm, oldest first.
#[derive(Serialize, Deserialize)]
pub(crate) struct Samples {
    joints: Range<usize>,
    samples: VecDeque<JointSample>,
    /// Room for those to come.
    spare: Vec<JointSample>,
    /// Motion over the window \[rad\].
    moved: Vec<f64>,
}

impl Samples {
    /// Of the arm whose joints are `joints` of all.
    pub fn new(joints: Range<usize>) -> Self {
        let zeros = vec![0.0; joints.len()];
        let room = || JointSample { time: Duration::ZERO, after: Duration::ZERO, positions: zeros.clone() };
        let spare = std::iter::repeat_with(room).take(CAPACITY).collect();
        Self { samples: VecDeque::with_capacity(CAPACITY), spare, moved: zeros, joints }
    }

    /// Forgets them, as when the robot is another, or their times are of another clock.
    pub fn clear(&mut self) {
        self.spare.extend(self.samples.drain(..));
    }

    /// Adds `positions` \[rad, prismatic: m\] at `time`, of joints of these kinds, if that is long enough after the last; true where it did.
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

    /// The motion of the last window; none before there is one.
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
