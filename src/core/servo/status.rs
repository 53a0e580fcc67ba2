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

/// A robot that moves at less than this part of the commanded speed was told to be slow.
const SLOW: f64 = 0.7;

/// The name of the joint of that number, counted from 1, of these names of all joints, arm after arm.
pub fn joint_name(number: usize, joints: &[String]) -> String {
    joints.get(number.wrapping_sub(1)).cloned().unwrap_or_else(|| number.to_string())
}

impl Status {
    /// Why the arm does not arrive, in words, and what to try, where there is no [`Reason`] for it; none where nothing holds it up. `joints`
    /// are the names of all joints, arm after arm.
    pub fn explain(&self, joints: &[String]) -> Option<String> {
        let name = |number: usize| joint_name(number, joints);
        match self.state {
            State::Stalled => self.stall.map(|stall| self.reconfiguration.explain(&stall, name)),
            State::Reconfiguring => match self.reconfiguration {
                Reconfiguration::Underway(detour) => {
                    Some(format!("{}, and the arm goes there", detour.explain(name)))
                }
                _ => None,
            },
            State::JointLimit => {
                self.joint_at_limit.map(|joint| format!("{} is at its position limit", name(joint)))
            }
            State::Constrained => self.held_by.map(|pair| pair.explain(name)),
            State::Tracking | State::Jogging | State::Settled if self.too_far.is_some() => {
                self.too_far.map(|(number, factor)| {
                    format!(
                        "{} goes {factor:.1} times as far as commanded: are its units and its gear right?",
                        name(number)
                    )
                })
            }
            State::Tracking | State::Jogging if self.speed_factor < SLOW => Some(format!(
                "the robot moves at {:.0} % of its speed: was it told to be slow?",
                100.0 * self.speed_factor
            )),
            State::Tracking if self.leaving_singularity => {
                Some("the law stands still at a singularity: the arm is led out of it".to_owned())
            }
            _ => None,
        }
    }
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
