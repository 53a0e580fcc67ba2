//! An arm's body among what it must keep out of: which pairs of the two can meet.

use super::{Body, Capsule, KeepOut, Name};
use serde::{Deserialize, Serialize};
use thiserror::Error;

/// The most capsules that a body may have.
pub const MOST_CAPSULES: usize = 32;
/// The most keep-outs and keep-ins together that a scene may have.
pub const MOST_KEEP_OUTS: usize = 64;
/// The most pairs that a scene may have: each two capsules, and each capsule with each keep-out.
pub const MOST_PAIRS: usize = MOST_CAPSULES * (MOST_CAPSULES - 1) / 2 + MOST_CAPSULES * MOST_KEEP_OUTS;

/// Why there is no such scene.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum SceneError {
    /// There are more capsules than there may be.
    #[error("a body of {0} capsules: there may be {MOST_CAPSULES}")]
    Capsules(usize),
    /// There are more keep-outs than there may be; these have no room.
    #[error("there may be {MOST_KEEP_OUTS} keep-outs, keep-ins among them: no room for {}", names(.0))]
    KeepOuts(Vec<Name>),
}

fn names(of: &[Name]) -> String {
    of.iter().map(Name::as_str).collect::<Vec<_>>().join(", ")
}

/// The other part of a pair, by its number, counted from 0.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Against {
    Capsule(usize),
    KeepOut(usize),
    /// A keep-in, which a tool meets from inside.
    KeepIn(usize),
}

/// A pair that may meet.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Meeting {
    /// A capsule of the body or, counted on, a tool.
    pub capsule: usize,
    pub against: Against,
    /// The number of its levers in those of the scene.
    pub levers: usize,
    /// Both radii together \[m\].
    pub radius: f64,
}

/// The names of a pair that may meet.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Pair {
    /// Two parts of the body, by the joints that move them, counted from 1, arm after arm; 0 for a base.
    Body(usize, usize),
    /// A part of the body and what it must keep out of.
    KeepOut(usize, Name),
    /// A tool and what it must stay in.
    KeepIn(Tool, Name),
}

/// Which tool of a scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Tool {
    /// Of an arm alone.
    Only,
    /// Of the left arm of two.
    Left,
    /// Of the right arm of two.
    Right,
}

impl Tool {
    fn of(number: usize, count: usize) -> Self {
        match (number, count) {
            (_, 1) => Self::Only,
            (0, _) => Self::Left,
            _ => Self::Right,
        }
    }

    fn explain(self) -> &'static str {
        match self {
            Self::Only => "the tool",
            Self::Left => "the left tool",
            Self::Right => "the right tool",
        }
    }
}

/// A length in words.
fn millimetres(length: f64) -> String {
    let digits = if length < 1e-3 { 3 } else { 0 };
    format!("{:.digits$} mm", 1e3 * length)
}

impl Pair {
    /// The pair in words; `joint` names a joint by its number.
    pub fn explain(&self, joint: impl Fn(usize) -> String) -> String {
        let link = |number: usize| match number {
            0 => "the base".to_owned(),
            number => format!("the link of {}", joint(number)),
        };
        match self {
            Self::Body(one, other) => format!("{} and {}", link(*one), link(*other)),
            Self::KeepOut(one, name) => format!("{} and {name}", link(*one)),
            Self::KeepIn(tool, name) => format!("{} and {name}", tool.explain()),
        }
    }

    /// The pair in words with its gap \[m\], which is negative where the two are in each other, or the tool is outside.
    pub fn explain_gap(&self, gap: f64, joint: impl Fn(usize) -> String) -> String {
        let (length, is_closed) = (millimetres(gap.abs()), gap < 0.0);
        match self {
            Self::KeepIn(tool, name) if is_closed => format!("{} is {length} outside {name}", tool.explain()),
            Self::KeepIn(tool, name) => format!("{} is {length} from the edge of {name}", tool.explain()),
            _ => format!(
                "{} are {length} {}",
                self.explain(joint),
                if is_closed { "in each other" } else { "apart" }
            ),
        }
    }
}

