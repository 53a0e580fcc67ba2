//! Measures the computation time of one step of each law.

use super::{CompareError, Study};
use dq_kinematics::arm::ArmState;
use serde::{Deserialize, Serialize};
use std::hint::black_box;
use std::time::Instant;

/// The time that this machine needs to compute one step of a law: the kinematics, and the joint velocity.
#[derive(Clone, Debug, Deserialize, PartialEq, Serialize)]
pub struct StepTime {
    /// The name of the law.
    pub law: String,
    /// The time of one step on the first arm \[ns\]: median, minimum and maximum of nine measurements.
    pub ns: [f64; 3],
}

/// Measures every law on the first arm's tasks. Returns an empty list in a build without optimization, because its times would mean
/// nothing.
///
/// # Errors
/// [`CompareError`] if a task does not fit the arm. This does not happen in practice.
pub fn step_times(study: &Study) -> Result<Vec<StepTime>, CompareError> {
    const ROUNDS: usize = 9;
    let Some(arm) = study.arms.first().filter(|_| !cfg!(debug_assertions)) else { return Ok(Vec::new()) };
    let tasks = (0..200).map(|number| arm.task(study.seed, number)).collect::<Result<Vec<_>, _>>()?;
    let chain = arm.parameters.arms.chain();
    let (mut state, mut theta_dot) = (ArmState::new(chain), vec![0.0; arm.joint_count()]);
    let mut all = Vec::new();
    for law in study.laws.iter().copied() {
        let controller = arm.parameters.settings.controller.with_law(law, 1.0);
        let mut rounds = Vec::with_capacity(ROUNDS);
        for _ in 0..ROUNDS {
            let begin = Instant::now();
            for task in &tasks {
                chain.evaluate(black_box(&task.start), &mut state)?;
                controller.joint_velocity(&state, black_box(&task.base_from_goal), &mut theta_dot);
                black_box(&theta_dot);
            }
            rounds.push(begin.elapsed().as_nanos() as f64 / tasks.len() as f64);
        }
        rounds.sort_by(f64::total_cmp);
        let ns = [rounds[ROUNDS / 2], rounds[0], rounds[ROUNDS - 1]].map(f64::round);
        all.push(StepTime { law: law.name().to_owned(), ns });
    }
    Ok(all)
}
