//! A scene: an arm's body, its keep-outs and keep-ins, and the pairs of these parts that can meet.

use super::{Body, Capsule, KeepOut, Name};
use dq_kinematics::arm::{Coupling, JointKind};
use serde::{Deserialize, Serialize};
use thiserror::Error;

/// Largest number of capsules in a body. It allows one capsule along the base and one along each link of the longest chain.
pub const MOST_CAPSULES: usize = 65;
/// Largest number of keep-outs and keep-ins together in a scene.
pub const MOST_KEEP_OUTS: usize = 64;
/// Largest number of pairs in a scene: all pairs of two capsules, and all pairs of a capsule and a keep-out.
pub const MOST_PAIRS: usize = MOST_CAPSULES * (MOST_CAPSULES - 1) / 2 + MOST_CAPSULES * MOST_KEEP_OUTS;

/// The reason why a scene is invalid.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum SceneError {
    /// There are this many capsules, which is too many.
    #[error("a body of {0} capsules: at most {MOST_CAPSULES} are possible")]
    Capsules(usize),
    /// There are too many keep-outs. The named keep-outs exceed the limit.
    #[error("at most {MOST_KEEP_OUTS} keep-outs and keep-ins are possible: no room for {}", names(.0))]
    KeepOuts(Vec<Name>),
}

fn names(of: &[Name]) -> String {
    of.iter().map(Name::as_str).collect::<Vec<_>>().join(", ")
}

/// The second part of a pair, with its index among the parts of its kind.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Against {
    Capsule(usize),
    KeepOut(usize),
    /// A keep-in, which a tool meets from inside.
    KeepIn(usize),
}

/// A pair of parts whose gap is checked. The first part is a capsule of the body or a tool.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Meeting {
    /// The index of the first part among the capsules of the body, followed by the tools.
    pub capsule: usize,
    pub against: Against,
    /// The index in [`Scene::levers`] of this pair's levers.
    pub levers: usize,
    /// The sum of the radii of both parts \[m\].
    pub radius: f64,
}

/// The names of the two parts of a pair.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Pair {
    /// Two parts of the body. Each number is that of the joint that moves the part, counted from 1, arm after arm; 0 for a part that
    /// is fixed to a base.
    Body(usize, usize),
    /// A part of the body and a keep-out.
    KeepOut(usize, Name),
    /// A tool and a keep-in.
    KeepIn(Tool, Name),
}

/// A tool of a scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Tool {
    /// The tool of a single arm.
    Only,
    /// The tool of the left arm.
    Left,
    /// The tool of the right arm.
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

/// Formats a length in millimeters.
fn millimeters(length: f64) -> String {
    let digits = if length < 1e-3 { 3 } else { 0 };
    format!("{:.digits$} mm", 1e3 * length)
}

impl Pair {
    /// Describes the pair in words. `joint` returns the name of the joint with a number.
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

    /// Describes the pair and its `gap` in words. The gap is the signed distance between the two parts \[m\]. It is negative if the
    /// parts overlap, or if the tool is outside its keep-in. `joint` returns the name of the joint with a number.
    pub fn explain_gap(&self, gap: f64, joint: impl Fn(usize) -> String) -> String {
        let (length, is_closed) = (millimeters(gap.abs()), gap < 0.0);
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

/// The reason why a pair is not checked.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Why {
    /// No joint moves one part relative to the other.
    Fixed,
    /// A single joint moves one part relative to the other, and the parts meet at this joint.
    Neighbours,
    /// Both are parts of the body, and they touch in nearly all configurations.
    Touch,
}

impl Why {
    /// Describes the reason in words.
    pub fn explain(self) -> &'static str {
        match self {
            Self::Fixed => "no joint between them",
            Self::Neighbours => "neighbours",
            Self::Touch => "they touch wherever the arm is",
        }
    }
}

/// A pair that is not checked, and the reason.
pub type LeftOut = (Pair, Why);

