//! Jogging: the tool moves by a twist that somebody holds, as from a joystick, and stands when it ceases.

use super::Servo;
use crate::servo::link::Contact;
use crate::servo::{Asked, Asker, Reason, Rejection, Revocation, Sent, State, Twist, TwistReading};
use std::time::Duration;

/// The twist in force.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Jog {
    pub twist: Twist,
    publisher: u32,
    received: Duration,
}

impl Servo {
    /// The frame besides that of goals in which twists come: the tool's own.
    #[must_use]
    pub fn with_tool_frame(mut self, tool_frame: &str) -> Self {
        tool_frame.clone_into(&mut self.frames.tool);
        self
    }

    /// Takes a twist received at `now`. It is in force for `twist_timeout`, and drops the goal; as long as its publisher holds the
    /// stick, that is one [`Consent`](crate::servo::Consent). One of zero asks for no motion: it lets go of the stick, and drops no goal.
    /// Of two publishers the one that came first counts.
    ///
    /// # Errors
    /// The [`Rejection`], which is counted.
    pub fn take_twist(&mut self, reading: &TwistReading, now: Duration) -> Result<(), Rejection> {
        let TwistReading { linear, angular, frame_id, sent: Sent { by: publisher, ago } } = *reading;
        let frames = [&self.frames.goal, &self.frames.tool].map(String::as_str);
        let timeout = self.settings.twist_timeout;
        let twist = self.counted(Twist::new(linear, angular, frame_id, frames))?;
        let before = self.twists.jog.filter(|jog| self.is_fresh(jog, now));
        if twist.is_zero() {
            self.twists.sticks.release(publisher);
            let obeys = before.is_none_or(|jog| jog.publisher == publisher);
            if obeys {
                self.twists.jog = before.map(|jog| Jog { twist, received: now, ..jog });
            }
            return Ok(());
        }
        let times = (now.saturating_sub(ago), now);
        let pushed = self.twists.sticks.push(publisher, times, (self.settings.rearm_timeout, timeout));
        // Its stick is held all the same.
        self.counted(if ago > timeout { Err(Rejection::Late(ago)) } else { Ok(()) })?;
        let Some(pushed) = pushed else { return Ok(()) };
        if before.is_none() {
            self.drop_goal(Revocation::Jogged);
            self.robot.link.try_again();
        }
        self.consent.ask_by_twist(publisher, pushed, now);
        self.twists.jog = Some(Jog { twist, publisher, received: now });
        Ok(())
    }

    fn is_fresh(&self, jog: &Jog, now: Duration) -> bool {
        now.saturating_sub(jog.received) <= self.settings.twist_timeout
    }

    /// Forgets a twist that has ceased, one of zero that the arm has obeyed, since whoever sends zeros for ever rules nothing, and the
    /// consent of a stick that was let go of.
    pub(super) fn watch_jog(&mut self, now: Duration) {
        let obeyed = |jog: &Jog| jog.twist.is_zero() && self.at_rest();
        self.twists.jog = self.twists.jog.filter(|jog| self.is_fresh(jog, now) && !obeyed(jog));
        if let Some(Asked { by: Asker::Twist(publisher), .. }) = self.consent.asked()
            && self.twists.jog.is_none()
            && !self.twists.sticks.is_held(*publisher, now, self.settings.rearm_timeout)
        {
            self.consent.withdraw();
        }
    }

    /// Whether a twist rules, so that no goal does.
    pub(super) fn is_jogged(&self, now: Duration) -> bool {
        self.twists.jog.as_ref().is_some_and(|jog| self.is_fresh(jog, now))
    }

    /// Wants the velocity at which the tool moves by the twist.
    pub(super) fn obey(&mut self, twist: &Twist) {
        let Twist { linear, angular, in_tool } = *twist;
        let rotation = self.robot.predicted.tool_axes();
        let turned = |v: nalgebra::Vector3<f64>| if in_tool { rotation * v } else { v };
        let controller = &self.settings.controller;
        let twist = (turned(angular), turned(linear));
        controller.joint_velocity_of(self.robot.predicted.state(), &twist, &mut self.output.velocity);
        self.status.gain_factor = 1.0;
    }

    /// Why the arm is not driven although somebody wants it to be: it does not follow, or nobody hears its commands.
    pub(super) fn contact(&self) -> (Option<State>, Option<Reason>) {
        let unheard = self.robot.link.find(&[Contact::Nobody]).map(Reason::NobodyListens);
        let lost = self.robot.link.find(&[Contact::Lost, Contact::Resting]).map(Reason::DoesNotMove);
        let must_rest = self.robot.link.find(&[Contact::Nobody, Contact::Resting]).is_some();
        (must_rest.then_some(State::NotFollowing), unheard.or(lost))
    }
}
