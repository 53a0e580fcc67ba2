//! A recorded run as figures need it: made from joint states, goals and commands alone, so that any bag of such a run will do.

use super::ReportError;
use super::timeline::{Timeline, decode};
use crate::config::{CycleParameters, DualParameters, NodeParameters, ServoParameters};
use crate::dq::UnitDualQuaternion;
use crate::nodes::{CycleLabel, Wiring};
use crate::ros::ParameterEvent;
use crate::ros::messages::{DiagnosticStatus, Float64MultiArray, JointState, PoseStamped};
use crate::servo::{Figures, Goal, GoalError, JointOrder, Limits, Motion, OneArm, Task, TwoArms};
use serde::Serialize;
use std::time::Duration;

/// One servo's run.
#[derive(Clone, Debug)]
pub struct Recorded {
    /// The namespace, and for two arms their servo's.
    pub name: String,
    /// Joint names, arm after arm.
    pub joints: Vec<String>,
    /// At each joint state.
    pub samples: Vec<Sample>,
    /// Commands with their times \[s\] [rad/s].
    pub commands: Vec<(f64, Vec<f64>)>,
    /// How far each cycle was from its period \[s\] \[ms\].
    pub jitter: Vec<(f64, f64)>,
    /// When goal, law or state changed.
    pub changes: Vec<Change>,
    /// The motion to each goal.
    pub motions: Vec<MotionRow>,
    /// What the commands should keep to.
    pub limits: Limits,
}

/// The run at one time.
#[derive(Clone, Debug)]
pub struct Sample {
    /// From the first goal on \[s\].
    pub time: f64,
    /// \[rad\]
    pub positions: Vec<f64>,
    /// [rad/s]; empty where the robot does not tell.
    pub velocities: Vec<f64>,
    /// The controlled pose.
    pub pose: UnitDualQuaternion,
    /// From the goal in force.
    pub error: Option<GoalError>,
    /// Of the Jacobian of what is controlled.
    pub smallest_singular_value: f64,
}

/// What changed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum What {
    /// The goal.
    Goal,
    /// The law.
    Law,
    /// The servo's state.
    State,
}

/// A change during the run.
#[derive(Clone, Debug)]
pub struct Change {
    /// \[s\]
    pub time: f64,
    /// What changed.
    pub what: What,
    /// To what.
    pub to: String,
}

/// The motion to one goal.
#[derive(Clone, Debug, Serialize)]
pub struct MotionRow {
    /// The bag and the servo.
    pub run: String,
    /// From 1.
    pub goal: usize,
    /// The law when the goal came, if the bag tells.
    pub law: Option<String>,
    /// When the goal came \[s\].
    pub start_s: f64,
    /// To 2 %, none where it has not.
    pub settling_time_rotation_s: Option<f64>,
    /// To 2 %, none where it has not.
    pub settling_time_position_s: Option<f64>,
    /// Length of the tool's path.
    pub path_length_m: f64,
    /// From the start to where the tool was in the end.
    pub straight_line_m: f64,
    /// The one by the other.
    pub path_ratio: f64,
    /// Past the goal along the line from the start.
    pub overshoot_mm: f64,
    /// Of the commands.
    pub peak_joint_speed_rad_s: f64,
    /// `∫|θ̇|² dt` [rad²/s].
    pub effort: f64,
    /// How often the servo said `stalled`.
    pub stalls: usize,
    /// In the end.
    pub position_error_mm: f64,
    /// In the end.
    pub rotation_error_deg: f64,
}

/// Every servo of a bag. `fallback` are parameters for those whose own are not in the bag.
///
/// # Errors
/// [`ReportError::NoRobot`] where there are no joint states, or not of such an arm.
pub fn recorded(timeline: &Timeline, name: &str, fallback: &Fallback) -> Result<Vec<Recorded>, ReportError> {
    let mut runs = Vec::new();
    let namespaces = |topic: &'static str| {
        timeline.ending(topic, "geometry_msgs/msg/PoseStamped").map(|(_, before)| before).collect::<Vec<_>>()
    };
    for namespace in namespaces("relative_goal") {
        runs.push(of::<TwoArms>(timeline, name, namespace, &fallback.dual)?);
    }
    let dual: Vec<String> = namespaces("relative_goal")
        .iter()
        .flat_map(|ns| TwoArms::ARMS.iter().map(move |arm| format!("{ns}{arm}")))
        .collect();
    for (_, namespace) in timeline.ending("joint_states", "sensor_msgs/msg/JointState") {
        if !dual.iter().any(|arm| arm == namespace) {
            runs.push(of::<OneArm>(timeline, name, namespace, &fallback.servo)?);
        }
    }
    match runs.is_empty() {
        true => Err(ReportError::NoRobot(format!(
            "{name} has no joint_states of type sensor_msgs/msg/JointState"
        ))),
        false => Ok(runs),
    }
}

