//! Jogging: the tool moves by a twist that somebody holds, as from a joystick, and stands when it ceases.

use super::Servo;
use crate::servo::mode::{Jog, Mode};
use crate::servo::{Ask, Asker, Outcome, Rejection, Revocation, Sent, Twist, TwistReading};
use std::time::Duration;

impl Servo {
    /// The frame besides that of goals in which twists come: the tool's own.
    #[must_use]
    pub fn with_tool_frame(mut self, tool_frame: &str) -> Self {
        tool_frame.clone_into(&mut self.frames.tool);
        self
    }

    /// Takes a twist received at `now`. It is in force for `twist_timeout`, and drops the goal; as long as its publisher holds the
    /// stick, that is one [`Ask`]. One of zero asks for no motion: it lets go of the stick, and drops no goal.
    /// Of two publishers the one that came first counts.
    ///
    /// # Errors
    /// The [`Rejection`], which is counted.
    pub fn take_twist(&mut self, reading: &TwistReading, now: Duration) -> Result<(), Rejection> {
        let TwistReading { linear, angular, frame_id, sent: Sent { by: publisher, ago } } = *reading;
        let frames = [&self.frames.goal, &self.frames.tool].map(String::as_str);
        let twist = self.counted(Twist::new(linear, angular, frame_id, frames))?;
        let by = Asker::Twist(publisher);
        let before = self.mode.jog().copied().filter(|jog| self.is_fresh(jog, now));
        let is_other = before.is_some_and(|jog| jog.publisher != publisher);
        let next = Jog { twist, publisher, received: now };
        if twist.is_zero() {
            self.asks.release(by);
            if before.is_some() && !is_other {
                self.mode = Mode::Jog(next);
            }
            return Ok(());
        }
        let ask = self.asks.hear(by, ago, now, self.silence());
        // Its stick is held all the same.
        let is_late = ago > self.settings.twist_timeout;
        self.counted(if is_late { Err(Rejection::Late(ago)) } else { Ok(()) })?;
        if !is_other {
            self.jog(next, ask, now);
        }
        Ok(())
    }

    /// Goes over to a twist, or goes on with it. A stick that is held in vain only keeps its reason, where nobody else asks.
    fn jog(&mut self, jog: Jog, ask: Ask, now: Duration) {
        let is_first = self.asks.consent().ask().is_none_or(|before| before.by == ask.by);
        if ask.revoked.is_some() && !is_first {
            return;
        }
        if self.asks.take(ask) {
            self.robot.link.try_again();
        }
        if ask.revoked.is_none() {
            self.drop_goal(Revocation::Jogged);
            self.asks.jog(now);
            self.mode = Mode::Jog(jog);
        }
    }

    fn is_fresh(&self, jog: &Jog, now: Duration) -> bool {
        now.saturating_sub(jog.received) <= self.settings.twist_timeout
    }

    /// Forgets a twist that has ceased, one of zero that the arm has obeyed, since whoever sends zeros for ever rules nothing, and the
    /// consent of a stick that was let go of.
    pub(super) fn watch_jog(&mut self, now: Duration) {
        let is_over = |jog: &Jog| !self.is_fresh(jog, now) || (jog.twist.is_zero() && self.at_rest());
        if self.mode.jog().is_some_and(is_over) {
            self.enter(Mode::Idle, Outcome::Replaced);
        }
        if let Some(Ask { by: by @ Asker::Twist(_), .. }) = self.asks.consent().ask()
            && self.mode.jog().is_none()
            && !self.asks.is_pushed(*by, now, self.silence())
        {
            self.asks.withdraw();
        }
    }

    /// Whether a twist rules, so that no goal does.
    pub(super) fn is_jogged(&self, now: Duration) -> bool {
        self.mode.jog().is_some_and(|jog| self.is_fresh(jog, now))
    }

    /// Wants the velocity at which the tool moves by the twist.
    pub(super) fn obey(&mut self, twist: &Twist) {
        let Twist { linear, angular, in_tool } = *twist;
        let rotation = self.robot.predicted.tool_axes();
        let turned = |v: nalgebra::Vector3<f64>| if in_tool { rotation * v } else { v };
        let controller = &self.settings.controller;
        let twist = (turned(angular), turned(linear));
        controller.joint_velocity_of(self.robot.predicted.state(), &twist, &mut self.output.velocity);
    }
}
