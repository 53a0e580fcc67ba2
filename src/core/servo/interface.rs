//! What kind of commands the robot's controller takes.

use dq_common::named;

named! {
    /// What kind of commands the robot's controller takes.
    "command interface" Interface {
        /// Joint velocities [rad/s, prismatic: m/s].
        Velocity = "velocity",
        /// Joint positions \[rad, prismatic: m\]: the velocities, integrated.
        Position = "position",
        /// The same positions, each as a trajectory of one point that is reached when the next one is due.
        Trajectory = "trajectory",
    }
}

impl Interface {
    /// Whether positions are sent.
    pub fn takes_positions(self) -> bool {
        self != Self::Velocity
    }
}
