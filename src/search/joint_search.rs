//! Searches for joint positions that bring the tool to its goal. The positions are within the limits, but the configuration may
//! differ from the present one, for example in the side of the elbow.
//!
//! From many start positions, spread evenly over the joint ranges, the search reduces the error by damped least squares (Wampler
//! 1986; Nakamura & Hanafusa 1986). The damping falls with the error (Sugihara 2011). So the search also reaches goals at
//! singularities, such as at the edge of the workspace. For random reachable poses of arms with six and seven joints, 64 start
//! positions were always enough to reach the goal. More start positions make the path slightly shorter.

use dq_algebra::UnitDualQuaternion;
use dq_kinematics::arm::{Arms, JointKind};
use dq_kinematics::control::{Aim, Damping, PoseError, nearer_goal};
use dq_limits::{Limits, PositionLimits};
use dq_metrics::{GoalError, Tolerance};
use std::f64::consts::{PI, TAU};
use std::time::Duration;

/// The number of start positions from which to search if there is enough time. Pass it to [`Search::run`].
pub const STARTS: u32 = 256;

/// The largest number of steps from one start position. A search that needs more steps converges slowly or never.
const STEPS: u32 = 60;

/// Largest step of a joint \[rad, prismatic: m\]. The linearization is good enough for a step up to this size.
const LONGEST_STEP: f64 = 0.5;

/// The ratio of λ, the damping of the [damped inverse](Damping), to the error. The constant [`DAMPINGS`] bounds λ.
///
/// The inverse is damped only if the smallest singular value of the Jacobian is below λ: the [threshold](Damping::threshold) σ₀
/// equals λ.
const DAMPING: f64 = 0.3;

/// The bounds of λ, the damping of the [damped inverse](Damping): `λ = min(DAMPING · error, first number) + second number`. So λ lies
/// between the second number and the sum of both.
const DAMPINGS: (f64, f64) = (0.2, 1e-3);

/// The fraction of the goal tolerance within which the search counts the goal as reached. It is less than 1, so that the law
/// settles at the positions found.
const CLOSE: f64 = 0.1;

/// The range in which a prismatic joint is searched, on each side of its present position \[m\]. Position limits may shift or narrow
/// this range.
const SLIDE: f64 = 1.0;

/// The task of a search: the goal, and the present state and limits of the arms that are to reach it.
#[derive(Clone, Copy, Debug)]
pub struct Question<'a> {
    /// The pose that the tool is to reach, in the base frame. For two arms, see [`Arms::pose`].
    pub goal: &'a UnitDualQuaternion,
    /// The components of the pose that count.
    pub aim: Aim,
    /// The errors within which the goal counts as reached.
    pub tolerance: Tolerance,
    /// The tool offset: the pose of the tool relative to the flange. The flange is the frame that the tool has without an offset.
    pub tool_offset: &'a UnitDualQuaternion,
    /// The present joint positions \[rad, prismatic: m\].
    pub from: &'a [f64],
    /// The limits. The result is within the position limits, and the largest joint speeds determine the travel times.
    pub limits: &'a Limits,
}

/// A search for joint positions that reach a goal: its question, its buffers and its result.
pub struct Search {
    /// The time at which the servo asked the question; `None` before the first question.
    asked: Option<Duration>,
    goal: UnitDualQuaternion,
    aim: Aim,
    tolerance: Tolerance,
    limits: PositionLimits,
    /// The largest speed of each joint [rad/s, prismatic: m/s]. Divided by these speeds, displacements become travel times, which
    /// the search compares.
    speeds: Vec<f64>,
    /// The joint positions of the arms when the servo asked the question \[rad, prismatic: m\].
    from: Vec<f64>,
    /// The arms at trial positions.
    trial: Arms,
    kinds: Vec<JointKind>,
    positions: Vec<f64>,
    step: Vec<f64>,
    starts: u32,
    /// The positions with the shortest travel time among those found so far \[rad, prismatic: m\].
    nearest: Vec<f64>,
    /// The travel time to `nearest` \[s\].
    shortest: f64,
}

