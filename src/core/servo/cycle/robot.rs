//! The servo's inputs from its robot, and their consequences.

use super::Servo;
use super::output::Output;
use crate::servo::{Contended, RateBound, Reason, Rejection, Revocation, Rivals, State, largest_rate};
use dq_algebra::UnitDualQuaternion;
use dq_link::{ArmFigures, Contact, Disobedience, Hold, JointReading, LinkSettings, Returned, seconds};
use std::time::Duration;

/// Largest allowed product of the law's fastest rate and the delay. The law feeds back positions that are predicted over the delay
/// τ. By the small-gain theorem, a law of rate λ is then stable while λ times the error of τ is less than 1. With λ τ up to 1, the
/// law is stable with any true delay from 0 to 2 τ.
const STABLE: f64 = 1.0;

/// A joint sags if it was commanded to stand for the time `AT_REST` and still moves faster than `SAGGING` [rad/s, prismatic: m/s].
/// `SAGGING` exceeds the noise of encoders.
const AT_REST: Duration = Duration::from_secs(1);
const SAGGING: f64 = 5e-3;

/// Returns the joint (counted from 0) with the largest absolute speed, and its signed speed; `None` if there are no joints.
pub(super) fn fastest_of(speeds: impl Iterator<Item = f64>) -> Option<(usize, f64)> {
    speeds.enumerate().max_by(|(_, one), (_, other)| one.abs().total_cmp(&other.abs()))
}

impl Servo {
    /// Takes a joint state of the arm number `arm` (0 for a single arm), received at `now`. If there are several joint states in
    /// one cycle, the last valid one counts.
    ///
    /// If two publishers send joint states of one arm, the servo uses only the joint states of the first publisher. Returns false for a
    /// joint state of the second publisher.
    ///
    /// # Errors
    /// The [`Rejection`], which is counted. The last valid joint state remains.
    pub fn take_joint_state(
        &mut self,
        arm: usize,
        reading: &JointReading,
        now: Duration,
    ) -> Result<bool, Rejection> {
        let arms = self.robot.link.figures().count();
        let taken = match arm < arms {
            true => {
                self.robot.link.take(arm, reading, now, self.settings.state_timeout).map_err(Rejection::from)
            }
            false => Err(Rejection::UnknownArm { arm, arms }),
        };
        self.counted(taken)
    }

    /// Notes whether anyone subscribes to the commands for the arm number `arm`. Without a subscriber the arm is not driven.
    ///
    /// # Panics
    /// If the servo has no arm with this number.
    pub fn set_listeners(&mut self, arm: usize, listeners: bool) {
        self.robot.link.set_listeners(arm, listeners);
    }

    /// Notes whether another publisher sends commands to the arm number `arm`. While it does, the servo does not drive the arm.
    ///
    /// # Panics
    /// If the servo has no arm with this number.
    pub fn set_rival(&mut self, arm: usize, rival: bool) {
        self.robot.link.set_rival(arm, rival);
    }

    /// Notes the speed scaling that the arm number `arm` reports: the arm moves at this fraction of the commanded speed, from 0 to
    /// 1. The report counts for 1 s.
    ///
    /// # Panics
    /// If the servo has no arm with this number.
    pub fn set_speed_scaling(&mut self, arm: usize, factor: f64) {
        self.robot.link.set_factor(arm, factor, self.clock.now);
    }

    /// Returns the number of the arm from which the servo has received no joint state for the longest time.
    pub fn quietest_arm(&self) -> usize {
        self.robot.link.quietest()
    }

    /// Returns the servo's estimates about each arm from the last cycle, such as its delay.
    pub fn arm_figures(&self) -> impl Iterator<Item = &ArmFigures> {
        self.robot.link.figures()
    }

    /// Processes the inputs since the last cycle. If an arm has appeared, or after missed cycles, the command begins at the arm's
    /// measured speed, or at zero if the arm takes positions.
    pub(super) fn process_robot_inputs(&mut self, now: Duration) {
        let settings = LinkSettings {
            limits: &self.settings.limits,
            state_timeout: self.settings.state_timeout,
            // If `state_timeout` is longer, the robot may be silent for that time without counting as away.
            rearm_timeout: self.settings.rearm_timeout.max(self.settings.state_timeout),
            latency: self.settings.latency,
            integral: self.settings.integral,
        };
        self.robot.link.advance(now, &settings);
        // An arm that takes positions stands at its last setpoint, unless somebody else moves it.
        let coasts = !self.settings.interface.takes_positions();
        for (joint, speed) in self.robot.link.coasting() {
            let limit = self.settings.limits.joint_velocity[joint];
            // Unlike `clamp`, this does not panic for any limit.
            let speed = if coasts { speed.max(-limit).min(limit) } else { 0.0 };
            self.output.command[joint] = speed + self.robot.link.hold()[joint];
            self.output.latched_limits.begin(joint, self.output.command[joint], speed == 0.0);
        }
    }

