//! Whether the goals of a stream are made from the measured pose: then they move with the tool, and their motion is nobody's.
//!
//! Visual servoing, hand guiding or "1 cm lower than now" publish the pose that was measured a moment ago with an offset. The velocity of
//! such a goal is the tool's own of a moment ago. To feed it forward would add it to the law's, which makes the goal faster still: the arm
//! would run away. A goal that moves by itself is seen at once from a tool that stands, or goes elsewhere. So a goal's motion counts as
//! its own only once no offset and no lag explains it by the tool's.

use dq_algebra::UnitDualQuaternion;
use serde::{Deserialize, Serialize};
use std::collections::VecDeque;
use std::time::Duration;

/// The pose may be so old when it comes back as a goal, in these steps.
const LONGEST_LAG: Duration = Duration::from_millis(300);
const STEP: Duration = Duration::from_millis(10);
const LAGS: usize = 31;

/// A goal must have gone so far [m, rad] before its motion is judged, which is more than noise of a measured pose ...
const TRAVEL: [f64; 2] = [5e-3, 2e-2];

/// ... and is no motion of the tool's if it differs from each of those by this part of that travel, and by what the tool goes in a step.
const OWN: f64 = 0.3;

/// Where the tool was at a time.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
struct Sample {
    time: Duration,
    pose: UnitDualQuaternion,
}

/// Compares goals with where the tool was before.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct FedBack {
    tool: VecDeque<Sample>,
    /// The first goal of the stream, and where the tool was then, a lag after the other.
    first: Option<(UnitDualQuaternion, [UnitDualQuaternion; LAGS])>,
    /// How far the goal went at most \[m, rad\], and how far from there each lag would have taken it at most.
    travel: [f64; 2],
    off: [[f64; 2]; LAGS],
    /// How far the tool went in a step at most \[m, rad\].
    step: [f64; 2],
    moves_by_itself: bool,
}

impl Default for FedBack {
    fn default() -> Self {
        Self {
            tool: VecDeque::with_capacity(LAGS + 1),
            first: None,
            travel: [0.0; 2],
            off: [[0.0; 2]; LAGS],
            step: [0.0; 2],
            moves_by_itself: false,
        }
    }
}

impl FedBack {
    /// Begins anew with the next goal.
    pub fn restart(&mut self) {
        (self.first, self.travel, self.off) = (None, [0.0; 2], [[0.0; 2]; LAGS]);
        (self.step, self.moves_by_itself) = ([0.0; 2], false);
    }

    /// Notes where the tool is measured at `now`.
    pub fn note(&mut self, now: Duration, pose: UnitDualQuaternion) {
        if self.tool.back().is_some_and(|last| now < last.time + STEP) {
            return;
        }
        while self.tool.len() > LAGS
            || self.tool.front().is_some_and(|first| first.time + LONGEST_LAG + STEP < now)
        {
            self.tool.pop_front();
        }
        self.tool.push_back(Sample { time: now, pose });
    }

    /// Where the tool was at that time: the last sample not after it, or the first.
    fn at(&self, time: Duration) -> Option<UnitDualQuaternion> {
        let after = self.tool.partition_point(|sample| sample.time <= time);
        self.tool.get(after.saturating_sub(1)).map(|sample| sample.pose)
    }

    /// Looks at a goal of the stream that came at `now`.
    pub fn look(&mut self, now: Duration, goal: &UnitDualQuaternion) {
        if self.moves_by_itself || self.tool.is_empty() {
            return;
        }
        let tool = std::array::from_fn(|lag| {
            let lag = STEP * u32::try_from(lag).unwrap_or_default();
            self.at(now.saturating_sub(lag)).unwrap_or(*goal)
        });
        let (first_goal, first_tool) = *self.first.get_or_insert((*goal, tool));
        let larger = |one: [f64; 2], other: [f64; 2]| std::array::from_fn(|part| one[part].max(other[part]));
        self.travel = larger(self.travel, first_goal.distances(goal));
        for pair in tool.windows(2) {
            self.step = larger(self.step, pair[0].distances(&pair[1]));
        }
        for ((off, before), now) in self.off.iter_mut().zip(&first_tool).zip(&tool) {
            *off = larger(*off, difference([before, now], [&first_goal, goal]));
        }
        self.moves_by_itself = (0..2).any(|part| {
            let least = self.off.iter().map(|off| off[part]).fold(f64::INFINITY, f64::min);
            self.travel[part] >= TRAVEL[part] && least >= OWN * self.travel[part] + self.step[part]
        });
    }

    /// Whether the goals of the stream move by themselves.
    pub fn moves_by_itself(&self) -> bool {
        self.moves_by_itself
    }
}

/// By how much [m, rad] a goal's motion differs from a tool's: the offset of the goal is constant along the base's axes or along the
/// tool's.
fn difference(
    [tool_before, tool]: [&UnitDualQuaternion; 2],
    [goal_before, goal]: [&UnitDualQuaternion; 2],
) -> [f64; 2] {
    let by_tool = (tool_before.conjugate() * *goal_before).distances(&(tool.conjugate() * *goal));
    let step = |from: &UnitDualQuaternion, to: &UnitDualQuaternion| to.translation() - from.translation();
    let by_base = (step(goal_before, goal) - step(tool_before, tool)).norm();
    let turned =
        |from: &UnitDualQuaternion, to: &UnitDualQuaternion| to.rotation() * from.rotation().inverse();
    let turned_by_base = turned(goal_before, goal).angle_to(&turned(tool_before, tool));
    [by_tool[0].min(by_base), by_tool[1].min(turned_by_base)]
}
