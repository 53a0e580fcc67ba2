//! Ensures that the arm can be stopped: rejects a command if a stop after it would lead into an obstacle.

use super::FilterInput;
use crate::servo::{Arms, ClosePair};
use dq_limits::{Pace, RAMP_TIME, STOP_TIME, scale};
use dq_space::space::{Gap, MOST_PAIRS, Near, Placed, Scene};
use std::ops::Range;

/// Every gap on the path of a stop must be at least this wide \[m\]. A gap that is already narrower must not close further, apart
/// from rounding.
const LEAST: f64 = 0.002;
const ROUNDING: f64 = 1e-9;

/// Largest number of points along a stop that are checked.
const MOST_PLACES: u32 = 40;

/// Number of cycles by which a stop may take longer than computed, because the duration of each of its phases is rounded up.
const MORE_CYCLES: usize = 10;

/// Largest number of times that the check of a stop halves the stop's path.
const DEPTH: usize = 10;

/// Accepts a velocity if the arm can stop from this velocity without closing any gap. In this stop, each joint brakes with its own
/// deceleration. If the velocity is not accepted, the arm slows down along its present path, or stops.
///
/// Because every velocity is checked, a stop at any time closes no gap. This is true even if one command of the stop acts for one
/// cycle longer than usual.
///
/// The check measures the gaps at the beginning and at the end of the stop's path. If these gaps do not prove that the path in between
/// is clear, the check measures the gaps at the middle of the path, and continues with each half (Schwarzer, Saha & Latombe 2005).
pub(super) struct Stoppable {
    pub(super) placed: Placed,
    near: Vec<Near>,
    stop: StoppingPath,
    /// For each level of the repeated halving of the path: the pairs whose gap is not yet proven wide enough on the first half, and
    /// those for the second half.
    open: Vec<[Vec<Open>; 2]>,
    positions: Vec<f64>,
    slope: Vec<f64>,
    slowed: Vec<f64>,
    places: u32,
    /// The pair whose gap might become too narrow in a stop after the last velocity; `None` if this velocity was accepted.
    pub held_by: Option<ClosePair>,
}

/// The path of a stop: the motion of each joint until it rests.
#[derive(Default)]
struct StoppingPath {
    /// The travel of each joint after each cycle. The first cycle is at full speed.
    joints: Vec<Vec<Travel>>,
    /// The largest decrease of each joint's speed per cycle of the stop [rad/s, prismatic: m/s].
    losses: Vec<f64>,
    /// The control period as set \[s\].
    period: f64,
    /// The recent mean time between cycles \[s\].
    cycle: f64,
    /// The number of cycles that the stop takes.
    cycles: usize,
}

/// The travel of one joint from the beginning of a stop to one of its cycles.
#[derive(Clone, Copy)]
struct Travel {
    /// The displacement since the beginning of the stop \[rad, prismatic: m\].
    gone: f64,
    /// The sum of the joint's motions in both directions since the beginning of the stop \[rad, prismatic: m\].
    length: f64,
    /// The least signed speed since the beginning of the stop [rad/s, prismatic: m/s].
    slowest: f64,
    /// The largest signed speed since the beginning of the stop [rad/s, prismatic: m/s].
    fastest: f64,
}

impl StoppingPath {
    fn begin(&mut self, input: &FilterInput, velocity: &[f64]) {
        (self.period, self.cycle, self.cycles) = (input.joints.braking.period, input.joints.braking.cycle, 0);
        for (joint, speed) in velocity.iter().enumerate() {
            self.follow(input, joint, *speed);
        }
    }

    /// Computes the travel of one joint from `speed` [rad/s, prismatic: m/s] to rest.
    fn follow(&mut self, input: &FilterInput, joint: usize, speed: f64) {
        let (most, jerk) =
            (input.joints.braking.decelerations[joint] * self.period, input.joints.braking.jerk_step(joint));
        let mut pace = Pace { speed, step: speed - input.joints.before[joint] };
        let mut travel = Travel { gone: 0.0, length: 0.0, slowest: speed, fastest: speed };
        let first = if jerk.is_finite() { pace.step.abs() } else { 0.0 };
        let travels = &mut self.joints[joint];
        travels.clear();
        travels.push(travel);
        let mut step = pace.towards(0.0, most, jerk);
        while (pace.speed, step) != (0.0, 0.0) && travels.len() < travels.capacity() {
            travel = Travel {
                gone: travel.gone + self.cycle * pace.speed,
                length: travel.length + self.cycle * pace.speed.abs(),
                slowest: travel.slowest.min(pace.speed),
                fastest: travel.fastest.max(pace.speed),
            };
            travels.push(travel);
            pace = Pace { speed: pace.speed + step, step };
            step = pace.towards(0.0, most, jerk);
        }
        self.losses[joint] = if travels.len() > 1 { most.max(first) } else { 0.0 };
        self.cycles = self.cycles.max(travels.len() - 1);
    }

