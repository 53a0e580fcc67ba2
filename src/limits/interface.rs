//! The kind of commands that the robot's controller takes.

use dq_common::named;
use dq_params::{Declarer, ParameterError, Parameters};

named! {
    /// The kind of commands that the robot's controller takes.
    "command interface" Interface {
        /// Joint velocities [rad/s, prismatic: m/s].
        Velocity = "velocity",
        /// Joint positions \[rad, prismatic: m\], integrated from the velocities.
        Position = "position",
        /// Joint positions. Each command is a trajectory of one point. The joints reach this point when the next command is due.
        Trajectory = "trajectory",
    }
}

impl Interface {
    /// Returns whether the controller takes positions.
    pub fn takes_positions(self) -> bool {
        self != Self::Velocity
    }
}

/// Servo, plant and guard share this parameter, so that one file can set it for all.
impl Parameters for Interface {
    fn declare(p: &mut Declarer) -> Result<Self, ParameterError> {
        #[derive(Parameters)]
        struct Command {
            /// what the robot's controller takes: joint velocities, joint positions, or trajectories of one point each
            #[parameter(one_of = Interface::NAMES, default = Interface::Velocity, fixed)]
            interface: Interface,
        }
        Command::declare(p).map(|command| command.interface)
    }
}