    /// Revokes consent if an arm has appeared or jumped, if a joint does not follow, or if two publishers send the same input although
    /// only one may. Returns these two publishers, if any.
    pub(super) fn revoke_for_faults(&mut self, now: Duration) -> Option<Rivals> {
        let mut is_elsewhere = false;
        for returned in self.robot.link.returns() {
            let why = match returned.what {
                // `why_of` replaces the 0 by the time from each request to the robot's appearance.
                Returned::Came => Revocation::CameLater(0.0),
                Returned::WasAway(seconds) => Revocation::WasAway(seconds),
                Returned::IsElsewhere(joint, jump, kind) => Revocation::IsElsewhere(joint, jump, kind),
            };
            returned.since.into_iter().for_each(|since| self.requests.revoke(since, now, why));
            is_elsewhere = true;
        }
        // A second publisher does not end the setpoint: the arm is at its setpoint, and decelerates.
        if is_elsewhere {
            self.output.setpoint.release();
        }
        let rivals = self.rivals(now);
        if let Some(rivals) = rivals {
            self.requests.revoke(now, now, Revocation::Rivals(rivals.of));
        }
        self.watch_setpoint(now);
        let disobedience = self.robot.link.disobedience(now, self.settings.rearm_timeout);
        if let Some(disobedience) = disobedience.filter(|_| self.requests.consent().is_asked()) {
            let why = match disobedience {
                Disobedience::For(joint, time) => Revocation::NotObeyed(joint + 1, time.as_secs_f64()),
                Disobedience::Again(joint) => Revocation::KeepsLosing(joint + 1),
            };
            self.requests.revoke(now, now, why);
            self.robot.link.tell();
        }
        rivals
    }

    /// Returns the two publishers that send the same input although only one may; `None` if there are no such publishers.
    fn rivals(&mut self, now: Duration) -> Option<Rivals> {
        let asking = self.requests.rivals(now, self.silence());
        let contended = self.robot.link.find(&[Contact::Contended]);
        let commands = contended.map(|arm| Rivals { of: Contended::Commands(arm), first: 0, second: 1 });
        let states = self.robot.link.rivals(now);
        let states =
            states.map(|(arm, [first, second])| Rivals { of: Contended::JointStates(arm), first, second });
        let wrenches = self.contact.rivals(now);
        let wrenches = wrenches.map(|[first, second]| Rivals { of: Contended::Wrenches, first, second });
        states.or(wrenches).or(asking).or(commands)
    }

    /// Revokes consent if an arm that takes positions is too far from its setpoint.
    fn watch_setpoint(&mut self, now: Duration) {
        // The distance is from the predicted position, because the delay of the robot is not a reason to stop.
        let lead = self.output.setpoint.farthest(self.robot.link.predicted());
        if let Some((joint, lead, kind)) = lead.filter(|(_, lead, _)| *lead > self.settings.following_error) {
            self.output.setpoint.give_way();
            if self.requests.consent().is_asked() {
                self.requests.revoke(now, now, Revocation::FellBehind(joint, lead, kind));
            }
        }
        if self.robot.link.is_lost() {
            self.output.setpoint.give_way();
        }
    }

    /// Updates the hold of each joint of an arm that takes velocities. The hold keeps a joint still against a payload or gravity.
    pub(super) fn hold_joints(&mut self, standing: Option<State>) {
        let is_on = self.settings.integral > 0.0 && self.output.is_sent_speeds();
        let hold = match standing {
            _ if !is_on => Hold::Nothing,
            Some(State::WaitingForState | State::StaleState) => Hold::Nothing,
            Some(_) => Hold::Standing,
            None => Hold::Driven,
        };
        let Output { command, latched_limits, .. } = &mut self.output;
        latched_limits.update(&self.settings.limits, command, self.robot.link.hold());
        let jerks = latched_limits.each()[1];
        self.robot.link.balance(hold, &self.settings.limits, jerks, self.clock.period);
        self.output.begin(self.robot.link.hold());
    }