    /// Returns the travel of each joint after `cycles` cycles.
    fn after(&self, cycles: usize) -> impl Iterator<Item = &Travel> + Clone {
        self.joints.iter().filter_map(move |travels| travels.get(cycles.min(travels.len() - 1)))
    }

    /// Returns the length of each joint's path during `cycles` \[rad, prismatic: m\]. Motions in both directions add up.
    fn lengths(&self, cycles: &Range<usize>) -> impl Iterator<Item = f64> + Clone {
        self.after(cycles.start).zip(self.after(cycles.end)).map(|(begin, end)| end.length - begin.length)
    }

    /// Returns, for each joint, the least and the largest difference between the real and the computed position after `cycles` cycles
    /// \[rad, prismatic: m\]. There are two reasons for a difference:
    ///
    /// - One cycle may take twice as long as usual.
    /// - The mean time between cycles may exceed the control period. The robot may move during all of the extra time, or during none.
    fn deviations(&self, cycles: usize) -> impl Iterator<Item = (f64, f64)> + Clone {
        let late = 1.0 - self.period / self.cycle;
        self.after(cycles).map(move |travel| {
            let spread = late * travel.length;
            (self.period * travel.slowest - spread, self.period * travel.fastest + spread)
        })
    }

    /// Returns the largest possible error of a computed gap after `cycles` cycles of the stop: the real gap may be narrower by this
    /// \[m\]. `slope` is the change of the gap with each joint [m/rad, prismatic: m/m].
    fn spare(&self, cycles: usize, slope: &[f64]) -> f64 {
        let joints = self.deviations(cycles).zip(slope);
        let closed = joints.map(|((least, most), slope)| (-least * slope).max(-most * slope));
        closed.sum::<f64>().max(0.0)
    }
}

/// A pair whose gap is not yet proven wide enough on a part of the path.
#[derive(Clone, Copy)]
struct Open {
    /// The index of the pair in `near`.
    number: usize,
    /// A lower bound of the pair's gap at the beginning of this part of the path \[m\].
    here: f64,
    /// A lower bound of the pair's gap at the end of this part of the path \[m\].
    there: f64,
}

impl Stoppable {
    /// Allocates the buffers for `arms`, for any scene, and for the cycles of the longest stop. `period` is the control period \[s\].
    pub fn new(arms: &Arms, period: f64) -> Self {
        let zeros = vec![0.0; arms.joint_count()];
        let cycles = ((STOP_TIME + 2.0 * RAMP_TIME) / period).ceil() as usize + MORE_CYCLES;
        let list = || Vec::with_capacity(MOST_PAIRS);
        Self {
            placed: Placed::with_room(arms.chains()),
            near: Vec::with_capacity(MOST_PAIRS),
            stop: StoppingPath {
                joints: zeros.iter().map(|_| Vec::with_capacity(cycles)).collect(),
                losses: zeros.clone(),
                ..StoppingPath::default()
            },
            open: (0..=DEPTH).map(|_| [list(), list()]).collect(),
            positions: zeros.clone(),
            slope: zeros.clone(),
            slowed: zeros,
            places: 0,
            held_by: None,
        }
    }

    /// Replaces the scene.
    pub fn set_scene(&mut self, scene: Option<&Scene>) {
        scene.into_iter().for_each(|scene| self.placed.take(scene));
        self.held_by = None;
    }

    /// Returns whether the arm can be stopped after `velocity`.
    fn can_stop(&mut self, input: &FilterInput, scene: &Scene, velocity: &[f64]) -> bool {
        let Self { placed, near, stop, positions, slope, places, held_by, .. } = self;
        stop.begin(input, velocity);
        let end = stop.cycles;
        placed.place(scene, input.arms.chains(), input.joints.positions);
        let deviation = stop.deviations(end).map(|(least, most)| most.max(-least));
        let all = 0..end;
        let travels = stop.lengths(&all).zip(deviation).map(|(length, deviation)| length + deviation);
        let within = |travel: f64| if travel > 0.0 { LEAST + travel } else { f64::NEG_INFINITY };
        placed.near(scene, travels, within, near);
        let Some(([open, _], room)) = self.open.split_first_mut().filter(|_| !near.is_empty()) else {
            return true;
        };
        *places = 1;
        let mut check = PathCheck { input, scene, placed, stop, near, positions, slope, places, held_by };
        check.whole(end, open) && check.between(all, open, room)
    }
}

