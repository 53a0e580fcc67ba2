//! Follows a run event by event.

use super::events::Event;
use super::halves::Halves;
use super::judge::Judge;
use super::motions::{Came, Measured, Motions};
use super::run::{Change, MotionRow, RecordedRun, Sample, What};
use super::timeline::Numbers;
use super::{RunError, timeline};
use crate::config::{CycleParameters, NodeParameters};
use crate::control::nearer_goal;
use crate::dq::UnitDualQuaternion;
use crate::params::ParameterStore;
use crate::servo::{Goal, GoalError, GoalReading, JointOrder, Settings, State, Task, longest_way};
use crate::text::{NAME, shown};
use crate::wire::messages::{DiagnosticStatus, Float64MultiArray, JointState, PoseStamped};
use crate::wire::{CycleLabel, ParameterEvent, PoseNumbers, StatusReport, Wiring, joint_names};
use std::time::Duration;

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
    halves: Halves,
    /// The last command [rad/s].
    command: Vec<f64>,
    /// When the arm was last sent to positions, by the cycle's clock where the command has it \[s\].
    sent_at: f64,
    /// The tool is another one than at the last sample.
    tool_changed: bool,
    motions: Motions,
    law: Option<String>,
    state: Option<String>,
    /// How often the servo had been stopped.
    stops: u64,
    judge: Judge,
    /// The highest speed that each joint has been allowed so far [rad/s].
    fastest: Vec<f64>,
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
            name: shown(&name, NAME),
            joints: joint_names::<T>(&parameters.joints).iter().map(|name| shown(name, NAME)).collect(),
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
            limits: vec![(f64::NEG_INFINITY, parameters.settings.limits.clone())],
            damping_threshold: T::damping(&parameters.settings.controller).threshold,
            parameters_known: store.is_some(),
        };
        let fastest = parameters.settings.limits.joint_velocity.clone();
        let halves = Halves::new(parameters.joints.iter().map(|arm| arm.names().len()));
        let judge = Judge::new(parameters.settings.limits.clone(), parameters.period);
        Self {
            run,
            heard: vec![false; parameters.joints.len()],
            fresh: vec![false; parameters.joints.len()],
            parameters,
            store,
            positions: vec![0.0; count],
            velocities: vec![0.0; count],
            halves,
            command: vec![0.0; count],
            sent_at: 0.0,
            tool_changed: false,
            motions: Motions::default(),
            law,
            state: None,
            stops: 0,
            judge,
            fastest,
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
        let velocities = &mut self.velocities[range];
        if joints.positions(&state.name, &state.velocity, velocities).is_err() {
            velocities.fill(f64::NAN);
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
        let jumped = self.has_jumped(time);
        if jumped {
            self.motions.jump();
        }
        self.parameters.task.evaluate(&self.positions)?;
        self.run.samples.push(Sample {
            time,
            positions: self.positions.clone(),
            velocities: self.velocities.clone(),
            pose: self.parameters.task.pose(),
            jumped: std::mem::take(&mut self.tool_changed) || jumped,
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

    /// Whether a joint is farther from where it was at the last sample than its limit of speed allows.
    fn has_jumped(&self, time: f64) -> bool {
        let speeds = &self.parameters.settings.limits.joint_velocity;
        self.run.samples.last().is_some_and(|last| {
            let ways = last.positions.iter().zip(&self.positions).map(|(from, to)| (to - from).abs());
            ways.zip(speeds).any(|(way, speed)| way > longest_way(*speed, time - last.time))
        })
    }

    /// The goal, with the sign that is nearer to the pose.
    fn signed_goal(&self) -> Option<UnitDualQuaternion> {
        Some(nearer_goal(self.motions.goal()?.base_from_goal(), &self.parameters.task.pose()))
    }

    fn goal_error(&self, goal: &UnitDualQuaternion) -> GoalError {
        self.parameters.task.goal_error(&self.parameters.settings.controller, goal)
    }

    /// Adds the last sample to the motion in progress, which it may begin.
    fn measure(&mut self, time: f64) {
        let (Some(sample), Some(goal)) = (self.run.samples.last(), self.signed_goal()) else { return };
        let Settings { controller, goal_tolerance, .. } = &self.parameters.settings;
        // Without commands in the bag, what the robot did stands for them, if it says so.
        let is_measured =
            self.run.commands.is_empty() && self.velocities.iter().all(|speed| speed.is_finite());
        let speeds = if is_measured { &self.velocities } else { &self.command };
        let measured = Measured {
            point: sample.pose.translation(),
            goal_point: goal.translation(),
            error: self.goal_error(&goal),
            speeds,
            lingers: self.parameters.task.lingers(controller, goal_tolerance, speeds),
            tolerance: goal_tolerance,
        };
        let row = |number| MotionRow::new(self.run.name.clone(), number, self.law.clone(), time);
        self.motions.measure(time, &measured, row);
    }

    fn take_goal(&mut self, time: f64, message: &PoseStamped) {
        let GoalReading { position, orientation_xyzw, frame_id, .. } = message.reading();
        let taken = Goal::new(position, orientation_xyzw, frame_id, &self.parameters.goal_frame);
        if let Ok(goal) = taken {
            self.pursue(time, goal);
        }
    }

    /// A goal that the servo has for `elapsed` \[s\], maybe without a message of it in the bag: `ros2 bag record` subscribes late. Where
    /// it has none, or this is its first status, the motion may have begun before what the bag has of it.
    fn take_goal_in_force(&mut self, time: f64, [x, y, z, orientation @ ..]: PoseNumbers, elapsed: f64) {
        let Ok(goal) = Goal::new([x, y, z], orientation, "", &self.parameters.goal_frame) else { return };
        let is_new = !self.motions.knows(&goal);
        if is_new {
            self.pursue(time, goal);
        }
        if is_new || self.state.is_none() {
            self.motions.was_taken(time - elapsed);
        }
    }

    fn pursue(&mut self, time: f64, goal: Goal) {
        let came = self.motions.pursue(time, goal, &self.parameters.settings.goal_tolerance);
        if came != Came::Again {
            self.run.goals.push((time, *goal.base_from_goal()));
        }
        if came == Came::Another {
            self.change(time, What::Goal, "goal".to_owned());
            self.measure(time);
        }
    }

    fn take_command(&mut self, time: f64, arm: usize, command: &Float64MultiArray) {
        let label = CycleLabel::of(command).map(|label| self.numbers.in_label(label));
        let now = label.as_ref().map(|label| label.now);
        let Some(whole) = self.halves.add(arm, &command.data, now) else { return };
        self.run.commands.push((time, whole.clone()));
        self.command = whole;
        self.count_stops(label.as_ref());
        self.measure(time);
        if self.store.is_some() {
            self.judge(time, label);
        }
    }

    /// Drops the goal where the servo was stopped since the command before.
    fn count_stops(&mut self, label: Option<&CycleLabel>) {
        let stops = label.map_or(0, |label| label.stops);
        if std::mem::replace(&mut self.stops, stops) < stops {
            self.motions.drop_goal();
        }
    }

    /// Where the arm is sent, which is its command of velocities, integrated.
    fn take_positions(&mut self, time: f64, arm: usize, positions: &[f64], label: Option<CycleLabel>) {
        let now = label.as_ref().map(|label| label.now);
        let Some(whole) = self.halves.add(arm, positions, now) else { return };
        let at = now.map_or(time, |now| now.as_secs_f64());
        let seconds = at - std::mem::replace(&mut self.sent_at, at);
        let speeds = self.speeds_to(&whole, seconds);
        if speeds.is_none() {
            self.run.sent.push((time, vec![f64::NAN; whole.len()]));
        }
        self.command = speeds.unwrap_or_else(|| vec![0.0; whole.len()]);
        self.run.commands.push((time, self.command.clone()));
        self.run.sent.push((time, whole));
        self.count_stops(label.as_ref());
        self.measure(time);
        let jitter = label.and_then(|label| self.judge.jitter(self.numbers.in_label(label).now));
        self.run.jitter.extend(jitter.map(|jitter| (time, jitter)));
    }

    /// The speeds at which the arm is sent on to `positions` [rad/s], `seconds` after those before: a cycle moves them on by its period,
    /// in whose time and that of the cycles missed before it the arm goes there. None for a step that no limit of speed has allowed:
    /// the positions begin anew where the arm is.
    fn speeds_to(&self, positions: &[f64], seconds: f64) -> Option<Vec<f64>> {
        let period = self.parameters.period.as_secs_f64();
        let (_, before) = self.run.sent.last()?;
        let ways: Vec<_> = before.iter().zip(positions).map(|(from, to)| to - from).collect();
        let is_allowed = |(way, limit): (&f64, &f64)| way.abs() <= 1.001 * limit * period;
        let time = (seconds / period).round().max(1.0) * period;
        ways.iter().zip(&self.fastest).all(is_allowed).then(|| ways.iter().map(|way| way / time).collect())
    }

    /// By the cycle's own clock where the command has it, else by when it was recorded.
    fn judge(&mut self, time: f64, label: Option<CycleLabel>) {
        let now = label.as_ref().map_or(Duration::from_secs_f64(time.max(0.0)), |label| label.now);
        let jitter = self.judge.jitter(now);
        self.run.jitter.extend(jitter.map(|jitter| (time, jitter)));
        // The task is where the last sample was.
        let tool = self.run.samples.last().map(|_| self.parameters.task.tool_speed(&self.command));
        let checked = label.map(|label| self.judge.check(&self.command, label, tool.as_ref()));
        if let Some(Err(violation)) = checked {
            self.run.violations.push((time, violation));
            if let Some(row) = self.motions.row() {
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
            self.tool_changed = true;
            self.motions.end();
        }
        if settings.limits != self.parameters.settings.limits {
            self.run.limits.push((time, settings.limits.clone()));
            for (fastest, limit) in self.fastest.iter_mut().zip(&settings.limits.joint_velocity) {
                *fastest = fastest.max(*limit);
            }
        }
        let same_aim = T::same_aim(&self.parameters.settings.controller, &settings.controller);
        self.judge.set_limits(settings.limits.clone());
        self.parameters.settings = settings;
        self.store = Some(store);
        self.set_law(time, law::<T>(&self.parameters));
        if !same_aim {
            self.motions.drop_goal();
        }
        Ok(())
    }

    fn take_status(&mut self, time: f64, status: &DiagnosticStatus) {
        let report = StatusReport::from_message(status);
        let elapsed =
            report.as_ref().and_then(|report| report.figures).map_or(0.0, |figures| figures.elapsed);
        let goal = report.and_then(|report| report.goal);
        if let Some(goal) = goal {
            self.take_goal_in_force(time, goal, elapsed);
        }
        let value =
            |key: &str| status.values.iter().find(|pair| pair.key == key).map(|pair| pair.value.clone());
        if let Some(law) = value("law").filter(|_| self.store.is_none()) {
            let aim = value("primitive").or_else(|| value("task"));
            let law = aim.iter().fold(law, |law, aim| format!("{law} {aim}"));
            self.set_law(time, shown(&law, NAME));
        }
        if self.state.as_ref() != Some(&status.message) {
            self.state = Some(status.message.clone());
            self.motions.hold(goal.is_some() && status.message == State::Holding.name());
            self.change(time, What::State, status.message.clone());
            if let Some(row) = self.motions.row().filter(|_| status.message == "stalled") {
                row.stalls += 1;
            }
        }
    }

    fn set_law(&mut self, time: f64, law: String) {
        if self.law.as_ref() != Some(&law) {
            if self.law.is_some() {
                self.change(time, What::Law, law.clone());
                self.motions.change_law(&law);
            }
            self.run.laws.push((time, law.clone()));
            self.law = Some(law);
        }
    }

    fn change(&mut self, time: f64, what: What, to: String) {
        self.run.changes.push(Change { time, what, to: shown(&to, NAME) });
    }

    /// The run.
    pub fn finish(mut self) -> Result<RecordedRun, RunError> {
        self.run.motions = self.motions.finish();
        if !self.run.has_speeds() {
            for row in &mut self.run.motions {
                (row.figures.peak_joint_speed, row.figures.effort) = (f64::NAN, f64::NAN);
            }
        }
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

fn law<T: Wiring>(parameters: &CycleParameters<T>) -> String {
    let names = T::law(&parameters.settings.controller);
    names.into_iter().map(|(_, name)| name).collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests;
