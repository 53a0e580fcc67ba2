//! The pursuit of a goal: from the goal and the pose to the target velocities, the figures of the motion, and its end.

use super::Servo;
use crate::arm::ArmError;
use crate::control::SignMemory;
use crate::dq::UnitDualQuaternion;
use crate::servo::progress::Progress;
use crate::servo::{Goal, GoalError, Motion, Rejection, Settings, State, Task};
use std::time::Duration;

/// A settled arm counts as tracking again when an error exceeds this multiple of its tolerance.
const UNSETTLE: f64 = 2.0;

/// The goal in force and the motion to it.
pub(super) struct Pursuit {
    pub goal: Goal,
    pub received: Duration,
    /// Chosen when the pursuit begins, by where the arm is then.
    sign: Option<SignMemory>,
    motion: Option<Motion>,
    /// Since the arm was last driven without a break.
    progress: Option<Progress>,
    /// Given up, until there is reason to try again.
    pub stalled: bool,
}

impl Pursuit {
    pub fn new(goal: Goal, received: Duration) -> Self {
        Self { goal, received, sign: None, motion: None, progress: None, stalled: false }
    }

    pub fn try_again(&mut self) {
        (self.progress, self.stalled) = (None, false);
    }
}

impl<T: Task> Servo<T> {
    /// Takes a goal received at `now`: position \[m\], orientation (x, y, z, w), frame. Another goal begins a new
    /// motion; the same again only counts as heard, but after a silence of `progress_timeout` it ends a stall.
    ///
    /// # Errors
    /// The [`Rejection`], which is counted; the last good goal stays in force.
    pub fn take_goal(
        &mut self,
        position: [f64; 3],
        orientation_xyzw: [f64; 4],
        frame_id: &str,
        now: Duration,
    ) -> Result<(), Rejection> {
        let goal = self.counted(Goal::new(position, orientation_xyzw, frame_id, &self.goal_frame))?;
        match &mut self.pursuit {
            Some(pursuit) if pursuit.goal == goal => {
                let silence = now.saturating_sub(pursuit.received);
                if self.settings.progress_timeout.is_some_and(|timeout| silence > timeout) {
                    pursuit.try_again();
                }
                pursuit.received = now;
            }
            _ => {
                self.pursuit = Some(Pursuit::new(goal, now));
                self.status.goal_count += 1;
                self.status.goal_beyond_reach = !self.task.may_reach(&goal.base_from_goal().translation());
            }
        }
        Ok(())
    }

    pub(super) fn driving_state(&self, arrived: bool) -> State {
        match (arrived, self.status.joint_at_limit) {
            (true, _) => State::Settled,
            (false, Some(_)) => State::JointLimit,
            (false, None) => State::Tracking,
        }
    }

    /// Gives the motion up, from the next cycle on, where it has made no progress for too long.
    pub(super) fn watch_progress(&mut self, now: Duration, error: Option<GoalError>) {
        let (Some(pursuit), Some(error)) = (&mut self.pursuit, error) else { return };
        if !matches!(self.status.state, State::Tracking | State::JointLimit) {
            pursuit.progress = None;
            return;
        }
        let progress = pursuit.progress.get_or_insert_with(|| Progress::begin(now, error));
        let without = progress.update(now, error, &self.settings.goal_tolerance);
        pursuit.stalled = self.settings.progress_timeout.is_some_and(|timeout| without > timeout);
    }

    /// Sets the target velocities by the law where `driving`, and returns the error.
    pub(super) fn pursue(&mut self, driving: bool) -> Result<Option<GoalError>, ArmError> {
        let (Some(pursuit), Some(_)) = (&mut self.pursuit, self.joints.received()) else { return Ok(None) };
        let (goal, pose) = (pursuit.goal.base_from_goal(), self.task.pose());
        let sign = pursuit.sign.get_or_insert_with(|| SignMemory::nearest(goal, &pose));
        let goal = sign.apply(goal, &pose, self.settings.sign_hysteresis);
        self.status.sign = sign.sign();
        self.status.pose_error = (goal.conjugate() * pose).screw_log();
        if driving {
            self.drive_towards(&goal)?;
        }
        Ok(Some(self.task.goal_error(&self.settings.controller, &goal)))
    }

    /// The law's velocities within all speed limits, slowed where following them would take too much acceleration.
    fn drive_towards(&mut self, goal: &UnitDualQuaternion) -> Result<(), ArmError> {
        let Settings { controller, limits, .. } = &self.settings;
        self.task.joint_velocity(controller, goal, &mut self.target);
        limits.limit_speed(&self.task.tool_speed(&self.target), &mut self.target);
        for ((ahead, position), speed) in
            self.ahead_positions.iter_mut().zip(self.joints.positions()).zip(&self.target)
        {
            *ahead = position + self.period * speed;
        }
        self.ahead.evaluate(&self.ahead_positions)?;
        self.ahead.joint_velocity(controller, goal, &mut self.ahead_target);
        limits.limit_speed(&self.ahead.tool_speed(&self.ahead_target), &mut self.ahead_target);
        for (ahead, speed) in self.ahead_target.iter_mut().zip(&self.target) {
            *ahead -= speed;
        }
        limits.limit_demanded_acceleration(&mut self.target, &self.ahead_target, self.period);
        let held_back = limits.keep_positions(&mut self.target, self.joints.expected(), self.period);
        self.status.joint_at_limit = held_back.map(|joint| joint + 1);
        Ok(())
    }

    /// Adds this cycle to the motion's figures; true where the errors are within the tolerances.
    pub(super) fn measure(&mut self, now: Duration, error: Option<GoalError>) -> bool {
        let (Some(pursuit), Some(error)) = (&mut self.pursuit, error) else { return false };
        let (point, tolerance) = (self.task.pose().translation(), self.settings.goal_tolerance);
        let goal_point = pursuit.goal.base_from_goal().translation();
        let motion =
            pursuit.motion.get_or_insert_with(|| Motion::begin(now, point, goal_point, &error, &tolerance));
        motion.update(now, point, &error, &self.command);
        let slack = if self.status.state == State::Settled { UNSETTLE } else { 1.0 };
        let within =
            error.position <= slack * tolerance.linear && error.rotation <= slack * tolerance.angular;
        if within {
            motion.arrived();
        }
        self.status.figures = motion.figures();
        within
    }
}
