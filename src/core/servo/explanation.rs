//! Determines whether a goal only repeats the motion of the tool. There are two such cases:
//!
//! 1. A program publishes the tool's pose of a moment ago with an offset, as in visual servoing, hand guiding, or "1 cm lower than
//!    now". Feeding the velocity of such a goal forward would add the tool's own velocity to the law's. The arm would run away,
//!    because it would chase a goal that moves with it.
//! 2. The frame of the goal is on the tool, or on an object that the tool has grasped. The law would drive the arm toward such a goal
//!    forever.
//!
//! One question covers both cases: does the tool's recent motion equal the goal's motion, up to a lag and a constant offset? If so,
//! the tool's motion *explains* the goal's motion. The servo answers this question whenever a goal arrives, for a sliding window.
//!
//! A tool that tracks its goal well explains the goal's motion, too: at lag zero. In that case, the previous answer remains in force.

mod places;

use dq_algebra::UnitDualQuaternion;
use dq_metrics::{GoalError, Tolerance};
use nalgebra::{UnitQuaternion, Vector3};
use places::{Place, Spread, alike, noise};
use serde::{Deserialize, Serialize};
use std::collections::VecDeque;
use std::time::Duration;

/// The length of the sliding window \[s\].
const WINDOW: f64 = 0.6;

/// The least time between two goals that are compared \[s\].
const GOAL_STEP: f64 = 0.019;
/// The least number of goals for a comparison.
const FEWEST: usize = 4;
/// The largest number of goals that are kept.
const MOST_GOALS: usize = 33;

/// Number of lags that are tried in addition to lag zero. `LAGS` times `LAG_STEP` is the longest delay with which the servo
/// recognizes that a goal repeats an earlier pose of the tool. Goals with a longer delay hardly make the arm run away.
const LAGS: u32 = 30;
/// The difference between two successive lags \[s\].
const LAG_STEP: f64 = 0.05;

/// Number of times that [`LAG_STEP`] is halved to refine the best lag.
const HALVINGS: i32 = 4;

/// The interval at which the tool's poses are kept \[s\].
const TOOL_STEP: f64 = 0.0099;
/// The largest number of tool poses that are kept. They cover the window and, before it, the longest lag.
const MOST_POSES: usize = 214;

/// A goal counts as moving if its root mean square spread is at least this \[m, rad\]. For a uniform motion along a line, this
/// spread is reached after 5 mm or 0.02 rad.
const MOVES: [f64; 2] = [1.5e-3, 6e-3];

/// The factor of the spread in the test of whether a goal moves independently of the tool.
///
/// Let `s` be the spread of the goal's poses, `n` their noise, and `r` the part of the goal's motion not explained by the tool's
/// motion. The goal moves independently if `r > √((BY_ITSELF · s)² + (NOISE · n)²)`.
const BY_ITSELF: f64 = 0.05;
/// The factor of the noise `n` in the test described at [`BY_ITSELF`].
const NOISE: f64 = 3.0;

/// The tool counts as tracking a goal if its error is below this fraction of the error that the law has without feed-forward.
const FOLLOWED: f64 = 0.4;

/// The tool counts as having reached a goal if the error is at most this many tolerances.
const REACHED: f64 = 10.0;

/// The tool counts as carrying a goal if the tool has moved this far \[m, rad\] and its motion still explains the goal's motion.
const CARRIED: [f64; 2] = [0.1, 0.3];

/// Compares the motion of a goal with the motion of the tool. Each array of two has an element for position and one for rotation.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct Explanation {
    tool: VecDeque<Place>,
    goals: VecDeque<Place>,
    /// When the goal last jumped \[s\]. A jump is not a motion. So the test for independent motion ignores goals before the jump.
    leapt: f64,
    by_itself: [bool; 2],
    /// The tool's pose when the tool began to carry the goal; `None` if the tool does not carry the goal.
    carries_since: Option<UnitDualQuaternion>,
}

/// The error of the tool with respect to its goal, and the numbers by which the servo judges whether the tool is near the goal.
#[derive(Clone, Copy, Debug)]
pub(super) struct Nearness {
    pub error: GoalError,
    pub tolerance: Tolerance,
    /// The law's rates for position and rotation [1/s].
    pub rates: [f64; 2],
}

