//! The tracking of a goal: from the goal and the pose to the target velocities, the figures of the motion, and its end.

use super::Servo;
use super::escape_phase::EscapePhase;
use crate::control::SignMemory;
use crate::dq::UnitDualQuaternion;
use crate::servo::carried::Carried;
use crate::servo::link::Contact;
use crate::servo::oscillation::Oscillation;
use crate::servo::progress::{BRISK, Progress, SHARE};
use crate::servo::stream::MovingGoal;
use crate::servo::{
    Asker, Goal, GoalError, Held, MotionMeter, Outcome, Reach, Reconfiguration, Revocation, Settings, Stall,
    State, Tolerance,
};
use nalgebra::Vector3;
use std::time::Duration;

/// A settled arm counts as tracking again when an error exceeds this multiple of its tolerance.
const UNSETTLE: f64 = 2.0;

/// Goals of one publisher that follow each other within this time are a stream, as those that `ros2 topic pub` sends once a second.
pub const STREAM: Duration = Duration::from_millis(1500);

/// An arm has arrived when at its speed it would take longer than this \[s\] to cross the tolerance.
const LINGERING: f64 = 0.1;

/// The smallest singular value is looked at so often.
const SIGMA_INTERVAL: Duration = Duration::from_millis(10);

/// A goal of a stream that has moved by less than this part of the way that is left is no reason to hope again for an arm that
/// gets no nearer.
const REASON_TO_HOPE: f64 = 0.1;

/// The goal in force in one cycle.
pub(super) struct Tracked {
    /// How far the arm is from it.
    pub error: GoalError,
    /// The goal with the sign that is chosen.
    pub goal: UnitDualQuaternion,
    /// The same where it moves and that is fed forward.
    pub moving: Option<MovingGoal>,
}

/// The goal in force and the motion to it.
pub(super) struct GoalTracking {
    pub goal: Goal,
    /// The stamp of its message \[ns\], and who sent it.
    pub stamp: i64,
    pub asker: Asker,
    /// When it was last heard of, by a message or from its frame, and by a message.
    pub received: Duration,
    heard: Duration,
    /// The goal with which the motion began, or to which a stream has last moved it: one that is the same within the tolerances is no
    /// other.
    begun: Goal,
    /// When a stream last moved the goal, where one has.
    pub moved: Option<Duration>,
    /// Chosen when the first goal is tracked, by where the arm is then.
    sign: Option<SignMemory>,
    pub meter: Option<MotionMeter>,
    /// When the motion began, and the controlled pose then.
    pub start: Option<(Duration, UnitDualQuaternion)>,
    /// Of each joint its largest speed as a part of its limit.
    pub peak_speeds: Vec<f64>,
    /// When the smallest singular value was last looked at.
    looked: Duration,
    /// What was last recorded of the motion.
    pub recorded: Option<Outcome>,
    /// Within the tolerances of this goal; it may then leave them a little.
    pub settled: bool,
    /// Since when it is not known where the frame is with which the goal moves.
    pub lost: Option<Duration>,
    pub carried: Carried,
    pub watch: Watch,
    /// Whether the arm has set out to another configuration.
    pub reconfigured: bool,
}

/// Watches whether the arm gets nearer.
pub(super) struct Watch {
    /// The goal for which it began.
    goal: Goal,
    /// How far the arm was when it was last looked at.
    error: GoalError,
    /// Since the arm was last driven without a break.
    progress: Option<Progress>,
    /// The same of the law's own error, for an arm that need not wait for a law that creeps.
    pace: Option<Progress>,
    /// The size of the law's own error.
    pub law_error: f64,
    pub escape: EscapePhase,
    /// Why the motion was given up, until there is reason to try again.
    pub stall: Option<Stall>,
    /// What is known of a way round that.
    pub reconfiguration: Reconfiguration,
    oscillation: Oscillation,
}

impl Watch {
    fn new(goal: Goal) -> Self {
        Self {
            goal,
            error: GoalError::default(),
            progress: None,
            pace: None,
            law_error: 0.0,
            escape: EscapePhase::default(),
            stall: None,
            reconfiguration: Reconfiguration::Unknown,
            oscillation: Oscillation::default(),
        }
    }

    /// Whether `goal`, of a stream, is too near to the one for which this began to be reason to begin anew.
    fn goes_on_for(&self, goal: &Goal, tolerance: &Tolerance) -> bool {
        let reach = Tolerance {
            linear: tolerance.linear.max(REASON_TO_HOPE * self.error.position),
            angular: tolerance.angular.max(REASON_TO_HOPE * self.error.rotation),
        };
        self.goal.is_same(goal, &reach)
    }
}

