//! What the arm must keep out of: the velocity nearest to the one that is wanted at which no gap closes too fast.

use super::Given;
use crate::servo::ClosePair;
use dq_kinematics::control::{Aim, QuadraticProgram};
use dq_space::space::{Gap, MOST_PAIRS, Near, Placed, Scene};

/// No gap is closed further than to this \[m\].
pub const CLEARANCE: f64 = 0.01;

/// A gap takes at least this many cycles, and times the delay, to come e times nearer to the clearance, as the way to a position limit does.
const CYCLES: f64 = 20.0;
const DELAYS: f64 = 5.0;

/// The part of the acceleration that keeping clear counts on.
const SHARE: f64 = 0.5;

/// A gap that is too small already grows at this part at least of what the joints could make of it at the speeds that are wanted: those
/// that go along it would else close it by the bend of their way.
const LEAVING: f64 = 0.1;

/// The weight of a joint's velocity beside that of the tool's, of which a rad/s and a m/s weigh alike.
const JOINT_WEIGHT: f64 = 1e-2;

/// Pairs are looked at beyond what the wanted velocity can reach by this \[m\], as another one goes elsewhere.
const AROUND: f64 = 0.05;

/// So many gaps bound the velocity at most.
const MOST_GAPS: usize = 200;

/// Makes of the velocity that is wanted the nearest one with `ḋ ≥ −η (d − d_safe)` for each gap d (Faverjon & Tournassoud 1987), joint speeds
/// within their limits and no faster towards position limits than they may be.
///
/// Nearest is that whose tool moves as the wanted one's does, `min |J (θ̇ − θ̇_w)|² + μ |θ̇ − θ̇_w|²`, where the tool's motion is what is
/// wanted; else that whose joints do. As to stand always satisfies what gaps that are large enough ask, there is a solution; what asks
/// gaps that are not to grow is dropped where they contradict each other; and where rounding finds none the arm is to stand.
pub(super) struct Constraints {
    pub(super) placed: Placed,
    near: Vec<Near>,
    program: QuadraticProgram,
    weights: Vec<f64>,
    wanted: Vec<f64>,
    slope: Vec<f64>,
    /// The number in `near` of the pair that each constraint after those of the joints is of.
    owners: Vec<usize>,
    /// The nearest pair of those that were looked at.
    pub closest: Option<ClosePair>,
    /// The pair that keeps the arm from what is wanted.
    pub held_by: Option<ClosePair>,
    /// The first joint, counted from 0, that its position limit holds back.
    pub held_back: Option<usize>,
}

impl Constraints {
    /// For so many joints, with room for any scene.
    pub fn new(joints: usize) -> Self {
        Self {
            placed: Placed::with_room(joints),
            near: Vec::with_capacity(MOST_PAIRS),
            program: QuadraticProgram::with_room(joints, 2 * joints + MOST_GAPS),
            weights: vec![0.0; joints * joints],
            wanted: vec![0.0; joints],
            slope: vec![0.0; joints],
            owners: Vec::with_capacity(MOST_GAPS),
            closest: None,
            held_by: None,
            held_back: None,
        }
    }

    /// Takes another scene.
    pub fn set_scene(&mut self, scene: Option<&Scene>) {
        scene.into_iter().for_each(|scene| self.placed.take(scene));
        (self.closest, self.held_by, self.held_back) = (None, None, None);
    }

    /// Weighs the joints by what is wanted of them.
    fn weigh(&mut self, given: &Given) {
        let joints = self.slope.len();
        self.weights.fill(0.0);
        let parts = match given.settings.controller.aim {
            _ if !given.by_tool => [0.0, 0.0],
            Aim::Position | Aim::Distance => [0.0, 1.0],
            Aim::Orientation => [1.0, 0.0],
            Aim::Pose | Aim::PositionAndAxis => [1.0, 1.0],
        };
        let own = if given.by_tool { JOINT_WEIGHT } else { 1.0 };
        (0..joints).for_each(|joint| self.weights[joint * joints + joint] = own);
        if !given.by_tool {
            return;
        }
        let state = given.arms.state();
        for (i, (turn, way)) in state.tool_motions().enumerate() {
            for (j, (other_turn, other_way)) in state.tool_motions().enumerate().take(i + 1) {
                let weight = parts[0] * turn.dot(&other_turn) + parts[1] * way.dot(&other_way);
                self.weights[i * joints + j] += weight;
                if i != j {
                    self.weights[j * joints + i] += weight;
                }
            }
        }
    }

    /// What joints may do by themselves.
    fn bound_joints(&mut self, given: &Given) {
        for joint in 0..given.joints.positions.len() {
            let (lowest, highest) = given.joints.span(joint).range;
            self.program.add_one(joint, 1.0, lowest);
            self.program.add_one(joint, -1.0, -highest);
        }
    }