/// Parameters for servos whose own are not in the bag.
#[derive(Clone, Debug)]
pub struct Fallback {
    /// For one arm.
    pub servo: ServoParameters,
    /// For two.
    pub dual: DualParameters,
}

/// What happened, and when \[ns\].
enum Event {
    JointState(usize, JointState),
    Goal(PoseStamped),
    Command(usize, Float64MultiArray),
    Parameters(ParameterEvent),
    Status(DiagnosticStatus),
}

fn of<T: Wiring>(
    timeline: &Timeline,
    bag: &str,
    namespace: &str,
    fallback: &CycleParameters<T>,
) -> Result<Recorded, ReportError>
where
    CycleParameters<T>: NodeParameters,
{
    let node = servo_in::<T>(timeline, namespace);
    let mut store = CycleParameters::<T>::store();
    let mut parameters = fallback.clone();
    let mut known = false;
    if let Some([first, ..]) = node.and_then(|node| timeline.parameters().get(node)).map(Vec::as_slice) {
        for parameter in &first.new_parameters {
            if let Some(value) = parameter.value.clone().into_value() {
                store.override_initial(&parameter.name, value)?;
            }
        }
        parameters = CycleParameters::<T>::from_store(&store)?;
        known = true;
    }
    let mut events = events::<T>(timeline, namespace, node);
    events.sort_by_key(|(time, _)| *time);
    let first_goal = events.iter().find(|(_, event)| matches!(event, Event::Goal(_)));
    let zero = first_goal.or(events.first()).map_or(0, |(time, _)| *time);
    let name = if namespace == "/" { bag.to_owned() } else { format!("{bag} {namespace}") };
    let mut reader = Reader::<T>::new(name, parameters, known.then_some(store));
    for (time, event) in events {
        reader.take((time - zero) as f64 * 1e-9, event)?;
    }
    reader.finish()
}

/// The servo node of that namespace, by what it tells of its parameters.
fn servo_in<'a, T: Wiring>(timeline: &'a Timeline, namespace: &str) -> Option<&'a str> {
    let own = if T::ARMS.len() > 1 { "primitive" } else { "diffc.gain" };
    let mut nodes = timeline.parameters().iter().filter(|(node, events)| {
        let here = node.strip_prefix(namespace).is_some_and(|name| !name.contains('/'));
        here && events[0].new_parameters.iter().any(|parameter| parameter.name == own)
    });
    nodes.next().map(|(node, _)| node.as_str())
}

fn events<T: Wiring>(timeline: &Timeline, namespace: &str, node: Option<&str>) -> Vec<(i64, Event)> {
    let topic = |name: &str| timeline.of(&format!("{namespace}{name}"));
    let mut events = Vec::new();
    for (arm, prefix) in T::ARMS.iter().enumerate() {
        let states = decode(topic(&format!("{prefix}joint_states")));
        events.extend(states.into_iter().map(|(time, state)| (time, Event::JointState(arm, state))));
        let commands = decode(topic(&format!("{prefix}forward_velocity_controller/commands")));
        events.extend(commands.into_iter().map(|(time, command)| (time, Event::Command(arm, command))));
    }
    events.extend(decode(topic(T::GOAL)).into_iter().map(|(time, goal)| (time, Event::Goal(goal))));
    for (status, before) in timeline.ending("status", "diagnostic_msgs/msg/DiagnosticStatus") {
        if node.is_some_and(|node| before.trim_end_matches('/') == node)
            || before
                .strip_prefix(namespace)
                .is_some_and(|name| !name.trim_end_matches('/').contains('/') && node.is_none())
        {
            events.extend(
                decode(timeline.of(status)).into_iter().map(|(time, status)| (time, Event::Status(status))),
            );
        }
    }
    let changes = node.and_then(|node| timeline.parameters().get(node)).into_iter().flatten().skip(1);
    events.extend(changes.map(|event| (event.stamp.nanoseconds(), Event::Parameters(event.clone()))));
    events
}

/// Follows a run event by event.
struct Reader<T: Task> {
    run: Recorded,
    parameters: CycleParameters<T>,
    store: Option<crate::config::ParameterStore>,
    heard: Vec<bool>,
    positions: Vec<f64>,
    velocities: Vec<f64>,
    command: Vec<f64>,
    goal: Option<Goal>,
    motion: Option<(Motion, MotionRow)>,
    law: Option<String>,
    state: Option<String>,
    cycle: Option<Duration>,
    strangers: u64,
}

