//! The events that revoke consent, and the inputs that may have only one publisher.

use dq_contact::ContactFault;
use dq_kinematics::arm::JointKind;
use serde::{Deserialize, Serialize};

/// An input that may have only one publisher.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Contended {
    /// Joint states of the arm with this number.
    JointStates(usize),
    /// Goals.
    Goals,
    /// Twists.
    Twists,
    /// Commands to the arm with this number.
    Commands(usize),
    /// Wrenches at the tool.
    Wrenches,
}

/// Two publishers of the same input, although it may have only one publisher.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Rivals {
    /// The input that both publish.
    pub of: Contended,
    /// The number of the first publisher.
    pub first: u32,
    /// The number of the other publisher.
    pub second: u32,
}

/// An event that revokes consent.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Revocation {
    /// The robot appeared this long after the request \[s\].
    CameLater(f64),
    /// No joint states came from the robot for this time \[s\].
    WasAway(f64),
    /// A joint jumped: its number (from 1, arm after arm), the distance \[rad, prismatic: m\], and its kind.
    IsElsewhere(usize, f64, JointKind),
    /// Two publishers sent this input.
    Rivals(Contended),
    /// A joint is too far from its setpoint: its number (from 1, arm after arm), the distance between its setpoint and its
    /// predicted position \[rad, prismatic: m\], and its kind.
    FellBehind(usize, f64, JointKind),
    /// A joint did not move as commanded: its number (from 1, arm after arm), and for how long \[s\].
    NotObeyed(usize, f64),
    /// The joint with this number (from 1, arm after arm) failed to move as commanded for the third time within 10 s.
    KeepsLosing(usize),
    /// For this time \[s\], TF lacked the frame with which the goal moves.
    FrameWasAway(f64),
    /// The goal's frame moves with the tool, so the arm would never reach the goal.
    MovesWithTool,
    /// The servo was stopped.
    Stopped,
    /// A twist moved the arm. This event revokes goals only.
    Jogged,
    /// The contact was too strong, or the measured wrench has the wrong sign.
    Contact(ContactFault),
    /// No wrench came for this time \[s\].
    WrenchWasAway(f64),
    /// The aim has changed.
    AnotherAim,
    /// The tool has changed.
    AnotherTool,
}

impl Revocation {
    /// Explains the revocation in words. `joint` names a joint by its number.
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
            Self::Rivals(Contended::Wrenches) => "two publishers gave wrenches".to_owned(),
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
                format!("TF did not have the goal's frame for {seconds:.1} s")
            }
            Self::MovesWithTool => {
                "the goal's frame moves with the tool, so that the arm can never reach it".to_owned()
            }
            Self::Stopped => "~/stop was called".to_owned(),
            Self::Jogged => "a twist on target_twist came".to_owned(),
            Self::Contact(fault) => fault.explain(),
            Self::WrenchWasAway(seconds) => format!("no wrench came for {seconds:.1} s"),
            Self::AnotherAim => "something else is controlled".to_owned(),
            Self::AnotherTool => "tool_offset was changed".to_owned(),
        }
    }

    /// Returns the name of the revocation in `~/status`.
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
            Self::Contact(_) => "contact",
            Self::WrenchWasAway(_) => "wrench_was_away",
            Self::AnotherAim => "another_task",
            Self::AnotherTool => "another_tool",
        }
    }
}
