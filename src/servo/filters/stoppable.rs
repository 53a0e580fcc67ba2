//! What is admitted can be stopped: no command after which a stop would lead into anything.

use super::stop::Stop;
use super::{Filter, Given, scale};
use crate::servo::ClosePair;
use crate::servo::jerk::Pace;
use crate::servo::limits::{RAMP_TIME, STOP_TIME};
use crate::space::{Near, Placed, Scene};

/// A stop leaves gaps of this \[m\], or half of one that is smaller: more where it is eased, as what comes late then is made up for later.
const LEAST: f64 = 0.002;
const LEAST_EASED: f64 = 0.008;

/// What is kept for cycles that are late is no more than this part of a gap: a small one could not grow again else.
const SPARE: f64 = 0.25;

/// So many places on the way of a stop are looked at, at most.
const MOST_PLACES: u32 = 40;

/// A stop may take so many cycles more than its longest time, as each of its parts is rounded up.
const MORE_CYCLES: usize = 10;

/// A way is halved so often, at most.
const DEPTH: usize = 10;

/// Lets a velocity pass if the arm can be stopped after it, each joint by its own deceleration, without closing any gap; else slows down
/// along the way that it is on, or stops.
///
/// It was let pass before only what could be stopped: so as long as commands and arm keep the cycle's time, a stop never closes a gap,
/// whenever it comes. The way of the stop is looked at where the arm would be after so many cycles of it, and where gaps there say too
/// little of those between, half way too (Schwarzer, Saha & Latombe 2005).
pub(super) struct Stoppable {
    placed: Option<Placed>,
    near: Vec<Near>,
    stop: StopWay,
    /// The gaps of the pairs in `near` at the ends of the ways that are looked at, one list for each time they were halved.
    gaps: Vec<Vec<f64>>,
    positions: Vec<f64>,
    slowed: Vec<f64>,
    places: u32,
    /// The pair for which the last command was not let pass.
    pub held_by: Option<ClosePair>,
}

/// The way of a stop.
#[derive(Default)]
struct StopWay {
    /// The speed with which it begins, and what it loses in a cycle, of each joint [rad/s].
    speeds: Vec<f64>,
    losses: Vec<f64>,
    /// Whether jerks are limited.
    is_eased: bool,
    /// How far each joint has gone after each cycle then, and by how much its way is longer than that, as it turns round \[rad\].
    gone: Vec<Vec<f64>>,
    asides: Vec<f64>,
    /// The cycle \[s\].
    cycle: f64,
    /// How many cycles it takes.
    cycles: u32,
}

impl StopWay {
    fn begin(&mut self, given: &Given, velocity: &[f64]) {
        let braking = &given.braking;
        self.cycle = braking.cycle;
        self.speeds.copy_from_slice(velocity);
        let losses = self.losses.iter_mut().zip(braking.decelerations);
        losses.for_each(|(loss, deceleration)| *loss = deceleration * braking.period);
        let cycles = self.speeds.iter().zip(&self.losses).map(|(speed, loss)| (speed.abs() / loss).ceil());
        self.cycles = cycles.fold(0.0, f64::max) as u32;
        self.is_eased = braking.limits_jerk();
        if self.is_eased {
            (0..self.speeds.len()).for_each(|joint| self.ease(given, joint));
        }
    }

    /// The same of a joint whose acceleration may not step: it goes on for a while, and may turn round.
    fn ease(&mut self, given: &Given, joint: usize) {
        let (speed, jerk) = (self.speeds[joint], given.braking.jerk_step(joint));
        let most = given.braking.decelerations[joint] * given.period;
        let (mut pace, mut way, mut length) = (Pace { speed, step: speed - given.before[joint] }, 0.0, 0.0);
        self.losses[joint] = most.max(pace.step.abs());
        let gone = &mut self.gone[joint];
        gone.clear();
        gone.push(way);
        while gone.len() < gone.capacity() {
            way += self.cycle * pace.speed;
            length += self.cycle * pace.speed.abs();
            gone.push(way);
            let step = pace.towards(0.0, most, jerk);
            pace = Pace { speed: pace.speed + step, step };
            if pace.speed == 0.0 && pace.towards(0.0, most, jerk) == 0.0 {
                break;
            }
        }
        self.asides[joint] = length - way.abs();
        self.cycles = self.cycles.max(gone.len() as u32 - 1);
    }

    /// What it leaves of gaps \[m\].
    fn least(&self) -> f64 {
        if self.is_eased { LEAST_EASED } else { LEAST }
    }