impl GoalTracking {
    /// To `goal`, whose message has that stamp \[ns\] and sender, and could be taken at `received`; of an arm with so many joints.
    pub fn new(goal: Goal, (stamp, asker): (i64, Asker), received: Duration, joint_count: usize) -> Self {
        Self {
            goal,
            stamp,
            asker,
            received,
            heard: received,
            begun: goal,
            moved: None,
            sign: None,
            meter: None,
            start: None,
            peak_speeds: vec![0.0; joint_count],
            looked: Duration::ZERO,
            recorded: None,
            settled: false,
            lost: None,
            carried: Carried::default(),
            watch: Watch::new(goal),
            reconfigured: false,
        }
    }

    /// Whether `goal`, which came from `asker` at `now`, goes on with this motion: it is of the same stream.
    pub fn streams(&self, asker: Asker, now: Duration) -> bool {
        self.asker == asker && now.saturating_sub(self.heard) <= STREAM
    }

    /// Goes on to `goal` of the same stream, whose message has that stamp \[ns\] and could be taken at `now`.
    pub fn stream_to(&mut self, goal: Goal, stamp: i64, now: Duration, tolerance: &Tolerance) {
        if !self.begun.is_same(&goal, tolerance) {
            (self.begun, self.moved) = (goal, Some(now));
        }
        self.move_to(goal, now, tolerance);
        // Where it is was said just now, whatever a frame did before.
        (self.stamp, self.heard, self.carried) = (stamp, now, Carried::default());
    }

    /// The tracking of `next` instead of this one. Of a motion that has come to its end nothing is left. Of one that is under way the sign
    /// goes on; and what is the same goal within `tolerance` gives no new hope to an arm that gets no nearer.
    pub fn replaced_by(&mut self, mut next: Self, tolerance: &Tolerance) -> Self {
        if self.recorded.is_some_and(|outcome| outcome.is_end()) {
            return next;
        }
        let carried =
            |sign: &SignMemory| sign.carried(self.goal.base_from_goal(), next.goal.base_from_goal());
        next.sign = self.sign.as_ref().map(carried);
        if self.begun.is_same(&next.goal, tolerance) {
            std::mem::swap(&mut next.watch, &mut self.watch);
            next.reconfigured = next.is_reconfiguring();
        }
        next
    }

    /// Moves on to `goal`, where a stream or its frame has taken it by `now`; for how long the frame was lost before, if it was.
    pub fn move_to(&mut self, goal: Goal, now: Duration, tolerance: &Tolerance) -> Option<Duration> {
        let carried = |sign: &SignMemory| sign.carried(self.goal.base_from_goal(), goal.base_from_goal());
        self.sign = self.sign.as_ref().map(carried);
        self.settled &= self.goal == goal;
        (self.goal, self.received) = (goal, now);
        if !self.watch.goes_on_for(&goal, tolerance) {
            // In the memory that there is: a goal that moves gets here every few cycles.
            self.watch.oscillation.restart();
            let oscillation = std::mem::take(&mut self.watch.oscillation);
            self.watch = Watch { oscillation, ..Watch::new(goal) };
        }
        self.lost.take().map(|since| now.saturating_sub(since))
    }

    /// Begins the motion anew.
    pub fn begin_anew(&mut self, asker: Asker, joint_count: usize) {
        let Self { goal, stamp, received, lost, .. } = *self;
        *self = Self { lost, ..Self::new(goal, (stamp, asker), received, joint_count) };
    }

    /// Forgets the figures of the motion so far, and that it has ended: they were of another tool, or of another part of the pose.
    pub fn forget_motion(&mut self) {
        (self.meter, self.settled) = (None, false);
    }

    /// Ends a stall, and what was found out since; a reconfiguration that is under way is no stall, and goes on.
    pub fn try_again(&mut self) {
        if !self.is_reconfiguring() {
            self.watch.reconfiguration = Reconfiguration::Unknown;
        }
        let watch = &mut self.watch;
        (watch.progress, watch.pace) = (None, None);
        (watch.escape, watch.stall) = (EscapePhase::default(), None);
        watch.oscillation.restart();
    }

    /// Chooses the sign anew: the arm stands, and the nearer one is as good as any.
    pub fn forget_sign(&mut self) {
        self.sign = None;
    }

