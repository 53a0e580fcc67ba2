//! The cycles of a recorded servo, each with the messages that it was made from.

use super::Timeline;
use super::timeline::Numbers;
use crate::record::BagMessage;
use crate::servo::Interface;
use crate::wire::messages::{Float64MultiArray, JointState, JointTrajectory};
use crate::wire::{ArmLabel, Command, CycleLabel, ServoKind, command_topic};
use std::collections::BTreeMap;
use std::time::Duration;

/// Goals are recorded at most this long \[ns\] before or after the first command that they had a part in.
const SAME_TIME: i64 = 1_000_000_000;

/// One cycle of the servo.
pub(super) struct Cycle<'a> {
    pub label: CycleLabel,
    /// What was sent, arm after arm: velocities or positions.
    pub command: Vec<f64>,
    /// When its last part was recorded \[ns\].
    logged: i64,
    /// Of each arm, the joint state that it was made from, if that is in the bag.
    pub joint_states: Vec<Option<&'a BagMessage>>,
    /// Goals that came since the cycle before, without those that are not in the bag.
    pub goals: Vec<&'a BagMessage>,
    /// The same of twists.
    pub twists: Vec<&'a BagMessage>,
}

/// The whole cycles of the node since it was last started, in their order, and how many commands of it there are from before; its
/// robot takes commands of that kind.
pub(super) fn cycles<'a>(
    kind: ServoKind,
    timeline: &'a Timeline,
    node: &str,
    interface: Interface,
) -> (Vec<Cycle<'a>>, u64) {
    let (namespace, _) = node.rsplit_once('/').unwrap_or_default();
    let namespace = format!("{namespace}/");
    let numbers = timeline.parameters(node).map(|known| known.numbers.clone()).unwrap_or_default();
    let topic = command_topic(interface);
    let (mut cycles, earlier) = match interface {
        Interface::Trajectory => commands::<JointTrajectory>(kind, timeline, &namespace, topic, &numbers),
        _ => commands::<Float64MultiArray>(kind, timeline, &namespace, topic, &numbers),
    };
    for (arm, prefix) in kind.arms().iter().enumerate() {
        let states = States::new(timeline.of(&format!("{namespace}{prefix}joint_states")));
        cycles.iter_mut().for_each(|cycle| cycle.joint_states.push(cycle.joint_state(arm, &states)));
    }
    // The last commands may come from states that came too late for the recording.
    let is_whole = |cycle: &Cycle| cycle.has_its_joint_states();
    cycles.truncate(cycles.iter().rposition(is_whole).map_or(0, |last| last + 1));
    let goals = timeline.of(&format!("{namespace}{}", kind.goal_topic()));
    give(&mut cycles, goals, |label| label.goals, |cycle| &mut cycle.goals);
    let twists = timeline.of(&format!("{node}/target_twist"));
    give(&mut cycles, twists, |label| label.twists, |cycle| &mut cycle.twists);
    give_sources(&mut cycles);
    (cycles, earlier)
}

impl<'a> Cycle<'a> {
    /// Whether the arms rested before it, sent nothing yet: this was the first command since the node's start.
    pub fn is_first(&self) -> bool {
        self.label.sent == 1 && !self.label.arms.iter().any(|arm| arm.figures.came)
    }

    /// Whether its command, of that kind, lets the arms rest.
    pub fn rests(&self, interface: Interface) -> bool {
        match interface {
            Interface::Velocity => self.command.iter().all(|speed| *speed == 0.0),
            Interface::Position | Interface::Trajectory => self.label.rests,
        }
    }

    /// The joint velocities of its command of that kind, as far as it says them.
    pub fn speeds(&self, interface: Interface) -> Option<&[f64]> {
        let speeds = if interface.takes_positions() { &self.label.speeds } else { &self.command };
        (speeds.len() == self.command.len()).then_some(speeds)
    }

    /// Whether it is the servo's next one after `before`.
    pub fn follows(&self, before: &Self) -> bool {
        self.label.sent == before.label.sent.saturating_add(1)
    }

    /// Whether the joint states are in the bag from which its command was made.
    pub fn has_its_joint_states(&self) -> bool {
        let mut arms = self.label.arms.iter().zip(&self.joint_states);
        arms.all(|(arm, state)| arm.count == 0 || state.is_some())
    }

