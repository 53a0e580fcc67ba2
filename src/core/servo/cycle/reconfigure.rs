//! The way round what a motion has stalled at: to another configuration along the straight line in joint space, then on by the law.
//!
//! The positions that the joints go to come from a [`Search`], which the servo [asks](Servo::ask) and somebody else lets run: what it comes
//! to is an event, as what comes from the robot is.

use super::Servo;
use crate::servo::mode::{Pursuit, Watch};
use crate::servo::{
    Detour, Found, NoWayRound, Reconfiguration, Reconfigure, Rejection, Search, Settings, Stall,
};
use std::time::Duration;

/// Who has not answered so long after a stall does not: by then the arm stands, which takes a second at most.
const ANSWER: Duration = Duration::from_secs(2);

/// Where every joint is so near to its end \[rad, prismatic: m\], the law takes over.
const NEAR: f64 = 1e-3;

impl Servo {
    /// Puts the question to `search` whether the goal in force can be reached in another configuration than the one in which the arm has
    /// stalled, once it has come to rest; true where there is that question and it was not put to this search yet. What it comes to is
    /// [`Event::Found`](crate::servo::Event::Found). Allocates nothing.
    pub fn ask(&self, search: &mut Search) -> bool {
        let Some(pursuit) = self.mode.pursuit() else { return false };
        let Reconfiguration::Searching(since) = pursuit.watch.reconfiguration else { return false };
        let is_new = self.at_rest() && search.asked() != Some(since);
        if is_new {
            search.put(since, pursuit.goal.base_from_goal(), self.robot.link.measured(), &self.settings);
        }
        is_new
    }

    /// Takes what a search came to; nothing where that is not asked any more.
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
        self.elsewhere.positions.copy_from_slice(positions);
        let from = self.robot.link.measured();
        let (joint, _) = self.elsewhere.longest(from, limits);
        let (kind, from, to) = (self.elsewhere.kinds[joint], from[joint], positions[joint]);
        let detour = Detour { joint: joint + 1, kind, from, to, found: now };
        tracking.watch.reconfiguration = Reconfiguration::Found(detour);
        if self.settings.reconfigure == Reconfigure::Always {
            tracking.go_round(detour);
        }
    }

    /// Lets the arm go to the configuration that was found for the goal at which it has stalled; who asks for it did so `ago`.
    ///
    /// # Errors
    /// [`Rejection::NoWayRound`], [`Rejection::Late`] where it was asked for before it was found; they are counted, and nothing moves.
    pub fn reconfigure(&mut self, ago: Duration) -> Result<(), Rejection> {
        let detour = self.way_round(ago);
        let detour = self.counted(detour)?;
        if let Some(pursuit) = self.mode.pursuit_mut() {
            pursuit.go_round(detour);
        }
        Ok(())
    }

    fn way_round(&self, ago: Duration) -> Result<Detour, Rejection> {
        let given = self.mode.pursuit().filter(|_| self.asks.consent().is_given());
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

    /// Whether the arm goes to another configuration.
    pub(super) fn is_reconfiguring(&self) -> bool {
        self.mode.pursuit().is_some_and(Pursuit::is_reconfiguring)
    }

    /// Ends a search that nobody answers, and a reconfiguration that is at its end: the law takes over.
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
                    || self.elsewhere.displacements(self.robot.link.measured(), limits).all(is_near) =>
            {
                tracking.try_again();
                tracking.watch.reconfiguration = Reconfiguration::Taken;
            }
            _ => {}
        }
    }

    /// Wants the velocity along the straight line in joint space to the other configuration.
    pub(super) fn go_elsewhere(&mut self) {
        let limits = &self.settings.limits;
        let [_, jerks, steps] = self.output.latched_limits.each();
        let braking = self.robot.link.braking([&limits.joint_acceleration, jerks, steps], self.clock.period);
        let from = self.robot.link.predicted();
        self.elsewhere.velocity(from, limits, &braking, &mut self.output.velocity);
    }

    /// What holds up a law that creeps, a limit or a singularity, where the arm always may go round and nobody has looked yet whether it can.
    pub(super) fn hindrance(&self) -> Option<Stall> {
        let pursuit = self.mode.pursuit()?;
        let Settings { controller, reconfigure, .. } = &self.settings;
        let is_new = pursuit.watch.reconfiguration == Reconfiguration::Unknown;
        if *reconfigure != Reconfigure::Always
            || !is_new
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

    /// How long the rest of the line to the other configuration takes at the largest speeds \[s\].
    pub(super) fn time_to_elsewhere(&self) -> f64 {
        let (_, time) = self.elsewhere.longest(self.robot.link.measured(), &self.settings.limits);
        time
    }

    /// After other settings: a reconfiguration that they do not allow is over. A stall is over too, unless settings were changed at `before`
    /// that is not longer ago than `progress_timeout`: changes that come all the time are no reason to try again.
    pub(super) fn look_again(&mut self, before: Option<Duration>) {
        let Settings { limits, reconfigure, progress_timeout, .. } = &self.settings;
        let is_allowed =
            *reconfigure != Reconfigure::Never && limits.position.contain(&self.elsewhere.positions);
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
    fn go_round(&mut self, detour: Detour) {
        self.try_again();
        self.record.reconfigured = true;
        self.watch.reconfiguration = Reconfiguration::Underway(detour);
    }
}