    /// How far each joint has gone after so many cycles, the first of them at the whole speed \[rad\].
    fn ways(&self, cycles: u32) -> impl Iterator<Item = f64> + Clone + '_ {
        self.speeds.iter().zip(&self.losses).enumerate().map(move |(joint, (speed, loss))| {
            if self.is_eased {
                let gone = &self.gone[joint];
                return gone[(cycles as usize).min(gone.len() - 1)];
            }
            let count = f64::from(cycles).min((speed.abs() / loss).ceil());
            let way = count * speed.abs() - 0.5 * loss * count * (count - 1.0);
            (self.cycle * way).copysign(*speed)
        })
    }
}

impl Stoppable {
    /// For so many joints and nothing to keep out of.
    pub fn new(joints: usize) -> Self {
        let zeros = vec![0.0; joints];
        Self {
            placed: None,
            near: Vec::new(),
            stop: StopWay::default(),
            gaps: Vec::new(),
            positions: zeros.clone(),
            slowed: zeros,
            places: 0,
            held_by: None,
        }
    }

    /// Makes room for that scene, and for stops in cycles of that `period` \[s\].
    pub fn set_scene(&mut self, scene: Option<&Scene>, period: f64) {
        self.placed = scene.map(Placed::of);
        if let Some(scene) = scene {
            self.near.reserve_exact(scene.pair_count());
            self.gaps = (0..DEPTH + 2).map(|_| Vec::with_capacity(scene.pair_count())).collect();
            self.stop.speeds.resize(self.positions.len(), 0.0);
            self.stop.losses.resize(self.positions.len(), 0.0);
            self.stop.asides.resize(self.positions.len(), 0.0);
            let cycles = ((STOP_TIME + 2.0 * RAMP_TIME) / period).ceil() as usize + MORE_CYCLES;
            self.stop.gone = self.positions.iter().map(|_| Vec::with_capacity(cycles)).collect();
        }
        self.held_by = None;
    }

    /// Whether the arm can be stopped after `velocity`.
    fn can_stop(&mut self, given: &Given, scene: &Scene, velocity: &[f64]) -> bool {
        let (Some(placed), stop) = (&mut self.placed, &mut self.stop) else { return true };
        stop.begin(given, velocity);
        let (is_eased, asides) = (stop.is_eased, &stop.asides);
        let aside = |pair| if is_eased { scene.travel(pair, asides.iter().copied()) } else { 0.0 };
        let late = 1.0 - given.period / given.braking.cycle;
        // What joints go in a cycle that is late, and in cycles that are as late as they were.
        let spare = |pair: usize, way: f64| {
            given.period * scene.travel(pair, velocity.iter().copied()) + late * way + aside(pair)
        };
        placed.place(scene, given.arms.chains(), given.positions);
        let ways = stop.ways(stop.cycles);
        let within = |pair: usize| {
            let way = scene.travel(pair, ways.clone());
            if way > 0.0 { stop.least() + way + spare(pair, way) } else { f64::NEG_INFINITY }
        };
        placed.near(scene, within, &mut self.near);
        if self.near.is_empty() {
            return true;
        }
        let gaps: &mut [Vec<f64>] = &mut self.gaps;
        gaps[0].clear();
        gaps[0].extend(self.near.iter().map(|near| near.gap.distance));
        self.places = 0;
        let mut look = Look {
            given,
            scene,
            placed,
            stop,
            near: &self.near,
            positions: &mut self.positions,
            places: &mut self.places,
            spare: &spare,
            held_by: &mut self.held_by,
        };
        let end = look.stop.cycles;
        let (first, rest) = gaps.split_at_mut(1);
        let Some((last, rest)) = rest.split_first_mut() else { return false };
        look.at(end, last) && look.between((0, &first[0]), (end, last), rest)
    }
}

/// One look at the way of a stop.
struct Look<'a, S: Fn(usize, f64) -> f64> {
    given: &'a Given<'a>,
    scene: &'a Scene,
    placed: &'a mut Placed,
    stop: &'a StopWay,
    near: &'a [Near],
    positions: &'a mut [f64],
    places: &'a mut u32,
    spare: &'a S,
    held_by: &'a mut Option<ClosePair>,
}