/// What moves the goal's position, or its rotation, in the window.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Motion {
    /// Nothing moves the goal, or there are too few goals to tell.
    None,
    /// The tool carries the goal.
    Tool,
    /// The goal moves independently of the tool.
    Goal,
}

impl Default for Explanation {
    fn default() -> Self {
        Self {
            tool: VecDeque::with_capacity(MOST_POSES),
            goals: VecDeque::with_capacity(MOST_GOALS),
            leapt: 0.0,
            by_itself: [false; 2],
            carries_since: None,
        }
    }
}

impl Explanation {
    /// Clears the goals, and the conclusions from them. Keeps the tool's poses.
    pub fn restart(&mut self) {
        self.goals.clear();
        (self.by_itself, self.carries_since) = ([false; 2], None);
    }

    /// Adds the measured pose of the tool at `now`. If the two newest stored poses are less than `TOOL_STEP` seconds apart, the new
    /// pose replaces the newer of them.
    pub fn note(&mut self, now: Duration, pose: UnitDualQuaternion) {
        let mut place = Place::of(now, &pose);
        if let Some(last) = self.tool.back() {
            place.turn = alike(&place.turn, &last.turn);
        }
        let mut latest = self.tool.iter().rev().map(|place| place.time);
        if let (Some(last), Some(before)) = (latest.next(), latest.next())
            && last < before + TOOL_STEP
        {
            self.tool.pop_back();
        }
        if self.tool.len() >= MOST_POSES {
            self.tool.pop_front();
        }
        self.tool.push_back(place);
    }

    /// Compares the motion of `goal`, which arrived at `now`, with the motion of the tool. `goes_on` says whether the goal continues
    /// the stream without a jump. Returns false if the goal is ignored because the last compared goal arrived less than `GOAL_STEP`
    /// earlier.
    pub fn compare(
        &mut self,
        now: Duration,
        goal: &UnitDualQuaternion,
        goes_on: bool,
        nearness: &Nearness,
    ) -> bool {
        let place = Place::of(now, goal);
        if !goes_on {
            (self.leapt, self.by_itself) = (place.time, [false; 2]);
        }
        if self.goals.back().is_some_and(|last| place.time < last.time + GOAL_STEP) {
            return false;
        }
        let is_old = |first: &Place| first.time + WINDOW < place.time;
        while self.goals.len() >= MOST_GOALS || self.goals.front().is_some_and(is_old) {
            self.goals.pop_front();
        }
        self.goals.push_back(place);
        let motions = self.motions(self.leapt);
        let follows = self.follows(nearness);
        for part in 0..2 {
            self.by_itself[part] = match motions[part] {
                Motion::Goal => true,
                Motion::Tool => self.by_itself[part] && follows[part],
                Motion::None => false,
            };
        }
        true
    }

    /// Returns, for the goal's position and for its rotation, whether it moves independently of the tool.
    pub fn moves_by_itself(&self) -> [bool; 2] {
        self.by_itself
    }

    /// Returns whether the `tool` carries the goal: the tool has moved together with the goal, but has neither reached nor tracked
    /// the goal.
    pub fn is_carried(&mut self, tool: &UnitDualQuaternion, nearness: &Nearness) -> bool {
        let Nearness { error, tolerance, .. } = nearness;
        let errors = [error.position / tolerance.linear, error.rotation / tolerance.angular];
        let (motions, follows) = (self.motions(0.0), self.follows(nearness));
        let recedes = |part: usize| motions[part] == Motion::Tool && errors[part] > REACHED && !follows[part];
        if motions.contains(&Motion::Goal) || !(0..2).any(recedes) {
            self.carries_since = None;
            return false;
        }
        let travelled = self.carries_since.get_or_insert(*tool).distances(tool);
        (0..2).any(|part| recedes(part) && travelled[part] >= CARRIED[part])
    }

    /// Returns, for position and rotation, whether feed-forward brings the tool nearer to its goal. This is so if the error is
    /// clearly smaller than the error that the law would leave at the goal's speed without feed-forward.
    fn follows(&self, nearness: &Nearness) -> [bool; 2] {
        let (Some(first), Some(last)) = (self.goals.front(), self.goals.back()) else { return [false; 2] };
        let Nearness { error, rates, .. } = nearness;
        let (travelled, seconds) = (first.distances(last), last.time - first.time);
        let errors = [error.position, error.rotation];
        std::array::from_fn(|part| errors[part] * rates[part] * seconds <= FOLLOWED * travelled[part])
    }