impl<T: Wiring> Reader<T>
where
    CycleParameters<T>: NodeParameters,
{
    fn new(
        name: String,
        parameters: CycleParameters<T>,
        store: Option<crate::config::ParameterStore>,
    ) -> Self {
        let count = parameters.task.joint_count();
        let law = store.is_some().then(|| law::<T>(&parameters));
        let run = Recorded {
            name,
            joints: parameters.joints.iter().flat_map(|arm| arm.names()).cloned().collect(),
            samples: Vec::new(),
            commands: Vec::new(),
            jitter: Vec::new(),
            changes: Vec::new(),
            motions: Vec::new(),
            limits: parameters.settings.limits.clone(),
        };
        Self {
            run,
            heard: vec![false; parameters.joints.len()],
            parameters,
            store,
            positions: vec![0.0; count],
            velocities: vec![0.0; count],
            command: vec![0.0; count],
            goal: None,
            motion: None,
            law,
            state: None,
            cycle: None,
            strangers: 0,
        }
    }

    fn take(&mut self, time: f64, event: Event) -> Result<(), ReportError> {
        match event {
            Event::JointState(arm, state) => self.take_joint_state(time, arm, &state)?,
            Event::Goal(goal) => self.take_goal(time, &goal),
            Event::Command(arm, command) => self.take_command(time, arm, &command),
            Event::Parameters(event) => self.take_parameters(time, event)?,
            Event::Status(status) => self.take_status(time, &status),
        }
        Ok(())
    }

    fn range(&self, arm: usize) -> std::ops::Range<usize> {
        let before = self.parameters.joints[..arm].iter().map(|arm| arm.names().len()).sum();
        before..before + self.parameters.joints[arm].names().len()
    }

    fn take_joint_state(&mut self, time: f64, arm: usize, state: &JointState) -> Result<(), ReportError> {
        let (range, joints) = (self.range(arm), &self.parameters.joints[arm]);
        if joints.positions(&state.name, &state.position, &mut self.positions[range.clone()]).is_err() {
            self.strangers += 1;
            return Ok(());
        }
        self.heard[arm] = true;
        if joints.positions(&state.name, &state.velocity, &mut self.velocities[range]).is_err() {
            self.velocities.clear();
            self.velocities.resize(self.positions.len(), f64::NAN);
        }
        if self.heard.iter().all(|heard| *heard) { self.sample(time) } else { Ok(()) }
    }

    fn sample(&mut self, time: f64) -> Result<(), ReportError> {
        let controller = &self.parameters.settings.controller;
        let task = &mut self.parameters.task;
        task.evaluate(&self.positions)?;
        let pose = task.pose();
        let goal = self.goal.as_ref().map(|goal| {
            let near = goal.base_from_goal().real().dot(&pose.real()) >= 0.0;
            if near { *goal.base_from_goal() } else { -*goal.base_from_goal() }
        });
        let error = goal.map(|goal| task.goal_error(controller, &goal));
        let smallest_singular_value = task.smallest_singular_value(controller);
        if let (Some(goal), Some(error)) = (goal, error) {
            self.measure(time, &pose, &goal, &error);
        }
        self.run.samples.push(Sample {
            time,
            positions: self.positions.clone(),
            velocities: self.velocities.clone(),
            pose,
            error,
            smallest_singular_value,
        });
        Ok(())
    }

    fn measure(
        &mut self,
        time: f64,
        pose: &UnitDualQuaternion,
        goal: &UnitDualQuaternion,
        error: &GoalError,
    ) {
        let (tolerance, point) = (self.parameters.settings.goal_tolerance, pose.translation());
        let start = self.run.motions.len() + 1;
        let (law, run) = (self.law.clone(), self.run.name.clone());
        let (motion, row) = self.motion.get_or_insert_with(|| {
            let begun = Duration::from_secs_f64(time.max(0.0));
            (
                Motion::begin(begun, point, goal.translation(), error, &tolerance),
                MotionRow::new(run, start, law, time),
            )
        });
        // Without commands in the bag, what the robot did stands for them.
        let speeds = if self.run.commands.is_empty() { &self.velocities } else { &self.command };
        motion.update(Duration::from_secs_f64(time.max(0.0)), point, error, speeds);
        row.fill(&motion.figures());
    }

    fn take_goal(&mut self, time: f64, message: &PoseStamped) {
        let (p, o) = (&message.pose.position, &message.pose.orientation);
        let taken = Goal::new(
            [p.x, p.y, p.z],
            [o.x, o.y, o.z, o.w],
            &message.header.frame_id,
            &self.parameters.goal_frame,
        );
        let Ok(goal) = taken else { return };
        if self.goal.as_ref() != Some(&goal) {
            self.end_motion();
            self.goal = Some(goal);
            self.change(time, What::Goal, "goal".to_owned());
        }
    }

    fn take_command(&mut self, time: f64, arm: usize, command: &Float64MultiArray) {
        let range = self.range(arm);
        if command.data.len() != range.len() {
            return;
        }
        self.command[range].copy_from_slice(&command.data);
        if arm + 1 == self.parameters.joints.len() {
            self.run.commands.push((time, self.command.clone()));
            self.measure_cycle(time, command);
        }
    }

    /// By the cycle's own clock where the command tells it, else by when it was recorded.
    fn measure_cycle(&mut self, time: f64, command: &Float64MultiArray) {
        let label = command.layout.dim.first().and_then(|dim| dim.label.parse::<CycleLabel>().ok());
        let now = label.map_or(Duration::from_secs_f64(time.max(0.0)), |label| label.now);
        if let Some(last) = self.cycle.replace(now).filter(|_| self.store.is_some()) {
            let late = now.saturating_sub(last).as_secs_f64() - self.parameters.period.as_secs_f64();
            self.run.jitter.push((time, 1e3 * late));
        }
    }

    fn take_parameters(&mut self, time: f64, event: ParameterEvent) -> Result<(), ReportError> {
        let Some(store) = &self.store else { return Ok(()) };
        let changes = event.changed_parameters.into_iter();
        let changes: Vec<_> =
            changes.filter_map(|parameter| Some((parameter.name, parameter.value.into_value()?))).collect();
        let store = store.with(&changes)?;
        let settings = CycleParameters::<T>::from_store(&store)?.settings;
        if !T::same_aim(&self.parameters.settings.controller, &settings.controller) {
            self.end_motion();
        }
        self.parameters.settings = settings;
        self.store = Some(store);
        self.set_law(time, law::<T>(&self.parameters));
        Ok(())
    }

    fn take_status(&mut self, time: f64, status: &DiagnosticStatus) {
        let value =
            |key: &str| status.values.iter().find(|pair| pair.key == key).map(|pair| pair.value.clone());
        if let Some(law) = value("law").filter(|_| self.store.is_none()) {
            let law = value("primitive").iter().fold(law, |law, primitive| format!("{law} {primitive}"));
            self.set_law(time, law);
        }
        if self.state.as_ref() != Some(&status.message) {
            self.state = Some(status.message.clone());
            self.change(time, What::State, status.message.clone());
            if let Some((_, row)) = self.motion.as_mut().filter(|_| status.message == "stalled") {
                row.stalls += 1;
            }
        }
    }

    fn set_law(&mut self, time: f64, law: String) {
        if self.law.as_ref() != Some(&law) {
            if self.law.is_some() {
                self.change(time, What::Law, law.clone());
            }
            self.law = Some(law);
        }
    }

    fn change(&mut self, time: f64, what: What, to: String) {
        self.run.changes.push(Change { time, what, to });
    }

    fn end_motion(&mut self) {
        self.run.motions.extend(self.motion.take().map(|(_, row)| row));
    }

    fn finish(mut self) -> Result<Recorded, ReportError> {
        self.end_motion();
        if self.run.samples.is_empty() {
            let joints = self.parameters.joints.iter().map(JointOrder::names).collect::<Vec<_>>();
            return Err(ReportError::NoRobot(format!(
                "{}: no joint state is of this arm ({joints:?}): {} are of another, whose parameters --ros-args --params-file gives",
                self.run.name, self.strangers
            )));
        }
        Ok(self.run)
    }
}

