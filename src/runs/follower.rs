//! Follows a run event by event.

mod commands;
mod goals;
mod states;

use super::asked::Asked;
use super::clock::CommandClock;
use super::events::Event;
use super::halves::Halves;
use super::judge::Judge;
use super::motions::{Measured, Motions};
use super::run::{Change, MotionRow, RecordedRun, What};
use super::timeline::{AnnouncedParameters, Numbers};
use super::{RunError, Thinned, timeline};
use crate::config::{CycleParameters, NodeParameters};
use crate::params::ParameterStore;
use crate::servo::{Input, JointOrder, Settings, State, Task};
use crate::text::{NAME, shown};
use crate::wire::messages::DiagnosticStatus;
use crate::wire::{CycleLabel, ParameterEvent, StatusReport, Wiring, joint_names};

/// So many points of a curve are kept at most, some fifty a pixel of a figure: what a run of an hour takes is what one of a minute does.
const POINTS: usize = 1 << 15;

/// So many changes are kept at most, and so many of laws, each of which has a curve.
const CHANGES: usize = 1 << 13;
const LAWS: usize = 1 << 9;

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
    clock: CommandClock,
    /// The tool is another one than at the last sample.
    tool_changed: bool,
    motions: Motions,
    law: Option<String>,
    state: Option<String>,
    /// Of the servo's last command.
    label: Option<CycleLabel>,
    asked: Asked,
    /// A twist rules, by the last status.
    jogged: bool,
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
    /// Begins with the node's parameters, and where the bag has them with what it announced of them.
    pub fn new(
        name: String,
        parameters: CycleParameters<T>,
        announced: Option<(ParameterStore, Numbers)>,
    ) -> Self {
        let count = parameters.task.joint_count();
        let (store, numbers) = announced.map(|(store, numbers)| (Some(store), numbers)).unwrap_or_default();
        let law = store.is_some().then(|| law::<T>(&parameters));
        let mut run = RecordedRun {
            name: shown(&name, NAME),
            joints: joint_names::<T>(&parameters.joints).iter().map(|name| shown(name, NAME)).collect(),
            arms: parameters.task.chains().into_iter().cloned().collect(),
            samples: Thinned::new(POINTS, |next, gone| next.jumped |= gone.jumped),
            commands: Thinned::new(POINTS, larger_speeds),
            sent: Thinned::new(POINTS, |_, _| {}),
            jitter: Thinned::new(POINTS, |next, gone| next.1 = larger(next.1, gone.1)),
            changes: Thinned::new(CHANGES, |_, _| {}),
            laws: Thinned::new(LAWS, |_, _| {}),
            goals: Thinned::new(POINTS, |_, _| {}),
            motions: Vec::new(),
            more_motions: 0,
            violations: Vec::new(),
            limits: vec![(f64::NEG_INFINITY, parameters.settings.limits.clone())],
            damping_thresholds: vec![(f64::NEG_INFINITY, damping_threshold::<T>(&parameters.settings))],
            parameters_known: store.is_some(),
        };
        law.iter().for_each(|law| run.laws.push((0.0, law.clone())));
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
            clock: CommandClock::default(),
            tool_changed: false,
            motions: Motions::default(),
            law,
            state: None,
            label: None,
            asked: Asked::default(),
            jogged: false,
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

    /// Adds the last sample to the motion in progress, which it may begin.
    fn measure(&mut self, time: f64) {
        let (Some(sample), Some(goal)) = (self.run.samples.last(), self.signed_goal()) else { return };
        // Where another tool is is known with the next joint state.
        if self.tool_changed {
            return;
        }
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
        let same_aim = T::same_aim(&self.parameters.settings.controller, &settings.controller);
        self.store = Some(store);
        self.judge.set_limits(settings.limits.clone());
        self.set_settings(time, settings);
        if !same_aim {
            self.motions.drop_goal(time);
        }
        Ok(())
    }

    /// The servo is started again at `time` \[s\] with what it announces of its parameters: it has no goal.
    pub fn start_again(&mut self, time: f64, announced: &AnnouncedParameters) -> Result<(), RunError> {
        let store = announced.initial::<CycleParameters<T>>()?;
        let parameters = CycleParameters::<T>::from_store(&store)?;
        self.motions.drop_goal(time);
        (self.state, self.jogged) = (None, false);
        if !self.run.sent.is_empty() {
            self.run.sent.push((time, vec![f64::NAN; self.positions.len()]));
        }
        self.tool_changed |= parameters.task.chains() != self.parameters.task.chains();
        self.run.arms = parameters.task.chains().into_iter().cloned().collect();
        self.judge = Judge::new(parameters.settings.limits.clone(), parameters.period);
        (self.store, self.numbers) = (Some(store), announced.numbers.clone());
        let settings = parameters.settings.clone();
        let before = std::mem::replace(&mut self.parameters, parameters);
        self.parameters.settings = before.settings;
        self.set_settings(time, settings);
        Ok(())
    }

    /// Puts settings into force, and notes what they change.
    fn set_settings(&mut self, time: f64, settings: Settings<T::Controller>) {
        if settings.limits != self.parameters.settings.limits {
            self.run.limits.push((time, settings.limits.clone()));
            for (fastest, limit) in self.fastest.iter_mut().zip(&settings.limits.joint_velocity) {
                *fastest = fastest.max(*limit);
            }
        }
        let threshold = damping_threshold::<T>(&settings);
        if threshold != damping_threshold::<T>(&self.parameters.settings) {
            self.run.damping_thresholds.push((time, threshold));
        }
        self.parameters.settings = settings;
        self.set_law(time, law::<T>(&self.parameters));
    }

    fn take_status(&mut self, time: f64, status: &DiagnosticStatus) {
        let report = StatusReport::from_message(status);
        let holds = status.message == State::Holding.name();
        if let Some(report) = &report {
            self.take_input(time, report, holds);
        }
        if self.state.as_ref() != Some(&status.message) {
            self.state = Some(status.message.clone());
            let has_goal = report.is_some_and(|report| report.goal.is_some());
            self.motions.hold(has_goal && holds);
            self.change(time, What::State, status.message.clone());
            if let Some(row) = self.motions.row().filter(|_| status.message == State::Stalled.name()) {
                row.stalls += 1;
            }
        }
    }

    /// What rules, and the law where the parameters do not say.
    fn take_input(&mut self, time: f64, report: &StatusReport, holds: bool) {
        self.jogged = report.input == Some(Input::Twist);
        if self.jogged {
            self.motions.drop_goal(time);
        } else if let Some(goal) = report.goal {
            let elapsed = report.figures.map_or(0.0, |figures| figures.elapsed);
            self.take_goal_in_force(time, goal, (elapsed, holds));
        }
        if self.store.is_none() {
            self.set_law(time, shown(&report.law_and_aim(), NAME));
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
        (self.run.motions, self.run.more_motions) = self.motions.finish();
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

/// The one that is farther from 0.
fn larger(one: f64, other: f64) -> f64 {
    if other.abs() > one.abs() { other } else { one }
}

fn larger_speeds((_, next): &mut (f64, Vec<f64>), (_, gone): &(f64, Vec<f64>)) {
    next.iter_mut().zip(gone).for_each(|(next, gone)| *next = larger(*next, *gone));
}

fn damping_threshold<T: Wiring>(settings: &Settings<T::Controller>) -> f64 {
    T::damping(&settings.controller).threshold
}

fn law<T: Wiring>(parameters: &CycleParameters<T>) -> String {
    let names = T::law(&parameters.settings.controller);
    names.into_iter().map(|(_, name)| name).collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests;
