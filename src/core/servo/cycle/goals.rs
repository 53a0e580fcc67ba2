//! Goals as they come, and where their frames take them: which of them the arm may go to.

use super::Servo;
use crate::servo::carried::Nearness;
use crate::servo::mode::{Mode, Pursuit};
use crate::servo::{
    Ask, Asker, BeyondReach, Goal, GoalError, GoalMotion, GoalReading, Outcome, Rejection, Revocation, Sent,
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
        // What is no goal asks for nothing.
        let goal = self.counted(Goal::new(position, orientation_xyzw, frame_id, &self.frames.goal))?;
        let ask = self.asks.hear(Asker::Goal(sent.by), waited + sent.ago, now, self.silence());
        let goal = self.counted(self.wanted(goal, sent.ago, &ask, now))?;
        self.pursue(goal, stamp, ask.by, now);
        if self.asks.take(ask) {
            self.robot.link.try_again();
        }
        self.stream.add(goal.base_from_goal(), stamp, now);
        self.fed_back.look(now, goal.base_from_goal());
        Ok(())
    }

    /// Goes on to a goal of the same stream, or begins a motion to another one.
    fn pursue(&mut self, goal: Goal, stamp: i64, asker: Asker, now: Duration) {
        let (tolerance, timeout) = (self.settings.goal_tolerance, self.settings.progress_timeout);
        // Where the arm is now, and by which way it went there, has nothing to do with a motion that was revoked.
        let is_revoked = self.asks.consent().revocation().is_some();
        let mut before = self.mode.pursuit_mut().filter(|_| !is_revoked);
        if let Some(pursuit) = &mut before {
            let silence = now.saturating_sub(pursuit.received);
            if timeout.is_some_and(|timeout| silence > timeout) {
                pursuit.try_again();
            }
            if pursuit.streams(asker, now) {
                return pursuit.stream_to(goal, stamp, now, &tolerance);
            }
        }
        let mut next = Pursuit::new(goal, stamp, asker, now, self.output.command.len());
        if let Some(pursuit) = before {
            next.take_over(pursuit, &tolerance);
        }
        self.enter(Mode::Goal(Box::new(next)), Outcome::Replaced);
        self.motions.count += 1;
    }

    /// The goal, which took so long to come and is of that ask, where the arm may go to it.
    fn wanted(&self, goal: Goal, ago: Duration, ask: &Ask, now: Duration) -> Result<Goal, Rejection> {
        if ago > self.settings.rearm_timeout {
            return Err(Rejection::Late(ago));
        }
        if self.is_jogged(now) {
            return Err(Rejection::Jogging);
        }
        if let Some(why) = ask.revoked {
            return Err(Rejection::Superseded(why));
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
        let Some(pursuit) = self.mode.pursuit_mut() else { return Ok(()) };
        let GoalMotion::To(reading) = motion else {
            pursuit.lost.get_or_insert(now);
            return Ok(());
        };
        let GoalReading { position, orientation_xyzw, frame_id, stamp, .. } = *reading;
        let goal = Goal::new(position, orientation_xyzw, frame_id, &self.frames.goal);
        let goal = self.counted(goal.and_then(|goal| self.reachable(goal)))?;
        let Some(pursuit) = self.mode.pursuit_mut() else { return Ok(()) };
        let away = pursuit.move_to(goal, now, &self.settings.goal_tolerance);
        let Settings { controller, goal_tolerance: tolerance, .. } = &self.settings;
        let (place, arm) = (goal.base_from_goal(), self.robot.arms.state());
        let nearness = Nearness {
            error: GoalError::of(controller.aim, arm, place),
            tolerance: *tolerance,
            rates: controller.fastest_rates(arm, place).map(|rate| pursuit.watch.gain_factor * rate),
        };
        let moves_with_tool = pursuit.carried.look(now, &self.robot.arms.pose(), place, &nearness);
        if let Some(away) = away.filter(|away| *away > self.settings.rearm_timeout) {
            self.asks.revoke(now, now, Revocation::FrameWasAway(away.as_secs_f64()));
        }
        if moves_with_tool {
            self.asks.revoke(now, now, Revocation::MovesWithTool);
        }
        self.stream.add(goal.base_from_goal(), stamp, now);
        self.fed_back.look(now, goal.base_from_goal());
        Ok(())
    }
}
