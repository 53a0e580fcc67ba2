//! The pursuit of a goal: from the goal and the pose to the target velocities, the figures of the motion, and its end.

use super::Servo;
use super::demand::Demand;
use super::passage::Passage;
use crate::arm::ArmError;
use crate::control::SignMemory;
use crate::dq::UnitDualQuaternion;
use crate::servo::carried::Carried;
use crate::servo::link::Contact;
use crate::servo::oscillation::Oscillation;
use crate::servo::progress::Progress;
use crate::servo::stream::MovingGoal;
use crate::servo::{Goal, GoalError, Motion, Reach, Settings, Stall, State, Task, Tolerance};
use nalgebra::Vector3;
use std::time::Duration;

/// A settled arm counts as tracking again when an error exceeds this multiple of its tolerance.
const UNSETTLE: f64 = 2.0;

/// Goals that follow each other within this time are a stream.
pub const STREAM: Duration = Duration::from_secs(1);

/// A goal of a stream that has moved by less than this part of the way that is left is no reason to hope again for an arm that
/// gets no nearer.
const REASON_TO_HOPE: f64 = 0.1;

/// The goal in force and the motion to it.
pub(super) struct Pursuit {
    pub goal: Goal,
    /// When it was last heard.
    pub received: Duration,
    /// The goal with which the motion began: one that is the same within the tolerances begins no other.
    begun: Goal,
    /// Chosen when the first goal is pursued, by where the arm is then.
    sign: Option<SignMemory>,
    motion: Option<Motion>,
    /// Within the tolerances of this goal; it may then leave them a little.
    settled: bool,
    /// Since when it is not known where the frame is with which the goal moves.
    pub lost: Option<Duration>,
    pub carried: Carried,
    pub watch: Watch,
}

/// Watches whether the arm gets nearer.
pub(super) struct Watch {
    /// The goal for which it began.
    goal: Goal,
    /// How far the arm was when it was last looked at.
    error: GoalError,
    /// Since the arm was last driven without a break.
    progress: Option<Progress>,
    /// The size of the law's own error.
    pub law_error: f64,
    pub passage: Passage,
    /// Why the motion was given up, until there is reason to try again.
    pub stall: Option<Stall>,
    oscillation: Oscillation,
}