/// The check of one stop's path.
struct PathCheck<'a> {
    input: &'a FilterInput<'a>,
    scene: &'a Scene,
    placed: &'a mut Placed,
    stop: &'a StoppingPath,
    near: &'a [Near],
    positions: &'a mut [f64],
    slope: &'a mut [f64],
    places: &'a mut u32,
    held_by: &'a mut Option<ClosePair>,
}

/// Returns the least gap that the pair `near` may have on the path. A gap that is already narrower than [`LEAST`] must not close
/// further.
fn least(near: &Near) -> f64 {
    LEAST.min(near.gap.distance) - ROUNDING
}

impl PathCheck<'_> {
    /// Places the arm at its position after `cycles` cycles of the stop.
    fn place(&mut self, cycles: usize) {
        *self.places += 1;
        let travels = self.stop.after(cycles).zip(self.input.joints.positions);
        self.positions
            .iter_mut()
            .zip(travels)
            .for_each(|(place, (travel, position))| *place = position + travel.gone);
        self.placed.place(self.scene, self.input.arms.chains(), self.positions);
    }

    /// Returns a lower bound of the real gap after `cycles` cycles of the stop \[m\]: the computed `gap` less its largest possible
    /// error. The caller must have [placed](Self::place) the arm at its computed position after these cycles.
    fn left(&mut self, cycles: usize, pair: usize, gap: &Gap) -> f64 {
        self.placed.slope(self.scene, pair, gap, self.slope);
        gap.distance - self.stop.spare(cycles, self.slope)
    }

    /// Returns a lower bound of a pair's gap, or `None` if the gap is too narrow.
    ///
    /// First computes a rough bound, which takes little time. If the rough bound is too small, or if `is_enough` returns false for
    /// it, measures the gap. `is_enough` returns whether a bound proves that the nearby path is clear.
    fn check(&mut self, cycles: usize, near: &Near, is_enough: impl Fn(&Self, f64) -> bool) -> Option<f64> {
        let at_least = self.placed.gap_at_least(self.scene, near);
        let at_least = at_least.map(|gap| self.left(cycles, near.pair, &gap));
        let is_fine = |check: &Self, left: &f64| *left >= least(near) && is_enough(check, *left);
        let left = at_least.filter(|left| is_fine(self, left)).unwrap_or_else(|| {
            let gap = self.placed.gap_of(self.scene, near.pair);
            self.left(cycles, near.pair, &gap)
        });
        if left < least(near) {
            self.hold(near);
            return None;
        }
        Some(left)
    }

    fn hold(&mut self, near: &Near) -> bool {
        *self.held_by = Some(ClosePair::of(self.scene, near));
        false
    }

    /// Returns whether all gaps are wide enough at the beginning and at the end of a stop of `end` cycles. The caller must have placed
    /// the arm at the beginning of the stop. Fills `open` with the pairs whose gap is not yet proven wide enough on the path in between.
    fn whole(&mut self, end: usize, open: &mut Vec<Open>) -> bool {
        open.clear();
        for (number, near) in self.near.iter().enumerate() {
            let here = self.left(0, near.pair, &near.gap);
            if here < least(near) {
                return self.hold(near);
            }
            open.push(Open { number, here, there: here });
        }
        self.place(end);
        let mut count = 0;
        for next in 0..open.len() {
            let Open { number, here, .. } = open[next];
            let near = &self.near[number];
            let knows = |check: &Self, there: f64| check.knows(near, &(0..end), [here, there]);
            let Some(there) = self.check(end, near, knows) else { return false };
            if !knows(self, there) {
                open[count] = Open { number, here, there };
                count += 1;
            }
        }
        open.truncate(count);
        true
    }

    /// Returns by how much a gap may shrink between two positions of the arm \[m\]. At both positions the gap is at least `gap`. The
    /// two parts move by at most `travel` relative to each other. The result is the sum of three bounds:
    ///
    /// 1. For a straight path: let a point move by w past a convex body, at the distance D from the body at both ends of the path.
    ///    Between the ends, the distance is at least `√(D² − w²/4)`. If the point moves inside a convex body instead, its distance
    ///    from the surface is never smaller than at the nearer end.
    /// 2. For the curvature of the path: the rotation φ of the joints bends the path by at most `φ w/8`.
    /// 3. For the braking of the joints: with the deceleration `a` during the time `t`, a joint deviates from uniform motion by at
    ///    most `a t²/8`.
    fn dip(&self, pair: usize, cycles: &Range<usize>, gap: f64, travel: f64) -> f64 {
        let apart = gap + self.scene.radius(pair);
        let square = apart * apart - 0.25 * travel * travel;
        let straight = match self.scene.is_inside(pair) {
            true => 0.0,
            false if square <= 0.0 => return f64::INFINITY,
            false => apart - square.sqrt(),
        };
        let turn: f64 = self.stop.lengths(cycles).sum();
        let count = cycles.len() as f64;
        let braked = if cycles.len() > 1 { 0.125 * count * count * self.stop.cycle } else { 0.0 };
        let bends = self.stop.losses.iter().map(|loss| braked * loss);
        straight + 0.125 * turn * travel + self.scene.travel(pair, bends)
    }

    /// Returns whether a gap is certainly wide enough during `cycles`. `here` and `there` are lower bounds of the gap at the first
    /// and at the last cycle.
    fn knows(&self, near: &Near, cycles: &Range<usize>, [here, there]: [f64; 2]) -> bool {
        let travel = self.scene.travel(near.pair, self.stop.lengths(cycles));
        // A closed gap is checked only at the points of the path, not between them. For an open gap, half of the least gap is the
        // margin for unknown effects.
        let least = 0.5 * least(near);
        least <= 0.0
            || 0.5 * (here + there - travel) >= least
            || here.min(there) - self.dip(near.pair, cycles, here.min(there), travel) >= least
    }

    /// Returns whether the gaps of the `open` pairs stay wide enough during `cycles` of the stop.
    fn between(&mut self, cycles: Range<usize>, open: &[Open], room: &mut [[Vec<Open>; 2]]) -> bool {
        let Some(first) = open.first() else { return true };
        let half = cycles.start + cycles.len() / 2;
        let (first_half, second_half) = (cycles.start..half, half..cycles.end);
        let Some(([before, after], room)) =
            room.split_first_mut().filter(|_| !first_half.is_empty() && *self.places < MOST_PLACES)
        else {
            return self.hold(&self.near[first.number]);
        };
        self.place(half);
        before.clear();
        after.clear();
        for Open { number, here, there } in open.iter().copied() {
            let near = &self.near[number];
            let knows = |check: &Self, left: f64| {
                [check.knows(near, &first_half, [here, left]), check.knows(near, &second_half, [left, there])]
            };
            let Some(left) = self.check(half, near, |check, left| knows(check, left) == [true; 2]) else {
                return false;
            };
            let [knows_before, knows_after] = knows(self, left);
            if !knows_before {
                before.push(Open { number, here, there: left });
            }
            if !knows_after {
                after.push(Open { number, here: left, there });
            }
        }
        self.between(first_half, before, room) && self.between(second_half, after, room)
    }
}

