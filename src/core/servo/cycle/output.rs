//! The output to the robot: velocities, or the positions that follow from them.

use crate::servo::filters::Filters;
use crate::servo::setpoint::Setpoint;
use crate::servo::{Arms, ClosePair, Interface, Limits, Settings};
use dq_limits::LatchedLimits;
use serde::Serialize;
use std::time::Duration;

/// A desired velocity counts as zero if no joint is faster than this rounding error [rad/s, prismatic: m/s].
const NOTHING: f64 = 1e-9;

/// The output to the robot.
pub(super) struct Output {
    /// The desired velocity, which the filters turn into the next motion [rad/s, prismatic: m/s].
    pub velocity: Vec<f64>,
    /// The last command without the hold [rad/s, prismatic: m/s]. The hold is the part of a command that keeps a joint still
    /// against a payload or gravity.
    pub motion: Vec<f64>,
    /// The last command, with the hold [rad/s, prismatic: m/s].
    pub command: Vec<f64>,
    pub filters: Filters,
    pub latched_limits: LatchedLimits,
    pub setpoint: Setpoint,
    /// What kept the arm from its desired motion in the last cycle.
    pub hindrance: Hindrance,
    interface: Interface,
    /// Whether the servo sends commands. It sends commands from the first time that the arm is driven or braked.
    begun: bool,
    /// Whether the servo sends nothing because the arm's motion during missed cycles is unknown.
    blind: bool,
}

/// What keeps a driven arm from its desired motion: a position limit, or a narrow gap.
#[derive(Clone, Copy, Default)]
pub(super) struct Hindrance {
    /// The joint (counted from 1) that cannot move on because of its position limit, if any.
    pub at_limit: Option<usize>,
    /// The pair of parts that would come too close to each other, if any.
    pub pair: Option<ClosePair>,
    /// The closest pair of parts among the pairs that were checked; `None` if no two parts were near each other.
    pub closest: Option<ClosePair>,
}

impl Hindrance {
    /// Collects from the filters what keeps the arm from its desired motion.
    pub fn of(filters: &Filters) -> Self {
        let at_limit = filters.held_back().map(|joint| joint + 1);
        Self { at_limit, pair: filters.held_by(), closest: filters.closest() }
    }
}

/// The saved state of an [`Output`]: its fields `motion`, `command`, `latched_limits`, `setpoint` and `begun`.
pub(super) type SavedOutput = (Vec<f64>, Vec<f64>, LatchedLimits, Setpoint, bool);

impl Output {
    /// Returns the state from which the next cycle continues, for [`restore`](Self::restore).
    pub fn saved(&self) -> impl Serialize + use<'_> {
        let Self { motion, command, latched_limits, setpoint, begun, .. } = self;
        (motion, command, latched_limits, setpoint, begun)
    }

    /// Restores a saved state.
    pub fn restore(&mut self, (motion, command, latched_limits, setpoint, begun): SavedOutput) {
        (self.motion, self.command, self.latched_limits) = (motion, command, latched_limits);
        (self.setpoint, self.begun) = (setpoint, begun);
    }

    /// Creates an output without a command, for the control period `period` \[s\].
    pub fn new(arms: &Arms, settings: &Settings, period: f64) -> Self {
        let joints = arms.joint_count();
        let mut filters = Filters::new(arms, period);
        filters.set_scene(settings.scene.as_deref());
        Self {
            velocity: vec![0.0; joints],
            motion: vec![0.0; joints],
            command: vec![0.0; joints],
            filters,
            latched_limits: LatchedLimits::new(&settings.limits),
            setpoint: Setpoint::new(arms.joint_kinds()),
            hindrance: Hindrance::default(),
            interface: settings.interface,
            begun: false,
            blind: false,
        }
    }

    /// Sets the desired velocity to zero if it only consists of rounding errors.
    pub fn drop_rounding_errors(&mut self) {
        if self.velocity.iter().all(|speed| speed.abs() <= NOTHING) {
            self.velocity.fill(0.0);
        }
    }

    /// Returns whether the last command moves no joint.
    pub fn at_rest(&self) -> bool {
        self.motion.iter().all(|speed| *speed == 0.0)
    }

    /// Returns the output, or `None` if nothing is to be sent.
    pub fn to_send(&self) -> Option<&[f64]> {
        match self.interface {
            _ if self.blind => None,
            Interface::Velocity => self.begun.then_some(self.command.as_slice()),
            Interface::Position | Interface::Trajectory => self.setpoint.get(),
        }
    }

    /// Returns whether the servo sends velocity commands. False until it has sent the first one.
    pub fn is_sent_speeds(&self) -> bool {
        self.begun && !self.interface.takes_positions()
    }

    /// Sets whether the servo is `blind`: it does not know how the arm moved during missed cycles. A blind servo sends nothing, so the
    /// robot's controller stops the arm after its own timeout. Therefore the last command becomes `hold` [rad/s, prismatic: m/s], the
    /// command under which the joints stand still.
    pub fn be_silent(&mut self, blind: bool, hold: &[f64]) {
        self.blind = blind;
        if blind {
            self.motion.fill(0.0);
            self.command.copy_from_slice(hold);
        }
    }

    /// Sets `motion` to the last command minus `hold`. The joints stand still under the command `hold` [rad/s, prismatic: m/s].
    pub fn begin(&mut self, hold: &[f64]) {
        for ((motion, command), hold) in self.motion.iter_mut().zip(&self.command).zip(hold) {
            *motion = command - hold;
        }
    }

    /// Sets the command to the filtered velocity plus `hold`. The joints stand still under the command `hold` [rad/s, prismatic:
    /// m/s].
    pub fn send(&mut self, hold: &[f64]) {
        std::mem::swap(&mut self.motion, &mut self.velocity);
        for ((command, motion), hold) in self.command.iter_mut().zip(&self.motion).zip(hold) {
            *command = motion + hold;
        }
    }

    /// Returns the joint speeds that the output causes [rad/s, prismatic: m/s].
    pub fn speeds(&self) -> &[f64] {
        if self.interface.takes_positions() { self.setpoint.speeds() } else { &self.motion }
    }

    /// Advances the position setpoint. `elapsed` is the time since the last cycle. When the servo begins to drive the arm
    /// (`driven`), the setpoint starts at the `measured` positions.
    pub fn move_setpoint(
        &mut self,
        driven: bool,
        elapsed: Duration,
        measured: &[f64],
        period: f64,
        limits: &Limits,
    ) {
        self.begun |= driven || !self.at_rest();
        if !self.interface.takes_positions() {
            return;
        }
        if driven {
            self.setpoint.lead(measured);
        } else if self.at_rest() {
            self.setpoint.go_back(measured);
        }
        let cycles = (elapsed.as_secs_f64() / period).round().max(1.0);
        self.setpoint.advance(&self.command, &limits.position, period, cycles);
    }
}
