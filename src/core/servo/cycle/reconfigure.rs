//! Reconfiguration of a stalled motion: the arm moves to another configuration along a straight line in joint space. From there the
//! law continues.
//!
//! A [`Search`] finds the joint positions of the other configuration. [`Servo::ask`] gives the search the goal to reach, and the
//! caller runs the search. The result of the search is an event, like every input from the robot.

use super::Servo;
use crate::servo::mode::{Pursuit, Watch};
use crate::servo::{Detour, NoWayRound, Reconfiguration, Reconfigure, Rejection, Settings, Stall};
use dq_search::{Found, Search};
use std::time::Duration;

/// A search counts as failed if it has not answered within this time after a stall. The search begins once the arm has stopped,
/// which takes at most one second of this time.
const ANSWER: Duration = Duration::from_secs(2);

/// The law takes over if every joint is this near to the end of the line \[rad, prismatic: m\].
const NEAR: f64 = 1e-3;

impl Servo {
    /// Asks `search` for another configuration that reaches the goal, once the stalled arm has come to rest. Returns whether it has
    /// asked in this call; the caller then runs the search. The result comes back as [`Event::Found`](crate::servo::Event::Found).
    /// Allocates nothing.
    pub fn ask(&self, search: &mut Search) -> bool {
        let Some(pursuit) = self.mode.pursuit() else { return false };
        let Reconfiguration::Searching(since) = pursuit.watch.reconfiguration else { return false };
        let is_new = self.at_rest() && search.asked() != Some(since);
        if is_new {
            search.put(
                since,
                &self.settings.question(pursuit.goal.base_from_goal(), self.robot.link.measured()),
            );
        }
        is_new
    }

    /// Takes the result of a search. Ignores the result if the servo no longer waits for this search.
    pub(in crate::servo) fn take_found(&mut self, found: &Found) {
        let (now, limits) = (self.now(), &self.settings.limits);
        let asked = Reconfiguration::Searching(found.asked);
        let Some(tracking) = self.mode.pursuit_mut().filter(|it| it.watch.reconfiguration == asked) else {
            return;
        };
        let positions = found.positions.filter(|positions| limits.position.contain(positions));
        let Some(positions) = positions else {
            tracking.watch.reconfiguration = Reconfiguration::NotFound { starts: found.starts };
            return;
        };
        self.joint_line.positions.copy_from_slice(positions);
        let from = self.robot.link.measured();
        let (joint, _) = self.joint_line.longest(from, limits);
        let (kind, from, to) = (self.joint_line.kinds[joint], from[joint], positions[joint]);
        let detour = Detour { joint: joint + 1, kind, from, to, found: now };
        tracking.watch.reconfiguration = Reconfiguration::Found(detour);
        if self.settings.reconfigure == Reconfigure::Always {
            tracking.start_reconfiguration(detour);
        }
    }

    /// Starts the reconfiguration that the search has found for the stalled goal. `ago` is the age of the request on arrival.
    ///
    /// # Errors
    /// [`Rejection::NoWayRound`], or [`Rejection::Late`] if the request was sent before the search found the configuration. The
    /// servo counts the rejection, and nothing moves.
    pub fn reconfigure(&mut self, ago: Duration) -> Result<(), Rejection> {
        let detour = self.way_round(ago);
        let detour = self.counted(detour)?;
        if let Some(pursuit) = self.mode.pursuit_mut() {
            pursuit.start_reconfiguration(detour);
        }
        Ok(())
    }

    fn way_round(&self, ago: Duration) -> Result<Detour, Rejection> {
        let given = self.mode.pursuit().filter(|_| self.requests.consent().is_given());
        let Some(Watch { stall: Some(stall), reconfiguration, .. }) = given.map(|pursuit| &pursuit.watch)
        else {
            return Err(NoWayRound::NothingStalled.into());
        };
        let why = match *reconfiguration {
            Reconfiguration::Found(detour) if self.now().saturating_sub(ago) >= detour.found => {
                return Ok(detour);
            }
            Reconfiguration::Found(_) => return Err(Rejection::Late(ago)),
            Reconfiguration::Searching(_) => NoWayRound::Searching,
            Reconfiguration::NotFound { starts } => NoWayRound::NotFound { starts },
            Reconfiguration::Underway(_) | Reconfiguration::Taken => NoWayRound::Taken,
            Reconfiguration::Unknown if self.settings.reconfigure == Reconfigure::Never => NoWayRound::Never,
            Reconfiguration::Unknown => NoWayRound::NotLookedFor(*stall),
        };
        Err(why.into())
    }

