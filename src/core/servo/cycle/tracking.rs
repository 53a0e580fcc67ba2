//! Tracks a goal: computes the desired velocity toward the goal and the figures of the motion. Detects that the arm has settled or
//! that the motion has stalled.

use super::Servo;
use crate::servo::escape_phase::Phase;
use crate::servo::mode::Pursuit;
use crate::servo::progress::{Progress, SHARE};
use crate::servo::stream::MovingGoal;
use crate::servo::{Reach, Reconfigure, Settings, Stall, State};
use dq_algebra::UnitDualQuaternion;
use dq_kinematics::control::{Aim, SignMemory};
use dq_link::Contact;
use dq_metrics::{GoalError, MotionMeter, Tolerance};
use nalgebra::Vector3;
use std::time::Duration;

/// A settled arm counts as tracking again if an error exceeds its tolerance times this factor.
const UNSETTLE: f64 = 2.0;

/// An arm has arrived only if it would take longer than this to cross the tolerance at its present speed \[s\].
const LINGERING: f64 = 0.1;

/// The least and the largest time over which the trend of the error is computed \[s\]. Between these limits, this time is the law's
/// time constant.
const TREND: (f64, f64) = (LINGERING, 0.9);

/// Interval at which the smallest singular value is computed.
const SIGMA_INTERVAL: Duration = Duration::from_millis(10);

/// An arm counts as standing if no joint is faster than this [rad/s, prismatic: m/s]. An arm that moves a little faster may be
/// passing a saddle point of the error.
const STANDS: f64 = 1e-3;
/// The largest effective `progress_timeout` of an arm that stands where no small motion of the joints brings the tool nearer to the
/// goal.
const CLOSED: Duration = Duration::from_secs(1);

/// The current goal and the arm's error in one cycle.
pub(super) struct Tracked {
    /// The error of the arm with respect to the goal.
    pub error: GoalError,
    /// The screw log of the error, `(ω, v)` \[rad, m\]. Components that the [`Aim`](dq_kinematics::control::Aim) leaves free are 0.
    pub log: nalgebra::Vector6<f64>,
    /// The goal pose. The quaternions q and −q are the same pose; this is the one with the sign that the servo has chosen.
    pub goal: UnitDualQuaternion,
    /// The goal's motion, if it moves and its velocity is fed forward.
    pub moving: Option<MovingGoal>,
}

impl Servo {
    /// Returns how far away `point` is and how far the arm reaches \[m\], if the point is beyond reach. Returns `None` if the arm can
    /// reach the point, or if the aim is only an orientation.
    pub(super) fn beyond_reach(&self, point: &Vector3<f64>) -> Option<Reach> {
        let Settings { limits, goal_tolerance, controller, .. } = &self.settings;
        let reach = self.robot.arms.reach(point, limits.position.ranges());
        (controller.aim != Aim::Orientation && reach.is_beyond(goal_tolerance.linear)).then_some(reach)
    }

    pub(super) fn driving_state(&self, arrived: bool) -> State {
        match (arrived, self.output.hindrance.at_limit) {
            (true, _) => State::Settled,
            (false, _) if self.robot.link.find(&[Contact::Lost]).is_some() => State::NotFollowing,
            (false, _) if self.output.hindrance.pair.is_some() => State::Constrained,
            (false, _) if self.is_reconfiguring() => State::Reconfiguring,
            (false, Some(_)) => State::JointLimit,
            (false, None) if self.mode.jog().is_some() => State::Jogging,
            (false, None) => State::Tracking,
        }
    }

