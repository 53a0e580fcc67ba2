//! What takes consent back, and of what there may be one publisher only.

use dq_kinematics::arm::JointKind;
use serde::{Deserialize, Serialize};

/// What two publishers give at the same time, of which there may be one only.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Contended {
    /// Joint states of the arm of that number.
    JointStates(usize),
    /// Goals.
    Goals,
    /// Twists.
    Twists,
    /// Commands to the arm of that number.
    Commands(usize),
}

/// Two publishers of what may have one only.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Rivals {
    /// What they publish.
    pub of: Contended,
    /// The number of the publisher that was there first.
    pub first: u32,
    /// The number of the other one.
    pub second: u32,
}

/// What revokes a consent.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Revocation {
    /// The robot came this long after the consent \[s\].
    CameLater(f64),
    /// The robot was away for so long \[s\].
    WasAway(f64),
    /// The joint, counted from 1 arm after arm and of that kind, is this far \[rad, prismatic: m\] from where it was a moment before.
    IsElsewhere(usize, f64, JointKind),
    /// There were two publishers.
    Rivals(Contended),
    /// The joint, counted from 1 arm after arm and of that kind, is this far \[rad, prismatic: m\] from where it was sent and should be.
    FellBehind(usize, f64, JointKind),
    /// The joint, counted from 1 arm after arm, has not obeyed for so long \[s\].
    NotObeyed(usize, f64),
    /// The joint, counted from 1 arm after arm, ceased to follow for the third time within 10 s.
    KeepsLosing(usize),
    /// The frame with which the goal moves was lost for so long \[s\].
    FrameWasAway(f64),
    /// The goal's frame moves with the tool.
    MovesWithTool,
    /// The servo was stopped.
    Stopped,
    /// A twist moved the arm; it revokes goals only.
    Jogged,
    /// Something else is controlled than when it was given.
    AnotherAim,
    /// The tool is another.
    AnotherTool,
}

impl Revocation {
    /// What happened, for people; `joint` names a joint by its number.
    pub fn explain(&self, joint: impl Fn(usize) -> String) -> String {
        match self {
            Self::CameLater(seconds) => format!("the robot came {seconds:.1} s after it was asked to move"),
            Self::WasAway(seconds) => format!("the robot was away for {seconds:.1} s"),
            Self::IsElsewhere(number, jump, kind) => {
                let unit = kind.unit();
                format!("the robot came back elsewhere: {} jumped by {jump:.2} {unit}", joint(*number))
            }
            Self::Rivals(Contended::JointStates(_)) => "two publishers gave joint states".to_owned(),
            Self::Rivals(Contended::Goals) => "two publishers sent goals".to_owned(),
            Self::Rivals(Contended::Twists) => "two publishers sent twists".to_owned(),
            Self::Rivals(Contended::Commands(_)) => "another publisher sent commands to the arm".to_owned(),
            Self::FellBehind(number, lead, kind) => {
                let unit = kind.unit();
                format!(
                    "{} is {lead:.2} {unit} from where it was sent (following_error): is it blocked?",
                    joint(*number)
                )
            }
            Self::NotObeyed(number, seconds) => format!(
                "{} has not obeyed for {seconds:.1} s: is the robot stopped, its controller inactive, or the joint blocked or wired wrongly?",
                joint(*number)
            ),
            Self::KeepsLosing(number) => format!(
                "{} ceased to follow three times within 10 s: is it blocked, or wired to another motor or in the other direction?",
                joint(*number)
            ),
            Self::FrameWasAway(seconds) => {
                format!("TF did not say for {seconds:.1} s where the goal's frame is")
            }
            Self::MovesWithTool => {
                "the goal's frame moves with the tool, so that the arm can never reach it".to_owned()
            }
            Self::Stopped => "~/stop was called".to_owned(),
            Self::Jogged => "a twist on target_twist came".to_owned(),
            Self::AnotherAim => "something else is controlled".to_owned(),
            Self::AnotherTool => "tool_offset was changed".to_owned(),
        }
    }

    /// The revocation in one word, as `~/status` has it.
    pub fn name(&self) -> &'static str {
        match self {
            Self::CameLater(_) => "robot_came",
            Self::WasAway(_) => "robot_was_away",
            Self::IsElsewhere(..) => "robot_jumped",
            Self::Rivals(_) => "two_publishers",
            Self::FellBehind(..) => "fell_behind",
            Self::NotObeyed(..) => "not_obeyed",
            Self::KeepsLosing(_) => "not_following",
            Self::FrameWasAway(_) => "frame_was_away",
            Self::MovesWithTool => "moves_with_tool",
            Self::Stopped => "stop",
            Self::Jogged => "twist",
            Self::AnotherAim => "another_task",
            Self::AnotherTool => "another_tool",
        }
    }
}