    /// Returns whether the arm is moving to another configuration.
    pub(super) fn is_reconfiguring(&self) -> bool {
        self.mode.pursuit().is_some_and(Pursuit::is_reconfiguring)
    }

    /// Ends a search that has not answered in time. Ends a reconfiguration when the arm is at the end of its line. The law then
    /// continues.
    pub(super) fn watch_reconfiguration(&mut self, now: Duration) {
        let Some(tracking) = self.mode.pursuit_mut() else { return };
        let limits = &self.settings.limits;
        let is_near = |displacement: f64| displacement.abs() <= NEAR;
        match tracking.watch.reconfiguration {
            Reconfiguration::Searching(since) if now.saturating_sub(since) > ANSWER => {
                tracking.watch.reconfiguration = Reconfiguration::Unknown;
            }
            Reconfiguration::Underway(_)
                if tracking.record.settled
                    || self.joint_line.displacements(self.robot.link.measured(), limits).all(is_near) =>
            {
                tracking.try_again();
                tracking.watch.reconfiguration = Reconfiguration::Taken;
                // The motion continues in the other configuration.
                tracking.posture.clear();
            }
            _ => {}
        }
    }

    /// Computes the velocity along the straight line in joint space to the other configuration or to the joint goal.
    pub(super) fn follow_joint_line(&mut self) {
        let limits = &self.settings.limits;
        let [_, jerks, steps] = self.output.latched_limits.each();
        let braking = self.robot.link.braking([&limits.joint_acceleration, jerks, steps], self.clock.period);
        let from = self.robot.link.predicted();
        self.joint_line.velocity(from, limits, &braking, &mut self.output.velocity);
        self.output.drop_rounding_errors();
    }

    /// Returns the position limit or the singularity that slows the law down, if any.
    ///
    /// Also returns `None` if a stall would not lead to another configuration. This is so if `reconfigure` is not `Always`, if there
    /// was already a search during the motion, if the goal is joint positions, or if the goal is beyond reach.
    pub(super) fn hindrance(&self) -> Option<Stall> {
        let pursuit = self.mode.pursuit()?;
        let Settings { controller, reconfigure, .. } = &self.settings;
        let is_new = pursuit.watch.reconfiguration == Reconfiguration::Unknown;
        if *reconfigure != Reconfigure::Always
            || !is_new
            || pursuit.by_joints
            || pursuit.beyond_reach.is_some_and(|(_, is_beyond)| is_beyond)
        {
            return None;
        }
        if let Some(joint) = self.output.hindrance.at_limit {
            return Some(Stall::AtLimit { joint });
        }
        let sigma = self.smallest_singular_value();
        (sigma < controller.damping.threshold).then_some(Stall::Singular { sigma })
    }

    /// Returns how long the rest of the line takes at the joints' largest speeds \[s\].
    pub(super) fn time_left_on_joint_line(&self) -> f64 {
        let (_, time) = self.joint_line.longest(self.robot.link.measured(), &self.settings.limits);
        time
    }

    /// Reacts to changed settings: ends a reconfiguration that the new settings do not allow, and ends a stall.
    ///
    /// `before` is the time of the previous change. If that change was at most `progress_timeout` ago, a stall remains, so that changes
    /// in quick succession do not restart a stalled motion again and again.
    pub(super) fn settings_changed(&mut self, before: Option<Duration>) {
        let Settings { limits, reconfigure, progress_timeout, .. } = &self.settings;
        let is_allowed =
            *reconfigure != Reconfigure::Never && limits.position.contain(&self.joint_line.positions);
        let silence = before.map_or(Duration::MAX, |before| self.clock.now.saturating_sub(before));
        let is_quiet = progress_timeout.is_none_or(|timeout| silence > timeout);
        let Some(pursuit) = self.mode.pursuit_mut() else { return };
        if !is_allowed && pursuit.is_reconfiguring() {
            pursuit.watch.reconfiguration = Reconfiguration::Unknown;
        }
        if is_quiet && pursuit.watch.stall.is_some() {
            pursuit.try_again();
        }
    }
}

impl Pursuit {
    fn start_reconfiguration(&mut self, detour: Detour) {
        self.try_again();
        self.record.reconfigured = true;
        self.watch.reconfiguration = Reconfiguration::Underway(detour);
    }
}
