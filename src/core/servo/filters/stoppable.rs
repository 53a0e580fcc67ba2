//! What is admitted can be stopped: no command after which a stop would lead into anything.

use super::Given;
use crate::servo::ClosePair;
use dq_limits::{Pace, RAMP_TIME, STOP_TIME, scale};
use dq_space::space::{Gap, MOST_PAIRS, Near, Placed, Scene};
use std::ops::Range;

/// A stop leaves gaps of this \[m\], and does not close one that is smaller, but for rounding.
const LEAST: f64 = 0.002;
const ROUNDING: f64 = 1e-9;

/// So many places along a stop are looked at, at most.
const MOST_PLACES: u32 = 40;

/// A stop may take so many cycles more than its longest time, as each of its parts is rounded up.
const MORE_CYCLES: usize = 10;

/// A path is halved so often, at most.
const DEPTH: usize = 10;

/// Lets a velocity pass if the arm can be stopped after it, each joint by its own deceleration, without closing any gap; else slows down
/// along the path that it is on, or stops.
///
/// It was let pass before only what could be stopped: so a stop never closes a gap, whenever it comes, even if one command more holds for
/// two cycles than did in the last seconds. The stop is looked at where the arm would be after so many cycles of it, and of
/// gaps that say too little there of those between, half way too (Schwarzer, Saha & Latombe 2005).
pub(super) struct Stoppable {
    pub(super) placed: Placed,
    near: Vec<Near>,
    stop: StoppingPath,
    /// The pairs of which not enough is known on both halves of the paths that are looked at, for each time these were halved.
    open: Vec<[Vec<Open>; 2]>,
    positions: Vec<f64>,
    slope: Vec<f64>,
    slowed: Vec<f64>,
    places: u32,
    /// The pair for which the last command was not let pass.
    pub held_by: Option<ClosePair>,
}

/// The path of a stop: how each joint comes to rest.
#[derive(Default)]
struct StoppingPath {
    /// Of each joint, how far it has come after each cycle, the first of them at the whole speed.
    joints: Vec<Vec<Travel>>,
    /// What each joint loses in a cycle at most [rad/s].
    losses: Vec<f64>,
    /// How long a cycle should take and takes on average \[s\].
    period: f64,
    cycle: f64,
    /// How many cycles it takes.
    cycles: usize,
}

/// How far one joint has come.
#[derive(Clone, Copy)]
struct Travel {
    /// From where it was \[rad\].
    gone: f64,
    /// The same with what it went back \[rad\].
    length: f64,
    /// Between which its speed was [rad/s].
    slowest: f64,
    fastest: f64,
}

impl StoppingPath {
    fn begin(&mut self, given: &Given, velocity: &[f64]) {
        (self.period, self.cycle, self.cycles) = (given.joints.braking.period, given.joints.braking.cycle, 0);
        for (joint, speed) in velocity.iter().enumerate() {
            self.follow(given, joint, *speed);
        }
    }

