//! The setpoint of an arm that takes positions: the integral of the velocity commands, starting at the arm's measured position.

use super::PositionLimits;
use dq_kinematics::arm::JointKind;
use serde::{Deserialize, Serialize};

/// The position setpoints of all joints \[rad, prismatic: m\]. There are no setpoints until the servo first drives the arm. After
/// something else has moved the arm, there are none until the servo drives the arm again.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Setpoint {
    positions: Vec<f64>,
    /// The speed of the setpoints in the last cycle [rad/s, prismatic: m/s].
    speeds: Vec<f64>,
    kinds: Vec<JointKind>,
    phase: Phase,
}

/// How the setpoints change from cycle to cycle.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
enum Phase {
    /// There are no setpoints, and nothing is sent. The robot's controller holds the last setpoint that it received.
    Released,
    /// The setpoints advance by the commands.
    Leading,
    /// The arm does not follow. Once the command is zero, the setpoints return to the measured positions. So the arm does not jump
    /// when nothing blocks it any more.
    GivingWay,
    /// The setpoints are the measured positions. They are sent one last time.
    Back,
}

impl Setpoint {
    /// Creates a setpoint without positions, for joints of these kinds.
    pub fn new(kinds: Vec<JointKind>) -> Self {
        let zeros = vec![0.0; kinds.len()];
        Self { positions: zeros.clone(), speeds: zeros, kinds, phase: Phase::Released }
    }

    /// Returns the positions to send \[rad, prismatic: m\], if there are any.
    pub fn get(&self) -> Option<&[f64]> {
        (self.phase != Phase::Released).then_some(self.positions.as_slice())
    }

    /// Returns the mean speeds of the setpoints since the last cycle [rad/s, prismatic: m/s]. After missed cycles, the speeds are lower
    /// than the command.
    pub fn speeds(&self) -> &[f64] {
        &self.speeds
    }

    /// Drops the setpoints, so that nothing is sent. The robot's controller then holds the last setpoint that it received.
    pub fn release(&mut self) {
        self.phase = Phase::Released;
        self.speeds.fill(0.0);
    }

    /// Notes that the arm does not follow. The setpoints then return to the measured positions once the command is zero.
    pub fn give_way(&mut self) {
        if self.phase == Phase::Leading {
            self.phase = Phase::GivingWay;
        }
    }

    /// Continues to drive the arm. If there are no setpoints yet, they begin at the `measured` positions \[rad, prismatic: m\].
    pub fn lead(&mut self, measured: &[f64]) {
        if self.phase == Phase::Released {
            self.positions.copy_from_slice(measured);
        }
        self.phase = Phase::Leading;
    }

    /// If the arm does not follow, sets the setpoints to the `measured` positions \[rad, prismatic: m\]. The next call drops the
    /// setpoints, so that they are sent only once. Call this while the command is zero.
    pub fn go_back(&mut self, measured: &[f64]) {
        match self.phase {
            Phase::GivingWay => {
                self.positions.copy_from_slice(measured);
                self.phase = Phase::Back;
            }
            Phase::Back => self.release(),
            Phase::Released | Phase::Leading => {}
        }
    }

    /// Advances the setpoints, if there are any, by the `command` [rad/s, prismatic: m/s] during one `period` \[s\]. `cycles`
    /// periods have passed since the last cycle. The setpoints still advance by one period only, so that no step exceeds the speed
    /// limits. The setpoints never pass a position limit.
    pub fn advance(&mut self, command: &[f64], limits: &PositionLimits, period: f64, cycles: f64) {
        if self.phase == Phase::Released {
            return;
        }
        let bounds = limits.lower.iter().zip(&limits.upper);
        let slots = self.positions.iter_mut().zip(&mut self.speeds);
        for (((position, sent), speed), (lower, upper)) in slots.zip(command).zip(bounds) {
            let next = *position + period * speed;
            let next = next.max(lower.min(*position)).min(upper.max(*position));
            *sent = (next - *position) / (cycles * period);
            *position = next;
        }
    }

    /// Returns the joint (counted from 1) that is farthest from its setpoint, its distance from the setpoint \[rad, prismatic: m\],
    /// and its kind. `expected` are the predicted positions of the joints. Returns `None` if there are no setpoints.
    pub fn farthest(&self, expected: &[f64]) -> Option<(usize, f64, JointKind)> {
        let leads = self.get()?.iter().zip(expected).zip(&self.kinds);
        let leads = leads.map(|((sent, is), kind)| (kind.displacement(*is, *sent).abs(), *kind));
        let joints = leads.enumerate().map(|(joint, (lead, kind))| (joint + 1, lead, kind));
        joints.max_by(|(_, a, _), (_, b, _)| a.total_cmp(b))
    }
}