    /// Stalls the motion, from the next cycle on, if the arm was driven too long without progress. `elapsed` is the time since the
    /// last cycle.
    pub(super) fn watch_progress(&mut self, now: Duration, elapsed: Duration, tracked: &Tracked) {
        let on_line = self.mode.pursuit().is_some_and(Pursuit::follows_joint_line);
        let left = if on_line { self.time_left_on_joint_line() } else { 0.0 };
        let Settings { goal_tolerance: tolerance, progress_timeout, reconfigure, .. } = self.settings;
        let Some(pursuit) = self.mode.pursuit_mut() else { return };
        // A joint goal is a configuration itself, so no other configuration helps.
        let reconfigure = if pursuit.by_joints { Reconfigure::Never } else { reconfigure };
        let watch = &mut pursuit.watch;
        // An escape from a singularity ends by its own rules.
        if watch.escape.is_escaping() {
            return;
        }
        // On the joint line, the distance to the goal may grow for a while.
        let (error, law_error) =
            if on_line { (GoalError::default(), left) } else { (tracked.error, watch.law_error) };
        let without = watch.progress.update(elapsed, error, law_error, &tolerance);
        let creeps = watch.pace.update(elapsed, GoalError::default(), law_error, &tolerance);
        let oscillates = watch.oscillation.update(now, &self.output.motion, law_error);
        let stands = self.output.motion.iter().all(|speed| speed.abs() < STANDS);
        let is_closed = stands && !on_line && watch.escape.phase == Phase::Closed;
        let timeout = progress_timeout.map(|timeout| if is_closed { timeout.min(CLOSED) } else { timeout });
        let stall = match timeout {
            _ if oscillates => Some(self.stall_of_swings(&tracked.goal.translation())),
            Some(timeout) if without > timeout => match on_line {
                true => Some(self.stall_on_the_way()),
                false => self.stall(&tracked.goal),
            },
            Some(timeout) if creeps > timeout => self.hindrance(),
            _ => None,
        };
        if let (Some(stall), Some(pursuit)) = (stall, self.mode.pursuit_mut()) {
            pursuit.watch.give_up(stall, reconfigure, now);
        }
    }

    /// Returns the reason why an oscillating arm stalls. A goal far beyond reach makes the arm oscillate at any gain; for such a
    /// goal, the reason is its distance. Otherwise the reason is the oscillation.
    fn stall_of_swings(&self, goal: &Vector3<f64>) -> Stall {
        self.beyond_reach(goal).map_or(Stall::Oscillating, Stall::BeyondReach)
    }

    /// Returns the reason why the arm stalls on the joint line.
    fn stall_on_the_way(&self) -> Stall {
        match (self.output.hindrance.pair, self.output.hindrance.at_limit) {
            (Some(pair), _) => Stall::Constrained(pair),
            (None, Some(joint)) => Stall::AtLimit { joint },
            (None, None) => self.sag().unwrap_or(Stall::NoProgress),
        }
    }

    /// Returns the current goal at time `now`, with the error of the arm; `None` without a goal, or before the first joint state.
    pub(super) fn track(&mut self, now: Duration) -> Option<Tracked> {
        self.robot.link.received()?;
        let pose = self.robot.arms.pose();
        self.explanation.note(now, pose);
        let pursuit = self.mode.pursuit_mut()?;
        if pursuit.posture.is_empty() {
            pursuit.posture.extend_from_slice(self.robot.link.measured());
        }
        let Settings { controller, feed_forward, hysteresis, .. } = &self.settings;
        let moving =
            if *feed_forward { self.stream.at(now, self.explanation.moves_by_itself()) } else { None };
        let moving = Self::yielded(&self.contact.offset, moving, pursuit);
        let goal = moving.as_ref().map_or(pursuit.goal.base_from_goal(), |moving| &moving.pose);
        let sign = pursuit.sign.get_or_insert_with(|| SignMemory::nearest(goal, &pose));
        let goal = sign.apply(goal, &pose, *hysteresis);
        let nearest = controller.aim.nearest(&goal, &pose);
        let log = (nearest.inverse() * pose).screw_log();
        let error = GoalError::of(controller.aim, self.robot.arms.state(), &goal);
        pursuit.watch.error = error;
        Some(Tracked { error, log, goal, moving: moving.map(|moving| MovingGoal { pose: goal, ..moving }) })
    }

    /// Computes the law's velocity toward the goal.
    pub(super) fn obey_law(&mut self, now: Duration, tracked: &Tracked) {
        let (arm, wanted) = (self.robot.predicted.state(), &mut self.output.velocity);
        let (controller, last) = (&self.settings.controller, (&*self.output.motion, self.clock.period));
        self.law_memory.joint_velocity(controller, arm, &tracked.goal, last, wanted);
        self.output.drop_rounding_errors();
        self.watch_escape(now, &tracked.goal, tracked.error.is_within(&self.settings.goal_tolerance));
        let gain_factor = self.stable_part(&tracked.goal);
        if let Some(pursuit) = self.mode.pursuit_mut() {
            pursuit.watch.gain_factor = gain_factor;
        }
    }

