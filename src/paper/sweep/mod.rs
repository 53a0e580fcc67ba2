//! (c) Many random tasks under each law: who wins where.

mod chebyshev;
mod dormand_prince;
mod figure;
mod run;
mod solution;
mod summary;

pub(super) use figure::figure;
pub use run::INTERVAL as SETTLING_INTERVAL;
pub use summary::{LawSummary, SweepSummary};

use super::{Laboratory, PaperError};
use crate::batch::{self, Batch, Part};
use crate::control::{Law, nearer_goal};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use serde::{Deserialize, Serialize};
use std::f64::consts::PI;
use std::path::Path;

/// The laws, in the order of every list here.
pub const LAWS: [Law; 3] = [Law::Diffc, Law::Logc, Law::DoubleGeodesic];

/// What a law made of a task.
#[derive(Clone, Copy, Debug, Default, Deserialize, PartialEq, Serialize)]
pub struct Outcome {
    /// When rotation and position had settled to 2 % \[s\]; none where they have not, which is a failure.
    #[serde(rename = "settling_time_2_percent_s")]
    pub settling_time: Option<f64>,
    /// Path length by the distance from start to goal.
    pub path_ratio: f64,
    /// Largest joint speed [rad/s].
    #[serde(rename = "peak_joint_speed_rad_s")]
    pub peak_joint_speed: f64,
}

/// A task and what each law made of it.
#[derive(Clone, Debug, Deserialize, PartialEq, Serialize)]
pub struct Pair {
    /// The number of the task.
    pub task: u32,
    /// Angle between start and goal \[°\].
    pub angle_deg: f64,
    /// Distance between start and goal \[m\].
    pub distance_m: f64,
    /// What each law made of it, in the order of [`LAWS`].
    pub outcomes: [Outcome; 3],
}

/// The sweep's runs in a file, a line a task.
pub struct Sweep<'a> {
    /// The arm, the laws and the constants of the sweep.
    pub lab: &'a Laboratory,
    /// The file: `sweep.jsonl`.
    pub file: &'a Path,
}

impl Sweep<'_> {
    /// Writes the tasks of `part`, going on after those that the file has; `done` is called with how many are done.
    ///
    /// # Errors
    /// As [`Batch::write`]; [`PaperError::Arm`] where the constants are not for this arm.
    pub fn write(&self, part: Part, done: impl Fn(u64)) -> Result<(), PaperError> {
        // The number of tasks is one of 32 bits.
        let line = |number: u64| Ok(batch::line(&pair(self.lab, number as u32)?)?);
        let head = |number: u64| format!("{{\"task\":{number},");
        Batch { file: self.file, runs: part.runs(self.count()), head, line }.write(done)
    }

    /// All tasks.
    ///
    /// # Errors
    /// As [`batch::read`].
    pub fn read(&self) -> Result<Vec<Pair>, PaperError> {
        let mut pairs = Vec::new();
        batch::read(self.file, self.count(), |pair| pairs.push(pair))?;
        Ok(pairs)
    }

    fn count(&self) -> u64 {
        u64::from(self.lab.experiment.sweep.pairs)
    }
}

/// Joint angles at the start and at the goal \[rad\] of the task of that number: a stream of random numbers of its own, so that the
/// order of running does not matter.
pub fn task(lab: &Laboratory, number: u32) -> (Vec<f64>, Vec<f64>) {
    let mut random = ChaCha8Rng::seed_from_u64(lab.experiment.sweep.seed);
    random.set_stream(u64::from(number));
    let mut angles = || (0..lab.chain.joint_count()).map(|_| angle(&mut random)).collect();
    (angles(), angles())
}

fn pair(lab: &Laboratory, number: u32) -> Result<Pair, PaperError> {
    let (start, theta_goal) = task(lab, number);
    let base_from_start = lab.chain.forward_kinematics(&start)?;
    let goal = nearer_goal(&lab.chain.forward_kinematics(&theta_goal)?, &base_from_start);
    let mut outcomes = [Outcome::default(); 3];
    for (outcome, law) in outcomes.iter_mut().zip(LAWS) {
        *outcome = run::run(lab, &lab.controller(law, lab.gain(law)), &goal, &start)?;
    }
    Ok(Pair {
        task: number,
        angle_deg: base_from_start.rotation().angle_to(&goal.rotation()).to_degrees(),
        distance_m: (base_from_start.translation() - goal.translation()).norm(),
        outcomes,
    })
}

/// An angle in [−π, π).
fn angle(random: &mut ChaCha8Rng) -> f64 {
    // The 53 highest bits make a number in [0, 1).
    let unit = (random.next_u64() >> 11) as f64 / (1_u64 << 53) as f64;
    (2.0 * unit - 1.0) * PI
}
