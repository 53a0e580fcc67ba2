//! One arm and one task under several laws, for the figures and the comparison.

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
    /// The servo's settings. Only the controller and the goal tolerances are used.
    pub settings: Settings,
    /// The constants of the experiments.
    pub experiment: Experiment,
}

/// A simulated motion from start to goal under a law.
#[derive(Clone, Debug)]
pub struct SimulatedRun {
    /// The law with its gains.
    pub controller: Controller,
    /// The goal pose. The quaternions q and −q are the same pose; this is the one that is nearer to the start pose.
    pub goal: UnitDualQuaternion,
    /// The joint angles over time.
    pub trajectory: Trajectory,
    /// The tool's pose at each time of the trajectory.
    pub poses: Vec<UnitDualQuaternion>,
}

impl Laboratory {
    /// Returns the controller with this law, and with the gains that correspond to the single gain `gain` [1/s].
    pub fn controller(&self, law: Law, gain: f64) -> Controller {
        self.settings.controller.with_law(law, gain)
    }

    /// Returns the law's gain in the comparison [1/s].
    pub fn gain(&self, law: Law) -> f64 {
        if law == Law::Diffc { self.experiment.diffc.gain } else { self.experiment.comparison.gain }
    }

    /// Returns the paper's goal.
    ///
    /// # Errors
    /// [`PaperError::Arm`] if the constants do not match the arm.
    pub fn goal(&self) -> Result<UnitDualQuaternion, PaperError> {
        Ok(self.chain.forward_kinematics(&self.experiment.theta_desired)?)
    }

    /// Simulates the paper's motion under `controller` for `duration` \[s\].
    ///
    /// # Errors
    /// [`PaperError`] if the simulation fails.
    pub fn run(&self, controller: Controller, duration: f64) -> Result<SimulatedRun, PaperError> {
        self.run_on(&self.chain, controller, duration)
    }

    /// Simulates the paper's motion with `chain` instead of the laboratory's arm.
    ///
    /// # Errors
    /// [`PaperError`] if the simulation fails.
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