impl<S: Fn(usize, f64) -> f64> Look<'_, S> {
    /// What the gap of a pair that is `near` must stay above on the way: one that is closed already must grow.
    fn least(&self, near: &Near) -> f64 {
        let now = near.gap.distance;
        if now > 0.0 { self.stop.least().min(0.5 * now) } else { now }
    }

    /// Finds the gaps after so many cycles of the stop; whether they are large enough there.
    fn at(&mut self, cycles: u32, gaps: &mut Vec<f64>) -> bool {
        *self.places += 1;
        for ((place, position), way) in
            self.positions.iter_mut().zip(self.given.positions).zip(self.stop.ways(cycles))
        {
            *place = position + way;
        }
        self.placed.place(self.scene, self.given.arms.chains(), self.positions);
        gaps.clear();
        for near in self.near {
            let gap = self.placed.gap_of(self.scene, near.pair).distance;
            if gap < self.least(near) {
                return self.is_held_by(near);
            }
            gaps.push(gap);
        }
        true
    }

    fn is_held_by(&mut self, near: &Near) -> bool {
        *self.held_by = Some(ClosePair::of(self.scene, near));
        false
    }

    /// By how much a gap may be smaller on the way between two places than at both, where it is `gap` at least and the two may move by
    /// `way` against each other \[m\].
    ///
    /// Who goes straight by w past something convex and is D from it at both ends is nowhere nearer than `√(D² − w²/4)`, and who stays in it nowhere nearer than at the ends. That the way of a
    /// point is not straight, but bends with the joints by φ, takes it `φ w/8` aside at most; and that they brake differently, what the
    /// bend of their own ways moves it.
    fn dip(&self, pair: usize, (from, to): (u32, u32), gap: f64, way: f64) -> f64 {
        let apart = gap + self.scene.radius(pair);
        let square = apart * apart - 0.25 * way * way;
        let straight = match self.scene.is_inside(pair) {
            true => 0.0,
            false if square <= 0.0 => return f64::INFINITY,
            false => apart - square.sqrt(),
        };
        let (begin, end) = (self.stop.ways(from), self.stop.ways(to));
        let turn: f64 = begin.zip(end).map(|(begin, end)| (end - begin).abs()).sum();
        let cycles = f64::from(to - from);
        let braked = if to - from > 1 { 0.125 * cycles * cycles * self.stop.cycle } else { 0.0 };
        let bends = self.stop.losses.iter().zip(&self.stop.speeds);
        let bends = bends.map(|(loss, speed)| if *speed == 0.0 { 0.0 } else { braked * loss });
        straight + 0.125 * turn * way + self.scene.travel(pair, bends)
    }

    /// Whether gaps stay large enough from so many cycles of the stop to so many, by those at both.
    fn between(
        &mut self,
        (from, here): (u32, &[f64]),
        (to, there): (u32, &[f64]),
        room: &mut [Vec<f64>],
    ) -> bool {
        let (begin, end) = (self.stop.ways(from), self.stop.ways(to));
        let ways = begin.zip(end).map(|(begin, end)| end - begin);
        let known = |near: &Near, here: f64, there: f64| {
            let way = self.scene.travel(near.pair, ways.clone());
            let least = self.least(near);
            // Of a closed gap it is enough that it grows from place to place.
            let spare = (self.spare)(near.pair, way).min(SPARE * near.gap.distance);
            least <= 0.0
                || 0.5 * (here + there - way) - spare >= least
                || here.min(there) - self.dip(near.pair, (from, to), here.min(there), way) - spare >= least
        };
        let all = self.near.iter().zip(here.iter().zip(there));
        let unknown = all.clone().find(|(near, (here, there))| !known(near, **here, **there));
        let Some((near, _)) = unknown else { return true };
        let half = from + (to - from) / 2;
        match room.split_first_mut() {
            Some((gaps, room)) if half > from && *self.places < MOST_PLACES => {
                self.at(half, gaps)
                    && self.between((from, here), (half, gaps), room)
                    && self.between((half, gaps), (to, there), room)
            }
            _ => self.is_held_by(near),
        }
    }
}

/// Makes of what is `slowed` the slowest along the way that the arm is on; half way to a stop where accelerations may not step.
fn slow(given: &Given, velocity: &[f64], slowed: &mut [f64]) {
    if given.braking.limits_jerk() {
        Stop.apply(given, slowed);
        slowed.iter_mut().zip(velocity).for_each(|(slowed, speed)| *slowed = 0.5 * (*slowed + speed));
        return;
    }
    slowed.copy_from_slice(given.before);
    let left = given
        .before
        .iter()
        .zip(given.braking.decelerations)
        .map(|(before, deceleration)| 1.0 - deceleration * given.period / before.abs());
    // None where a joint that stands has no part in it.
    scale(slowed, left.fold(0.0, f64::max).min(1.0));
}

impl Filter for Stoppable {
    fn apply(&mut self, given: &Given, velocity: &mut [f64]) {
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
            Stop.apply(given, velocity);
        }
        (self.slowed, self.held_by) = (slowed, held_by);
    }
}
