//! Goals of joint positions: the arm moves to them along the straight line in joint space.

use super::Servo;
use crate::servo::{Goal, JointGoalError, JointGoalReading, Rejection, Settings};
use dq_kinematics::arm::bounds;
use std::time::Duration;

impl Servo {
    /// Takes a joint goal received at `now`. The joint goal replaces the current goal. The arm moves to the joint goal along a straight
    /// line in joint space. It has settled when both the pose and the joints are within the tolerances. Otherwise the rules of
    /// [`take_goal`](Self::take_goal) apply.
    ///
    /// # Errors
    /// The [`Rejection`], which is counted. The last valid goal remains. While a twist is in force, the servo rejects every goal.
    pub fn take_joint_goal(&mut self, reading: &JointGoalReading, now: Duration) -> Result<(), Rejection> {
        let JointGoalReading { positions, stamp, sent } = *reading;
        let goal = self.offer(positions);
        self.watch_frame(now);
        let request = self.hear_goal(sent, now, goal.is_ok());
        let goal = self.counted(goal.and_then(|goal| self.acceptable(goal, sent.ago, &request, now)))?;
        let is_same = self.offers_present_goal();
        let streams = self.pursue(goal, true, stamp, request.by, now);
        let before = self.time_left_on_joint_line();
        self.joint_line.accept();
        let after = self.time_left_on_joint_line();
        if let Some(pursuit) = self.mode.pursuit_mut().filter(|_| streams) {
            pursuit.watch.oscillation.goal_moved(before, after);
            if !is_same {
                // The tool may have the same pose at the new joint positions. Then `pursue` has not noticed that the goal has
                // moved.
                pursuit.moved = Some(now);
                pursuit.try_again();
            }
        }
        if self.requests.take(request) {
            self.robot.link.try_again();
        }
        Ok(())
    }

    /// Returns whether the offered joint goal equals the end of the joint line within the tolerances.
    pub(super) fn offers_present_goal(&self) -> bool {
        let (line, Settings { limits, goal_tolerance, .. }) = (&self.joint_line, &self.settings);
        line.is_near(&line.offered, limits, goal_tolerance)
    }

    /// Checks the positions of a joint goal, and stores them in `joint_line.offered`. Adds a position for each joint that the goal
    /// does not name. Returns the controlled pose at these positions.
    fn offer(&mut self, positions: &[Option<f64>]) -> Result<Goal, Rejection> {
        let (expected, got) = (self.joint_line.kinds.len(), positions.len());
        if positions.iter().all(Option::is_none) {
            return Err(JointGoalError::Empty.into());
        }
        if got != expected {
            return Err(Rejection::OnePerJoint { expected, got });
        }
        for (joint, position) in positions.iter().enumerate() {
            self.joint_line.offered[joint] = match *position {
                Some(position) => self.allowed(joint, position)?,
                None => self.unnamed(joint)?,
            };
        }
        Ok(Goal::of(self.joint_line.offered_pose()))
    }

    /// Returns the requested `position` of `joint` \[rad, prismatic: m\] if it is within the limits.
    fn allowed(&self, joint: usize, position: f64) -> Result<f64, Rejection> {
        let number = joint + 1;
        let field = || format!("position of joint {number}");
        bounds::check(field, &[position], bounds::JOINT_ANGLE, "rad or m")?;
        let limits = &self.settings.limits.position;
        let (lower, upper) = (limits.lower[joint], limits.upper[joint]);
        if (lower..=upper).contains(&position) {
            return Ok(position);
        }
        let (kind, name) = (self.joint_line.kinds[joint], self.joint_name(joint));
        Err(JointGoalError::OutsideLimits { joint: number, name, kind, position, lower, upper }.into())
    }

    /// Returns the name of `joint`, counted from 0, arm after arm.
    fn joint_name(&self, joint: usize) -> String {
        let link = &self.robot.link;
        let arms = (0..link.figures().count()).map(|arm| link.order(arm));
        let mut names = arms.flat_map(|(order, _)| order.names().to_vec());
        names.nth(joint).unwrap_or_default()
    }

    /// Returns the position for a `joint` that the goal does not name \[rad, prismatic: m\]. This is its position in the joint goal
    /// in force or, if there is no such goal, its measured position.
    fn unnamed(&self, joint: usize) -> Result<f64, Rejection> {
        let is_asked = self.requests.consent().is_asked();
        if self.mode.pursuit().is_some_and(|pursuit| pursuit.by_joints && is_asked) {
            return Ok(self.joint_line.positions[joint]);
        }
        if self.robot.link.received().is_none() {
            return Err(JointGoalError::NoState(joint + 1).into());
        }
        let limits = &self.settings.limits.position;
        // An arm may stand a little outside its limits, but a goal must be within them.
        Ok(self.robot.link.measured()[joint].max(limits.lower[joint]).min(limits.upper[joint]))
    }

    /// Recomputes the pose of the current joint goal, if any, after the tool has changed. Its joint positions do not change.
    pub(super) fn renew_joint_goal(&mut self) {
        let goal = Goal::of(self.joint_line.end_pose());
        let (now, tolerance) = (self.clock.now, self.settings.goal_tolerance);
        if let Some(pursuit) = self.mode.pursuit_mut().filter(|pursuit| pursuit.by_joints) {
            pursuit.move_to(goal, now, &tolerance);
        }
    }
}
