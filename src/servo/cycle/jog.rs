//! Jogging: the tool moves by a twist that somebody holds, as from a joystick, and stands when it ceases.

use super::Servo;
use crate::servo::link::Contact;
use crate::servo::{Rearm, Reason, Rejection, State, Task, Twist};
use std::time::Duration;

/// The twist in force.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Jog {
    twist: Twist,
    /// Since when the stick is held.
    began: Duration,
    received: Duration,
    /// Why it must cease, or be zero, before another one moves the arm.
    barred: Option<Rearm>,
}

impl Jog {
    /// Since when the stick is held: what the robot did after that, its user may not have seen.
    pub fn began(&self) -> Duration {
        self.began
    }

    /// Lets it move nothing until it has ceased.
    pub fn bar(&mut self, why: Rearm) {
        self.barred.get_or_insert(why);
    }
}

impl<T: Task> Servo<T> {
    /// The frame besides that of goals in which twists come: the tool's own.
    #[must_use]
    pub fn with_tool_frame(mut self, tool_frame: &str) -> Self {
        tool_frame.clone_into(&mut self.tool_frame);
        self
    }

    /// Takes a twist received at `now`: of the tool point, linear [m/s] and angular [rad/s], along the axes of `frame_id`, the goals'
    /// frame (or none) or the tool's. It is in force for `twist_timeout`, and drops the goal. One of zero asks for no motion, and so
    /// drops none.
    ///
    /// # Errors
    /// The [`Rejection`], which is counted.
    pub fn take_twist(
        &mut self,
        linear: [f64; 3],
        angular: [f64; 3],
        frame_id: &str,
        now: Duration,
    ) -> Result<(), Rejection> {
        let frames = [&self.goal_frame, &self.tool_frame].map(String::as_str);
        let twist = self.counted(Twist::new(linear, angular, frame_id, frames))?;
        let before = self.jog.as_ref().filter(|jog| self.is_fresh(jog, now)).copied();
        if twist.is_zero() {
            // What barred it is over when the stick was released.
            self.jog = before.map(|_| Jog { twist, began: now, received: now, barred: None });
            return Ok(());
        }
        match before {
            Some(_) => self.overtake(now, now, Rearm::Jogged),
            None => {
                self.drop_goal(now, Rearm::Jogged);
                self.another_aim = false;
                self.link.try_again();
            }
        }
        let held = before.filter(|jog| !jog.twist.is_zero());
        let began = held.map_or(now, |jog| jog.began);
        self.jog = Some(Jog { twist, began, received: now, barred: held.and_then(|jog| jog.barred) });
        Ok(())
    }

    fn is_fresh(&self, jog: &Jog, now: Duration) -> bool {
        now.saturating_sub(jog.received) <= self.settings.twist_timeout
    }

    /// Forgets a twist that has ceased, and one of zero that the arm has obeyed: whoever sends zeros for ever rules nothing.
    pub(super) fn watch_jog(&mut self, now: Duration) {
        let obeyed = |jog: &Jog| jog.twist.is_zero() && self.at_rest();
        self.jog = self.jog.filter(|jog| self.is_fresh(jog, now) && !obeyed(jog));
    }

    /// Whether a twist rules, so that no goal does.
    pub(super) fn is_jogged(&self, now: Duration) -> bool {
        self.jog.as_ref().is_some_and(|jog| self.is_fresh(jog, now))
    }

    /// The state in which the twist `jog` must not move the arm, if there is reason for one.
    pub(super) fn reason_not_to_jog(
        &self,
        jog: &Jog,
        rivals: Option<Reason>,
    ) -> (Option<State>, Option<Reason>) {
        match rivals.or(jog.barred.map(Reason::Release)) {
            Some(held) => (Some(State::Holding), Some(held)),
            None => self.contact(),
        }
    }

    /// Sets the target velocities so that the tool moves by the twist, within all limits; its direction stays.
    pub(super) fn jog(&mut self) {
        let Some(jog) = self.jog else { return };
        let Twist { linear, angular, in_tool } = jog.twist;
        let rotation = self.predicted.tool_axes();
        let turned = |v: nalgebra::Vector3<f64>| if in_tool { rotation * v } else { v };
        let controller = &self.settings.controller;
        self.predicted.joint_velocity_of(controller, &turned(angular), &turned(linear), &mut self.target);
        self.status.gain_factor = 1.0;
        let limits = &self.settings.limits;
        limits.limit_speed(&self.predicted.tool_speed(&self.target), &mut self.target);
        let probing = self.link.probing_factor(&self.target, &limits.joint_acceleration);
        self.target.iter_mut().for_each(|speed| *speed *= probing);
        self.keep_positions();
    }

    /// Why the arm is not driven although somebody wants it to be: it does not follow, or nobody hears its commands.
    pub(super) fn contact(&self) -> (Option<State>, Option<Reason>) {
        let unheard = self.link.find(&[Contact::Nobody]).map(Reason::NobodyListens);
        let lost = self.link.find(&[Contact::Lost, Contact::Resting]).map(Reason::DoesNotMove);
        let must_rest = self.link.find(&[Contact::Nobody, Contact::Resting]).is_some();
        (must_rest.then_some(State::NotFollowing), unheard.or(lost))
    }
}
