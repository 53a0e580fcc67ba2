//! Tests the gains of the built-in arms.

use dq_config::ARMS;
use dq_kinematics::control::Law;
use dq_studies::compare::{Arm, ClosedLoop, Outcome, PLANTS, Task, sign_test};
use std::path::Path;

/// The number of tasks on which a gain is chosen, and the seed of these tasks. The comparison does not use this seed.
const TASKS: u32 = 50;
const SEED: u64 = 0x6761_696e;

/// The candidates [1/s]. With 8, half of the motions of some arms overshoot by more than the tolerance, and no arm settles faster by a
/// quarter.
const GAINS: [f64; 3] = [1.0, 2.0, 4.0];

/// The results of the laws on an arm's tasks under the arm's limits, with one age of the joint states.
struct Runs {
    settled: Vec<bool>,
    times: Vec<f64>,
    overshoots: Vec<f64>,
}

impl Runs {
    fn of(arm: &Arm, tasks: &[Task], gain: f64, plant: usize) -> Self {
        let controller = arm.parameters.settings.controller.with_law(Law::Logc, gain);
        let closed_loop = ClosedLoop { arm, controller, plant: PLANTS[plant], limits: true };
        let ended = tasks.iter().zip(0..).map(|(task, number)| closed_loop.run(task, number).unwrap());
        let ended: Vec<_> = ended.collect();
        let settled: Vec<_> = ended.iter().map(|end| end.outcome == Outcome::Settled).collect();
        let of_settled = |figure: &dyn Fn(usize) -> f64| {
            let mut all: Vec<_> = (0..ended.len()).filter(|at| settled[*at]).map(figure).collect();
            all.sort_by(f64::total_cmp);
            all
        };
        let times = of_settled(&|at| ended[at].figures.settling_time().unwrap());
        let overshoots = of_settled(&|at| ended[at].figures.overshoot);
        Self { settled, times, overshoots }
    }

    /// Returns whether significantly fewer tasks settle than with `other`, which has the same tasks.
    fn is_worse_than(&self, other: &Self) -> bool {
        let pairs = || self.settled.iter().zip(&other.settled);
        let (lost, won) =
            (pairs().filter(|(a, b)| !**a && **b).count(), pairs().filter(|(a, b)| **a && !**b).count());
        lost > won && sign_test(lost, won) < 0.05
    }
}

fn median(sorted: &[f64]) -> f64 {
    sorted[sorted.len() / 2]
}

/// Returns the gain of logc. It is the largest one with which not significantly fewer tasks settle than with any smaller one, and
/// half of the motions overshoot by at most the tolerance. Both conditions hold under the arm's limits, with joint states of age 0
/// and 20 ms.
fn choice(arm: &Arm) -> f64 {
    let tasks: Vec<_> = (0..TASKS).map(|number| arm.task(SEED, number).unwrap()).collect();
    let tolerance = arm.parameters.settings.goal_tolerance.linear;
    let ages = [0, 2].map(|plant| GAINS.map(|gain| Runs::of(arm, &tasks, gain, plant)));
    for (age, runs) in ["0", "20"].iter().zip(&ages) {
        for (gain, runs) in GAINS.iter().zip(runs) {
            println!(
                "{} at {age} ms, {gain} 1/s: {} of {TASKS} settle, median {:.2} s, {:.1} mm past the goal",
                arm.name,
                runs.times.len(),
                median(&runs.times),
                median(&runs.overshoots) * 1e3
            );
        }
    }
    let is_good = |at: usize| {
        ages.iter().all(|runs| {
            let before = &runs[..at];
            !before.iter().any(|less| runs[at].is_worse_than(less))
                && median(&runs[at].overshoots) <= tolerance
        })
    };
    GAINS[(0..GAINS.len()).rev().find(|at| is_good(*at)).unwrap()]
}

#[test]
fn each_built_in_arm_has_the_gains_that_its_tasks_choose() {
    // The PUMA 560 has the gain of the reference work.
    let chosen = ARMS.into_iter().filter(|(name, _)| *name != "puma560").map(|(name, _)| {
        let arm = Arm::named(Path::new(name)).unwrap();
        let gains = arm.parameters.settings.controller.gains(Law::Logc);
        (name, gains, [choice(&arm); 2])
    });
    let wrong: Vec<_> = chosen.filter(|(_, gains, choice)| gains != choice).collect();
    assert!(wrong.is_empty(), "{wrong:?}");
}
