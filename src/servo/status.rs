//! What the servo did in its last cycle.

use super::{Figures, Goal, Stall, State};
use nalgebra::Vector6;

/// What the servo did in its last cycle.
#[derive(Clone, Debug, PartialEq)]
pub struct Status {
    /// The state.
    pub state: State,
    /// Number of different goals taken since the start.
    pub goal_count: u64,
    /// The goal in force.
    pub goal: Option<Goal>,
    /// Whether the goal is farther away than the arm can reach.
    pub goal_beyond_reach: bool,
    /// The sign chosen for the goal's dual quaternion (+1 or −1).
    pub sign: f64,
    /// The joint that its position limit holds back, counted from 1, arm after arm.
    pub joint_at_limit: Option<usize>,
    /// Whether the arm is being led out of a singularity at which the law stood still.
    pub leaving_singularity: bool,
    /// Why the motion was given up, in the state `stalled`.
    pub stall: Option<Stall>,
    /// Figures of the motion to the goal.
    pub figures: Figures,
    /// The screw log of the pose error, `(ω, v)` [rad, m].
    pub pose_error: Vector6<f64>,
}

impl Default for Status {
    fn default() -> Self {
        Self {
            state: State::WaitingForState,
            goal_count: 0,
            goal: None,
            goal_beyond_reach: false,
            sign: 1.0,
            joint_at_limit: None,
            leaving_singularity: false,
            stall: None,
            figures: Figures::default(),
            pose_error: Vector6::zeros(),
        }
    }
}