    /// Returns what has moved the goal's position, and what has moved its rotation. Considers only the kept goals since the time
    /// `since`.
    fn motions(&self, since: f64) -> [Motion; 2] {
        let first = self.goals.partition_point(|goal| goal.time < since);
        let goals = || self.goals.range(first..);
        if goals().len() < FEWEST || self.tool.len() < 2 {
            return [Motion::None; 2];
        }
        let mut spread = Spread::default();
        goals().for_each(|goal| spread.add(goal.point, goal.turn));
        let spread = spread.sizes();
        let moves = |part: usize| spread[part] >= MOVES[part];
        if !(0..2).any(moves) {
            return [Motion::None; 2];
        }
        let (noise, left) = (noise(goals()), self.least_unexplained(first));
        std::array::from_fn(|part| {
            let explained = (BY_ITSELF * spread[part]).powi(2) + (NOISE * noise[part]).powi(2);
            match left[part].powi(2) > explained {
                _ if !moves(part) => Motion::None,
                true => Motion::Goal,
                false => Motion::Tool,
            }
        })
    }

    /// Returns the part of the goals' motion that is not explained by the tool's motion, at the lag for which this part is smallest
    /// \[m, rad\]. Considers only the goals from index `first` on.
    fn least_unexplained(&self, first: usize) -> [f64; 2] {
        let mut best = [(0.0, f64::INFINITY); 2];
        let look = |lag: f64, best: &mut [(f64, f64); 2]| {
            for (best, left) in best.iter_mut().zip(self.unexplained(first, lag)) {
                if left < best.1 {
                    *best = (lag, left);
                }
            }
        };
        (0..=LAGS).for_each(|lag| look(f64::from(lag) * LAG_STEP, &mut best));
        for halving in 1..=HALVINGS {
            let step = LAG_STEP * 0.5_f64.powi(halving);
            for lag in best.map(|(lag, _)| lag) {
                look(lag + step, &mut best);
                look((lag - step).max(0.0), &mut best);
            }
        }
        best.map(|(_, left)| left)
    }

    /// Returns the part of the goals' motion that is not explained by the motion that the tool made `lag` seconds earlier
    /// \[m, rad\]. This part is the spread of the offset between tool and goal, along the base's axes or along the tool's axes. The
    /// smaller of these two spreads counts. Considers only the goals from index `first` on.
    fn unexplained(&self, first: usize, lag: f64) -> [f64; 2] {
        let (mut by_base, mut by_tool) = (Spread::default(), Spread::default());
        for (point, turn, back) in self.goals.range(first..).filter_map(|goal| self.seen_from_tool(goal, lag))
        {
            by_base.add(point, turn * back);
            by_tool.add(back * point, back * turn);
        }
        let (by_base, by_tool) = (by_base.sizes(), by_tool.sizes());
        std::array::from_fn(|part| by_base[part].min(by_tool[part]))
    }

    /// Compares a goal with the pose that the tool had `lag` seconds before the goal. Returns three values:
    ///
    /// 1. the vector from the tool to the goal, along the base's axes \[m\],
    /// 2. the goal's rotation,
    /// 3. the inverse of the tool's rotation.
    ///
    /// Before the oldest stored pose, the tool counts as standing. After the newest stored pose, its motion is extrapolated by at most
    /// one interval between two poses. Returns `None` until two poses of the tool are stored.
    fn seen_from_tool(
        &self,
        goal: &Place,
        lag: f64,
    ) -> Option<(Vector3<f64>, UnitQuaternion<f64>, UnitQuaternion<f64>)> {
        let time = goal.time - lag;
        let newest = self.tool.len().checked_sub(1)?;
        let after = self.tool.partition_point(|place| place.time <= time).min(newest).max(1);
        let (before, next) = (self.tool.get(after - 1)?, self.tool.get(after)?);
        // Beyond the newest pose, the tool's last motion is extrapolated.
        let share = ((time - before.time) / (next.time - before.time)).clamp(0.0, 2.0);
        let (point, turn) = (before.point.lerp(&next.point, share), before.turn.nlerp(&next.turn, share));
        Some((goal.point - point, goal.turn, turn.inverse()))
    }
}