    /// What the gaps of the pairs that are near ask.
    fn bound_gaps(&mut self, scene: &Scene, rate: f64) {
        let placed = &self.placed;
        self.owners.clear();
        for (number, near) in self.near.iter().enumerate() {
            let mut bound = |gap: Gap| {
                placed.slope(scene, near.pair, &gap, &mut self.slope);
                if is_none(&self.slope) {
                    return;
                }
                let room = gap.distance - CLEARANCE;
                let bound = if room > 0.0 {
                    -rate * room
                } else {
                    let most: f64 =
                        self.slope.iter().zip(&self.wanted).map(|(slope, speed)| (slope * speed).abs()).sum();
                    (-rate * room).min(LEAVING * most)
                };
                // What the wanted velocity is far from asks nothing.
                let speed: f64 =
                    self.slope.iter().zip(&self.wanted).map(|(slope, speed)| slope * speed).sum();
                let is_at_hand = room < AROUND || speed < 0.5 * bound;
                if is_at_hand && self.owners.len() < MOST_GAPS {
                    self.program.add(&self.slope, bound);
                    self.owners.push(number);
                }
            };
            bound(near.gap);
            placed.ends(scene, near.pair, &mut bound);
        }
    }

    /// The pair that is nearest to each other, but for one that is in each other and that no joint takes apart, as the first link is in what
    /// the arm stands on.
    fn find_closest(&mut self, scene: &Scene) {
        let Self { placed, slope, .. } = self;
        let may_move = |near: &&Near| {
            near.gap.distance > 0.0 || {
                placed.slope(scene, near.pair, &near.gap, slope);
                !is_none(slope)
            }
        };
        let nearest =
            self.near.iter().filter(may_move).min_by(|a, b| a.gap.distance.total_cmp(&b.gap.distance));
        self.closest = nearest.map(|near| ClosePair::of(scene, near));
    }

    /// The pair that holds the arm, if the velocity is another one than the one that is wanted.
    fn find_holder(&mut self, scene: &Scene, velocity: &[f64]) {
        let norm = |numbers: &mut dyn Iterator<Item = f64>| numbers.map(|x| x * x).sum::<f64>().sqrt();
        let change = norm(&mut velocity.iter().zip(&self.wanted).map(|(now, wanted)| now - wanted));
        if change <= HELD * norm(&mut self.wanted.iter().copied()) {
            return;
        }
        let first = 2 * velocity.len();
        let forces =
            self.owners.iter().enumerate().map(|(row, of)| (self.program.multiplier(first + row), of));
        let most = forces.max_by(|(one, _), (other, _)| one.total_cmp(other));
        if let Some((_, of)) = most.filter(|(force, _)| *force > 0.0) {
            self.held_by = Some(ClosePair::of(scene, &self.near[*of]));
        }
    }
}

/// Whether no joint changes a gap of that slope [m/rad, prismatic: m/m], but for rounding: such a gap asks nothing of them.
fn is_none(slope: &[f64]) -> bool {
    slope.iter().all(|slope| slope.abs() < 1e-9)
}

/// An arm whose velocity is changed by less than this part is not held.
const HELD: f64 = 0.1;

/// η \[1/s\]: as fast as braking, the cycle and the delay allow.
fn rate(given: &Given) -> f64 {
    let limits = &given.settings.limits;
    let braking = &given.joints.braking;
    let slowest = (CYCLES * braking.cycle).max(DELAYS * braking.delay);
    let joints = limits.joint_acceleration.iter().zip(&limits.joint_velocity).zip(braking.jerks);
    let stops = joints.map(|((acceleration, speed), jerk)| {
        let rate = SHARE * acceleration / speed;
        // The acceleration itself takes time.
        rate / (1.0 + rate * acceleration / jerk)
    });
    let stops = stops.fold(f64::INFINITY, f64::min);
    stops.min(1.0 / slowest) * (braking.period / braking.cycle)
}

impl Constraints {
    /// Changes `velocity`, one number a joint [rad/s, prismatic: m/s].
    pub fn apply(&mut self, given: &Given, velocity: &mut [f64]) {
        (self.closest, self.held_by, self.held_back) = (None, None, None);
        let Some(scene) = given.settings.scene.as_deref() else { return };
        // What is no number the gate sees.
        if velocity.iter().any(|speed| !speed.is_finite()) {
            return;
        }
        self.placed.place(scene, given.arms.chains(), given.joints.positions);
        let rate = rate(given);
        let reach = |approach: f64| CLEARANCE + AROUND + 2.0 * approach / rate;
        self.placed.near(scene, velocity.iter().copied(), reach, &mut self.near);
        self.find_closest(scene);
        self.wanted.copy_from_slice(velocity);
        self.weigh(given);
        if !self.program.begin(velocity.len(), &self.weights) {
            return velocity.fill(0.0);
        }
        self.bound_joints(given);
        self.bound_gaps(scene, rate);
        if self.program.solve(velocity).is_err() {
            velocity.copy_from_slice(&self.wanted);
            self.program.relax();
            if self.program.solve(velocity).is_err() {
                velocity.fill(0.0);
            }
        }
        self.find_holder(scene, velocity);
        let limits = &given.settings.limits.position;
        let mut joints = given.joints.positions.iter().enumerate();
        self.held_back = joints.find_map(|(joint, position)| {
            let forces = [2 * joint, 2 * joint + 1].map(|row| self.program.multiplier(row));
            (forces != [0.0; 2] && limits.is_near(joint, *position)).then_some(joint)
        });
    }
}
