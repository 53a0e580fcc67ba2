//! What a recorded servo had seen, cycle by cycle, given to a new one.

use super::timeline::{ToldParameters, changed};
use super::{RunError, Timeline};
use crate::config::{CycleParameters, NodeParameters, ParameterStore};
use crate::nodes::{CycleLabel, Wiring};
use crate::ros::ParameterEvent;
use crate::ros::messages::{JointState, PoseStamped};
use crate::servo::Servo;
use std::collections::{BTreeMap, VecDeque};

/// Joint states with the times at which they were recorded \[ns\], by their stamps \[ns\].
pub(super) type ByStamp = BTreeMap<i64, Vec<(i64, JointState)>>;

/// A servo, and what is still to come to it.
pub(super) struct Inputs<T: Wiring>
where
    CycleParameters<T>: NodeParameters,
{
    servo: Servo<T>,
    store: ParameterStore,
    changes: VecDeque<ParameterEvent>,
    joint_states: Vec<ByStamp>,
    goals: VecDeque<PoseStamped>,
    last: CycleLabel,
    missing: u64,
}

impl<T: Wiring> Inputs<T>
where
    CycleParameters<T>: NodeParameters,
{
    /// Begins as the servo was before the cycle `first`, in which it rested: what it had been sent before is over.
    pub fn new(
        timeline: &Timeline,
        namespace: &str,
        node: &str,
        first: &CycleLabel,
        joint_states: Vec<ByStamp>,
    ) -> Result<Self, RunError> {
        let nothing = || RunError::NotReplayable(format!("the parameters of {node} are not in it"));
        let told: &ToldParameters = timeline.parameters(node).ok_or_else(nothing)?;
        let store = told.initial::<CycleParameters<T>>()?;
        let CycleParameters { task, joints, goal_frame, settings, period, .. } =
            CycleParameters::<T>::from_store(&store)?;
        let goals = timeline.of(&format!("{namespace}{}", T::GOAL));
        let (goals_before, stops, pauses) = (first.goals, first.stops, first.pauses);
        Ok(Self {
            servo: Servo::new(task, joints, &goal_frame, settings, period)?,
            store,
            changes: told.changes.iter().cloned().collect(),
            joint_states,
            goals: goals.into_iter().map(|(_, goal)| goal).collect(),
            last: CycleLabel { goals: goals_before, stops, pauses, ..CycleLabel::new(T::ARMS.len()) },
            missing: 0,
        })
    }

    /// How many inputs the bag does not have.
    pub fn missing(&self) -> u64 {
        self.missing
    }

    /// One cycle with the inputs that its label names; `logged` is when its command was recorded \[ns\].
    pub fn cycle(&mut self, label: &CycleLabel, logged: i64) -> Result<&[f64], RunError> {
        while self.last.settings < label.settings {
            self.last.settings += 1;
            self.change_parameters()?;
        }
        self.interrupt(label);
        for arm in 0..label.joint_states.len() {
            if self.last.joint_states[arm].0 != label.joint_states[arm].0 {
                self.take_joint_state(arm, label, logged);
            }
        }
        self.take_goals(label);
        self.last.clone_from(label);
        Ok(self.servo.step(label.now)?)
    }

    fn change_parameters(&mut self) -> Result<(), RunError> {
        let Some(event) = self.changes.pop_front() else {
            self.missing += 1;
            return Ok(());
        };
        self.store = self.store.with(&changed(event))?;
        self.servo.configure(CycleParameters::<T>::from_store(&self.store)?.settings);
        Ok(())
    }

    fn interrupt(&mut self, label: &CycleLabel) {
        if label.stops > self.last.stops {
            self.servo.stop();
        }
        if label.pauses > self.last.pauses {
            self.servo.pause(label.paused);
        }
    }

    fn take_joint_state(&mut self, arm: usize, label: &CycleLabel, logged: i64) {
        let same_stamp = self.joint_states[arm].get(&label.joint_states[arm].1);
        // A robot that does not stamp gives many of one stamp.
        let newest = same_stamp
            .and_then(|states| states.iter().rev().find(|(time, _)| *time <= logged).or(states.first()));
        match newest {
            Some((_, state)) => {
                let _ = self.servo.take_joint_state(arm, &state.name, &state.position, label.now);
            }
            None => self.missing += 1,
        }
    }

    fn take_goals(&mut self, label: &CycleLabel) {
        for _ in self.last.goals..label.goals {
            let Some(goal) = self.goals.pop_front() else {
                self.missing += 1;
                continue;
            };
            let (position, orientation) = goal.pose.arrays();
            // What the servo rejected is rejected again.
            let _ = self.servo.take_goal(position, orientation, &goal.header.frame_id, label.now);
        }
    }
}

/// The joint states of each arm.
pub(super) fn recorded_states<T: Wiring>(timeline: &Timeline, namespace: &str) -> Vec<ByStamp> {
    let by_stamp = |arm: &&str| {
        let mut by_stamp = ByStamp::new();
        for (time, state) in timeline.of::<JointState>(&format!("{namespace}{arm}joint_states")) {
            by_stamp.entry(state.header.stamp.nanoseconds()).or_default().push((time, state));
        }
        by_stamp
    };
    T::ARMS.iter().map(by_stamp).collect()
}

/// Whether the joint states from which the cycle's command was made are among these.
pub(super) fn are_recorded(label: &CycleLabel, joint_states: &[ByStamp]) -> bool {
    let mut arms = label.joint_states.iter().zip(joint_states);
    arms.all(|((count, stamp), states)| *count == 0 || states.contains_key(stamp))
}
