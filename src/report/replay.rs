//! A recorded run once more, without DDS: its goals, joint states and parameters through the servo cycle, at the cycle's
//! own times, and the commands beside those recorded.

use super::ReportError;
use super::timeline::{Timeline, decode};
use crate::config::{CycleParameters, NodeParameters, ParameterStore, Value};
use crate::nodes::{CycleLabel, Wiring};
use crate::record::Bag;
use crate::ros::ParameterEvent;
use crate::ros::messages::{Float64MultiArray, JointState, PoseStamped};
use crate::servo::{OneArm, Servo, TwoArms};
use serde::Serialize;
use std::collections::{BTreeMap, VecDeque};

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
/// [`ReportError::NotReplayable`] where the bag has no servo with its parameters, or begins in the midst of a motion.
pub fn replay(bag: &Bag) -> Result<Vec<Replayed>, ReportError> {
    let timeline = Timeline::read(bag)?;
    let servo = |(node, changes): (&String, &Vec<ParameterEvent>)| {
        let of = |name: &str| changes[0].new_parameters.iter().any(|parameter| parameter.name == name);
        match (of("primitive"), of("controller")) {
            (true, _) => Some(replay_node::<TwoArms>(&timeline, node, changes)),
            (false, true) => Some(replay_node::<OneArm>(&timeline, node, changes)),
            (false, false) => None,
        }
    };
    let replayed: Vec<_> = timeline.parameters().iter().filter_map(servo).collect::<Result<_, _>>()?;
    match replayed.is_empty() {
        true => Err(ReportError::NotReplayable(
            "it has no /parameter_events of a servo's start: record with `dq_servo record`".to_owned(),
        )),
        false => Ok(replayed),
    }
}

fn replay_node<T: Wiring>(
    timeline: &Timeline,
    node: &str,
    events: &[ParameterEvent],
) -> Result<Replayed, ReportError>
where
    CycleParameters<T>: NodeParameters,
{
    let (namespace, _) = node.rsplit_once('/').unwrap_or_default();
    let topic = |name: &str| format!("{namespace}/{name}");
    let mut inputs = Inputs::<T>::new(timeline, &topic, events)?;
    let commands: Vec<_> = T::ARMS
        .iter()
        .map(|arm| {
            decode::<Float64MultiArray>(
                timeline.of(&topic(&format!("{arm}forward_velocity_controller/commands"))),
            )
        })
        .collect();
    let mut replayed = Replayed {
        node: node.to_owned(),
        commands: 0,
        different: 0,
        largest_difference: 0.0,
        first_difference_s: None,
        inputs_missing: 0,
    };
    let mut begun = None;
    for cycle in cycles(&commands) {
        let (label, recorded) = cycle;
        if begun.is_none() && !inputs.may_begin(&label, &recorded)? {
            continue;
        }
        let start = *begun.get_or_insert(label.now);
        let command = inputs.cycle(&label)?;
        replayed.commands += 1;
        let difference = command.iter().zip(&recorded).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        if command.iter().zip(&recorded).any(|(a, b)| a.to_bits() != b.to_bits()) {
            replayed.different += 1;
            replayed.largest_difference = replayed.largest_difference.max(difference);
            replayed.first_difference_s.get_or_insert((label.now - start).as_secs_f64());
        }
    }
    replayed.inputs_missing = inputs.missing;
    match replayed.commands {
        0 => Err(ReportError::NotReplayable(format!(
            "{node} has no commands that tell what they were made from"
        ))),
        _ => Ok(replayed),
    }
}

/// Each cycle's label and command, arm after arm, in the order of the cycle; incomplete ones are left out.
fn cycles(commands: &[Vec<(i64, Float64MultiArray)>]) -> Vec<(CycleLabel, Vec<f64>)> {
    let mut cycles = BTreeMap::new();
    for (arm, list) in commands.iter().enumerate() {
        for (_, command) in list {
            let label = command.layout.dim.first().and_then(|dim| dim.label.parse::<CycleLabel>().ok());
            let Some(label) = label else { continue };
            let (_, parts) = cycles.entry(label.now).or_insert((label, vec![None; commands.len()]));
            parts[arm] = Some(&command.data);
        }
    }
    let whole = |(label, parts): (CycleLabel, Vec<Option<&Vec<f64>>>)| {
        let parts: Option<Vec<_>> = parts.into_iter().collect();
        parts.map(|parts| (label, parts.into_iter().flatten().copied().collect()))
    };
    cycles.into_values().filter_map(whole).collect()
}

