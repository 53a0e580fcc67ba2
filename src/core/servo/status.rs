//! The report of the last cycle.

use dq_common::named;

use super::{ClosePair, Consent, FreeDirections, Goal, Reason, Reconfiguration, Stall, State};
use dq_metrics::Figures;
use nalgebra::Vector6;

named! {
    /// The input that moves the arm.
    "input" Input {
        /// No input moves the arm, and the arm stands.
        None = "none",
        /// A goal.
        Goal = "goal",
        /// A twist.
        Twist = "twist",
    }
}

/// The report of the last cycle.
#[derive(Clone, Debug, PartialEq)]
pub struct Status {
    /// The servo's state.
    pub state: State,
    /// The reason for the state, if the state needs one to be understood.
    pub reason: Option<Reason>,
    /// The last request, and the event that has revoked it.
    pub consent: Consent,
    /// The input that moves the arm.
    pub input: Input,
    /// Number of motions that have begun. A goal that was revoked and requested again begins another motion.
    pub goal_count: u64,
    /// The current goal.
    pub goal: Option<Goal>,
    /// The stamp of the goal's last message \[ns\].
    pub goal_stamp: i64,
    /// Whether the goal is beyond the reach of the arm.
    pub goal_beyond_reach: bool,
    /// The sign chosen for the goal's dual quaternion (+1 or −1).
    pub sign: f64,
    /// The number of the joint that cannot move on because of its position limit, counted from 1, arm after arm; `None` if there is no
    /// such joint.
    pub joint_at_limit: Option<usize>,
    /// The pair of parts that keeps the arm from its desired motion, if any: a part of the arm's body, and an obstacle or another part
    /// of the body.
    pub held_by: Option<ClosePair>,
    /// The closest pair of parts: a part of the arm's body, and an obstacle or another part of the body. `None` if no pair is near.
    pub closest: Option<ClosePair>,
    /// A joint that moves farther than commanded, if any: its number (from 1, arm after arm), and the ratio of its motion to the
    /// command.
    pub too_far: Option<(usize, f64)>,
    /// The fraction of the commanded speed at which the robot moves, as estimated or as reported. The fraction is below 1 if
    /// somebody has told the robot to move slowly.
    pub speed_factor: f64,
    /// Whether the arm is escaping from a singularity at which the law stands still.
    pub leaving_singularity: bool,
    /// The directions in which the arm can move, if it cannot follow the present twist.
    pub instead_of_twist: Option<FreeDirections>,
    /// The contact; `None` if goals do not yield.
    pub contact: Option<ContactStatus>,
    /// Why the motion has stalled; `None` if it has not stalled.
    pub stall: Option<Stall>,
    /// Information about another configuration in which the goal can be reached.
    pub reconfiguration: Reconfiguration,
    /// The figures of the motion to the goal.
    pub figures: Figures,
    /// The screw log of the pose error, `(ω, v)` \[rad, m\]. Components that the [`Aim`](dq_kinematics::control::Aim) leaves free are
    /// 0.
    pub pose_error: Vector6<f64>,
    /// The estimated time from a command to the joint state that shows its effect \[s\].
    pub latency: f64,
    /// The fraction of the law's gain that the latency allows; 1 if the latency does not limit the gain.
    pub gain_factor: f64,
}

/// The contact in the last cycle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactStatus {
    /// The sizes of the contact force \[N\] and torque \[N m\] at the tool. They are low-pass filtered, and do not include the weight
    /// of the load and the bias of the sensor.
    pub wrench: [f64; 2],
    /// The distance \[m\] and angle \[rad\] by which the goal has yielded.
    pub offset: [f64; 2],
    /// The smallest damping with which motion along every axis is stable \[N s/m\], and the delay \[s\] that makes it necessary.
    /// `None` if the parameter `contact.damping` is large enough.
    pub least_damping: Option<(f64, f64)>,
}

/// If a robot moves at less than this fraction of the commanded speed, the servo assumes that somebody has told the robot to move
/// slowly.
const SLOW: f64 = 0.7;

/// Returns the name of the joint `number`, counted from 1, arm after arm. `joints` are the names of all joints in that order.
/// Without such a joint, returns the number as text.
pub fn joint_name(number: usize, joints: &[String]) -> String {
    joints.get(number.wrapping_sub(1)).cloned().unwrap_or_else(|| number.to_string())
}

impl Status {
    /// Explains why the arm does not arrive and what to try. Returns `None` if nothing stops the arm, or if a [`Reason`] says what
    /// stops it. `joints` are the names of all joints, arm after arm.
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
            State::Jogging if self.instead_of_twist.is_some() => {
                self.instead_of_twist.map(|directions| directions.explain())
            }
            State::Tracking | State::Jogging if self.speed_factor < SLOW => Some(format!(
                "the robot moves at {:.0} % of its speed: was it told to be slow?",
                100.0 * self.speed_factor
            )),
            State::Tracking | State::Settled if self.contact.is_some_and(|it| it.least_damping.is_some()) => {
                self.contact.and_then(|contact| contact.least_damping).map(|(damping, delay)| {
                    format!(
                        "the delay of {:.0} ms needs a damping of {damping:.0} N s/m: contact.damping counts as this",
                        1e3 * delay
                    )
                })
            }
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
            instead_of_twist: None,
            stall: None,
            contact: None,
            reconfiguration: Reconfiguration::Unknown,
            figures: Figures::default(),
            pose_error: Vector6::zeros(),
            latency: 0.0,
            gain_factor: 1.0,
        }
    }
}
