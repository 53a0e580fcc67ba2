//! What a command was made from, told in the label of its layout: with it a bag can be replayed to the last bit.

use crate::ros::messages::Float64MultiArray;
use std::fmt;
use std::str::FromStr;
use std::time::Duration;

/// What the cycle had seen when it made a command. Counts are since the node's start.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct CycleLabel {
    /// The cycle's own clock.
    pub now: Duration,
    /// Of each arm, how many joint states it has taken, and the stamp \[ns\] of the last.
    pub joint_states: Vec<(u64, i64)>,
    /// Goal messages seen.
    pub goals: u64,
    /// Changes of parameters taken into force.
    pub settings: u64,
    /// Requests to pause or to go on.
    pub pauses: u64,
    /// Whether the servo is paused.
    pub paused: bool,
    /// How often it was stopped.
    pub stops: u64,
}

impl CycleLabel {
    /// Before the first cycle of a servo of so many arms.
    pub fn new(arm_count: usize) -> Self {
        Self { joint_states: vec![(0, 0); arm_count], ..Self::default() }
    }

    /// The one that the command carries; none if it is from another program.
    pub fn of(command: &Float64MultiArray) -> Option<Self> {
        command.layout.dim.first()?.label.parse().ok()
    }
}

impl fmt::Display for CycleLabel {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "now={} joint_states=", self.now.as_nanos())?;
        for (i, (count, stamp)) in self.joint_states.iter().enumerate() {
            write!(f, "{}{count}@{stamp}", if i > 0 { "," } else { "" })?;
        }
        let Self { goals, settings, pauses, stops, .. } = self;
        let paused = u8::from(self.paused);
        write!(f, " goals={goals} settings={settings} pauses={pauses} paused={paused} stops={stops}")
    }
}

/// A text that is no label, as commands from another program have it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NoLabel;

impl FromStr for CycleLabel {
    type Err = NoLabel;
    fn from_str(text: &str) -> Result<Self, NoLabel> {
        let mut fields = text.split(' ');
        let mut field = |name: &str| {
            let (key, value) = fields.next().and_then(|field| field.split_once('=')).ok_or(NoLabel)?;
            if key == name { Ok(value) } else { Err(NoLabel) }
        };
        let number = |text: &str| text.parse::<u64>().map_err(|_| NoLabel);
        let label = Self {
            now: Duration::from_nanos(number(field("now")?)?),
            joint_states: field("joint_states")?.split(',').map(joint_state).collect::<Result<_, _>>()?,
            goals: number(field("goals")?)?,
            settings: number(field("settings")?)?,
            pauses: number(field("pauses")?)?,
            paused: number(field("paused")?)? > 0,
            stops: number(field("stops")?)?,
        };
        fields.next().is_none().then_some(label).ok_or(NoLabel)
    }
}

fn joint_state(text: &str) -> Result<(u64, i64), NoLabel> {
    let (count, stamp) = text.split_once('@').ok_or(NoLabel)?;
    Ok((count.parse().map_err(|_| NoLabel)?, stamp.parse().map_err(|_| NoLabel)?))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn a_label_reads_back_as_it_was() {
        let label = CycleLabel {
            now: Duration::from_nanos(1_234_567_890_123),
            joint_states: vec![(7, 1_795_242_920_633_002_124), (9, -5)],
            goals: 3,
            settings: 1,
            pauses: 3,
            paused: true,
            stops: 2,
        };
        assert_eq!(label.to_string().parse(), Ok(label));
        for text in
            ["", "joint", "now=1", "now=1 joint_states=5 goals=0 settings=0 pauses=0 paused=0 stops=0"]
        {
            assert_eq!(text.parse::<CycleLabel>(), Err(NoLabel), "{text:?}");
        }
    }

    proptest! {
        #[test]
        fn no_text_panics(text in ".{0,60}") {
            let _ = text.parse::<CycleLabel>();
        }
    }
}
