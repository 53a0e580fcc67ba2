//! What is sent to the robot: the command, and where an arm that takes positions is sent by it.

use crate::servo::filters::{Filters, HeldLimits};
use crate::servo::setpoint::Setpoint;
use crate::servo::{Arms, Interface, PositionLimits, Settings};
use std::time::Duration;

/// What is sent to the robot.
pub(super) struct Output {
    /// What is wanted, and what filters make of it: the command.
    pub velocity: Vec<f64>,
    /// The last command.
    pub command: Vec<f64>,
    pub filters: Filters,
    pub held_limits: HeldLimits,
    pub setpoint: Setpoint,
    interface: Interface,
    /// The arm was driven, or braked: from then on it is sent commands.
    begun: bool,
}

impl Output {
    /// Nothing yet, for cycles of that `period` \[s\].
    pub fn new(arms: &Arms, settings: &Settings, period: f64) -> Self {
        let joints = arms.joint_count();
        let mut filters = Filters::new(arms, period);
        filters.set_scene(settings.scene.as_deref());
        Self {
            velocity: vec![0.0; joints],
            command: vec![0.0; joints],
            filters,
            held_limits: HeldLimits::new(&settings.limits),
            setpoint: Setpoint::new(arms.joint_kinds()),
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
            Interface::Velocity => self.begun.then_some(self.command.as_slice()),
            Interface::Position | Interface::Trajectory => self.setpoint.get(),
        }
    }

    /// How fast the arm is sent on [rad/s, prismatic: m/s].
    pub fn speeds(&self) -> &[f64] {
        if self.interface.takes_positions() { self.setpoint.speeds() } else { &self.command }
    }

    /// Takes these for the command and what was sent in the last cycle.
    pub fn adopt(&mut self, command: &[f64], sent: &[f64]) {
        self.begun = true;
        self.command.copy_from_slice(command);
        if self.interface.takes_positions() {
            self.setpoint.place(sent);
        }
    }

    /// Stands, as what has sent nothing for a while.
    pub fn stand_anew(&mut self) {
        self.setpoint.release();
        self.command.fill(0.0);
        self.held_limits.begin(&self.command);
    }

    /// Moves on where an arm that takes positions is sent, `elapsed` after the cycle before; one that is `driven` begins where it is
    /// `measured`.
    pub fn move_setpoint(
        &mut self,
        driven: bool,
        elapsed: Duration,
        measured: &[f64],
        period: f64,
        limits: &PositionLimits,
    ) {
        self.begun |= driven || !self.at_rest();
        if self.interface.takes_positions() {
            if driven {
                self.setpoint.anchor(measured);
            }
            let cycles = (elapsed.as_secs_f64() / period).round().max(1.0);
            self.setpoint.advance(&self.command, limits, period, cycles);
        }
    }
}