    /// Goes on from where a servo held its goal.
    pub fn from_held(held: &Held, joint_count: usize) -> Self {
        let mut tracking = Self::new(held.goal, (held.stamp, held.asker), held.received, joint_count);
        tracking.watch.stall = held.stalled.then_some(Stall::NoProgress);
        tracking.recorded = match (held.revoked, tracking.watch.stall) {
            (true, _) => Some(Outcome::Revoked(Revocation::Stopped)),
            (false, stall) => stall.map(Outcome::Stalled),
        };
        tracking
    }

    /// What is kept while the arm stands, by a consent that was sent then; none of a goal that moves with its frame,
    /// or where more is known: another configuration.
    pub fn held(&self, sent: Duration, revoked: bool) -> Option<Held> {
        let Self { goal, stamp, asker, received, .. } = *self;
        let stalled = self.watch.stall.is_some();
        let held = Held { goal, stamp, asker, sent, received, stalled, revoked };
        let is_all =
            matches!(self.watch.reconfiguration, Reconfiguration::Unknown | Reconfiguration::NotFound { .. });
        (received == self.heard && self.lost.is_none() && is_all).then_some(held)
    }
}

impl Servo {
    /// How far that point \[m\] is, and how far the arm reaches, where that is too little.
    pub(super) fn beyond_reach(&self, point: &Vector3<f64>) -> Option<Reach> {
        let Settings { limits, goal_tolerance, .. } = &self.settings;
        let reach = self.robot.arms.reach(point, &limits.position);
        reach.is_beyond(goal_tolerance.linear).then_some(reach)
    }

    pub(super) fn driving_state(&self, arrived: bool) -> State {
        match (arrived, self.status.joint_at_limit) {
            (true, _) => State::Settled,
            (false, _) if self.robot.link.find(&[Contact::Lost]).is_some() => State::NotFollowing,
            (false, _) if self.status.held_by.is_some() => State::Constrained,
            (false, _) if self.is_reconfiguring() => State::Reconfiguring,
            (false, Some(_)) => State::JointLimit,
            (false, None) if self.twists.jog.is_some() => State::Jogging,
            (false, None) => State::Tracking,
        }
    }

    /// Gives the motion up, from the next cycle on, where it has made no progress for too long.
    pub(super) fn watch_progress(&mut self, now: Duration, error: Option<GoalError>) {
        let reconfigures = self.is_reconfiguring();
        let left = if reconfigures { self.time_to_elsewhere() } else { 0.0 };
        let (Some(tracking), Some(error)) = (&mut self.goals.tracking, error) else { return };
        let watch = &mut tracking.watch;
        watch.error = error;
        let is_driven = matches!(
            self.status.state,
            State::Tracking | State::JointLimit | State::Constrained | State::Reconfiguring
        );
        // The escape from a singularity has an end of its own.
        if !is_driven || watch.escape.is_escaping() {
            (watch.progress, watch.pace) = (None, None);
            watch.oscillation.restart();
            return;
        }
        // On the way to another configuration the goal may be farther away for a while.
        let (error, law_error) =
            if reconfigures { (GoalError::default(), left) } else { (error, watch.law_error) };
        let tolerance = &self.settings.goal_tolerance;
        let progress = watch.progress.get_or_insert_with(|| Progress::begin(now, error, law_error, SHARE));
        let without = progress.update(now, error, law_error, tolerance);
        let nothing = GoalError::default();
        let pace = watch.pace.get_or_insert_with(|| Progress::begin(now, nothing, law_error, BRISK));
        let creeps = pace.update(now, nothing, law_error, tolerance);
        if watch.oscillation.update(now, &self.output.command, law_error) {
            // One far beyond reach makes the arm swing whatever the gains are.
            let point = tracking.goal.base_from_goal().translation();
            let stall = self.beyond_reach(&point).map_or(Stall::Oscillating, Stall::BeyondReach);
            let Some(tracking) = &mut self.goals.tracking else { return };
            tracking.give_up(stall, self.settings.reconfigure, now);
            return;
        }
        let Some(timeout) = self.settings.progress_timeout else { return };
        let (goal, sign) = (*tracking.goal.base_from_goal(), self.status.sign);
        let stall = match self.status.joint_at_limit {
            _ if without <= timeout && creeps <= timeout => None,
            _ if without <= timeout => self.hindrance(),
            _ if !reconfigures => self.stall(&if sign > 0.0 { goal } else { -goal }),
            joint => Some(match (self.status.held_by, joint) {
                (Some(pair), _) => Stall::Constrained(pair),
                (None, Some(joint)) => Stall::AtLimit { joint },
                (None, None) => Stall::NoProgress,
            }),
        };
        let Some(tracking) = &mut self.goals.tracking else { return };
        stall.into_iter().for_each(|stall| tracking.give_up(stall, self.settings.reconfigure, now));
    }

