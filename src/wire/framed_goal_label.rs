//! What a label says of goals in frames of TF.

use super::PoseNumbers;
use super::no_label::{NoLabel, parse};
use crate::servo::{GoalReading, Sent};
use std::fmt;
use std::str::FromStr;
use std::time::Duration;

/// What TF has made of a goal, as the cycle took it: a replay needs no TF.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FramedGoalLabel {
    /// Which of the goal messages it is, counted from 1.
    pub number: u64,
    /// What has become of it.
    pub outcome: FramedGoalOutcome,
}

/// What has become of a goal in a frame of TF.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FramedGoalOutcome {
    /// It was found there, after it had waited for so long, and taken.
    Taken(PlacedGoal, Duration),
    /// Its frame has taken it there.
    Moved(PlacedGoal),
    /// It is not known any more where its frame is.
    Lost,
}

/// A goal in the base frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlacedGoal {
    /// The stamp of the message, or of the transform \[ns\].
    pub stamp: i64,
    /// The pose: a shortest text of each number, which reads back to the last bit.
    pub pose: PoseNumbers,
}

impl PlacedGoal {
    /// The goal as the servo takes it.
    pub fn reading(&self) -> GoalReading<'static> {
        let [x, y, z, orientation_xyzw @ ..] = self.pose;
        GoalReading {
            position: [x, y, z],
            orientation_xyzw,
            frame_id: "",
            stamp: self.stamp,
            waited: Duration::ZERO,
            sent: Sent::default(),
        }
    }
}

/// What stands after the number of a goal that its frame has moved, and of one whose frame is lost.
const MOVED: &str = "~";
const LOST: &str = "!";

impl fmt::Display for FramedGoalLabel {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (mark, placed) = match &self.outcome {
            FramedGoalOutcome::Taken(placed, _) => ("", placed),
            FramedGoalOutcome::Moved(placed) => (MOVED, placed),
            FramedGoalOutcome::Lost => return write!(f, "{}{LOST}", self.number),
        };
        write!(f, "{}{mark}@{}", self.number, placed.stamp)?;
        placed.pose.iter().try_for_each(|number| write!(f, "@{number}"))?;
        match &self.outcome {
            FramedGoalOutcome::Taken(_, waited) => write!(f, "@{}", waited.as_nanos()),
            FramedGoalOutcome::Moved(_) | FramedGoalOutcome::Lost => Ok(()),
        }
    }
}

impl FromStr for FramedGoalLabel {
    type Err = NoLabel;
    fn from_str(text: &str) -> Result<Self, NoLabel> {
        let mut fields = text.split('@');
        let mut field = || fields.next().ok_or(NoLabel);
        let first = field()?;
        if let Some(number) = text.strip_suffix(LOST) {
            return Ok(Self { number: parse(number)?, outcome: FramedGoalOutcome::Lost });
        }
        let mut placed = PlacedGoal { stamp: parse(field()?)?, pose: PoseNumbers::default() };
        for slot in &mut placed.pose {
            *slot = parse(field()?)?;
        }
        let (number, outcome) = match first.strip_suffix(MOVED) {
            Some(number) => (number, FramedGoalOutcome::Moved(placed)),
            None => {
                // Labels of earlier versions do not say how long it waited.
                let waited = fields.next().map(parse).transpose()?.unwrap_or(0);
                (first, FramedGoalOutcome::Taken(placed, Duration::from_nanos(waited)))
            }
        };
        fields.next().is_none().then_some(Self { number: parse(number)?, outcome }).ok_or(NoLabel)
    }
}