impl Watch {
    fn new(goal: Goal) -> Self {
        Self {
            goal,
            error: GoalError::default(),
            progress: None,
            law_error: 0.0,
            passage: Passage::default(),
            stall: None,
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

impl Pursuit {
    /// To `goal`, which could be taken at `received`.
    pub fn new(goal: Goal, received: Duration) -> Self {
        Self {
            goal,
            received,
            begun: goal,
            sign: None,
            motion: None,
            settled: false,
            lost: None,
            carried: Carried::default(),
            watch: Watch::new(goal),
        }
    }

    /// Goes on to `goal`, which could be taken at `now`, if it is the same within `tolerance`; else returns the pursuit that follows
    /// this one.
    pub fn follow(&mut self, goal: Goal, now: Duration, tolerance: &Tolerance) -> Option<Self> {
        let carried = |sign: &SignMemory| sign.carried(self.goal.base_from_goal(), goal.base_from_goal());
        let sign = self.sign.as_ref().map(carried);
        if self.begun.is_same(&goal, tolerance) {
            self.settled &= self.goal == goal;
            (self.goal, self.received, self.sign) = (goal, now, sign);
            // Where it is was said just now, whatever a frame did before.
            (self.lost, self.carried) = (None, Carried::default());
            return None;
        }
        let mut next = Self { sign, ..Self::new(goal, now) };
        if now.saturating_sub(self.received) <= STREAM && self.watch.goes_on_for(&goal, tolerance) {
            std::mem::swap(&mut next.watch, &mut self.watch);
        }
        Some(next)
    }

    /// Moves on to `goal`, where its frame has taken it by `now`; for how long the frame was lost before, if it was.
    pub fn move_to(&mut self, goal: Goal, now: Duration, tolerance: &Tolerance) -> Option<Duration> {
        let carried = |sign: &SignMemory| sign.carried(self.goal.base_from_goal(), goal.base_from_goal());
        self.sign = self.sign.as_ref().map(carried);
        self.settled &= self.goal == goal;
        (self.goal, self.received) = (goal, now);
        if !self.watch.goes_on_for(&goal, tolerance) {
            self.watch = Watch::new(goal);
        }
        self.lost.take().map(|since| now.saturating_sub(since))
    }

    /// Begins the motion anew.
    pub fn begin_anew(&mut self) {
        let Self { goal, received, lost, .. } = *self;
        *self = Self { lost, ..Self::new(goal, received) };
    }

    /// Forgets the figures of the motion so far, and that it has ended: they were of another tool, or of another part of the pose.
    pub fn forget_motion(&mut self) {
        (self.motion, self.settled) = (None, false);
    }

    pub fn try_again(&mut self) {
        let watch = &mut self.watch;
        (watch.progress, watch.passage, watch.stall) = (None, Passage::default(), None);
        watch.oscillation = Oscillation::default();
    }
}

impl<T: Task> Servo<T> {
    /// How far that point \[m\] is, and how far the arm reaches, where that is too little.
    pub(super) fn beyond_reach(&self, point: &Vector3<f64>) -> Option<Reach> {
        let Settings { limits, goal_tolerance, .. } = &self.settings;
        let reach = self.task.reach(point, &limits.position);
        reach.is_beyond(goal_tolerance.linear).then_some(reach)
    }

    pub(super) fn driving_state(&self, arrived: bool) -> State {
        match (arrived, self.status.joint_at_limit) {
            (true, _) => State::Settled,
            (false, _) if self.link.find(&[Contact::Lost]).is_some() => State::NotFollowing,
            (false, Some(_)) => State::JointLimit,
            (false, None) if self.jog.is_some() => State::Jogging,
            (false, None) => State::Tracking,
        }
    }

    /// Gives the motion up, from the next cycle on, where it has made no progress for too long.
    pub(super) fn watch_progress(&mut self, now: Duration, error: Option<GoalError>) -> Result<(), ArmError> {
        let (Some(pursuit), Some(error)) = (&mut self.pursuit, error) else { return Ok(()) };
        let watch = &mut pursuit.watch;
        watch.error = error;
        // The way out of a singularity has an end of its own.
        if !matches!(self.status.state, State::Tracking | State::JointLimit) || watch.passage.is_leaving() {
            (watch.progress, watch.oscillation) = (None, Oscillation::default());
            return Ok(());
        }
        let progress = watch.progress.get_or_insert_with(|| Progress::begin(now, error, watch.law_error));
        let without = progress.update(now, error, watch.law_error, &self.settings.goal_tolerance);
        if watch.oscillation.update(now, &self.command, watch.law_error) {
            // One far beyond reach makes the arm swing whatever the gains are.
            let point = pursuit.goal.base_from_goal().translation();
            let stall = self.beyond_reach(&point).map_or(Stall::Oscillating, Stall::BeyondReach);
            self.pursuit.iter_mut().for_each(|pursuit| pursuit.watch.stall = Some(stall));
            return Ok(());
        }
        if self.settings.progress_timeout.is_some_and(|timeout| without > timeout) {
            let (goal, sign) = (*pursuit.goal.base_from_goal(), self.status.sign);
            let stall = self.stall(&if sign > 0.0 { goal } else { -goal })?;
            self.pursuit.iter_mut().for_each(|pursuit| pursuit.watch.stall = stall);
        }
        Ok(())
    }

    /// Sets the target velocities by the law where `driving` at time `now`, and returns the error.
    pub(super) fn pursue(&mut self, now: Duration, driving: bool) -> Result<Option<GoalError>, ArmError> {
        let (Some(pursuit), Some(_)) = (&mut self.pursuit, self.link.received()) else { return Ok(None) };
        let moving = match self.settings.feed_forward && T::feeds_forward(&self.settings.controller) {
            true => self.stream.at(now),
            false => None,
        };
        let goal = moving.as_ref().map_or(pursuit.goal.base_from_goal(), |moving| &moving.pose);
        let pose = self.task.pose();
        let sign = pursuit.sign.get_or_insert_with(|| SignMemory::nearest(goal, &pose));
        let goal = sign.apply(goal, &pose, self.settings.sign_hysteresis);
        self.status.sign = sign.sign();
        let nearest = self.task.nearest_goal(&self.settings.controller, &goal);
        self.status.pose_error = (nearest.conjugate() * pose).screw_log();
        let error = self.task.goal_error(&self.settings.controller, &goal);
        if driving {
            let arrived = error.is_within(&self.settings.goal_tolerance);
            let moving = moving.map(|moving| MovingGoal { pose: goal, ..moving });
            self.drive_towards(now, &goal, moving.as_ref(), arrived)?;
        }
        Ok(Some(error))
    }

    /// The law's velocities within all speed limits, slowed where following them would take too much acceleration.
    fn drive_towards(
        &mut self,
        now: Duration,
        goal: &UnitDualQuaternion,
        moving: Option<&MovingGoal>,
        arrived: bool,
    ) -> Result<(), ArmError> {
        self.predicted.joint_velocity(&self.settings.controller, goal, &mut self.target);
        self.watch_passage(now, goal, arrived)?;
        self.status.gain_factor = self.stable_part(goal);
        let Settings { controller, limits, .. } = &self.settings;
        let leaving = self.pursuit.as_ref().is_some_and(|pursuit| pursuit.watch.passage.is_leaving());
        let moving = moving.filter(|_| !leaving);
        let demand = Demand {
            settings: &self.settings,
            gain_factor: self.status.gain_factor,
            way_out: leaving.then_some(&self.way_out),
        };
        let predicted = self.link.predicted();
        demand.complete((&self.predicted, predicted), moving, &mut self.free, &mut self.target);
        for ((ahead, position), speed) in self.ahead_positions.iter_mut().zip(predicted).zip(&self.target) {
            *ahead = position + self.period * speed;
        }
        self.ahead.evaluate(&self.ahead_positions)?;
        let moving = moving.map(|moving| moving.after(self.period));
        let goal = moving.as_ref().map_or(goal, |moving| &moving.pose);
        self.ahead.joint_velocity(controller, goal, &mut self.ahead_target);
        let ahead = (&self.ahead, self.ahead_positions.as_slice());
        demand.complete(ahead, moving.as_ref(), &mut self.free, &mut self.ahead_target);
        for (ahead, speed) in self.ahead_target.iter_mut().zip(&self.target) {
            *ahead -= speed;
        }
        limits.limit_demanded_acceleration(&mut self.target, &self.ahead_target, self.period);
        let probing = self.link.probing_factor(&self.target, &limits.joint_acceleration);
        self.target.iter_mut().for_each(|speed| *speed *= probing);
        self.keep_positions();
        let way = self.period * self.way_out.along(&self.target);
        self.pursuit.iter_mut().for_each(|pursuit| pursuit.watch.passage.travel(way));
        Ok(())
    }

    /// Slows joints in the target towards their position limits.
    pub(super) fn keep_positions(&mut self) {
        let limits = &self.settings.limits;
        let braking = self.link.braking(self.decelerations.each(), self.period);
        let held_back = limits.keep_positions(&mut self.target, self.link.predicted(), &braking);
        // The joint that is held back may have been what kept the tool slow.
        limits.limit_speed(&self.predicted.tool_speed(&self.target), &mut self.target);
        self.status.joint_at_limit = held_back.map(|joint| joint + 1);
    }

    /// Adds this cycle to the motion's figures; true where the errors are within the tolerances.
    pub(super) fn measure(&mut self, now: Duration, error: Option<GoalError>) -> bool {
        let (Some(pursuit), Some(error)) = (&mut self.pursuit, error) else { return false };
        let (point, tolerance) = (self.task.pose().translation(), self.settings.goal_tolerance);
        let goal_point = pursuit.goal.base_from_goal().translation();
        let motion =
            pursuit.motion.get_or_insert_with(|| Motion::begin(now, point, goal_point, &error, &tolerance));
        let takes_positions = self.settings.interface.takes_positions();
        motion.update(
            now,
            point,
            &error,
            if takes_positions { self.setpoint.speeds() } else { &self.command },
        );
        let slack = if pursuit.settled { UNSETTLE } else { 1.0 };
        let lingers = self.task.lingers(&self.settings.controller, &tolerance, &self.command);
        let Tolerance { linear, angular } = tolerance;
        let within =
            lingers && error.is_within(&Tolerance { linear: slack * linear, angular: slack * angular });
        if within {
            motion.arrived();
        }
        pursuit.settled = within;
        self.status.figures = motion.figures();
        within
    }
}
