//! Keeps the arm clear of its scene: replaces the desired velocity by the nearest velocity that closes no gap too fast.

use super::FilterInput;
use crate::servo::{Arms, ClosePair};
use dq_kinematics::control::{Aim, QuadraticProgram};
use dq_space::space::{Gap, MOST_PAIRS, Near, Placed, Scene};

/// The smallest width to which the arm may close a gap \[m\].
pub const CLEARANCE: f64 = 0.01;

/// A gap approaches the clearance with a time constant of at least this many cycles.
const CYCLES: f64 = 20.0;
/// A gap approaches the clearance with a time constant of at least this many times the delay. The approach of a joint to its position
/// limit has the same bound.
const DELAYS: f64 = 5.0;

/// The fraction of the acceleration limit that the arm uses to brake for gaps.
const SHARE: f64 = 0.5;

/// A gap below the clearance has to grow at a certain rate. This rate is at most this fraction of the largest possible rate, which
/// results if every joint moves with its desired speed in the direction that widens the gap.
///
/// If the gap only had to stay constant, it would slowly close, because the joints move the parts along curved paths.
const LEAVING: f64 = 0.1;

/// The weight of the joints' velocities relative to the tool's velocity. 1 rad/s counts as much as 1 m/s.
const JOINT_WEIGHT: f64 = 1e-2;

/// A margin on the distance up to which pairs are checked \[m\]. The margin is necessary because the constrained velocity may lead
/// toward pairs that the desired velocity does not approach.
const AROUND: f64 = 0.05;

/// Largest number of gaps that constrain the velocity.
const MOST_GAPS: usize = 200;

/// Replaces the desired velocity by the nearest velocity with `ḋ ≥ −η (d − d_safe)` for each gap d (Faverjon & Tournassoud 1987).
/// Here `d_safe` is the clearance, and η is the [`rate`] of approach. The velocity also keeps the joints' speed limits, and the
/// limits on speed near position limits.
///
/// Let `θ̇_w` be the desired velocity. If the desired motion is a motion of the tool, the nearest velocity is the one with the
/// nearest tool motion: it minimizes `|J (θ̇ − θ̇_w)|² + μ |θ̇ − θ̇_w|²`. Here `J` is the Jacobian, and the weight μ is
/// [`JOINT_WEIGHT`]. Otherwise the nearest velocity is the one with the nearest joint motion.
///
/// If all gaps are above the clearance, there is always a solution, because a standing arm satisfies every constraint. A gap below
/// the clearance must grow. If no velocity satisfies all constraints, such a gap need not grow, but must not close. If rounding
/// still leaves no solution, the velocity is zero.
pub(super) struct Constraints {
    pub(super) placed: Placed,
    near: Vec<Near>,
    program: QuadraticProgram,
    weights: Vec<f64>,
    wanted: Vec<f64>,
    slope: Vec<f64>,
    /// For each gap constraint, the index of its pair in `near`. In `program`, the gap constraints come after the constraints of the
    /// joints.
    owners: Vec<usize>,
    /// The closest pair of parts among the pairs that were checked; `None` if no two parts were near each other.
    pub closest: Option<ClosePair>,
    /// The pair that keeps the arm from the desired velocity, if any.
    pub held_by: Option<ClosePair>,
    /// The first joint (counted from 0) that cannot move on because of its position limit, if any.
    pub held_back: Option<usize>,
}

