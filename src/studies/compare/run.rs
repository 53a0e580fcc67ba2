//! One run of the comparison: a law on an arm under certain conditions.

use super::arm::Arm;
use super::conditions::Plant;
use super::matching::Matched;
use dq_kinematics::control::Law;

/// One run of the comparison.
#[derive(Clone, Copy)]
pub(super) struct Run<'a> {
    pub matched: Matched,
    pub law: Law,
    pub arm: &'a Arm,
    pub limits: bool,
    pub plant: Plant,
    pub task: u32,
    pub gain: f64,
}