    /// Follows one joint from that `speed` [rad/s] until it stands.
    fn follow(&mut self, given: &Given, joint: usize, speed: f64) {
        let (most, jerk) =
            (given.joints.braking.decelerations[joint] * self.period, given.joints.braking.jerk_step(joint));
        let mut pace = Pace { speed, step: speed - given.joints.before[joint] };
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

    /// How far each joint has come after so many cycles.
    fn after(&self, cycles: usize) -> impl Iterator<Item = &Travel> + Clone {
        self.joints.iter().filter_map(move |travels| travels.get(cycles.min(travels.len() - 1)))
    }

    /// How far each joint goes in these `cycles`, back and forth \[rad\].
    fn lengths(&self, cycles: &Range<usize>) -> impl Iterator<Item = f64> + Clone {
        self.after(cycles.start).zip(self.after(cycles.end)).map(|(begin, end)| end.length - begin.length)
    }

    /// How far beside the path each joint may be after so many cycles, from and to \[rad\]: one of them may have held for twice its time,
    /// and what cycles took longer on average it may have gone at first or not at all.
    fn beside(&self, cycles: usize) -> impl Iterator<Item = (f64, f64)> + Clone {
        let late = 1.0 - self.period / self.cycle;
        self.after(cycles).map(move |travel| {
            let spread = late * travel.length;
            (self.period * travel.slowest - spread, self.period * travel.fastest + spread)
        })
    }

    /// By how much a gap may be smaller after so many cycles than on the path there, if it changes by `slope` with the joints \[m\].
    fn spare(&self, cycles: usize, slope: &[f64]) -> f64 {
        let joints = self.beside(cycles).zip(slope);
        let closed = joints.map(|((least, most), slope)| (-least * slope).max(-most * slope));
        closed.sum::<f64>().max(0.0)
    }
}

/// A pair of which too little is known on a part of the path.
#[derive(Clone, Copy)]
struct Open {
    /// Its number in `near`.
    number: usize,
    /// What is surely left of its gap where that begins and ends \[m\].
    here: f64,
    there: f64,
}

impl Stoppable {
    /// For so many joints, with room for any scene, and for stops in cycles of that `period` \[s\].
    pub fn new(joints: usize, period: f64) -> Self {
        let zeros = vec![0.0; joints];
        let cycles = ((STOP_TIME + 2.0 * RAMP_TIME) / period).ceil() as usize + MORE_CYCLES;
        let list = || Vec::with_capacity(MOST_PAIRS);
        Self {
            placed: Placed::with_room(joints),
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

    /// Takes another scene.
    pub fn set_scene(&mut self, scene: Option<&Scene>) {
        scene.into_iter().for_each(|scene| self.placed.take(scene));
        self.held_by = None;
    }

    /// Whether the arm can be stopped after `velocity`.
    fn can_stop(&mut self, given: &Given, scene: &Scene, velocity: &[f64]) -> bool {
        let Self { placed, near, stop, positions, slope, places, held_by, .. } = self;
        stop.begin(given, velocity);
        let end = stop.cycles;
        placed.place(scene, given.arms.chains(), given.joints.positions);
        let beside = stop.beside(end).map(|(least, most)| most.max(-least));
        let all = 0..end;
        let travels = stop.lengths(&all).zip(beside).map(|(length, beside)| length + beside);
        let within = |travel: f64| if travel > 0.0 { LEAST + travel } else { f64::NEG_INFINITY };
        placed.near(scene, travels, within, near);
        let Some(([open, _], room)) = self.open.split_first_mut().filter(|_| !near.is_empty()) else {
            return true;
        };
        *places = 1;
        let mut look = Look { given, scene, placed, stop, near, positions, slope, places, held_by };
        look.whole(end, open) && look.between(all, open, room)
    }
}

/// One look at the path of a stop.
struct Look<'a> {
    given: &'a Given<'a>,
    scene: &'a Scene,
    placed: &'a mut Placed,
    stop: &'a StoppingPath,
    near: &'a [Near],
    positions: &'a mut [f64],
    slope: &'a mut [f64],
    places: &'a mut u32,
    held_by: &'a mut Option<ClosePair>,
}

/// What the gap of a pair that is `near` must stay above on the path: one that is smaller already may not close further.
fn least(near: &Near) -> f64 {
    LEAST.min(near.gap.distance) - ROUNDING
}

impl Look<'_> {
    /// Places the arm where it is after so many cycles of the stop.
    fn place(&mut self, cycles: usize) {
        *self.places += 1;
        let travels = self.stop.after(cycles).zip(self.given.joints.positions);
        self.positions
            .iter_mut()
            .zip(travels)
            .for_each(|(place, (travel, position))| *place = position + travel.gone);
        self.placed.place(self.scene, self.given.arms.chains(), self.positions);
    }

    /// What is surely left of a gap where the arm is placed, after so many cycles of the stop \[m\].
    fn left(&mut self, cycles: usize, pair: usize, gap: &Gap) -> f64 {
        self.placed.slope(self.scene, pair, gap, self.slope);
        gap.distance - self.stop.spare(cycles, self.slope)
    }