fn law<T: Wiring>(parameters: &CycleParameters<T>) -> String {
    let names = T::law(&parameters.settings.controller);
    names.into_iter().map(|(_, name)| name).collect::<Vec<_>>().join(" ")
}

impl MotionRow {
    fn new(run: String, goal: usize, law: Option<String>, start_s: f64) -> Self {
        Self {
            run,
            goal,
            law,
            start_s,
            settling_time_rotation_s: None,
            settling_time_position_s: None,
            path_length_m: 0.0,
            straight_line_m: 0.0,
            path_ratio: 0.0,
            overshoot_mm: 0.0,
            peak_joint_speed_rad_s: 0.0,
            effort: 0.0,
            stalls: 0,
            position_error_mm: 0.0,
            rotation_error_deg: 0.0,
        }
    }

    fn fill(&mut self, figures: &Figures) {
        self.settling_time_rotation_s = figures.settling_time_rotation;
        self.settling_time_position_s = figures.settling_time_position;
        self.path_length_m = figures.path_length;
        self.straight_line_m = figures.straight_line;
        self.path_ratio = figures.path_length / figures.straight_line;
        self.overshoot_mm = figures.overshoot * 1e3;
        self.peak_joint_speed_rad_s = figures.peak_joint_speed;
        self.effort = figures.effort;
        self.position_error_mm = figures.position_error * 1e3;
        self.rotation_error_deg = figures.rotation_error.to_degrees();
    }
}
