//! Takes new goals, and moves goals with their frames. Rejects the goals to which the arm may not move.

use super::Servo;
use crate::servo::explanation::Nearness;
use crate::servo::mode::{Mode, Pursuit};
use crate::servo::{
    BeyondReach, Goal, GoalMotion, GoalReading, MotionRequest, Outcome, Rejection, Requester, Revocation,
    Sent, Settings,
};
use dq_kinematics::control::nearer_goal;
use dq_metrics::GoalError;
use std::time::Duration;

impl Servo {
    /// Takes a goal received at `now`: its position \[m\], its orientation (x, y, z, w), and its frame.
    ///
    /// A goal that arrives within [`STREAM`](crate::servo::STREAM) after the last goal of the same publisher moves the goal of the
    /// motion in progress. Any other goal begins a new motion. A goal that equals the last goal within the tolerances (−q equals q)
    /// ends a stall only after a silence of `progress_timeout`.
    ///
    /// # Errors
    /// The [`Rejection`], which is counted. The last valid goal remains. While a twist is in force, the servo rejects every goal.
    pub fn take_goal(
        &mut self,
        position: [f64; 3],
        orientation_xyzw: [f64; 4],
        frame_id: &str,
        now: Duration,
    ) -> Result<(), Rejection> {
        let (waited, sent) = (Duration::ZERO, Sent::default());
        self.take_stamped_goal(
            &GoalReading { position, orientation_xyzw, frame_id, stamp: 0, waited, sent },
            now,
        )
    }

    /// Takes a goal with a time stamp. Stamps make the tracking of a stream steadier.
    ///
    /// # Errors
    /// The errors of [`take_goal`](Self::take_goal), [`Rejection::Late`] and [`Rejection::Superseded`].
    pub fn take_stamped_goal(&mut self, reading: &GoalReading, now: Duration) -> Result<(), Rejection> {
        let GoalReading { position, orientation_xyzw, frame_id, stamp, waited, sent } = *reading;
        let goal = Goal::new(position, orientation_xyzw, frame_id, &self.frames.goal);
        self.watch_frame(now);
        let request = self.hear_goal(sent, now.saturating_sub(waited), goal.is_ok());
        let goal = self.counted(goal.and_then(|goal| self.acceptable(goal, sent.ago, &request, now)))?;
        let before = self.mode.pursuit().map(|pursuit| pursuit.goal);
        self.pursue(goal, false, stamp, request.by, now);
        self.tell_oscillation(before);
        if self.requests.take(request) {
            self.robot.link.try_again();
        }
        self.explain(stamp, now);
        Ok(())
    }

    /// Notes the arrival of a goal that waits for its frame, so that its publisher does not count as silent.
    pub(in crate::servo) fn wait_for_frame(&mut self, sent: Sent) {
        self.hear_goal(sent, self.clock.now, false);
    }

    /// Notes that a goal arrived at `came`. Returns the request that it belongs to.
    pub(super) fn hear_goal(&mut self, sent: Sent, came: Duration, is_usable: bool) -> MotionRequest {
        self.requests.hear(Requester::Goal(sent.by), sent.ago, came, self.silence(), is_usable)
    }

    /// Continues a stream with its next goal, or begins a motion to a new goal. `by_joints` says whether the goal is joint
    /// positions. Returns whether the goal continues a stream.
    pub(super) fn pursue(
        &mut self,
        goal: Goal,
        by_joints: bool,
        stamp: i64,
        asker: Requester,
        now: Duration,
    ) -> bool {
        let (tolerance, timeout) = (self.settings.goal_tolerance, self.settings.progress_timeout);
        // A new motion does not inherit the state of a revoked one.
        let is_revoked = self.requests.consent().revocation().is_some();
        let is_elsewhere = by_joints && !self.offers_present_goal();
        let mut before = self.mode.pursuit_mut().filter(|_| !is_revoked);
        if let Some(pursuit) = &mut before {
            let silence = now.saturating_sub(pursuit.received);
            if timeout.is_some_and(|timeout| silence > timeout) {
                pursuit.try_again();
            }
            if pursuit.by_joints == by_joints && pursuit.streams(asker, now) {
                pursuit.stream_to(goal, stamp, now, &tolerance);
                return true;
            }
        }
        let mut next = Pursuit::new(goal, stamp, asker, now, self.output.command.len());
        next.by_joints = by_joints;
        if let Some(pursuit) = before.filter(|before| before.by_joints == by_joints && !is_elsewhere) {
            next.take_over(pursuit, &tolerance);
        }
        self.enter(Mode::Goal(Box::new(next)), Outcome::Replaced);
        self.motions.count += 1;
        false
    }

