//! Compares how many tasks settle under the servo's limits for two values of a parameter.
//!
//! Start and goal of each task are tool poses at joint positions within the limits, so all goals can be reached. Each law runs
//! each task once with each value of the parameter. The joint states have no delay or noise, and each law has its gain for equal
//! settling time.

use super::closed_loop::{ClosedLoop, HORIZON};
use super::conditions::PLANTS;
use super::paired::{Counts, End, Paired};
use super::{Arm, CompareError, Gain, Matched, Study};
use dq_check::Gaps;
use dq_core::servo::Reconfigure;
use dq_kinematics::control::Law;
use dq_params::Value;
use dq_space::space::Scene;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use std::sync::Arc;
use std::time::Duration;

/// A servo parameter. A study can run every task with two values of the parameter, and compare the results.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Switch {
    /// Whether a stalled arm moves to another configuration: never or always.
    Reconfigure,
    /// Whether the law has constraints that keep the arm away from keep-outs, from itself, and from its joint limits.
    Constraints,
    /// Whether the joints of a redundant arm return to the posture in which the motion began.
    Posture,
}

impl Switch {
    /// Returns the name of the parameter.
    pub fn parameter(self) -> &'static str {
        match self {
            Self::Reconfigure => "reconfigure",
            Self::Constraints => "constraints",
            Self::Posture => "posture.gain",
        }
    }

    fn values(self) -> [Value; 2] {
        match self {
            Self::Reconfigure => {
                [Reconfigure::Never, Reconfigure::Always].map(|way| Value::String(way.name().to_owned()))
            }
            Self::Constraints => [false, true].map(Value::Bool),
            Self::Posture => [0.0, 1.0].map(Value::Double),
        }
    }

    /// Returns the two values of the parameter that are compared, as text.
    pub fn names(self) -> [String; 2] {
        self.values().map(|value| value.to_string())
    }

    /// Returns the time after which a loop that has not settled counts as failed.
    pub fn horizon(self) -> Duration {
        match self {
            // A reconfiguration begins only after the motion has stalled, which takes `progress_timeout`.
            Self::Reconfigure => Duration::from_secs(60),
            Self::Constraints | Self::Posture => HORIZON,
        }
    }
}

/// The results of the comparison of two values of a parameter. The file is `reconfigure.json`, `constraints.json` or
/// `posture.gain.json`.
#[derive(Clone, Debug, Deserialize, PartialEq, Serialize)]
pub struct SwitchFindings {
    /// The number of tasks for each law on each arm.
    pub tasks: u32,
    /// The seed of the tasks.
    pub seed: u64,
    /// The gains of each law.
    pub gains: Vec<Gain>,
    /// The results of each law on each arm. The two numbers of a pair are for the first and for the second value of the parameter.
    pub cells: Vec<Counts>,
}

impl SwitchFindings {
    /// Summarizes the results `rows` of [`Study::switched`].
    pub fn new(study: &Study, rows: &[Paired]) -> Self {
        let gains =
            study.gains.iter().filter(|gain| gain.matched == Matched::SettlingTime).cloned().collect();
        Self { tasks: study.tasks, seed: study.seed, gains, cells: rows.iter().map(Paired::counts).collect() }
    }
}

impl Study {
    /// Returns how many loops [`switched`](Self::switched) runs.
    pub fn switched_count(&self) -> u64 {
        2 * (self.laws.len() * self.arms.len()) as u64 * u64::from(self.tasks)
    }

    /// Runs every law on every arm with both values of the parameter. Calls `done` after each loop.
    ///
    /// # Errors
    /// The first error of a simulated run. In practice, no simulated run fails.
    pub fn switched(&self, switch: Switch, done: impl Fn() + Sync) -> Result<Vec<Paired>, CompareError> {
        let row = |cell: SwitchedCell| {
            let both = |number| {
                let ends = self.both_ends(&cell, number, switch);
                (0..2).for_each(|_| done());
                ends
            };
            let tasks = (0..self.tasks).into_par_iter().map(both).collect::<Result<_, CompareError>>()?;
            Ok(Paired { law: cell.law.name().to_owned(), arm: cell.ways[0].name.clone(), tasks })
        };
        self.switched_cells(switch)?.into_iter().map(row).collect()
    }

    /// Returns one cell for each pair of a law and an arm. The cell has the arm twice, once with each value of the parameter.
    pub(super) fn switched_cells(&self, switch: Switch) -> Result<Vec<SwitchedCell>, CompareError> {
        let with = |arm: &Arm, switch: Switch, value: &Value| {
            arm.with([(switch.parameter().to_owned(), value.clone())])
        };
        let [first, second] = switch.values();
        let cell = |(law, arm)| {
            let body = with(arm, Switch::Constraints, &Value::Bool(true))?.parameters.settings.scene;
            Ok(SwitchedCell { law, ways: [with(arm, switch, &first)?, with(arm, switch, &second)?], body })
        };
        self.laws.iter().flat_map(|law| self.arms.iter().map(move |arm| (*law, arm))).map(cell).collect()
    }

    /// Runs the task `number` with each of the two values of the parameter. Returns how each run ends, and whether the arm passes
    /// through itself.
    pub(super) fn both_ends(
        &self,
        SwitchedCell { law, ways, body }: &SwitchedCell,
        number: u32,
        switch: Switch,
    ) -> Result<[End; 2], CompareError> {
        let end = |arm: &Arm| {
            let gain = self.gain(Matched::SettlingTime, &arm.name, *law);
            let controller = arm.parameters.settings.controller.with_law(*law, gain);
            let closed_loop = ClosedLoop { arm, controller, plant: PLANTS[0], limits: true };
            let (mut gaps, mut through_itself) = (body.clone().map(Gaps::new), false);
            let see = |theta: &[f64]| {
                let chains = arm.parameters.arms.chains();
                through_itself |= gaps.as_mut().is_some_and(|gaps| gaps.check(chains, theta).is_err());
            };
            let task = arm.task(self.seed, number)?;
            let (ended, words) = closed_loop.run_for(&task, number, switch.horizon(), see)?;
            Ok::<_, CompareError>(End { settled: ended.settled(), through_itself, words })
        };
        let [first, second] = ways;
        Ok([end(first)?, end(second)?])
    }
}

/// A law, and an arm twice: once with each of the two values of a parameter.
pub(super) struct SwitchedCell {
    law: Law,
    ways: [Arm; 2],
    /// The arm's body, with which the program checks whether the arm passes through itself.
    body: Option<Arc<Scene>>,
}
