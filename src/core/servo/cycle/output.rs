//! What is sent to the robot: the command, and where an arm that takes positions is sent by it.

use crate::servo::filters::Filters;
use crate::servo::setpoint::Setpoint;
use crate::servo::{Arms, ClosePair, Interface, Limits, Settings};
use dq_kinematics::control::Approach;
use dq_limits::LatchedLimits;
use serde::Serialize;
use std::time::Duration;

/// What is sent to the robot.
pub(super) struct Output {
    /// What is wanted, and what filters make of it: the command.
    pub velocity: Vec<f64>,
    /// The last command.
    pub command: Vec<f64>,
    /// The same with what holds the joints against what pulls at them.
    sent: Vec<f64>,
    pub filters: Filters,
    pub latched_limits: LatchedLimits,
    pub setpoint: Setpoint,
    /// What keeps the arm from what is wanted, in the last cycle.
    pub hindrance: Hindrance,
    interface: Interface,
    /// The arm was driven, or braked: from then on it is sent commands.
    begun: bool,
}

/// What keeps an arm that is driven from what is wanted.
#[derive(Clone, Copy, Default)]
pub(super) struct Hindrance {
    /// The joint that its position limit holds back, counted from 1.
    pub at_limit: Option<usize>,
    /// The pair that would come too near to each other.
    pub pair: Option<ClosePair>,
    /// The nearest pair of those that were looked at.
    pub closest: Option<ClosePair>,
}

impl Hindrance {
    /// What the filters have found for an arm that is driven.
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
        let Self { command, sent, latched_limits, setpoint, filters, begun, .. } = self;
        (command, sent, latched_limits, setpoint, filters.approach_memory(), begun)
    }

    /// Restores a saved state.
    pub fn restore(&mut self, (command, sent, latched_limits, setpoint, approach, begun): SavedOutput) {
        (self.command, self.sent, self.latched_limits) = (command, sent, latched_limits);
        (self.setpoint, self.begun) = (setpoint, begun);
        self.filters.go_on_from(approach);
    }

    /// Nothing yet, for cycles of that `period` \[s\].
    pub fn new(arms: &Arms, settings: &Settings, period: f64) -> Self {
        let joints = arms.joint_count();
        let mut filters = Filters::new(arms, period);
        filters.set_scene(settings.scene.as_deref());
        Self {
            velocity: vec![0.0; joints],
            command: vec![0.0; joints],
            sent: vec![0.0; joints],
            filters,
            latched_limits: LatchedLimits::new(&settings.limits),
            setpoint: Setpoint::new(arms.joint_kinds()),
            hindrance: Hindrance::default(),
            interface: settings.interface,
            begun: false,
        }
    }

    /// Whether the last command was zero for every joint.
    pub fn at_rest(&self) -> bool {
        self.command.iter().all(|speed| *speed == 0.0)
    }

    /// What is to be sent, if anything is.
    pub fn to_send(&self) -> Option<&[f64]> {
        match self.interface {
            Interface::Velocity => self.begun.then_some(self.sent.as_slice()),
            Interface::Position | Interface::Trajectory => self.setpoint.get(),
        }
    }

    /// Whether speeds are sent.
    pub fn is_sent_speeds(&self) -> bool {
        self.begun && !self.interface.takes_positions()
    }

    /// Sends so much besides the command to each joint [rad/s, prismatic: m/s].
    pub fn trim(&mut self, trim: impl Iterator<Item = f64>) {
        for ((sent, command), trim) in self.sent.iter_mut().zip(&self.command).zip(trim) {
            // A command of −0 stays what it is.
            *sent = if trim == 0.0 { *command } else { command + trim };
        }
    }

    /// How fast the arm is sent on [rad/s, prismatic: m/s].
    pub fn speeds(&self) -> &[f64] {
        if self.interface.takes_positions() { self.setpoint.speeds() } else { &self.command }
    }

    /// Moves on where an arm that takes positions is sent, `elapsed` after the cycle before; one that is `driven` begins where it is
    /// `measured`.
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