    /// The same of a pair: what is known at once where that is enough for both parts of the path there, else by what is measured. None
    /// where it is too little.
    fn look(&mut self, cycles: usize, near: &Near, is_enough: impl Fn(&Self, f64) -> bool) -> Option<f64> {
        let at_least = self.placed.gap_at_least(self.scene, near);
        let at_least = at_least.map(|gap| self.left(cycles, near.pair, &gap));
        let is_fine = |look: &Self, left: &f64| *left >= least(near) && is_enough(look, *left);
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

    /// Looks at where the stop begins, where the arm is placed, and at where it ends, after so many cycles: whether all gaps are large
    /// enough there. Those of which not enough is known between are `open`.
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
            let knows = |look: &Self, there: f64| look.knows(near, &(0..end), [here, there]);
            let Some(there) = self.look(end, near, knows) else { return false };
            if !knows(self, there) {
                open[count] = Open { number, here, there };
                count += 1;
            }
        }
        open.truncate(count);
        true
    }

    /// By how much a gap may be smaller between two places than at both, where it is `gap` at least and the two may move by
    /// `travel` against each other \[m\].
    ///
    /// Who goes straight by w past something convex and is D from it at both ends is nowhere nearer than `√(D² − w²/4)`, and who stays
    /// in it nowhere nearer than at the ends. That the path of a point is not straight, but bends with the joints by φ, takes it `φ w/8`
    /// aside at most; and that they brake differently, what the bend of their own paths moves it.
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

    /// Whether a gap of which so much is left where these `cycles` of the stop begin and end stays large enough between.
    fn knows(&self, near: &Near, cycles: &Range<usize>, [here, there]: [f64; 2]) -> bool {
        let travel = self.scene.travel(near.pair, self.stop.lengths(cycles));
        // Of a closed gap it is enough that it grows from place to place, and half of an open one is room for what is not known.
        let least = 0.5 * least(near);
        least <= 0.0
            || 0.5 * (here + there - travel) >= least
            || here.min(there) - self.dip(near.pair, cycles, here.min(there), travel) >= least
    }

    /// Whether the gaps that are `open` between these `cycles` of the stop stay large enough.
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
            let knows = |look: &Self, left: f64| {
                [look.knows(near, &first_half, [here, left]), look.knows(near, &second_half, [left, there])]
            };
            let Some(left) = self.look(half, near, |look, left| knows(look, left) == [true; 2]) else {
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

/// Makes of what is `slowed` the slowest along the path that the arm is on; half way to a stop where accelerations may not step.
fn slow(given: &Given, velocity: &[f64], slowed: &mut [f64]) {
    if given.joints.braking.limits_jerk() {
        given.joints.stop(slowed);
        slowed.iter_mut().zip(velocity).for_each(|(slowed, speed)| *slowed = 0.5 * (*slowed + speed));
        return;
    }
    slowed.copy_from_slice(given.joints.before);
    let left = given
        .joints
        .before
        .iter()
        .zip(given.joints.braking.decelerations)
        .map(|(before, deceleration)| 1.0 - deceleration * given.joints.braking.period / before.abs());
    // None where a joint that stands has no part in it.
    scale(slowed, left.fold(0.0, f64::max).min(1.0));
    slowed.iter_mut().enumerate().for_each(|(joint, speed)| *speed = given.joints.span(joint).hold(*speed));
}

impl Stoppable {
    /// Changes `velocity`, one number a joint [rad/s, prismatic: m/s].
    pub fn apply(&mut self, given: &Given, velocity: &mut [f64]) {
        self.held_by = None;
        let Some(scene) = &given.settings.scene else { return };
        let stands = velocity.iter().all(|speed| *speed == 0.0);
        let is_none = velocity.iter().any(|speed| !speed.is_finite());
        // What is no number the gate sees.
        if stands || is_none || self.can_stop(given, scene, velocity) {
            return;
        }
        let mut slowed = std::mem::take(&mut self.slowed);
        slow(given, velocity, &mut slowed);
        let held_by = self.held_by;
        if self.can_stop(given, scene, &slowed) {
            velocity.copy_from_slice(&slowed);
        } else {
            given.joints.stop(velocity);
        }
        (self.slowed, self.held_by) = (slowed, held_by);
    }
}