    /// Returns the joint (counted from 0) that sags fastest, and its signed speed [rad/s, prismatic: m/s]. `None` if no joint sags
    /// or the arm is driven.
    pub(super) fn sinks(&self, now: Duration) -> Option<(usize, f64)> {
        let stands = self.output.is_sent_speeds() && self.robot.link.stood_after(now.saturating_sub(AT_REST));
        let speeds =
            self.robot.link.hold().iter().zip(self.robot.link.pulls()).map(|(hold, pull)| hold - pull);
        let fastest = fastest_of(speeds);
        fastest.filter(|(_, speed)| stands && speed.abs() >= SAGGING)
    }

    /// Returns the state in which the arm must stand, and the reason for it. The state is `None` if the arm may be driven. If several
    /// states apply, returns the first one in the order of the checks below.
    pub(super) fn reason_to_stand(
        &self,
        now: Duration,
        rivals: Option<Rivals>,
    ) -> (Option<State>, Option<Reason>) {
        let rivals = rivals.map(Reason::Rivals);
        let consent = *self.requests.consent();
        if consent.is_stopping() {
            return (Some(State::Stopping), rivals);
        }
        let Some(received) = self.robot.link.received() else {
            return (Some(State::WaitingForState), rivals);
        };
        if let Some(interval) = self.robot.link.rare_states() {
            return (Some(State::StaleState), rivals.or(Some(Reason::RareStates(interval))));
        }
        if now.saturating_sub(received) > self.settings.state_timeout || self.robot.link.is_blind() {
            return (Some(State::StaleState), rivals);
        }
        if consent.is_paused() {
            return (Some(State::Paused), rivals);
        }
        let revoked = if consent.is_of_twist() { Reason::Release } else { Reason::Revoked };
        let reason = rivals.or(consent.revocation().map(revoked));
        if reason.is_some() {
            return (Some(State::Holding), reason);
        }
        if self.mode.jog().is_some() {
            return self.contact();
        }
        let Some(pursuit) = self.mode.pursuit() else { return (Some(State::Holding), None) };
        let numb = self.feels_nothing(now);
        match self.settings.goal_timeout {
            Some(timeout) if now.saturating_sub(pursuit.received) > timeout => {
                return (Some(State::StaleGoal), Some(Reason::StreamEnded));
            }
            _ if pursuit.lost.is_some() => return (Some(State::StaleGoal), Some(Reason::FrameLost)),
            _ if numb.is_some() => return (Some(State::StaleWrench), numb),
            _ if pursuit.watch.stall.is_some() => return (Some(State::Stalled), None),
            _ => {}
        }
        self.contact()
    }

    /// Returns the state in which an arm with consent must stand because it does not follow or nobody subscribes to its commands.
    /// The state is `None` if the arm may be driven. Also returns the reason, if any.
    fn contact(&self) -> (Option<State>, Option<Reason>) {
        let unheard = self.robot.link.find(&[Contact::Nobody]).map(Reason::NobodyListens);
        let lost = self.robot.link.lost().map(Reason::DoesNotMove);
        let must_rest = self.robot.link.find(&[Contact::Nobody, Contact::Resting]).is_some();
        (must_rest.then_some(State::NotFollowing), unheard.or(lost))
    }

    /// Returns the rate of the present law at the present pose, and the largest rate that is stable at the robot's delay. `None`
    /// until the first joint state arrives.
    pub fn demand(&self) -> Option<RateBound> {
        let here = self.pose()?;
        let rate = self.fastest_rate(&here);
        let latency = self.robot.link.latency(self.settings.latency);
        let period = (self.robot.link.delay() - latency).max(self.clock.period);
        let largest = largest_rate(seconds(latency), seconds(period));
        Some(RateBound { rate, largest, latency, period })
    }

    /// Returns the fraction of the law's gain that the delay allows on the way to `goal`; 1 if the delay does not limit the gain.
    pub(super) fn stable_part(&self, goal: &UnitDualQuaternion) -> f64 {
        let part = self.stable_rate() / self.fastest_rate(goal);
        if part < 1.0 { part } else { 1.0 }
    }

    /// Returns the largest rate [1/s] at which the law is stable.
    pub(super) fn stable_rate(&self) -> f64 {
        // The control period may be longer than the interval of joint states.
        STABLE / self.robot.link.delay().max(self.clock.period)
    }

    /// Returns the law's fastest rate [1/s] on the way to `goal`.
    pub(super) fn fastest_rate(&self, goal: &UnitDualQuaternion) -> f64 {
        self.settings.controller.fastest_rates(self.robot.arms.state(), goal).into_iter().fold(0.0, f64::max)
    }
}