/// The servo with what is still to come to it.
struct Inputs<T: Wiring>
where
    CycleParameters<T>: NodeParameters,
{
    servo: Servo<T>,
    store: ParameterStore,
    changes: VecDeque<ParameterEvent>,
    joint_states: Vec<BTreeMap<i64, JointState>>,
    goals: VecDeque<PoseStamped>,
    last: CycleLabel,
    missing: u64,
}

impl<T: Wiring> Inputs<T>
where
    CycleParameters<T>: NodeParameters,
{
    fn new(
        timeline: &Timeline,
        topic: &impl Fn(&str) -> String,
        events: &[ParameterEvent],
    ) -> Result<Self, ReportError> {
        let mut store = CycleParameters::<T>::store();
        for parameter in &events[0].new_parameters {
            if let Some(value) = parameter.value.clone().into_value() {
                store.override_initial(&parameter.name, value)?;
            }
        }
        let CycleParameters { task, joints, goal_frame, settings, period, .. } =
            CycleParameters::<T>::from_store(&store)?;
        let states = |arm: &&str| {
            let states = decode::<JointState>(timeline.of(&topic(&format!("{arm}joint_states"))));
            states.into_iter().map(|(_, state)| (state.header.stamp.nanoseconds(), state)).collect()
        };
        Ok(Self {
            servo: Servo::new(task, joints, &goal_frame, settings, period)?,
            store,
            changes: events[1..].iter().cloned().collect(),
            joint_states: T::ARMS.iter().map(states).collect(),
            goals: decode(timeline.of(&topic(T::GOAL))).into_iter().map(|(_, goal)| goal).collect(),
            last: CycleLabel { joint_states: vec![0; T::ARMS.len()], ..CycleLabel::default() },
            missing: 0,
        })
    }

    /// Whether the replay may begin with this cycle: at rest, and with no goal that the bag does not have.
    fn may_begin(&mut self, label: &CycleLabel, recorded: &[f64]) -> Result<bool, ReportError> {
        if recorded.iter().any(|speed| *speed != 0.0) {
            return Err(ReportError::NotReplayable("the bag begins in the midst of a motion".to_owned()));
        }
        // What was seen before the bag began is over: the arm rests.
        self.last.goals = label.goals;
        self.last.stops = label.stops;
        Ok(true)
    }

    /// One cycle with the inputs that its label names.
    fn cycle(&mut self, label: &CycleLabel) -> Result<Vec<f64>, ReportError> {
        while self.last.settings < label.settings {
            self.last.settings += 1;
            self.change_parameters()?;
        }
        if self.last.stops < label.stops {
            self.servo.stop();
        } else if self.last.paused != label.paused {
            self.servo.pause(label.paused);
        }
        for (arm, stamp) in label.joint_states.iter().enumerate() {
            if self.last.joint_states.get(arm) != Some(stamp) {
                self.take_joint_state(arm, *stamp, label);
            }
        }
        let mut newest = None;
        for _ in self.last.goals..label.goals {
            newest = self.goals.pop_front();
            self.missing += u64::from(newest.is_none());
        }
        if let Some(goal) = newest {
            let (p, o) = (goal.pose.position, goal.pose.orientation);
            // A goal that the servo rejected is rejected again.
            let _ =
                self.servo.take_goal([p.x, p.y, p.z], [o.x, o.y, o.z, o.w], &goal.header.frame_id, label.now);
        }
        self.last.clone_from(label);
        Ok(self.servo.step(label.now)?.to_vec())
    }

    fn take_joint_state(&mut self, arm: usize, stamp: i64, label: &CycleLabel) {
        match self.joint_states.get(arm).and_then(|states| states.get(&stamp)) {
            Some(state) => {
                let _ = self.servo.take_joint_state(arm, &state.name, &state.position, label.now);
            }
            None => self.missing += 1,
        }
    }

    fn change_parameters(&mut self) -> Result<(), ReportError> {
        let Some(event) = self.changes.pop_front() else {
            self.missing += 1;
            return Ok(());
        };
        let changes = event.changed_parameters.into_iter();
        let changes: Vec<(String, Value)> =
            changes.filter_map(|parameter| Some((parameter.name, parameter.value.into_value()?))).collect();
        self.store = self.store.with(&changes)?;
        self.servo.configure(CycleParameters::<T>::from_store(&self.store)?.settings);
        Ok(())
    }
}
