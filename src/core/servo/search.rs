//! The search for joint positions within the limits at which the tool is at its goal, in whatever configuration of the arm.
//!
//! From many starts, spread evenly over what the limits allow, the error is reduced by damped least squares (Wampler 1986; Nakamura &
//! Hanafusa 1986). The damping falls with the error (Sugihara 2011), so that goals at singularities are reached too, as at the edge of the
//! workspace. For random reachable poses 64 starts have found the goal each time, with six joints as with seven; with more of them the
//! way that is taken gets a little shorter.

use super::{Arms, GoalError, PositionLimits, Settings, Tolerance};
use dq_algebra::UnitDualQuaternion;
use dq_kinematics::arm::JointKind;
use dq_kinematics::control::{Aim, Damping, PoseError, nearer_goal};
use std::f64::consts::{PI, TAU};
use std::time::Duration;

/// So many starts are tried, where there is time.
pub const STARTS: u32 = 256;

/// A start from which the goal is not reached in so many steps leads to it slowly, or never.
const STEPS: u32 = 60;

/// No joint moves farther in a step \[rad, prismatic: m\]: what is linear there is so only near.
const LONGEST_STEP: f64 = 0.5;

/// λ of the damped inverse, and σ₀ below which it damps: this part of the error ...
const DAMPING: f64 = 0.3;

/// ... and not more than this, nor less than that.
const DAMPINGS: (f64, f64) = (0.2, 1e-3);

/// The tool is at the goal within this part of the goal tolerance, so that the law finds it settled.
const CLOSE: f64 = 0.1;

/// A joint that slides and has no limits is looked for so far from where it is \[m\].
const SLIDE: f64 = 1.0;

/// What is looked for, the memory that looking for it takes, and what was found.
pub struct Search {
    /// The time of the cycle that asks; none before the first one.
    asked: Option<Duration>,
    goal: UnitDualQuaternion,
    aim: Aim,
    tolerance: Tolerance,
    limits: PositionLimits,
    /// The largest speed of each joint [rad/s, prismatic: m/s]: of two displacements the one that takes less time is shorter.
    speeds: Vec<f64>,
    /// Where the arm is \[rad, prismatic: m\].
    from: Vec<f64>,
    /// To try positions on.
    trial: Arms,
    kinds: Vec<JointKind>,
    positions: Vec<f64>,
    step: Vec<f64>,
    starts: u32,
    /// The positions that are nearest in time so far.
    nearest: Vec<f64>,
    /// How long it takes \[s\].
    shortest: f64,
}

/// What a search came to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Found<'a> {
    /// The time of the servo's cycle that asked.
    pub asked: Duration,
    /// From how many starts the goal was looked for.
    pub starts: u32,
    /// The joint positions \[rad, prismatic: m\] that were found, one a joint, those that are nearest in time; none where there are none.
    pub positions: Option<&'a [f64]>,
}

impl Search {
    /// For these arms; nothing is looked for yet.
    pub fn new(arms: Arms) -> Self {
        let joints = arms.joint_count();
        let zeros = vec![0.0; joints];
        Self {
            asked: None,
            goal: UnitDualQuaternion::identity(),
            aim: Aim::Pose,
            tolerance: Tolerance { linear: 0.0, angular: 0.0 },
            limits: PositionLimits::none(joints),
            speeds: zeros.clone(),
            from: zeros.clone(),
            kinds: arms.joint_kinds(),
            trial: arms,
            positions: zeros.clone(),
            step: zeros.clone(),
            starts: 0,
            nearest: zeros,
            shortest: f64::INFINITY,
        }
    }

    /// When what is looked for was asked; none before the first time.
    pub fn asked(&self) -> Option<Duration> {
        self.asked
    }

    /// Begins anew: `goal` is looked for, for joints at `from` \[rad, prismatic: m\], one number a joint, under `settings`; asked at that
    /// time. Allocates nothing.
    pub fn put(&mut self, asked: Duration, goal: &UnitDualQuaternion, from: &[f64], settings: &Settings) {
        let Settings { controller, limits, goal_tolerance, tool_offset, .. } = settings;
        (self.asked, self.goal, self.aim) = (Some(asked), *goal, controller.aim);
        self.tolerance = *goal_tolerance;
        self.limits.lower.clone_from(&limits.position.lower);
        self.limits.upper.clone_from(&limits.position.upper);
        self.speeds.clone_from(&limits.joint_velocity);
        self.from.copy_from_slice(from);
        self.trial.set_tool_offset(tool_offset);
        (self.starts, self.shortest) = (0, f64::INFINITY);
    }

