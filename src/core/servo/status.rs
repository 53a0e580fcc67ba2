//! What the servo did in its last cycle.

use dq_common::named;

use super::{ClosePair, Consent, Figures, Goal, Reason, Reconfiguration, Stall, State};
use nalgebra::Vector6;

named! {
    /// Which input rules.
    "input" Input {
        /// None: the arm stands.
        None = "none",
        /// The goal.
        Goal = "goal",
        /// A twist.
        Twist = "twist",
    }
}

/// What the servo did in its last cycle.
#[derive(Clone, Debug, PartialEq)]
pub struct Status {
    /// The state.
    pub state: State,
    /// Why, where the state alone does not say enough.
    pub reason: Option<Reason>,
    /// Who asked for motion, and what has revoked that.
    pub consent: Consent,
    /// Which input rules.
    pub input: Input,
    /// Number of motions begun since the start: by another goal, or by one that was revoked and asked for again.
    pub goal_count: u64,
    /// The goal in force.
    pub goal: Option<Goal>,
    /// The stamp of the message that last gave it \[ns\].
    pub goal_stamp: i64,
    /// Whether the goal is farther away than the arm can reach.
    pub goal_beyond_reach: bool,
    /// The sign chosen for the goal's dual quaternion (+1 or −1).
    pub sign: f64,
    /// The joint that its position limit holds back, counted from 1, arm after arm.
    pub joint_at_limit: Option<usize>,
    /// The pair of the body and what it must keep out of, or of the body alone, that keeps the arm from where it is to go.
    pub held_by: Option<ClosePair>,
    /// The nearest such pair, where one is near.
    pub closest: Option<ClosePair>,
    /// The joint, counted from 1 arm after arm, that goes too far, and how many times as far as commanded.
    pub too_far: Option<(usize, f64)>,
    /// The part of the commanded speed at which the robot moves, as estimated or as it says: below 1 where it was told to be slow.
    pub speed_factor: f64,
    /// Whether the arm is being led out of a singularity at which the law stood still.
    pub leaving_singularity: bool,
    /// Why the motion was given up, in the state `stalled`.
    pub stall: Option<Stall>,
    /// What is known of another configuration in which the goal can be reached.
    pub reconfiguration: Reconfiguration,
    /// Figures of the motion to the goal.
    pub figures: Figures,
    /// The screw log of the pose error, `(ω, v)` [rad, m], without what of the goal the tool is not asked for.
    pub pose_error: Vector6<f64>,
    /// From a command to the joint state that shows it \[s\], as estimated.
    pub latency: f64,
    /// The part of the law's gain that this latency allows: 1 where it does not limit.
    pub gain_factor: f64,
}

impl Default for Status {
    fn default() -> Self {
        Self {
            state: State::WaitingForState,
            reason: None,
            consent: Consent::default(),
            input: Input::None,
            goal_count: 0,
            goal: None,
            goal_stamp: 0,
            goal_beyond_reach: false,
            sign: 1.0,
            joint_at_limit: None,
            held_by: None,
            closest: None,
            too_far: None,
            speed_factor: 1.0,
            leaving_singularity: false,
            stall: None,
            reconfiguration: Reconfiguration::Unknown,
            figures: Figures::default(),
            pose_error: Vector6::zeros(),
            latency: 0.0,
            gain_factor: 1.0,
        }
    }
}
