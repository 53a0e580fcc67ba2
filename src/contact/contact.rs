//! The state of contact: the wrench, the offset, and what stops the arm.

use crate::compliance::{angular_first, sizes};
use crate::sign_watch::SignWatch;
use crate::{Admittance, Compliance, WrenchSensor, wrench_in};
use dq_algebra::{UnitDualQuaternion, split};
use nalgebra::{UnitQuaternion, Vector6};
use serde::{Deserialize, Serialize};
use std::time::Duration;

/// A wrench that has stopped the arm stops the arm again only if it grows to this many times its size at the last stop. Without
/// this margin, the arm could not move out of the contact.
const LEAVING: f64 = 1.2;
/// The contact has ended when force and torque are both below this fraction of their limits.
const LEFT: f64 = 0.8;

/// Why a contact stops the arm.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum ContactFault {
    /// The force has this size \[N\], which exceeds its limit.
    Force(f64),
    /// The torque has this size \[N m\], which exceeds its limit.
    Torque(f64),
    /// The sign of the force is probably wrong. The force has this size \[N\] and points along the motion that touched the obstacle.
    /// In addition, either the force grows while the tool yields, or the force or the torque exceeds its limit.
    Sign(f64),
}

impl ContactFault {
    /// Explains the fault in words.
    pub fn explain(&self) -> String {
        match self {
            Self::Force(force) => format!("contact: {force:.0} N"),
            Self::Torque(torque) => format!("contact: {torque:.1} N m"),
            Self::Sign(force) => format!(
                "contact: {force:.0} N, and pushing back grows with yielding: is the sign of wrench right (contact.reversed)?"
            ),
        }
    }
}

/// The contact of one tool.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct ContactState {
    /// The wrench at the tool.
    pub sensor: WrenchSensor,
    /// The offset by which the goal yields.
    pub offset: Admittance,
    sign: SignWatch,
    /// The raised limits of force and torque \[N, N m\]. They replace [`Compliance::largest_wrench`] from the time at which a wrench
    /// stops the arm until the contact ends; `None` at other times.
    tolerated: Option<[f64; 2]>,
}

impl ContactState {
    /// Returns the numbers of the publisher in use and of another one, if both send wrenches at `now`.
    pub fn rivals(&mut self, now: Duration) -> Option<[u32; 2]> {
        self.sensor.sources.rivals(now)
    }

    /// Returns why the arm has to stop now; `None` if it need not stop. `twist` is the body twist of the tool frame, `(ω, v)`
    /// [rad/s, m/s], and `dt` the time since the last call \[s\].
    pub fn fault(&mut self, compliance: &Compliance, twist: &Vector6<f64>, dt: f64) -> Option<ContactFault> {
        let (_, velocity) = split(twist);
        self.sensor.note_motion(velocity.norm() * dt);
        let (_, force) = split(self.sensor.filtered());
        let wrong_sign = self.sign.update(&force, &velocity, compliance.dead_band[0], dt);
        // At a stiff wall, the force exceeds its limit before the filtered wrench does. So these checks use the latest wrench.
        let (_, sudden) = split(self.sensor.latest());
        let latest = sizes(self.sensor.latest());
        let [force_now, torque_now] = latest;
        let limits = compliance.largest_wrench;
        if (0..2).all(|part| latest[part] < LEFT * limits[part]) {
            self.tolerated = None;
        }
        let [most_force, most_torque] = self.tolerated.unwrap_or(limits);
        let is_too_large = force_now > most_force || torque_now > most_torque;
        if is_too_large {
            self.tolerated = Some([0, 1].map(|part| limits[part].max(LEAVING * latest[part])));
        }
        match () {
            () if wrong_sign || (is_too_large && self.sign.helps(&sudden)) => {
                Some(ContactFault::Sign(force_now))
            }
            () if force_now > most_force => Some(ContactFault::Force(force_now)),
            () if torque_now > most_torque => Some(ContactFault::Torque(torque_now)),
            () => None,
        }
    }

    /// Moves the offset by one step of `dt` \[s\]. The controlled tool is at `tool_offset` in the tool frame. `rotation` converts
    /// vectors from the axes of the controlled tool to those of the yielded goal. The tool follows the yielded goal `delay` \[s\]
    /// later. Without `compliance`, the offset returns to the identity.
    pub fn yield_to_wrench(
        &mut self,
        compliance: Option<&Compliance>,
        tool_offset: &UnitDualQuaternion,
        rotation: &UnitQuaternion<f64>,
        (delay, dt): (f64, f64),
    ) {
        let Some(compliance) = compliance else {
            return self.offset.advance(None, &Vector6::zeros(), delay, dt);
        };
        let felt = wrench_in(&tool_offset.inverse(), self.sensor.filtered());
        let felt = beyond(&felt, compliance.dead_band);
        // The wrench at the tool acts on the goal as if the origin of the goal were at the tool.
        let turned = UnitDualQuaternion::from_parts(*rotation, Default::default());
        let wrench = wrench_in(&turned, &felt) + angular_first(&compliance.force_goal);
        self.offset.advance(Some(compliance), &wrench, delay, dt);
    }
}

/// Returns the part of a wrench that is beyond the dead band of force and torque.
fn beyond(wrench: &Vector6<f64>, dead_band: [f64; 2]) -> Vector6<f64> {
    let sizes = sizes(wrench);
    let [force, torque] = [0, 1]
        .map(|part| if sizes[part] > dead_band[part] { 1.0 - dead_band[part] / sizes[part] } else { 0.0 });
    wrench.component_mul(&Vector6::new(torque, torque, torque, force, force, force))
}
