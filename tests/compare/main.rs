//! Tests the comparison of the laws: its loops, its files, its page.

mod arms;
mod files;
mod gains;
mod loops;
mod page;
mod pairs;
mod peers;
mod switch;

use dq_kinematics::control::Law;
use dq_studies::compare::{Arm, Findings, Gain, Matched, Study};

/// The number of conditions: four plants without and with limits, and ideal plants with gains for equal peak speed, without and
/// with limits.
const CONDITIONS: usize = 2 * 6 + 2;

/// Returns the `compare.json` from which the committed page was written.
pub fn committed() -> Findings {
    serde_json::from_str(include_str!("../data/compare.json")).unwrap()
}

/// Returns the built-in arm with this name.
pub fn arm(name: &str) -> Arm {
    Arm::builtin().unwrap().into_iter().find(|arm| arm.name == name).unwrap()
}

/// Returns a study of the PUMA 560 with arbitrary gains.
pub fn study(tasks: u32, seed: u64) -> Study {
    let gain = |matched: Matched, law: Law| Gain {
        matched,
        law: law.name().to_owned(),
        arm: "puma560".to_owned(),
        gain: 4.0,
        target: 1.0,
        reached: Some(1.0),
    };
    let gains = Matched::ALL.iter().flat_map(|matched| Law::ALL.map(|law| gain(*matched, law)));
    let (gains, arms) = (gains.collect(), vec![arm("puma560")]);
    Study { gains, arms, laws: Law::ALL.to_vec(), tasks, seed }
}
