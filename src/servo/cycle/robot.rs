//! What the servo hears of its robot, and what follows from it.

use super::Servo;
use crate::dq::UnitDualQuaternion;
use crate::servo::link::{ArmFigures, Contact, JointReading, LinkSettings};
use crate::servo::{Asker, Contended, RateBound, Reason, Rejection, Revocation, Rivals, State, largest_rate};
use std::time::Duration;

/// The law's fastest rate times the delay is kept below this. A law of rate λ that feeds back positions predicted over a delay τ
/// is stable by the small-gain theorem while λ times the error of τ is less than 1; so it is with any true delay from 0 to 2 τ.
const STABLE: f64 = 1.0;

impl Servo {
    /// Takes a joint state of the arm number `arm` (0 where there is one), received at `now`; of several in one cycle the last
    /// good one counts. True where it is of the publisher that is believed: of two, the one that was there first.
    ///
    /// # Errors
    /// The [`Rejection`], which is counted; the last good joint state stays in force.
    pub fn take_joint_state(
        &mut self,
        arm: usize,
        reading: &JointReading,
        now: Duration,
    ) -> Result<bool, Rejection> {
        let arms = self.robot.link.figures().count();
        let taken = match arm < arms {
            true => self.robot.link.take(arm, reading, now, self.settings.state_timeout),
            false => Err(Rejection::UnknownArm { arm, arms }),
        };
        self.counted(taken)
    }

    /// Notes whether anyone subscribes to the commands for the arm number `arm`: without, it is not driven.
    ///
    /// # Panics
    /// Where the servo has no arm of that number.
    pub fn set_listeners(&mut self, arm: usize, listeners: bool) {
        self.robot.link.set_listeners(arm, listeners);
    }

    /// Notes whether anyone else sends commands to the arm number `arm`: then it is not driven.
    ///
    /// # Panics
    /// Where the servo has no arm of that number.
    pub fn set_rival(&mut self, arm: usize, rival: bool) {
        self.robot.link.set_rival(arm, rival);
    }

    /// The number of the arm that has been silent longest.
    pub fn quietest_arm(&self) -> usize {
        self.robot.link.quietest()
    }

    /// What the last cycle found out of each arm.
    pub fn arm_figures(&self) -> impl Iterator<Item = &ArmFigures> {
        self.robot.link.figures()
    }

    /// Lets the next cycle take these figures of the arm number `arm` for true, instead of finding out by itself how late the arm is and
    /// whether it follows. A replay gives what [`arm_figures`](Self::arm_figures) of the recorded servo gave after that cycle, and so
    /// gets the same commands.
    ///
    /// # Panics
    /// Where the servo has no arm of that number.
    pub fn repeat_with(&mut self, arm: usize, figures: ArmFigures) {
        self.robot.link.repeat_with(arm, figures);
    }

    /// Looks at what came since the last cycle: a robot that has returned needs its goal anew, and if it coasts it is braked from
    /// the speed that it has.
    pub(super) fn look_at_robot(&mut self, now: Duration) {
        let settings = LinkSettings {
            limits: &self.settings.limits,
            state_timeout: self.settings.state_timeout,
            // A robot that may be silent for longer is not away.
            rearm_timeout: self.settings.rearm_timeout.max(self.settings.state_timeout),
            latency: self.settings.latency,
        };
        let returned = self.robot.link.advance(now, &settings);
        // One that takes positions is moved by somebody else, if at all.
        let coasts = !self.settings.interface.takes_positions();
        if self.robot.link.came() && self.at_rest() && coasts {
            self.output.command.copy_from_slice(self.robot.link.velocity());
            for (speed, limit) in self.output.command.iter_mut().zip(&self.settings.limits.joint_velocity) {
                // Unlike clamp this takes any numbers.
                *speed = speed.max(-limit).min(*limit);
            }
            self.output.held_limits.begin(&self.output.command);
        }
        // Not for a second publisher: the arm is where it was sent, and decelerates.
        if self.robot.link.is_displaced() {
            self.output.setpoint.release();
        }
        if let Some(returned) = returned {
            self.consent.revoke_before(returned.since, now, returned.why);
        }
        if let Some(rivals) = self.rivals(now) {
            self.consent.revoke(now, Revocation::Rivals(rivals.of));
        }
        if let Some(arm) = self.robot.link.find(&[Contact::KeepsLosing]) {
            self.consent.revoke(now, Revocation::KeepsLosing(arm));
        }
    }