    /// Returns whether the last command is so slow that the tool moves by at most `tolerance` in the time [`LINGERING`].
    fn lingers(&self, tolerance: &Tolerance) -> bool {
        let arm = self.robot.arms.state();
        let asked_for = self.settings.controller.aim.part_of(arm, &arm.tool_twist(&self.output.motion));
        let (angular, linear) = (asked_for.0.norm(), asked_for.1.norm());
        linear * LINGERING <= tolerance.linear && angular * LINGERING <= tolerance.angular
    }

    /// Returns whether the arm is within `tolerance` and will also come to rest there, judged by the trend of the error. For an arm
    /// that has settled, returns true.
    fn stays(&mut self, now: Duration, tracked: &Tracked, tolerance: &Tolerance) -> bool {
        let Some(pursuit) = self.mode.pursuit_mut() else { return false };
        pursuit.record.trend.note(now, &tracked.log);
        if pursuit.record.settled || !tracked.error.is_within(tolerance) {
            return pursuit.record.settled;
        }
        let rate = self.fastest_rate(&tracked.goal);
        let Some(pursuit) = self.mode.pursuit() else { return false };
        let time = (1.0 / (pursuit.watch.gain_factor * rate)).max(TREND.0).min(TREND.1);
        let there = pursuit.record.trend.leads_to(now, &tracked.log, time);
        there.translation().norm() <= tolerance.linear && there.rotation().angle() <= tolerance.angular
    }

    /// Adds this cycle to the motion's figures. Returns whether the arm has settled: its errors stay within the tolerances and, if
    /// the goal is joint positions, each joint is at its position.
    pub(super) fn measure(&mut self, now: Duration, tracked: Option<&Tracked>) -> bool {
        let (pose, tolerance) = (self.robot.arms.pose(), self.settings.goal_tolerance);
        let lingers =
            tracked.is_some_and(|tracked| self.stays(now, tracked, &tolerance)) && self.lingers(&tolerance);
        let (Some(pursuit), Some(Tracked { error, .. })) = (self.mode.pursuit_mut(), tracked) else {
            return false;
        };
        let (point, goal_point) = (pose.translation(), pursuit.goal.base_from_goal().translation());
        let record = &mut pursuit.record;
        record.start.get_or_insert((now, pose));
        let begin = || MotionMeter::begin(now, point, goal_point, error, &tolerance);
        let meter = record.meter.get_or_insert_with(begin);
        meter.aim_at(goal_point);
        let speeds = self.output.speeds();
        meter.update(now, point, error, speeds);
        let limits = &self.settings.limits.joint_velocity;
        for ((peak, speed), limit) in record.peak_speeds.iter_mut().zip(speeds).zip(limits) {
            *peak = peak.max(speed.abs() / limit);
        }
        if now.saturating_sub(record.looked) >= SIGMA_INTERVAL {
            record.looked = now;
            let least = meter.figures().smallest_singular_value.unwrap_or(f64::INFINITY);
            let (controller, arm) = (&self.settings.controller, self.robot.arms.state());
            if let Some(sigma) = controller.singular_value_below(least, arm) {
                meter.see_singular_value(sigma);
            }
        }
        // A settled arm stays settled within its tolerances at any speed, for example after a switch to a faster law.
        let (slack, lingers) = if record.settled { (UNSETTLE, true) } else { (1.0, lingers) };
        let allowed = Tolerance { linear: slack * tolerance.linear, angular: slack * tolerance.angular };
        let (measured, limits) = (self.robot.link.measured(), &self.settings.limits);
        let joints_arrived = !pursuit.by_joints || self.joint_line.is_near(measured, limits, &allowed);
        let within = lingers && error.is_within(&allowed) && joints_arrived;
        if within {
            meter.arrived();
            // A later motion away from the goal is not caused by the earlier lack of progress.
            pursuit.watch.progress = Progress::new(SHARE);
        }
        record.settled = within;
        within
    }
}
