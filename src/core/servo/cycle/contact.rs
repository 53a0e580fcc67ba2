//! Contact: the wrench at the tool, and the goal that yields to it.

use super::Servo;
use crate::servo::mode::Pursuit;
use crate::servo::stream::MovingGoal;
use crate::servo::{ContactStatus, Reason, Rejection, Revocation, is_own_frame};
use dq_algebra::{UnitDualQuaternion, stack};
use dq_contact::{Load, WrenchReading, sizes};
use nalgebra::Vector6;
use std::time::Duration;

impl Servo {
    /// Takes a wrench that was received at `now`. Returns false if the servo ignores the wrench because it uses another publisher.
    /// Without the setting `contact`, or before the first joint state, ignores every wrench and returns true.
    ///
    /// # Errors
    /// The [`Rejection`], which is counted. The last valid wrench remains.
    pub fn take_wrench(&mut self, reading: &WrenchReading, now: Duration) -> Result<bool, Rejection> {
        let Some(compliance) = self.settings.contact.filter(|_| self.robot.link.received().is_some()) else {
            return Ok(true);
        };
        let in_tool = is_own_frame(reading.frame_id, &self.frames.tool);
        if !in_tool && !is_own_frame(reading.frame_id, &self.frames.goal) {
            let expected = [&self.frames.tool, &self.frames.goal];
            return self.counted(Err(Rejection::unknown_frame(reading.frame_id, expected)));
        }
        let taken =
            self.contact.sensor.hear(reading, (&self.base_from_tool_frame(), in_tool), &compliance, now);
        self.counted(taken.map_err(Rejection::from))
    }

    /// Returns the pose of the arm's tool frame in the base frame, without the setting `tool_offset`. The servo converts all
    /// wrenches to the tool frame.
    fn base_from_tool_frame(&self) -> UnitDualQuaternion {
        self.robot.arms.pose() * self.settings.tool_offset.inverse()
    }

    /// Sets the zero of the sensor: from now on, the present wrench counts as no contact.
    pub fn tare(&mut self) {
        self.contact.sensor.tare();
    }

    /// Begins to identify the load on the sensor. Turn the tool slowly about two horizontal axes, without contact, and call
    /// [`identified_tool`](Self::identified_tool).
    pub fn identify_tool(&mut self) {
        self.contact.sensor.begin_identification();
    }

    /// Ends the identification, and returns the load.
    ///
    /// # Errors
    /// The [`Rejection`], which is counted, if the tool was not turned about two axes.
    pub fn identified_tool(&mut self) -> Result<Load, Rejection> {
        let load = self.contact.sensor.end_identification();
        self.counted(load.map_err(Rejection::from))
    }

    /// Revokes consent if the wrench is too large, its sign is wrong, or it was missing for longer than `rearm_timeout`. `elapsed`
    /// is the time since the last cycle.
    pub(super) fn watch_contact(&mut self, now: Duration, elapsed: Duration) {
        let Some(compliance) = self.settings.contact else { return };
        let Some(request) = self.requests.consent().request().copied() else { return };
        let base_from_frame = self.base_from_tool_frame();
        let (angular, linear) = self.robot.arms.state().tool_twist(&self.output.motion);
        let back = base_from_frame.rotation().inverse();
        let twist = stack(back * angular, back * linear);
        let fault = self.contact.fault(&compliance, &twist, elapsed.as_secs_f64());
        let since = self.contact.sensor.measured_at().unwrap_or_default().max(request.pushed);
        let away = now.saturating_sub(since);
        let why = match fault {
            Some(fault) => Revocation::Contact(fault),
            None if self.mode.law_pursuit().is_some()
                && away > self.settings.rearm_timeout.max(compliance.wrench_timeout) =>
            {
                Revocation::WrenchWasAway(away.as_secs_f64())
            }
            None => return,
        };
        if self.requests.consent().is_asked() {
            self.requests.revoke(now, now, why);
        }
    }

    /// Returns the reason to stop the arm if goals must yield to the wrench at the tool, but no usable wrench arrives. Returns `None`
    /// if there is a usable wrench, if goals do not yield, or if no law drives the arm.
    pub(super) fn feels_nothing(&self, now: Duration) -> Option<Reason> {
        let compliance = self.settings.contact.filter(|_| self.mode.law_pursuit().is_some())?;
        let sensor = &self.contact.sensor;
        match () {
            () if sensor.is_stale(now, &compliance) => Some(Reason::NoWrench),
            () if sensor.is_frozen() => Some(Reason::FrozenWrench),
            () => None,
        }
    }

    /// Updates the offset by which the goal yields to the wrench, if the arm is `driven` and follows its law. Otherwise the offset
    /// does not change.
    pub(super) fn yield_to_wrench(&mut self, driven: bool) {
        let Some(pursuit) = self.mode.law_pursuit().filter(|_| driven) else {
            return self.contact.offset.freeze();
        };
        let goal = *pursuit.goal.base_from_goal() * *self.contact.offset.offset();
        let turn = goal.rotation().inverse() * self.robot.arms.pose().rotation();
        let (compliance, tool) = (self.settings.contact.as_ref(), &self.settings.tool_offset);
        let times = (self.contact_delay(), self.clock.period);
        self.contact.yield_to_wrench(compliance, tool, &turn, times);
    }

    /// Returns the time after which the tool responds to a wrench \[s\].
    fn contact_delay(&self) -> f64 {
        self.robot.link.delay() + self.clock.period
    }

    /// Returns the goal displaced by the `offset` by which it yields to the wrench. If there is no offset, returns `moving`.
    ///
    /// The argument `moving` is the goal if it moves. If it is `None`, the goal is the pose of `pursuit`, and does not move.
    ///
    /// The offset `x` moves with the goal. If `ξ_d` is the body twist of the goal and `v` the body twist of the offset, the yielded
    /// goal has the body twist `Ad_{x⁻¹} ξ_d + v`.
    pub(super) fn yielded(
        offset: &dq_contact::Admittance,
        moving: Option<MovingGoal>,
        pursuit: &Pursuit,
    ) -> Option<MovingGoal> {
        if *offset == dq_contact::Admittance::default() {
            return moving;
        }
        let standing = || MovingGoal { pose: *pursuit.goal.base_from_goal(), twist: Vector6::zeros() };
        let MovingGoal { pose, twist } = moving.unwrap_or_else(standing);
        let (x, v) = (offset.offset(), offset.twist());
        Some(MovingGoal { pose: pose * *x, twist: x.inverse().adjoint() * twist + v })
    }

    /// Returns the state of the contact for the status; `None` if goals do not yield.
    pub(super) fn contact_status(&self) -> Option<ContactStatus> {
        let compliance = self.settings.contact.as_ref()?;
        let delay = self.contact_delay();
        let [least, _] = compliance.least_damping(delay);
        let [x, y, z, ..] = compliance.damping;
        let lowest = x.min(y).min(z);
        Some(ContactStatus {
            wrench: sizes(self.contact.sensor.filtered()),
            offset: self.contact.offset.offset().distances(&UnitDualQuaternion::identity()),
            least_damping: (lowest < least).then_some((least, delay)),
        })
    }
}