    /// The two publishers of what may have one only, if there are two.
    fn rivals(&mut self, now: Duration) -> Option<Rivals> {
        let sticks = self.twists.sticks.rivals(now);
        let sticks = sticks.map(|(first, second)| Rivals { of: Contended::Twists, first, second });
        let contended = self.robot.link.find(&[Contact::Contended]);
        let commands = contended.map(|arm| Rivals { of: Contended::Commands(arm), first: 0, second: 1 });
        self.robot.link.rivals(now).or(sticks).or(commands)
    }

    /// An arm that takes positions and is too far from where it was sent is not driven on until somebody wants that; one that stands
    /// there is sent nothing more, as it may have been moved by somebody else.
    pub(super) fn watch_setpoint(&mut self, now: Duration) {
        // Where it should be by now: a robot's delay is no reason to stop.
        let lead = self.output.setpoint.lead(self.robot.link.predicted());
        let Some((joint, lead, kind)) = lead.filter(|(_, lead, _)| *lead > self.settings.following_error)
        else {
            return;
        };
        if self.at_rest() {
            self.output.setpoint.release();
            self.robot.link.watch_anew();
        }
        self.consent.revoke(now, Revocation::FellBehind(joint, lead, kind));
    }

    /// The state in which the arm must not be driven, if there is reason for one. The first reason that holds counts.
    pub(super) fn reason_to_stand(&mut self, now: Duration) -> (Option<State>, Option<Reason>) {
        let rivals = self.rivals(now).map(Reason::Rivals);
        if self.consent.is_stopping() {
            return (Some(State::Stopping), rivals);
        }
        let Some(received) = self.robot.link.received() else {
            return (Some(State::WaitingForState), rivals);
        };
        if now.saturating_sub(received) > self.settings.state_timeout {
            return (Some(State::StaleState), rivals);
        }
        if self.consent.is_paused() {
            return (Some(State::Paused), rivals);
        }
        let by_twist = self.consent.asked().is_some_and(|asked| matches!(asked.by, Asker::Twist(_)));
        let revoked = if by_twist { Reason::Release } else { Reason::Revoked };
        let held = rivals.or(self.consent.revocation().map(revoked));
        if held.is_some() {
            return (Some(State::Holding), held);
        }
        if self.twists.jog.is_some() {
            return self.contact();
        }
        let Some(tracking) = &self.goals.tracking else { return (Some(State::Holding), None) };
        match self.settings.goal_timeout {
            Some(timeout) if now.saturating_sub(tracking.received) > timeout => {
                return (Some(State::StaleGoal), Some(Reason::StreamEnded));
            }
            _ if tracking.lost.is_some() => return (Some(State::StaleGoal), Some(Reason::FrameLost)),
            _ if tracking.watch.stall.is_some() => return (Some(State::Stalled), None),
            _ => {}
        }
        self.contact()
    }

    /// What the law in force asks of the robot where the arm is, as far as its delay is known; none before the robot was heard.
    pub fn demand(&self) -> Option<RateBound> {
        let here = self.pose()?;
        let rate = self.fastest_rate(&here);
        let latency = self.robot.link.latency(self.settings.latency);
        let period = (self.robot.link.delay() - latency).max(self.clock.period);
        let seconds = |seconds| Duration::try_from_secs_f64(seconds).unwrap_or_default();
        let largest = largest_rate(seconds(latency), seconds(period));
        Some(RateBound { rate, largest, latency, period })
    }

    /// The part of the law's gain that the delay allows on the way to `goal`.
    pub(super) fn stable_part(&self, goal: &UnitDualQuaternion) -> f64 {
        // The cycle itself may be slower than the joint states come.
        let delay = self.robot.link.delay().max(self.clock.period);
        let demanded = self.fastest_rate(goal) * delay;
        if demanded > STABLE { STABLE / demanded } else { 1.0 }
    }

    /// The law's fastest rate [1/s] on the way to `goal`.
    fn fastest_rate(&self, goal: &UnitDualQuaternion) -> f64 {
        self.settings.controller.fastest_rates(self.robot.arms.state(), goal).into_iter().fold(0.0, f64::max)
    }
}
