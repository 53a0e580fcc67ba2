//! One arm, one task, several laws: what the figures and the comparison are made of.

use super::simulation::follow;
use super::{Experiment, PaperError, Trajectory};
use dq_algebra::UnitDualQuaternion;
use dq_core::servo::{Arms, Settings};
use dq_kinematics::arm::Chain;
use dq_kinematics::control::{Controller, Law, nearer_goal};

/// The arm, its parameters and the constants of the experiments.
#[derive(Clone, Debug)]
pub struct Laboratory {
    /// The arm that is simulated.
    pub chain: Chain,
    /// The servo's settings, of which damping and tolerances are used.
    pub settings: Settings,
    /// The constants of the experiments.
    pub experiment: Experiment,
}

/// A law driving the arm from start to goal.
#[derive(Clone, Debug)]
pub struct SimulatedRun {
    /// The law with its gains.
    pub controller: Controller,
    /// The goal, with the sign in force.
    pub goal: UnitDualQuaternion,
    /// The joint angles.
    pub trajectory: Trajectory,
    /// The tool's poses at the same times.
    pub poses: Vec<UnitDualQuaternion>,
}

impl Laboratory {
    /// The laboratory's controller with this law, and `gain` for all of its gains [1/s].
    pub fn controller(&self, law: Law, gain: f64) -> Controller {
        self.settings.controller.with_law(law, gain)
    }

    /// The gain that the comparison gives the law [1/s].
    pub fn gain(&self, law: Law) -> f64 {
        if law == Law::Diffc { self.experiment.diffc.gain } else { self.experiment.comparison.gain }
    }

    /// The paper's goal.
    ///
    /// # Errors
    /// [`PaperError::Arm`] where the constants are not for this arm.
    pub fn goal(&self) -> Result<UnitDualQuaternion, PaperError> {
        Ok(self.chain.forward_kinematics(&self.experiment.theta_desired)?)
    }

    /// The paper's motion under `controller` for `duration` \[s\].
    ///
    /// # Errors
    /// [`PaperError`].
    pub fn run(&self, controller: Controller, duration: f64) -> Result<SimulatedRun, PaperError> {
        self.run_on(&self.chain, controller, duration)
    }

    /// The paper's motion with `chain` in place of the laboratory's arm.
    ///
    /// # Errors
    /// [`PaperError`].
    pub fn run_on(
        &self,
        chain: &Chain,
        controller: Controller,
        duration: f64,
    ) -> Result<SimulatedRun, PaperError> {
        let Experiment { theta_initial, theta_desired, .. } = &self.experiment;
        let goal = chain.forward_kinematics(theta_desired)?;
        let start = chain.forward_kinematics(theta_initial)?;
        let goal = nearer_goal(&goal, &start);
        let arm = Arms::one(chain.clone());
        let trajectory = follow(arm.clone(), &controller, &goal, theta_initial, duration)?;
        let poses = trajectory.poses(arm);
        Ok(SimulatedRun { controller, goal, trajectory, poses })
    }
}
