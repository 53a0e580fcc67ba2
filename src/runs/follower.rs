//! Follows a run event by event.

use super::events::Event;
use super::judge::Judge;
use super::run::{Change, MotionRow, RecordedRun, Sample, What};
use super::timeline::Numbers;
use super::{RunError, timeline};
use crate::config::{CycleParameters, NodeParameters};
use crate::control::nearer_goal;
use crate::dq::UnitDualQuaternion;
use crate::params::ParameterStore;
use crate::servo::{Goal, GoalError, GoalReading, JointOrder, Motion, Task};
use crate::wire::messages::{DiagnosticStatus, Float64MultiArray, JointState, PoseStamped};
use crate::wire::{CycleLabel, ParameterEvent, PoseNumbers, StatusReport, Wiring, joint_names};
use std::collections::VecDeque;
use std::time::Duration;

/// Statuses that come late name one of the last so many goals.
const LATE_GOALS: usize = 16;

/// Follows a run event by event.
pub(super) struct Follower<T: Task> {
    run: RecordedRun,
    parameters: CycleParameters<T>,
    store: Option<ParameterStore>,
    /// Arms that have reported a state at all, and since the last sample.
    heard: Vec<bool>,
    fresh: Vec<bool>,
    positions: Vec<f64>,
    velocities: Vec<f64>,
    command: Vec<f64>,
    goal: Option<Goal>,
    /// The last goals that came, the newest last.
    goals: VecDeque<Goal>,
    /// The goal with which the motion began.
    begun: Option<Goal>,
    motion: Option<(Motion, MotionRow)>,
    law: Option<String>,
    state: Option<String>,
    judge: Judge,
    numbers: Numbers,
    strangers: u64,
}

