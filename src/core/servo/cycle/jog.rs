//! Jogging: the tool moves by twists while somebody sends them, as with a joystick, and stops when the twists end.

use super::Servo;
use crate::servo::mode::{Jog, Mode};
use crate::servo::{MotionRequest, Outcome, Rejection, Requester, Revocation, Sent, Twist, TwistReading};
use std::time::Duration;

impl Servo {
    /// Names the tool's own frame. Twists may then be given in this frame as well as in the goal frame.
    #[must_use]
    pub fn with_tool_frame(mut self, tool_frame: &str) -> Self {
        tool_frame.clone_into(&mut self.frames.tool);
        self
    }

    /// Takes a twist received at `now`. The twist is in force for `twist_timeout`. A twist other than zero drops the goal.
    ///
    /// All twists that one publisher sends without a silence are one [`MotionRequest`], as if a user held a joystick. A zero twist
    /// ends this request, as if the user released the joystick. While a twist of one publisher is in force, twists of other publishers
    /// do not move the arm.
    ///
    /// # Errors
    /// The [`Rejection`], which is counted.
    pub fn take_twist(&mut self, reading: &TwistReading, now: Duration) -> Result<(), Rejection> {
        let TwistReading { linear, angular, frame_id, sent: Sent { by: publisher, ago } } = *reading;
        let frames = [&self.frames.goal, &self.frames.tool].map(String::as_str);
        let by = Requester::Twist(publisher);
        let twist = Twist::new(linear, angular, frame_id, frames);
        let request = self.requests.hear(by, ago, now, self.silence(), twist.is_ok());
        let twist = self.counted(twist)?;
        let before = self.mode.jog().copied().filter(|jog| self.is_fresh(jog, now));
        let is_other = before.is_some_and(|jog| jog.publisher != publisher);
        let next = Jog { twist, publisher, received: now };
        if twist.is_zero() {
            self.requests.release(by);
            if before.is_some() && !is_other {
                self.mode = Mode::Jog(next);
            }
            return Ok(());
        }
        // A late twist is rejected only here, after `hear`: it also shows that the user holds the joystick.
        let is_late = ago > self.settings.twist_timeout;
        self.counted(if is_late { Err(Rejection::Late(ago)) } else { Ok(()) })?;
        if !is_other {
            self.jog(next, request, now);
        }
        Ok(())
    }

    /// Follows a twist, unless its `request` is revoked. A revoked request does not move the arm, but becomes the current request
    /// unless another publisher's request is current. The servo can then report why the twist does not move the arm.
    fn jog(&mut self, jog: Jog, request: MotionRequest, now: Duration) {
        let is_first = self.requests.consent().request().is_none_or(|before| before.by == request.by);
        if request.revoked.is_some() && !is_first {
            return;
        }
        if self.requests.take(request) {
            self.robot.link.try_again();
        }
        if request.revoked.is_none() {
            self.drop_goal(Revocation::Jogged);
            self.requests.jog(now);
            self.mode = Mode::Jog(jog);
        }
    }

    fn is_fresh(&self, jog: &Jog, now: Duration) -> bool {
        now.saturating_sub(jog.received) <= self.settings.twist_timeout
    }

    /// Ends a twist that has lapsed. Withdraws the request for twists if its publisher has released the joystick or has fallen
    /// silent. Ends a zero twist once the arm is at rest, so that endless zero twists do not block goals.
    pub(super) fn watch_jog(&mut self, now: Duration) {
        let is_over = |jog: &Jog| !self.is_fresh(jog, now) || (jog.twist.is_zero() && self.at_rest());
        if self.mode.jog().is_some_and(is_over) {
            self.enter(Mode::Idle, Outcome::Replaced);
        }
        if let Some(MotionRequest { by: by @ Requester::Twist(_), .. }) = self.requests.consent().request()
            && self.mode.jog().is_none()
            && !self.requests.is_pushed(*by, now, self.silence())
        {
            self.requests.withdraw();
        }
    }

    /// Returns whether a twist is in force. The servo rejects goals during that time.
    pub(super) fn is_jogged(&self, now: Duration) -> bool {
        self.mode.jog().is_some_and(|jog| self.is_fresh(jog, now))
    }

    /// Sets the desired joint velocities [rad/s, prismatic: m/s] so that the tool moves with `twist`.
    pub(super) fn obey(&mut self, twist: &Twist) {
        let Twist { linear, angular, in_tool } = *twist;
        let rotation = self.robot.predicted.tool_axes();
        let turned = |v: nalgebra::Vector3<f64>| if in_tool { rotation * v } else { v };
        let controller = &self.settings.controller;
        let twist = (turned(angular), turned(linear));
        controller.joint_velocity_of(self.robot.predicted.state(), &twist, &mut self.output.velocity);
    }
}