    fn joint_state(&self, arm: usize, states: &States<'a>) -> Option<&'a BagMessage> {
        let ArmLabel { stamp, digest, .. } = self.label.arms.get(arm)?;
        // Of a robot that does not stamp, or by a simulated clock, many have one stamp.
        let is_it = |digest_of: &u64| digest.is_none_or(|digest| digest == *digest_of);
        let mut candidates = states.0.get(stamp)?.iter().filter(|(digest_of, _)| is_it(digest_of));
        let newest = candidates.clone().rev().find(|(_, state)| state.log_time <= self.logged);
        newest.or_else(|| candidates.next()).map(|(_, state)| *state)
    }
}

/// The cycles of the last life whose commands to all arms are there, and how many cycles earlier lives have.
fn commands<'a, M: Command>(
    kind: ServoKind,
    timeline: &Timeline,
    namespace: &str,
    topic: &str,
    numbers: &Numbers,
) -> (Vec<Cycle<'a>>, u64) {
    let mut cycles = BTreeMap::new();
    let mut last_life = 0;
    for (arm, prefix) in kind.arms().iter().enumerate() {
        let (mut life, mut last) = (0_u64, None::<CycleLabel>);
        for message in timeline.of(&format!("{namespace}{prefix}{topic}")) {
            let Ok(command) = message.decode::<M>() else { continue };
            let label = command.label().map(|label| numbers.in_label(label));
            let Some(label) = label.filter(|label| label.arms.len() == kind.arms().len()) else {
                continue;
            };
            life += u64::from(last.is_some_and(|last| label.is_of_another_life(&last)));
            last = Some(label.clone());
            last_life = life.max(last_life);
            let (_, parts, logged) = cycles
                .entry((life, label.now))
                .or_insert_with(|| (label, vec![None; kind.arms().len()], message.log_time));
            parts[arm] = Some(command.numbers());
            *logged = message.log_time.max(*logged);
        }
    }
    let of_last_life = cycles.split_off(&(last_life, Duration::ZERO));
    let whole = of_last_life
        .into_values()
        .filter_map(|(label, parts, logged)| {
            let command = parts.into_iter().collect::<Option<Vec<_>>>()?.concat();
            Some(Cycle {
                label,
                command,
                logged,
                joint_states: Vec::new(),
                goals: Vec::new(),
                twists: Vec::new(),
            })
        })
        .collect();
    (whole, cycles.len() as u64)
}

/// The joint states of an arm by their stamps \[ns\], each with its digest; damaged ones are none.
struct States<'a>(BTreeMap<i64, Vec<(u64, &'a BagMessage)>>);

impl<'a> States<'a> {
    fn new(states: &'a [BagMessage]) -> Self {
        let mut by_stamp = BTreeMap::<_, Vec<_>>::new();
        for message in states {
            if let Ok(state) = message.decode::<JointState>() {
                let stamped = by_stamp.entry(state.header.stamp.nanoseconds()).or_default();
                stamped.push((ArmLabel::digest_of(&state), message));
            }
        }
        Self(by_stamp)
    }
}

/// Gives each cycle the messages of a topic that came with it, into its `slot`; `count` is how many its label has seen: all in their
/// order where there are as many as the labels count, else those that were recorded at its time.
fn give<'a>(
    cycles: &mut [Cycle<'a>],
    messages: &'a [BagMessage],
    count: impl Fn(&CycleLabel) -> u64,
    slot: impl for<'c> Fn(&'c mut Cycle<'a>) -> &'c mut Vec<&'a BagMessage>,
) {
    let counts: Vec<_> = cycles.iter().map(|cycle| count(&cycle.label)).collect();
    let first = cycles.first().is_some_and(Cycle::is_first);
    let came = |i: usize| match i {
        0 if first => counts[0],
        0 => 0,
        i => counts[i].saturating_sub(counts[i - 1]),
    };
    let all = (0..counts.len()).map(came).fold(0, u64::saturating_add);
    let in_order = all == messages.len() as u64;
    let mut messages = messages.iter().peekable();
    for (i, cycle) in cycles.iter_mut().enumerate() {
        let from = cycle.logged.saturating_sub(SAME_TIME);
        while came(i) > 0 && !in_order && messages.next_if(|message| message.log_time < from).is_some() {}
        let to = if in_order { i64::MAX } else { cycle.logged.saturating_add(SAME_TIME) };
        while (slot(cycle).len() as u64) < came(i)
            && let Some(message) = messages.next_if(|message| message.log_time <= to)
        {
            slot(cycle).push(message);
        }
    }
}

/// The first command, and one after a silence, may come from joint states that were heard before its cycle: they are from whom the
/// next ones are from.
fn give_sources(cycles: &mut [Cycle]) {
    let arms = cycles.first().map_or(0, |first| first.label.arms.len());
    for arm in 0..arms {
        let mut next = None;
        for cycle in cycles.iter_mut().rev() {
            let (begins, of_arm) = (cycle.is_first() || cycle.label.anew, &mut cycle.label.arms[arm]);
            if begins && of_arm.sources.is_empty() {
                of_arm.sources.extend(next);
            }
            next = of_arm.sources.first().copied().or(next);
        }
    }
}