    /// Where the goal in force is at time `now`, seen from where the arm is.
    pub(super) fn track(&mut self, now: Duration) -> Option<Tracked> {
        self.robot.link.received()?;
        let tracking = self.goals.tracking.as_mut()?;
        let Settings { controller, feed_forward, sign_hysteresis, .. } = &self.settings;
        let moving = if *feed_forward { self.goals.stream.at(now) } else { None };
        let goal = moving.as_ref().map_or(tracking.goal.base_from_goal(), |moving| &moving.pose);
        let pose = self.robot.arms.pose();
        let sign = tracking.sign.get_or_insert_with(|| SignMemory::nearest(goal, &pose));
        let goal = sign.apply(goal, &pose, *sign_hysteresis);
        self.status.sign = sign.sign();
        let nearest = controller.aim.nearest(&goal, &pose);
        self.status.pose_error = (nearest.conjugate() * pose).screw_log();
        let error = GoalError::of(controller.aim, self.robot.arms.state(), &goal);
        Some(Tracked { error, goal, moving: moving.map(|moving| MovingGoal { pose: goal, ..moving }) })
    }

    /// Wants the law's velocity towards the goal.
    pub(super) fn obey_law(&mut self, now: Duration, tracked: &Tracked) {
        let arm = self.robot.predicted.state();
        self.settings.controller.joint_velocity(arm, &tracked.goal, &mut self.output.velocity);
        self.watch_escape(now, &tracked.goal, tracked.error.is_within(&self.settings.goal_tolerance));
        self.status.gain_factor = self.stable_part(&tracked.goal);
    }

    /// Whether an arm that is within `tolerance` stays there for a moment at the speed of the last command.
    fn lingers(&self, tolerance: &Tolerance) -> bool {
        let arm = self.robot.arms.state();
        let asked_for = self.settings.controller.aim.part_of(arm, &arm.tool_twist(&self.output.command));
        let (angular, linear) = (asked_for.0.norm(), asked_for.1.norm());
        linear * LINGERING <= tolerance.linear && angular * LINGERING <= tolerance.angular
    }

    /// Adds this cycle to the motion's figures; true where the errors are within the tolerances.
    pub(super) fn measure(&mut self, now: Duration, error: Option<GoalError>) -> bool {
        let (pose, tolerance) = (self.robot.arms.pose(), self.settings.goal_tolerance);
        let lingers = self.lingers(&tolerance);
        let (Some(tracking), Some(error)) = (&mut self.goals.tracking, error) else { return false };
        let (point, goal_point) = (pose.translation(), tracking.goal.base_from_goal().translation());
        tracking.start.get_or_insert((now, pose));
        let begin = || MotionMeter::begin(now, point, goal_point, &error, &tolerance);
        let meter = tracking.meter.get_or_insert_with(begin);
        meter.aim_at(goal_point);
        let speeds = self.output.speeds();
        meter.update(now, point, &error, speeds);
        let limits = &self.settings.limits.joint_velocity;
        for ((peak, speed), limit) in tracking.peak_speeds.iter_mut().zip(speeds).zip(limits) {
            *peak = peak.max(speed.abs() / limit);
        }
        if now.saturating_sub(tracking.looked) >= SIGMA_INTERVAL {
            tracking.looked = now;
            let least = meter.figures().smallest_singular_value.unwrap_or(f64::INFINITY);
            let (controller, arm) = (&self.settings.controller, self.robot.arms.state());
            if let Some(sigma) = controller.singular_value_below(least, arm) {
                meter.see_singular_value(sigma);
            }
        }
        // An arm that has settled is within its tolerances at any speed, as after a switch to a law that drives it faster.
        let (slack, lingers) = if tracking.settled { (UNSETTLE, true) } else { (1.0, lingers) };
        let Tolerance { linear, angular } = tolerance;
        let within =
            lingers && error.is_within(&Tolerance { linear: slack * linear, angular: slack * angular });
        if within {
            meter.arrived();
        }
        tracking.settled = within;
        self.status.figures = meter.figures();
        within
    }
}
