//! Why the arm stands, or is not driven as its law would.

use super::{Rearm, Rivals};

/// A reason in words, where the state alone does not say enough.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Reason {
    /// The goal is older than the robot's presence (state `holding`).
    Rearm(Rearm),
    /// What is older than the robot's presence is a twist (state `holding`).
    Release(Rearm),
    /// Two publishers give joint states of one arm (state `holding`).
    Rivals(Rivals),
    /// The goals are a stream, and it has ceased (state `stale_goal`).
    StreamEnded,
    /// It is not known any more where the frame is with which the goal moves (state `stale_goal`).
    FrameLost,
    /// Something else is controlled than when the goal came, which was dropped (state `holding`).
    AnotherAim,
    /// Nobody subscribes to the commands for the arm of this number (state `not_following`).
    NobodyListens(usize),
    /// The arm of this number does not move as commanded (state `not_following`).
    DoesNotMove(usize),
}

impl Reason {
    /// A sentence for people; `joint` names a joint by its number, `publisher` and `topic` a publisher of joint states and the topic
    /// of the commands by the number of the arm.
    pub fn explain(
        &self,
        joint: impl Fn(usize) -> String,
        publisher: impl Fn(usize, u32) -> String,
        topic: impl Fn(usize) -> String,
    ) -> String {
        match *self {
            Self::Rearm(why) => {
                format!("{}; to go on, send a goal again or call ~/pause with false", why.explain(joint))
            }
            Self::Release(why) => {
                let why = match why {
                    Rearm::CameLater(_) => "the robot came after the twist".to_owned(),
                    why => why.explain(joint),
                };
                format!("{why}; to go on, let target_twist cease or be zero first")
            }
            Self::Rivals(Rivals { arm, first, second }) => {
                let (first, second) = (publisher(arm, first), publisher(arm, second));
                format!("two publishers give joint states of one arm: {first} and {second}; only one may")
            }
            Self::NobodyListens(arm) => {
                format!("nobody subscribes to {}: is the robot's controller running?", topic(arm))
            }
            Self::DoesNotMove(_) => {
                "the arm does not move as commanded: is its controller active, or its delay longer than before (then set latency)? It is tried gently once a second"
                    .to_owned()
            }
            Self::StreamEnded => {
                "no goal has come for longer than goal_timeout: a goal that is sent once needs goal_timeout 0".to_owned()
            }
            Self::FrameLost => {
                "TF does not say any more where the goal's frame is: it is followed again when TF does".to_owned()
            }
            Self::AnotherAim => {
                "something else is controlled now, so the goal was dropped: send another".to_owned()
            }
        }
    }
}
