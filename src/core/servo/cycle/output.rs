//! The output to the robot: the velocity command, or the positions that it leads to.

use crate::servo::filters::Filters;
use crate::servo::setpoint::Setpoint;
use crate::servo::{Arms, ClosePair, Interface, Limits, Settings};
use dq_kinematics::control::Approach;
use dq_limits::LatchedLimits;
use serde::Serialize;
use std::time::Duration;

/// The output to the robot.
pub(super) struct Output {
    /// The desired velocity, which the filters turn into the next motion [rad/s, prismatic: m/s].
    pub velocity: Vec<f64>,
    /// The motion of the last command, and the command: the motion plus the hold, which balances the pull at each joint.
    pub motion: Vec<f64>,
    pub command: Vec<f64>,
    pub filters: Filters,
    pub latched_limits: LatchedLimits,
    pub setpoint: Setpoint,
    /// What kept the arm from the desired motion in the last cycle.
    pub hindrance: Hindrance,
    interface: Interface,
    /// Whether the arm was ever driven or braked: from then on, commands are sent.
    begun: bool,
    /// Whether it is unknown what the arm did during a gap in the cycles: then nothing is sent.
    blind: bool,
}

/// What keeps a driven arm from its desired motion.
#[derive(Clone, Copy, Default)]
pub(super) struct Hindrance {
    /// The joint that its position limit stops, counted from 1.
    pub at_limit: Option<usize>,
    /// The pair that would come too close to each other.
    pub pair: Option<ClosePair>,
    /// The closest of the pairs that were checked.
    pub closest: Option<ClosePair>,
}

impl Hindrance {
    /// Collects what the filters have found for a driven arm.
    pub fn of(filters: &Filters) -> Self {
        let at_limit = filters.held_back().map(|joint| joint + 1);
        Self { at_limit, pair: filters.held_by(), closest: filters.closest() }
    }
}

/// The saved state of an [`Output`].
pub(super) type SavedOutput = (Vec<f64>, Vec<f64>, LatchedLimits, Setpoint, Approach, bool);

impl Output {
    /// Returns the state that the next cycle starts from, for [`restore`](Self::restore).
    pub fn saved(&self) -> impl Serialize + use<'_> {
        let Self { motion, command, latched_limits, setpoint, filters, begun, .. } = self;
        (motion, command, latched_limits, setpoint, filters.approach_memory(), begun)
    }

    /// Restores a saved state.
    pub fn restore(&mut self, (motion, command, latched_limits, setpoint, approach, begun): SavedOutput) {
        (self.motion, self.command, self.latched_limits) = (motion, command, latched_limits);
        (self.setpoint, self.begun) = (setpoint, begun);
        self.filters.go_on_from(approach);
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

    /// Returns whether the last command moves no joint.
    pub fn at_rest(&self) -> bool {
        self.motion.iter().all(|speed| *speed == 0.0)
    }

    /// Returns what to send, if anything.
    pub fn to_send(&self) -> Option<&[f64]> {
        match self.interface {
            _ if self.blind => None,
            Interface::Velocity => self.begun.then_some(self.command.as_slice()),
            Interface::Position | Interface::Trajectory => self.setpoint.get(),
        }
    }

    /// Returns whether speeds are sent.
    pub fn is_sent_speeds(&self) -> bool {
        self.begun && !self.interface.takes_positions()
    }

    /// Sends nothing while `blind`, so that the arm stops by its own timeout: what it did during a gap in the cycles is unknown.
    pub fn be_silent(&mut self, blind: bool, hold: &[f64]) {
        self.blind = blind;
        if blind {
            self.motion.fill(0.0);
            self.command.copy_from_slice(hold);
        }
    }

    /// Computes the motion that continues the last command, now that `hold` [rad/s, prismatic: m/s] is the command that moves nothing.
    pub fn begin(&mut self, hold: &[f64]) {
        for ((motion, command), hold) in self.motion.iter_mut().zip(&self.command).zip(hold) {
            *motion = command - hold;
        }
    }

    /// Sets the command to the filtered velocity plus the `hold` [rad/s, prismatic: m/s].
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

    /// Advances the position setpoint, `elapsed` after the last cycle. If the arm is `driven`, the setpoint begins at the `measured`
    /// positions.
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