    /// Looks for the goal from `most` starts, as long as it `goes_on`; allocates nothing.
    pub fn run(&mut self, most: u32, mut goes_on: impl FnMut() -> bool) {
        while self.starts < most && goes_on() {
            self.start();
            self.starts += 1;
            if self.reaches_goal() {
                self.keep();
            }
        }
    }

    /// What it came to.
    pub fn found(&self) -> Found<'_> {
        let positions = self.shortest.is_finite().then_some(self.nearest.as_slice());
        Found { asked: self.asked.unwrap_or_default(), starts: self.starts, positions }
    }

    /// Goes to the next start: first where the arm is, then to the points `frac(½ + n φᵢ)` of the range of each joint, with
    /// `φᵢ = g⁻ⁱ`, `g^(d+1) = g + 1`, for d joints: a sequence that leaves no large gaps (Roberts 2018).
    fn start(&mut self) {
        let (from, limits) = (&self.from, &self.limits);
        let root = (0..ROOT_STEPS).fold(1.5_f64, |g, _| (1.0 + g).powf(1.0 / (from.len() as f64 + 1.0)));
        let mut step = 1.0;
        let joints = self.positions.iter_mut().zip(from).zip(limits.ranges()).zip(&self.kinds);
        for (((position, from), (lower, upper)), kind) in joints {
            step /= root;
            let half = if *kind == JointKind::Revolute { PI } else { SLIDE };
            // A whole turn has every place of a joint that turns; beyond its range it has none.
            let lowest = (from - half).min(upper - 2.0 * half).max(lower);
            let highest = (lowest + 2.0 * half).min(upper);
            *position = match self.starts {
                0 => from.max(lower).min(upper),
                number => lowest + (0.5 + f64::from(number) * step).fract() * (highest - lowest),
            };
        }
    }

    /// Whether the goal is reached from where the joints are, which they then are at.
    fn reaches_goal(&mut self) -> bool {
        let (goal, aim, limits) = (&self.goal, self.aim, &self.limits);
        let Tolerance { linear, angular } = self.tolerance;
        let close = Tolerance { linear: CLOSE * linear, angular: CLOSE * angular };
        for _ in 0..STEPS {
            self.trial.evaluate(&self.positions);
            let arm = self.trial.state();
            let goal = nearer_goal(goal, &arm.base_from_tool());
            if GoalError::of(aim, arm, &goal).is_within(&close) {
                return true;
            }
            let (angular, linear) = PoseError::of(aim, arm, &goal).decoupled_log();
            let error = (angular.norm_squared() + linear.norm_squared()).sqrt();
            let lambda = (DAMPING * error).min(DAMPINGS.0) + DAMPINGS.1;
            let damping = Damping { max: lambda, threshold: lambda };
            damping.joint_velocity(arm, aim, || (angular, linear), &mut self.step);
            let longest = self.step.iter().fold(LONGEST_STEP, |longest, step| longest.max(step.abs()));
            let joints = self.positions.iter_mut().zip(&self.step).zip(limits.ranges());
            for ((position, step), (lower, upper)) in joints {
                *position = (*position + step * LONGEST_STEP / longest).max(lower).min(upper);
            }
        }
        false
    }

    /// Keeps the positions, each turn of a joint by whole turns as near to where that is as its limits allow, where the way there is the
    /// shortest so far.
    fn keep(&mut self) {
        let (from, limits, speeds) = (&self.from, &self.limits, &self.speeds);
        let mut time = 0.0_f64;
        let joints = self.positions.iter_mut().zip(from).zip(limits.ranges()).zip(speeds).zip(&self.kinds);
        for ((((position, from), (lower, upper)), speed), kind) in joints {
            let nearest = from + kind.displacement(*from, *position);
            let turns = [nearest, nearest - TAU, nearest + TAU].into_iter();
            let possible =
                turns.filter(|turned| *kind == JointKind::Revolute && (lower..=upper).contains(turned));
            let distance = |position: &f64| (position - from).abs();
            *position = possible.min_by(|a, b| distance(a).total_cmp(&distance(b))).unwrap_or(*position);
            time = time.max(distance(position) / speed);
        }
        if time < self.shortest {
            self.shortest = time;
            self.nearest.copy_from_slice(&self.positions);
        }
    }
}

/// Fixed-point steps to the root of `g^(d+1) = g + 1`: each divides the error by three or more.
const ROOT_STEPS: u32 = 34;