/// Sets `slowed` to the last command, scaled down as far as every joint can brake in one cycle. All joints are scaled by one factor,
/// so the arm stays on its path. If the jerk is limited, sets `slowed` to the mean of `velocity` and the first command of a stop.
fn slow(input: &FilterInput, velocity: &[f64], slowed: &mut [f64]) {
    if input.joints.braking.limits_jerk() {
        input.joints.stop(slowed);
        slowed.iter_mut().zip(velocity).for_each(|(slowed, speed)| *slowed = 0.5 * (*slowed + speed));
        return;
    }
    slowed.copy_from_slice(input.joints.before);
    let left = input
        .joints
        .before
        .iter()
        .zip(input.joints.braking.decelerations)
        .map(|(before, deceleration)| 1.0 - deceleration * input.joints.braking.period / before.abs());
    // The factor is 0 if no joint moves. A standing joint does not count.
    scale(slowed, left.fold(0.0, f64::max).min(1.0));
    slowed.iter_mut().enumerate().for_each(|(joint, speed)| *speed = input.joints.span(joint).hold(*speed));
}

impl Stoppable {
    /// Slows `velocity`, one number per joint [rad/s, prismatic: m/s], if a stop from this velocity could close a gap.
    pub fn apply(&mut self, input: &FilterInput, velocity: &mut [f64]) {
        self.held_by = None;
        let Some(scene) = &input.settings.scene else { return };
        let stands = velocity.iter().all(|speed| *speed == 0.0);
        let is_none = velocity.iter().any(|speed| !speed.is_finite());
        // The final check rejects numbers that are not finite.
        if stands || is_none || self.can_stop(input, scene, velocity) {
            return;
        }
        let mut slowed = std::mem::take(&mut self.slowed);
        slow(input, velocity, &mut slowed);
        let held_by = self.held_by;
        if self.can_stop(input, scene, &slowed) {
            velocity.copy_from_slice(&slowed);
        } else {
            input.joints.stop(velocity);
        }
        (self.slowed, self.held_by) = (slowed, held_by);
    }
}