    /// Returns the goal if the arm may move to it. The goal is part of `request`; `ago` is its age on arrival.
    pub(super) fn acceptable(
        &self,
        goal: Goal,
        ago: Duration,
        request: &MotionRequest,
        now: Duration,
    ) -> Result<Goal, Rejection> {
        if ago > self.settings.rearm_timeout {
            return Err(Rejection::Late(ago));
        }
        if self.is_jogged(now) {
            return Err(Rejection::Jogging);
        }
        if let Some(why) = request.revoked {
            return Err(Rejection::Superseded(why));
        }
        self.reachable(goal)
    }

    /// Returns the goal if the arm can reach it, or if the arm may approach goals that it cannot reach.
    fn reachable(&self, goal: Goal) -> Result<Goal, Rejection> {
        match self.settings.beyond_reach {
            BeyondReach::Approach => Ok(goal),
            BeyondReach::Reject => {
                let reach = self.beyond_reach(&goal.base_from_goal().translation());
                reach.map_or(Ok(goal), |reach| Err(Rejection::BeyondReach(reach)))
            }
        }
    }

    /// Moves the current goal with its frame. If the frame is lost, the arm holds until the frame is found again. Without a goal,
    /// or with a goal of joint positions, this does nothing.
    ///
    /// # Errors
    /// The [`Rejection`], which is counted. The goal does not move then.
    pub fn move_goal(&mut self, motion: &GoalMotion, now: Duration) -> Result<(), Rejection> {
        self.watch_frame(now);
        let Some(pursuit) = self.mode.pursuit_mut().filter(|pursuit| !pursuit.by_joints) else {
            return Ok(());
        };
        let GoalMotion::To(reading) = motion else {
            pursuit.lost.get_or_insert(now);
            return Ok(());
        };
        let GoalReading { position, orientation_xyzw, frame_id, stamp, .. } = *reading;
        let goal = Goal::new(position, orientation_xyzw, frame_id, &self.frames.goal);
        let goal = self.counted(goal.and_then(|goal| self.reachable(goal)))?;
        let Some(pursuit) = self.mode.pursuit_mut() else { return Ok(()) };
        let before = pursuit.goal;
        pursuit.move_to(goal, now, &self.settings.goal_tolerance);
        self.tell_oscillation(Some(before));
        if let Some(nearness) = self.explain(stamp, now)
            && self.explanation.is_carried(&self.robot.arms.pose(), &nearness)
        {
            self.requests.revoke(now, now, Revocation::MovesWithTool);
        }
        Ok(())
    }

    /// Passes the law's error for the goal `before` and for the present goal to the oscillation monitor, if the two goals differ.
    fn tell_oscillation(&mut self, before: Option<Goal>) {
        let after = self.mode.pursuit().map(|pursuit| pursuit.goal);
        let (Some(before), Some(after)) = (before, after.filter(|after| before.as_ref() != Some(after)))
        else {
            return;
        };
        let tool = self.robot.arms.pose();
        let [before, after] =
            [before, after].map(|goal| self.freedom(&nearer_goal(goal.base_from_goal(), &tool)).error);
        if let Some(pursuit) = self.mode.pursuit_mut() {
            pursuit.watch.oscillation.goal_moved(before, after);
        }
    }

    /// Adds the current goal to its stream, and compares the motion of the goal with the motion of the tool. Returns how near the
    /// tool is to the goal. Returns `None` if there is no goal, or if the goal is ignored because another goal was compared shortly
    /// before.
    fn explain(&mut self, stamp: i64, now: Duration) -> Option<Nearness> {
        let pursuit = self.mode.pursuit()?;
        let Settings { controller, goal_tolerance: tolerance, .. } = &self.settings;
        let (place, arm) = (pursuit.goal.base_from_goal(), self.robot.arms.state());
        let nearness = Nearness {
            error: GoalError::of(controller.aim, arm, place),
            tolerance: *tolerance,
            rates: controller.fastest_rates(arm, place).map(|rate| pursuit.watch.gain_factor * rate),
        };
        let goes_on = self.stream.add(place, stamp, now);
        self.explanation.compare(now, place, goes_on, &nearness).then_some(nearness)
    }

    /// Revokes consent if TF has lacked the goal's frame for longer than `rearm_timeout`. The time before the current request does not
    /// count.
    pub(super) fn watch_frame(&mut self, now: Duration) {
        let Some(lost) = self.mode.pursuit().and_then(|pursuit| pursuit.lost) else { return };
        let request = self.requests.consent().request().filter(|request| request.revoked.is_none());
        if request
            .is_some_and(|request| now.saturating_sub(request.pushed.max(lost)) > self.settings.rearm_timeout)
        {
            let away = now.saturating_sub(lost);
            self.requests.revoke(now, now, Revocation::FrameWasAway(away.as_secs_f64()));
        }
    }
}
