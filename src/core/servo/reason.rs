//! Why the arm stands, or is not driven as its law would.

use super::{Contended, Revocation, Rivals};
use dq_kinematics::arm::JointKind;

/// A reason in words, where the state alone does not say enough.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Reason {
    /// What was asked for is revoked (state `holding`).
    Revoked(Revocation),
    /// What is revoked is a twist (state `holding`).
    Release(Revocation),
    /// Two publish what may have one publisher only (state `holding`).
    Rivals(Rivals),
    /// The goals are a stream, and it has ceased (state `stale_goal`).
    StreamEnded,
    /// It is not known any more where the frame is with which the goal moves (state `stale_goal`).
    FrameLost,
    /// Nobody subscribes to the commands for the arm of this number (state `not_following`).
    NobodyListens(usize),
    /// The joint, counted from 1, moves at that speed [rad/s, prismatic: m/s] where it is commanded to stand (states `holding`, `paused`,
    /// `stopping`).
    Sagging {
        /// The joint.
        joint: usize,
        /// How fast it moves.
        speed: f64,
        /// Of what kind it is.
        kind: JointKind,
    },
    /// The joint of this number, counted from 1, does not move as commanded (state `not_following`).
    DoesNotMove(usize),
}

impl Reason {
    /// A sentence for people; `joint` names a joint by its number, `publisher` the publisher of that number, and `topic` the topic of
    /// the commands by the number of the arm.
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
                    Contended::Commands(_) => "command one arm",
                };
                format!("two publishers {what}: {first} and {second}; only one may")
            }
            Self::NobodyListens(arm) => {
                format!("nobody subscribes to {}: is the robot's controller running?", topic(arm))
            }
            Self::Sagging { joint: number, speed, kind } => format!(
                "sagging: {} moves at {speed:.3} {}/s where it is commanded to stand: payload or gravity? The parameter integral holds it",
                joint(number),
                kind.unit()
            ),
            Self::DoesNotMove(number) => format!(
                "{} does not follow: contact? Else: is the robot's controller active, or its delay longer than before (then set latency)? It is tried gently once more",
                joint(number)
            ),
            Self::StreamEnded => {
                "no goal has come for longer than goal_timeout: a goal that is sent once needs goal_timeout 0"
                    .to_owned()
            }
            Self::FrameLost => {
                "TF does not say any more where the goal's frame is: it is followed again when TF does"
                    .to_owned()
            }
        }
    }
}