impl<T: Wiring> Follower<T>
where
    CycleParameters<T>: NodeParameters,
{
    /// Begins with the node's parameters, and the store that they came from if the bag has them.
    pub fn new(
        name: String,
        parameters: CycleParameters<T>,
        store: Option<ParameterStore>,
        numbers: Numbers,
    ) -> Self {
        let count = parameters.task.joint_count();
        let law = store.is_some().then(|| law::<T>(&parameters));
        let run = RecordedRun {
            name: shown(&name),
            joints: joint_names::<T>(&parameters.joints).iter().map(|name| shown(name)).collect(),
            arms: parameters.task.chains().into_iter().cloned().collect(),
            samples: Vec::new(),
            commands: Vec::new(),
            sent: Vec::new(),
            jitter: Vec::new(),
            changes: Vec::new(),
            laws: law.iter().map(|law| (0.0, law.clone())).collect(),
            goals: Vec::new(),
            motions: Vec::new(),
            violations: Vec::new(),
            limits: parameters.settings.limits.clone(),
            damping_threshold: T::damping(&parameters.settings.controller).threshold,
            parameters_known: store.is_some(),
        };
        let judge = Judge::new(parameters.settings.limits.clone(), parameters.period);
        Self {
            run,
            heard: vec![false; parameters.joints.len()],
            fresh: vec![false; parameters.joints.len()],
            parameters,
            store,
            positions: vec![0.0; count],
            velocities: vec![0.0; count],
            command: vec![0.0; count],
            goal: None,
            goals: VecDeque::new(),
            begun: None,
            motion: None,
            law,
            state: None,
            judge,
            numbers,
            strangers: 0,
        }
    }

    /// Goes on to what happened at `time` \[s\].
    pub fn take(&mut self, time: f64, event: Event) -> Result<(), RunError> {
        match event {
            Event::JointState(arm, state) => self.take_joint_state(time, arm, &state)?,
            Event::Goal(goal) => self.take_goal(time, &goal),
            Event::Command(arm, command) => self.take_command(time, arm, &command),
            Event::Positions(arm, positions, label) => self.take_positions(time, arm, &positions, label),
            Event::Parameters(event) => self.take_parameters(time, event)?,
            Event::Status(status) => self.take_status(time, &status),
        }
        Ok(())
    }

    fn range(&self, arm: usize) -> std::ops::Range<usize> {
        let before = self.parameters.joints[..arm].iter().map(|arm| arm.names().len()).sum();
        before..before + self.parameters.joints[arm].names().len()
    }

    fn take_joint_state(&mut self, time: f64, arm: usize, state: &JointState) -> Result<(), RunError> {
        let (range, joints) = (self.range(arm), &self.parameters.joints[arm]);
        if joints.positions(&state.name, &state.position, &mut self.positions[range.clone()]).is_err() {
            self.strangers += 1;
            return Ok(());
        }
        if joints.positions(&state.name, &state.velocity, &mut self.velocities[range]).is_err() {
            self.velocities.fill(f64::NAN);
        }
        // The arms' states of one moment make one sample; an arm that is silent does not hold up the others.
        (self.fresh[arm], self.heard[arm]) = (true, true);
        let timeout = self.parameters.settings.state_timeout.as_secs_f64();
        let silent = self.run.samples.last().is_some_and(|last| time - last.time > timeout);
        let due = silent || self.fresh.iter().all(|fresh| *fresh);
        if due && self.heard.iter().all(|heard| *heard) {
            self.fresh.fill(false);
            self.sample(time)?;
        }
        Ok(())
    }

    fn sample(&mut self, time: f64) -> Result<(), RunError> {
        self.parameters.task.evaluate(&self.positions)?;
        self.run.samples.push(Sample {
            time,
            positions: self.positions.clone(),
            velocities: self.velocities.clone(),
            pose: self.parameters.task.pose(),
            error: self.signed_goal().map(|goal| self.goal_error(&goal)),
            smallest_singular_value: self
                .parameters
                .task
                .smallest_singular_value(&self.parameters.settings.controller),
        });
        // As the servo does, once a cycle; in a bag without commands, at each state.
        if self.run.commands.is_empty() {
            self.measure(time);
        }
        Ok(())
    }

    /// The goal, with the sign that is nearer to the pose.
    fn signed_goal(&self) -> Option<UnitDualQuaternion> {
        Some(nearer_goal(self.goal.as_ref()?.base_from_goal(), &self.parameters.task.pose()))
    }

    fn goal_error(&self, goal: &UnitDualQuaternion) -> GoalError {
        self.parameters.task.goal_error(&self.parameters.settings.controller, goal)
    }

    /// Adds the last sample to the motion in progress, which it may begin.
    fn measure(&mut self, time: f64) {
        let (Some(sample), Some(goal)) = (self.run.samples.last(), self.signed_goal()) else { return };
        let (point, error) = (sample.pose.translation(), self.goal_error(&goal));
        let now = Duration::from_secs_f64(time.max(0.0));
        let begin = || {
            let tolerance = self.parameters.settings.goal_tolerance;
            let number = self.run.motions.len() + 1;
            (
                Motion::begin(now, point, goal.translation(), &error, &tolerance),
                MotionRow::new(self.run.name.clone(), number, self.law.clone(), time),
            )
        };
        let (mut motion, row) = self.motion.take().unwrap_or_else(begin);
        // Without commands in the bag, what the robot did stands for them.
        let speeds = if self.run.commands.is_empty() { &self.velocities } else { &self.command };
        motion.update(now, point, &error, speeds);
        self.motion = Some((motion, row));
    }

    fn take_goal(&mut self, time: f64, message: &PoseStamped) {
        let GoalReading { position, orientation_xyzw, frame_id, .. } = message.reading();
        let taken = Goal::new(position, orientation_xyzw, frame_id, &self.parameters.goal_frame);
        if let Ok(goal) = taken {
            self.pursue(time, goal);
        }
    }

    /// A goal that the servo has without a message of it in the bag: `ros2 bag record` subscribes late.
    fn take_goal_in_force(&mut self, time: f64, [x, y, z, orientation @ ..]: PoseNumbers) {
        let Ok(goal) = Goal::new([x, y, z], orientation, "", &self.parameters.goal_frame) else { return };
        if !self.goals.iter().any(|heard| same(heard, &goal)) {
            self.pursue(time, goal);
        }
    }

    fn pursue(&mut self, time: f64, goal: Goal) {
        self.goals.push_back(goal);
        if self.goals.len() > LATE_GOALS {
            self.goals.pop_front();
        }
        // As the servo does: a goal that cannot be distinguished from the one with which the motion began only moves the aim.
        let tolerance = self.parameters.settings.goal_tolerance;
        let same = self.begun.as_ref().is_some_and(|begun| begun.is_same(&goal, &tolerance));
        self.goal = Some(goal);
        if !same {
            self.end_motion();
            self.run.goals.push(*goal.base_from_goal());
            self.begun = Some(goal);
            self.change(time, What::Goal, "goal".to_owned());
            self.measure(time);
        }
    }

    fn take_command(&mut self, time: f64, arm: usize, command: &Float64MultiArray) {
        let range = self.range(arm);
        if command.data.len() != range.len() {
            return;
        }
        self.command[range].copy_from_slice(&command.data);
        if arm + 1 < self.parameters.joints.len() {
            return;
        }
        self.run.commands.push((time, self.command.clone()));
        self.measure(time);
        if self.store.is_some() {
            self.judge(time, command);
        }
    }

    /// Where the arm is sent; how fast that makes it is what it did.
    fn take_positions(&mut self, time: f64, arm: usize, positions: &[f64], label: Option<CycleLabel>) {
        let range = self.range(arm);
        if positions.len() != range.len() {
            return;
        }
        self.command[range].copy_from_slice(positions);
        if arm + 1 < self.parameters.joints.len() {
            return;
        }
        self.run.sent.push((time, self.command.clone()));
        let jitter = label.and_then(|label| self.judge.jitter(self.numbers.in_label(label).now));
        self.run.jitter.extend(jitter.map(|jitter| (time, jitter)));
    }

    /// By the cycle's own clock where the command has it, else by when it was recorded.
    fn judge(&mut self, time: f64, command: &Float64MultiArray) {
        let label = CycleLabel::of(command).map(|label| self.numbers.in_label(label));
        let now = label.as_ref().map_or(Duration::from_secs_f64(time.max(0.0)), |label| label.now);
        let jitter = self.judge.jitter(now);
        self.run.jitter.extend(jitter.map(|jitter| (time, jitter)));
        // The task is where the last sample was.
        let tool = self.run.samples.last().map(|_| self.parameters.task.tool_speed(&self.command));
        let checked = label.map(|label| self.judge.check(&self.command, label, tool.as_ref()));
        if let Some(Err(violation)) = checked {
            self.run.violations.push((time, violation));
            if let Some((_, row)) = &mut self.motion {
                row.violations += 1;
            }
        }
    }

    fn take_parameters(&mut self, time: f64, event: ParameterEvent) -> Result<(), RunError> {
        let Some(store) = &self.store else { return Ok(()) };
        let store = store.with(&timeline::changed(event)?)?;
        let settings = CycleParameters::<T>::from_store(&store)?.settings;
        if settings.tool_offset != self.parameters.settings.tool_offset {
            // As the servo does: another tool begins another motion to the same goal.
            self.parameters.task.set_tool_offset(&settings.tool_offset);
            self.end_motion();
        }
        let same_aim = T::same_aim(&self.parameters.settings.controller, &settings.controller);
        self.judge.set_limits(settings.limits.clone());
        self.parameters.settings = settings;
        self.store = Some(store);
        self.set_law(time, law::<T>(&self.parameters));
        if !same_aim {
            // The servo drops the goal.
            self.end_motion();
            (self.goal, self.begun) = (None, None);
        }
        Ok(())
    }

    fn take_status(&mut self, time: f64, status: &DiagnosticStatus) {
        if let Some(goal) = StatusReport::from_message(status).and_then(|report| report.goal) {
            self.take_goal_in_force(time, goal);
        }
        let value =
            |key: &str| status.values.iter().find(|pair| pair.key == key).map(|pair| pair.value.clone());
        if let Some(law) = value("law").filter(|_| self.store.is_none()) {
            let aim = value("primitive").or_else(|| value("task"));
            let law = aim.iter().fold(law, |law, aim| format!("{law} {aim}"));
            self.set_law(time, shown(&law));
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
            self.run.laws.push((time, law.clone()));
            self.law = Some(law);
        }
    }

    fn change(&mut self, time: f64, what: What, to: String) {
        self.run.changes.push(Change { time, what, to: shown(&to) });
    }

    fn end_motion(&mut self) {
        self.run.motions.extend(self.motion.take().map(|(motion, mut row)| {
            row.figures = motion.figures();
            row.path_ratio = row.figures.path_ratio();
            row
        }));
    }

    /// The run.
    pub fn finish(mut self) -> Result<RecordedRun, RunError> {
        self.end_motion();
        if self.run.samples.is_empty() {
            let joints = self.parameters.joints.iter().map(JointOrder::names).collect::<Vec<_>>();
            return Err(RunError::NoRobot(format!(
                "{}: no joint state is of this arm ({joints:?}): {} are of another, whose parameters --ros-args --params-file gives",
                self.run.name, self.strangers
            )));
        }
        Ok(self.run)
    }
}

/// Whether two goals are the same pose: a status has it as the servo has normalised it.
fn same(one: &Goal, other: &Goal) -> bool {
    const ROUNDING: f64 = 1e-9;
    (one.base_from_goal().to_vector8() - other.base_from_goal().to_vector8()).norm() < ROUNDING
}

/// A text as it can stand in a figure, a table and a line: without control characters, and not for ever.
fn shown(text: &str) -> String {
    const LONGEST: usize = 80;
    let clean = |c: char| if c.is_control() { char::REPLACEMENT_CHARACTER } else { c };
    let mut shown: String = text.chars().take(LONGEST).map(clean).collect();
    if text.chars().nth(LONGEST).is_some() {
        shown.push('…');
    }
    shown
}

fn law<T: Wiring>(parameters: &CycleParameters<T>) -> String {
    let names = T::law(&parameters.settings.controller);
    names.into_iter().map(|(_, name)| name).collect::<Vec<_>>().join(" ")
}
