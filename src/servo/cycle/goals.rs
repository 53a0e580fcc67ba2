//! Goals as they come, and where their frames take them: which of them the arm may go to.

use super::Servo;
use super::tracking::GoalTracking;
use crate::servo::carried::Nearness;
use crate::servo::{
    Asker, BeyondReach, Goal, GoalError, GoalMotion, GoalReading, Outcome, Rejection, Revocation, Sent,
    Settings,
};
use std::time::Duration;

impl Servo {
    /// Takes a goal received at `now`: position \[m\], orientation (x, y, z, w), frame. It begins a new motion; one that comes within
    /// [`STREAM`](crate::servo::STREAM) of the one before, from the same publisher, only moves the aim of the motion in progress. One that
    /// is the same within the tolerances, as −q for q, ends a stall only after a silence of `progress_timeout`.
    ///
    /// # Errors
    /// The [`Rejection`], which is counted; the last good goal stays in force. As long as a twist rules there is none.
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

    /// The same of a goal that says when it holds: so a stream of them is followed more steadily.
    ///
    /// # Errors
    /// As [`take_goal`](Self::take_goal), [`Rejection::Late`] and [`Rejection::Superseded`].
    pub fn take_stamped_goal(&mut self, reading: &GoalReading, now: Duration) -> Result<(), Rejection> {
        let GoalReading { position, orientation_xyzw, frame_id, stamp, waited, sent } = *reading;
        let at = now.saturating_sub(waited).saturating_sub(sent.ago);
        let goal = Goal::new(position, orientation_xyzw, frame_id, &self.frames.goal);
        let goal = self.counted(goal.and_then(|goal| self.wanted(goal, sent.ago, at, now)))?;
        let asker = Asker::Goal(sent.by);
        // Where the arm is now, and by which way it went there, has nothing to do with a motion that was revoked.
        let mut in_force = self.goals.tracking.as_mut().filter(|_| self.consent.revocation().is_none());
        if let Some(tracking) = &mut in_force {
            let silence = now.saturating_sub(tracking.received);
            if self.settings.progress_timeout.is_some_and(|timeout| silence > timeout) {
                tracking.try_again();
            }
        }
        match in_force {
            Some(tracking) if tracking.streams(asker, now) => {
                tracking.stream_to(goal, stamp, now, &self.settings.goal_tolerance);
            }
            in_force => {
                let next = GoalTracking::new(goal, (stamp, asker), now, self.output.command.len());
                let next = match in_force {
                    Some(tracking) => tracking.replaced_by(next, &self.settings.goal_tolerance),
                    None => next,
                };
                self.end_motion(Outcome::Replaced);
                self.goals.tracking = Some(next);
                self.status.goal_count += 1;
                self.goals.stream.clear();
            }
        }
        self.consent.ask_by_goal(sent.by, at);
        self.goals.stream.add(goal.base_from_goal(), stamp, now);
        self.robot.link.try_again();
        Ok(())
    }

    /// The goal, which was sent at `at` and took so long to come, where the arm may go to it.
    fn wanted(&self, goal: Goal, ago: Duration, at: Duration, now: Duration) -> Result<Goal, Rejection> {
        if ago > self.settings.rearm_timeout {
            return Err(Rejection::Late(ago));
        }
        if let Some(why) = self.consent.supersedes(at) {
            return Err(Rejection::Superseded(why));
        }
        if self.is_jogged(now) {
            return Err(Rejection::Jogging);
        }
        self.reachable(goal)
    }

    /// The goal, if the arm reaches it, or may go as near as it can.
    fn reachable(&self, goal: Goal) -> Result<Goal, Rejection> {
        match self.settings.beyond_reach {
            BeyondReach::Approach => Ok(goal),
            BeyondReach::Reject => {
                let reach = self.beyond_reach(&goal.base_from_goal().translation());
                reach.map_or(Ok(goal), |reach| Err(Rejection::BeyondReach(reach)))
            }
        }
    }

    /// Moves the goal in force with its frame, or notes that the frame is lost: then the arm holds until it is there again. Without a
    /// goal nothing happens.
    ///
    /// # Errors
    /// The [`Rejection`], which is counted; the goal stays where it was.
    pub fn move_goal(&mut self, motion: &GoalMotion, now: Duration) -> Result<(), Rejection> {
        let GoalMotion::To(reading) = motion else {
            self.goals.tracking.iter_mut().for_each(|tracking| tracking.lost = tracking.lost.or(Some(now)));
            return Ok(());
        };
        let GoalReading { position, orientation_xyzw, frame_id, stamp, .. } = *reading;
        if self.goals.tracking.is_none() {
            return Ok(());
        }
        let goal = Goal::new(position, orientation_xyzw, frame_id, &self.frames.goal);
        let goal = self.counted(goal.and_then(|goal| self.reachable(goal)))?;
        let Some(tracking) = &mut self.goals.tracking else { return Ok(()) };
        let away = tracking.move_to(goal, now, &self.settings.goal_tolerance);
        let Settings { controller, goal_tolerance: tolerance, .. } = &self.settings;
        let (place, arm) = (goal.base_from_goal(), self.robot.arms.state());
        let nearness = Nearness {
            error: GoalError::of(controller.aim, arm, place),
            tolerance: *tolerance,
            rates: controller.fastest_rates(arm, place).map(|rate| self.status.gain_factor * rate),
        };
        let moves_with_tool = tracking.carried.look(now, (&self.robot.arms.pose(), place), &nearness);
        if let Some(away) = away.filter(|away| *away > self.settings.rearm_timeout) {
            self.consent.revoke_present(now, Revocation::FrameWasAway(away.as_secs_f64()));
        }
        if moves_with_tool {
            self.consent.revoke_present(now, Revocation::MovesWithTool);
        }
        self.goals.stream.add(goal.base_from_goal(), stamp, now);
        Ok(())
    }
}