/// An arm's body with its keep-outs, its tools with their keep-ins, and the pairs of these parts that can meet.
#[derive(Clone, Debug, PartialEq)]
pub struct Scene {
    pub(super) body: Body,
    pub(super) keep_outs: Vec<KeepOut>,
    /// One capsule for each tool: a point without extent, the tool point.
    pub(super) tools: Vec<Capsule>,
    pub(super) keep_ins: Vec<KeepOut>,
    /// The levers [m/rad, prismatic: m/m]. There is one list for each part, then one list for each pair of capsules. Each list has
    /// one lever per joint. If the joint moves by x, no point of the part's segment moves by more than the lever times x. For a pair of
    /// capsules, this applies to the motion of one segment relative to the other.
    pub(super) levers: Vec<Vec<f64>>,
    pub(super) meetings: Vec<Meeting>,
    pub(super) left_out: Vec<LeftOut>,
    /// The coupling and the joint kind of each link, arm after arm. `Coupling::driver` is an index into the joints of all arms.
    pub(super) links: Vec<(Coupling, JointKind)>,
    pub(super) joint_count: usize,
}

impl Scene {
    /// Returns the pairs that are not checked: some pairs of two parts of the body, and pairs of a keep-out and a part that never
    /// moves.
    pub fn left_out(&self) -> &[LeftOut] {
        &self.left_out
    }

    /// Returns the keep-outs.
    pub fn keep_outs(&self) -> &[KeepOut] {
        &self.keep_outs
    }

    /// Returns the keep-ins of the tool, or of both tools of two arms, in the form of keep-outs.
    pub fn keep_ins(&self) -> &[KeepOut] {
        &self.keep_ins
    }

    /// Returns the body.
    pub fn body(&self) -> &Body {
        &self.body
    }

    /// Returns the number of pairs that are checked.
    pub fn pair_count(&self) -> usize {
        self.meetings.len()
    }

    /// Returns the number of joints that move the body.
    pub fn joint_count(&self) -> usize {
        self.joint_count
    }

    /// Returns the names of the two parts of the pair with the index `number`.
    pub fn pair(&self, number: usize) -> Pair {
        self.named(&self.meetings[number])
    }

    pub(super) fn named(&self, meeting: &Meeting) -> Pair {
        let driver = |link: usize| self.links[link].0.driver + 1;
        let of = |capsule: usize| self.part(capsule).link.checked_sub(1).map_or(0, driver);
        match meeting.against {
            Against::Capsule(other) => Pair::Body(of(meeting.capsule), of(other)),
            Against::KeepOut(other) => Pair::KeepOut(of(meeting.capsule), self.keep_outs[other].name),
            Against::KeepIn(other) => {
                let tool = meeting.capsule - self.body.capsules.len();
                Pair::KeepIn(Tool::of(tool, self.tools.len()), self.keep_ins[other].name)
            }
        }
    }

    /// Yields the parts that move with the arms: the capsules of the body, then the tools.
    pub(super) fn parts(&self) -> impl Iterator<Item = &Capsule> {
        self.body.capsules.iter().chain(&self.tools)
    }

    pub(super) fn part(&self, number: usize) -> &Capsule {
        self.body.capsules.get(number).unwrap_or_else(|| &self.tools[number - self.body.capsules.len()])
    }

    /// Returns an upper bound of the decrease of the gap of pair `number` \[m\] if each joint moves by `moves` \[rad, prismatic: m\]
    /// in either direction.
    pub fn travel(&self, number: usize, moves: impl Iterator<Item = f64>) -> f64 {
        travel(&self.levers[self.meetings[number].levers], moves)
    }

    /// Returns whether pair `number` is a tool and its keep-in. Because keep-ins are convex, the gap of a tool that moves on a
    /// straight line is smallest at one end of the line. So it is enough to check the two ends.
    pub fn is_inside(&self, number: usize) -> bool {
        matches!(self.meetings[number].against, Against::KeepIn(_))
    }

    /// Returns the sum of the radii of the two parts of pair `number` \[m\].
    pub fn radius(&self, number: usize) -> f64 {
        self.meetings[number].radius
    }
}

/// Returns an upper bound of the motion of a part \[m\] if each joint moves by `moves` \[rad, prismatic: m\]. `levers` are the part's
/// [levers](Scene::levers), one per joint.
pub(super) fn travel(levers: &[f64], moves: impl Iterator<Item = f64>) -> f64 {
    levers.iter().zip(moves).map(|(lever, by)| lever * by.abs()).sum()
}
