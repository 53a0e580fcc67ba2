//! The reasons why the arm stands, or does not move as its law demands.

use super::{Contended, Revocation, Rivals};
use dq_kinematics::arm::JointKind;
use std::time::Duration;

/// The reason for a state whose name alone does not say why the arm is in it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Reason {
    /// The request is revoked (state `holding`).
    Revoked(Revocation),
    /// The request is for twists, and is revoked until the user releases the joystick (state `holding`).
    Release(Revocation),
    /// Two publishers send the same input, but only one may (state `holding`).
    Rivals(Rivals),
    /// The interval of joint states is too long for `state_timeout` (state `stale_state`).
    RareStates(Duration),
    /// The stream of goals has ended (state `stale_goal`).
    StreamEnded,
    /// TF no longer has the frame with which the goal moves (state `stale_goal`).
    FrameLost,
    /// No wrench arrives (state `stale_wrench`).
    NoWrench,
    /// The sensor repeats one wrench although the tool moves (state `stale_wrench`).
    FrozenWrench,
    /// Nobody subscribes to the commands for the arm with this number (state `not_following`).
    NobodyListens(usize),
    /// A joint moves although it is commanded to stand (states `holding`, `paused`, `stopping`).
    Sagging {
        /// The number of the joint, counted from 1.
        joint: usize,
        /// The speed of the joint [rad/s, prismatic: m/s].
        speed: f64,
        /// Whether the joint is revolute or prismatic.
        kind: JointKind,
    },
    /// The joint with this number, counted from 1, does not move as commanded (state `not_following`).
    DoesNotMove(usize),
}

impl Reason {
    /// Explains the reason in a sentence. `joint` returns the name of a joint, given its number. `publisher` returns the name of a
    /// publisher, given its input and its number. `topic` returns the topic of the commands for an arm, given the number of the arm.
    pub fn explain(
        &self,
        joint: impl Fn(usize) -> String,
        publisher: impl Fn(Contended, u32) -> String,
        topic: impl Fn(usize) -> String,
    ) -> String {
        match *self {
            Self::Revoked(why) => {
                format!("{}; to go on, send a goal again or call ~/pause with false", why.explain(joint))
            }
            Self::Release(why) => {
                format!(
                    "{}; to go on, let go of the stick first: send a twist of zero, or none",
                    why.explain(joint)
                )
            }
            Self::Rivals(Rivals { of, first, second }) => {
                let (first, second) = (publisher(of, first), publisher(of, second));
                let what = match of {
                    Contended::JointStates(_) => "give joint states of one arm",
                    Contended::Goals => "send goals",
                    Contended::Twists => "send twists",
                    Contended::Wrenches => "give wrenches at one tool",
                    Contended::Commands(_) => "command one arm",
                };
                format!("two publishers {what}: {first} and {second}; only one may")
            }
            Self::NobodyListens(arm) => {
                format!("nobody subscribes to {}: is the robot's controller running?", topic(arm))
            }
            Self::Sagging { joint: number, speed, kind } => format!(
                "sagging: {} moves at {speed:.3} {}/s although it is commanded to stand: payload or gravity? The parameter integral holds it",
                joint(number),
                kind.unit()
            ),
            Self::DoesNotMove(number) => format!(
                "{} does not follow: contact? Else: is the robot's controller active, or its delay longer than before (then set latency)? It is tried gently once more",
                joint(number)
            ),
            Self::RareStates(interval) => {
                let interval = interval.as_secs_f64();
                let (rate, least) = (1.0 / interval, 2.0 * interval);
                format!("joint states come at {rate:.0} Hz: set state_timeout to {least:.2} s or more")
            }
            Self::NoWrench => {
                "no wrench has come for longer than contact.wrench_timeout: does the sensor publish on wrench?".to_owned()
            }
            Self::FrozenWrench => {
                "the wrench has not changed for 0.5 s although the tool has moved: has the sensor stopped?".to_owned()
            }
            Self::StreamEnded => {
                "no goal has come for longer than goal_timeout: a goal that is sent once needs goal_timeout 0"
                    .to_owned()
            }
            Self::FrameLost => {
                "TF no longer has the goal's frame: the goal is followed again when TF has it".to_owned()
            }
        }
    }
}
