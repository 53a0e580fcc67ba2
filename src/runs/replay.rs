//! A recorded run once more, without DDS: its goals, joint states and parameters through the servo cycle, at the cycle's
//! own times, and the commands beside those recorded.

use super::replay_inputs::{Inputs, are_recorded, recorded_states};
use super::{RunError, Timeline};
use crate::config::{CycleParameters, NodeParameters};
use crate::nodes::{CycleLabel, Wiring};
use crate::record::Bag;
use crate::ros::messages::Float64MultiArray;
use crate::servo::{OneArm, TwoArms};
use serde::Serialize;
use std::collections::BTreeMap;

/// A servo's commands, recorded and replayed.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Replayed {
    /// The servo's node.
    pub node: String,
    /// Commands compared.
    pub commands: u64,
    /// Commands that differ in any bit.
    pub different: u64,
    /// Largest difference of a joint's command [rad/s].
    pub largest_difference: f64,
    /// The cycle's time of the first command that differs, from the first one on \[s\].
    pub first_difference_s: Option<f64>,
    /// Inputs that the recorder missed: commands after them may differ.
    pub inputs_missing: u64,
}

/// Replays every servo of a bag.
///
/// # Errors
/// [`RunError::NotReplayable`] where the bag has no servo with its parameters, or begins in the midst of a motion.
pub fn replay(bag: &Bag) -> Result<Vec<Replayed>, RunError> {
    let timeline = Timeline::read(bag)?;
    let mut replayed = Vec::new();
    for node in timeline.nodes_with(OneArm::OWN_PARAMETER) {
        replayed.push(replay_node::<OneArm>(&timeline, node)?);
    }
    for node in timeline.nodes_with(TwoArms::OWN_PARAMETER) {
        replayed.push(replay_node::<TwoArms>(&timeline, node)?);
    }
    match replayed.is_empty() {
        true => Err(RunError::NotReplayable(
            "no servo tells in /parameter_events with what it started (`dq_servo record` records that)"
                .to_owned(),
        )),
        false => Ok(replayed),
    }
}

fn replay_node<T: Wiring>(timeline: &Timeline, node: &str) -> Result<Replayed, RunError>
where
    CycleParameters<T>: NodeParameters,
{
    let (namespace, _) = node.rsplit_once('/').unwrap_or_default();
    let namespace = format!("{namespace}/");
    let joint_states = recorded_states::<T>(timeline, &namespace);
    let mut cycles = cycles::<T>(timeline, &namespace);
    // The first commands may come from joint states of before the recording, the last ones from states that came too late for it.
    let is_whole = |cycle: &Cycle| are_recorded(&cycle.label, &joint_states);
    cycles.truncate(cycles.iter().rposition(is_whole).map_or(0, |last| last + 1));
    cycles.drain(..cycles.iter().position(is_whole).unwrap_or_default());
    let Some(first) = cycles.first() else {
        let why = format!("{node} has no commands that tell what they were made from");
        return Err(RunError::NotReplayable(why));
    };
    // A robot that moves when its servo starts is braked from its speed: that is a beginning too.
    let begins = first.label.arms.iter().any(|arm| arm.figures.came);
    if !begins && first.command.iter().any(|speed| *speed != 0.0) {
        let why = format!("it begins while {node} moves the arm");
        return Err(RunError::NotReplayable(why));
    }
    let mut inputs = Inputs::<T>::new(timeline, &namespace, node, &first.label, joint_states)?;
    let mut replayed = Replayed {
        node: node.to_owned(),
        commands: 0,
        different: 0,
        largest_difference: 0.0,
        first_difference_s: None,
        inputs_missing: 0,
    };
    for cycle in &cycles {
        let command = inputs.cycle(&cycle.label, cycle.logged)?;
        replayed.compare(
            command,
            &cycle.command,
            cycle.label.now.saturating_sub(first.label.now).as_secs_f64(),
        );
    }
    replayed.inputs_missing = inputs.missing();
    Ok(replayed)
}

impl Replayed {
    fn compare(&mut self, replayed: &[f64], recorded: &[f64], time: f64) {
        self.commands += 1;
        if replayed.iter().zip(recorded).any(|(a, b)| a.to_bits() != b.to_bits()) {
            let differences = replayed.iter().zip(recorded).map(|(a, b)| (a - b).abs());
            self.different += 1;
            self.largest_difference = differences.fold(self.largest_difference, f64::max);
            self.first_difference_s.get_or_insert(time);
        }
    }
}

/// One cycle of the servo.
struct Cycle {
    label: CycleLabel,
    /// Arm after arm.
    command: Vec<f64>,
    /// When its last part was recorded \[ns\].
    logged: i64,
}

/// The cycles that are whole, in their order.
fn cycles<T: Wiring>(timeline: &Timeline, namespace: &str) -> Vec<Cycle> {
    let mut cycles = BTreeMap::new();
    for (arm, prefix) in T::ARMS.iter().enumerate() {
        let topic = format!("{namespace}{prefix}forward_velocity_controller/commands");
        for (logged, command) in timeline.of::<Float64MultiArray>(&topic) {
            let label = CycleLabel::of(&command);
            let Some(label) = label.filter(|label| label.arms.len() == T::ARMS.len()) else {
                continue;
            };
            let (_, parts, last) =
                cycles.entry(label.now).or_insert((label, vec![None; T::ARMS.len()], logged));
            parts[arm] = Some(command.data);
            *last = logged.max(*last);
        }
    }
    let whole = |(label, parts, logged): (CycleLabel, Vec<Option<Vec<f64>>>, i64)| {
        let parts: Option<Vec<_>> = parts.into_iter().collect();
        Some(Cycle { label, command: parts?.concat(), logged })
    };
    cycles.into_values().filter_map(whole).collect()
}