impl Constraints {
    /// Allocates for this many joints, and for any scene.
    pub fn new(arms: &Arms) -> Self {
        let joints = arms.joint_count();
        Self {
            placed: Placed::with_room(arms.chains()),
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

    /// Replaces the scene.
    pub fn set_scene(&mut self, scene: Option<&Scene>) {
        scene.into_iter().for_each(|scene| self.placed.take(scene));
        (self.closest, self.held_by, self.held_back) = (None, None, None);
    }

    /// Sets the weight matrix of the quadratic program. If the desired motion is a motion of the joints, this is the identity.
    /// Otherwise it is `JᵀJ + μ I`, with the rows of the Jacobian `J` that the aim controls, and with μ = [`JOINT_WEIGHT`].
    fn weigh(&mut self, input: &FilterInput) {
        let joints = self.slope.len();
        self.weights.fill(0.0);
        let parts = match input.settings.controller.aim {
            _ if !input.by_tool => [0.0, 0.0],
            Aim::Position | Aim::Distance => [0.0, 1.0],
            Aim::Orientation => [1.0, 0.0],
            Aim::Pose | Aim::PositionAndAxis => [1.0, 1.0],
        };
        let own = if input.by_tool { JOINT_WEIGHT } else { 1.0 };
        (0..joints).for_each(|joint| self.weights[joint * joints + joint] = own);
        if !input.by_tool {
            return;
        }
        let state = input.arms.state();
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

    /// Adds the constraints of the joints' speeds.
    fn bound_joints(&mut self, input: &FilterInput) {
        for joint in 0..input.joints.positions.len() {
            let (lowest, highest) = input.joints.span(joint).range;
            self.program.add_one(joint, 1.0, lowest);
            self.program.add_one(joint, -1.0, -highest);
        }
    }

    /// Adds the constraints for the gaps of the pairs that are near.
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
                // Leaves out constraints that the desired velocity satisfies by far.
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

    /// Finds the closest pair. Ignores pairs that overlap and that no joint can separate, such as the first link and the stand of
    /// the arm.
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

    /// Finds the pair that constrains the arm most, if the constraints change the desired velocity by more than the fraction
    /// [`HELD`].
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

/// Returns whether no joint changes a gap with this `slope` [m/rad, prismatic: m/m], apart from rounding. Such a gap does not
/// constrain the joints.
fn is_none(slope: &[f64]) -> bool {
    slope.iter().all(|slope| slope.abs() < 1e-9)
}

/// The pair that constrains the arm most is reported only if the constraints change the velocity by more than this fraction.
const HELD: f64 = 0.1;

/// Returns the rate η [1/s] at which a gap may approach the clearance: the fastest that braking, the control period and the delay
/// allow.
fn rate(input: &FilterInput) -> f64 {
    let limits = &input.settings.limits;
    let braking = &input.joints.braking;
    let slowest = (CYCLES * braking.cycle).max(DELAYS * braking.delay);
    let joints = limits.joint_acceleration.iter().zip(&limits.joint_velocity).zip(braking.jerks);
    let stops = joints.map(|((acceleration, speed), jerk)| {
        let rate = SHARE * acceleration / speed;
        // Building up the deceleration takes time, too.
        rate / (1.0 + rate * acceleration / jerk)
    });
    let stops = stops.fold(f64::INFINITY, f64::min);
    stops.min(1.0 / slowest) * (braking.period / braking.cycle)
}

impl Constraints {
    /// Replaces `velocity`, one number per joint [rad/s, prismatic: m/s], by the nearest velocity that satisfies the constraints.
    pub fn apply(&mut self, input: &FilterInput, velocity: &mut [f64]) {
        (self.closest, self.held_by, self.held_back) = (None, None, None);
        let Some(scene) = input.settings.scene.as_deref() else { return };
        // The final check rejects numbers that are not finite.
        if velocity.iter().any(|speed| !speed.is_finite()) {
            return;
        }
        self.placed.place(scene, input.arms.chains(), input.joints.positions);
        let rate = rate(input);
        let reach = |approach: f64| CLEARANCE + AROUND + 2.0 * approach / rate;
        self.placed.near(scene, velocity.iter().copied(), reach, &mut self.near);
        self.find_closest(scene);
        self.wanted.copy_from_slice(velocity);
        self.weigh(input);
        if !self.program.begin(velocity.len(), &self.weights) {
            return velocity.fill(0.0);
        }
        self.bound_joints(input);
        self.bound_gaps(scene, rate);
        if self.program.solve(velocity).is_err() {
            velocity.copy_from_slice(&self.wanted);
            self.program.relax();
            if self.program.solve(velocity).is_err() {
                velocity.fill(0.0);
            }
        }
        self.find_holder(scene, velocity);
        let limits = &input.settings.limits.position;
        let mut joints = input.joints.positions.iter().enumerate();
        self.held_back = joints.find_map(|(joint, position)| {
            let forces = [2 * joint, 2 * joint + 1].map(|row| self.program.multiplier(row));
            (forces != [0.0; 2] && limits.is_near(joint, *position)).then_some(joint)
        });
    }
}