/// The result of a search.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Found<'a> {
    /// The time of the cycle in which the servo asked the question.
    pub asked: Duration,
    /// The number of starts that the search has tried.
    pub starts: u32,
    /// The joint positions that bring the tool to the goal in the shortest travel time found \[rad, prismatic: m\]; `None` if the
    /// search has not reached the goal.
    pub positions: Option<&'a [f64]>,
}

impl Search {
    /// Creates a search for these arms. It has no question yet.
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

    /// Returns the time at which the servo asked the question; `None` before the first question.
    pub fn asked(&self) -> Option<Duration> {
        self.asked
    }

    /// Sets the question, which the servo asked at the time `asked`. Allocates nothing.
    pub fn put(&mut self, asked: Duration, question: &Question) {
        let Question { goal, aim, tolerance, tool_offset, from, limits } = *question;
        (self.asked, self.goal, self.aim, self.tolerance) = (Some(asked), *goal, aim, tolerance);
        self.limits.lower.clone_from(&limits.position.lower);
        self.limits.upper.clone_from(&limits.position.upper);
        self.speeds.clone_from(&limits.joint_velocity);
        self.from.copy_from_slice(from);
        self.trial.set_tool_offset(tool_offset);
        (self.starts, self.shortest) = (0, f64::INFINITY);
    }

    /// Tries start positions until `most` have been tried for the present question, or `goes_on` returns false. Allocates nothing.
    pub fn run(&mut self, most: u32, mut goes_on: impl FnMut() -> bool) {
        while self.starts < most && goes_on() {
            self.start();
            self.starts += 1;
            if self.reaches_goal() {
                self.keep();
            }
        }
    }

    /// Returns the result of the starts that were tried so far.
    pub fn found(&self) -> Found<'_> {
        let positions = self.shortest.is_finite().then_some(self.nearest.as_slice());
        Found { asked: self.asked.unwrap_or_default(), starts: self.starts, positions }
    }

    /// Sets the trial positions to the next start. Start 0 is at the positions of the arms when the servo asked the question. In
    /// start n, joint i (counted from 1) is at the fraction `frac(½ + n φᵢ)` of its range. Here `φᵢ = g⁻ⁱ` and `g^(d+1) = g + 1`
    /// for d joints. This sequence leaves no large gaps (Roberts 2018).
    fn start(&mut self) {
        let (from, limits) = (&self.from, &self.limits);
        let root = (0..ROOT_STEPS).fold(1.5_f64, |g, _| (1.0 + g).powf(1.0 / (from.len() as f64 + 1.0)));
        let mut step = 1.0;
        let joints = self.positions.iter_mut().zip(from).zip(limits.ranges()).zip(&self.kinds);
        for (((position, from), (lower, upper)), kind) in joints {
            step /= root;
            let half = if *kind == JointKind::Revolute { PI } else { SLIDE };
            // For a revolute joint, one whole turn within its range covers all positions.
            let lowest = (from - half).min(upper - 2.0 * half).max(lower);
            let highest = (lowest + 2.0 * half).min(upper);
            *position = match self.starts {
                0 => from.max(lower).min(upper),
                number => lowest + (0.5 + f64::from(number) * step).fract() * (highest - lowest),
            };
        }
    }

    /// Reduces the error, beginning at the trial positions. Returns whether the goal is reached at the positions found.
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

    /// Stores the positions found if their travel time is the shortest so far.
    ///
    /// First shifts each revolute joint by whole turns, within its limits. So the joint is as near as possible to the position that it
    /// had when the servo asked the question.
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

/// Number of fixed-point steps in which [`Search::start`] solves `g^(d+1) = g + 1` for g, with d joints. Each step divides the error
/// by three or more.
const ROOT_STEPS: u32 = 34;