/// Why a pair is not looked at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Why {
    /// No joint moves one against the other.
    Fixed,
    /// One joint alone moves one against the other, and they meet in it.
    Neighbours,
    /// Two parts of the body that touch in nearly all configurations.
    Touch,
}

impl Why {
    /// In words.
    pub fn explain(self) -> &'static str {
        match self {
            Self::Fixed => "no joint between them",
            Self::Neighbours => "neighbours",
            Self::Touch => "they touch wherever the arm is",
        }
    }
}

/// A pair that is not looked at, and why.
pub type LeftOut = (Pair, Why);

/// A body and what it must keep out of, tools and what they must stay in, and the pairs that can meet.
#[derive(Clone, Debug, PartialEq)]
pub struct Scene {
    pub(super) body: Body,
    pub(super) keep_outs: Vec<KeepOut>,
    /// A point each.
    pub(super) tools: Vec<Capsule>,
    pub(super) keep_ins: Vec<KeepOut>,
    /// By how much a part moves, or one capsule against another, at most, for each joint's motion [m/rad, prismatic: m/m]: those of
    /// each capsule first.
    pub(super) levers: Vec<Vec<f64>>,
    pub(super) meetings: Vec<Meeting>,
    pub(super) left_out: Vec<LeftOut>,
    pub(super) joint_count: usize,
}

impl Scene {
    /// The pairs of the body that are not looked at, and what no joint moves against a keep-out.
    pub fn left_out(&self) -> &[LeftOut] {
        &self.left_out
    }

    /// What is to be kept out of.
    pub fn keep_outs(&self) -> &[KeepOut] {
        &self.keep_outs
    }

    /// What the tool, of two arms each tool, is to stay in, written as keep-outs are.
    pub fn keep_ins(&self) -> &[KeepOut] {
        &self.keep_ins
    }

    /// The body.
    pub fn body(&self) -> &Body {
        &self.body
    }

    /// How many pairs are looked at.
    pub fn pair_count(&self) -> usize {
        self.meetings.len()
    }

    /// How many joints move the body.
    pub fn joint_count(&self) -> usize {
        self.joint_count
    }

    /// The pair of that number.
    pub fn pair(&self, number: usize) -> Pair {
        self.named(&self.meetings[number])
    }

    pub(super) fn named(&self, meeting: &Meeting) -> Pair {
        let of = |capsule: usize| self.part(capsule).joint;
        match meeting.against {
            Against::Capsule(other) => Pair::Body(of(meeting.capsule), of(other)),
            Against::KeepOut(other) => Pair::KeepOut(of(meeting.capsule), self.keep_outs[other].name),
            Against::KeepIn(other) => {
                let tool = meeting.capsule - self.body.capsules.len();
                Pair::KeepIn(Tool::of(tool, self.tools.len()), self.keep_ins[other].name)
            }
        }
    }

    /// What moves with the arms: the capsules of the body, then the tools.
    pub(super) fn parts(&self) -> impl Iterator<Item = &Capsule> {
        self.body.capsules.iter().chain(&self.tools)
    }

    pub(super) fn part(&self, number: usize) -> &Capsule {
        self.body.capsules.get(number).unwrap_or_else(|| &self.tools[number - self.body.capsules.len()])
    }

    /// By how much \[m\] the gap of a pair shrinks at most while each joint moves by so much \[rad, prismatic: m\], to either side.
    pub fn travel(&self, number: usize, moves: impl Iterator<Item = f64>) -> f64 {
        travel(&self.levers[self.meetings[number].levers], moves)
    }

    /// Whether the pair is a tool and what it must stay in: along a straight line the gap is nowhere less than at both ends, as the shape is
    /// convex.
    pub fn is_inside(&self, number: usize) -> bool {
        matches!(self.meetings[number].against, Against::KeepIn(_))
    }

    /// How far the cores of a pair are apart where its gap is 0 \[m\].
    pub fn radius(&self, number: usize) -> f64 {
        self.meetings[number].radius
    }
}

/// How far \[m\] what has these levers moves at most while each joint moves by so much \[rad, prismatic: m\].
pub(super) fn travel(levers: &[f64], moves: impl Iterator<Item = f64>) -> f64 {
    levers.iter().zip(moves).map(|(lever, by)| lever * by.abs()).sum()
}
