//! The parameters of the servo for two arms.

use super::common::{NO_POSE, pose};
use super::ranges::POSITIVE;
use super::{ArmParameters, NodeParameters, ServoParameters};
use dq_algebra::UnitDualQuaternion;
use dq_core::servo::Arms;
use dq_kinematics::control::{Aim, Controller, Damping, Map};
use dq_params::{Declarer, ParameterError};

/// The parameters that declare those of the servo for two arms.
#[derive(Clone, Debug, PartialEq)]
pub struct DualParameters(pub ServoParameters);

impl NodeParameters for DualParameters {
    const NODE_NAME: &'static str = "dq_dual_servo";

    fn declare(p: &mut Declarer) -> Result<Self, ParameterError> {
        let arm = ArmParameters::declare(p)?;
        let right = arm.chain.clone().standing_at(&right_base(p)?);
        let arms = Arms::two(arm.chain.clone(), right);
        // The plants' frames are told apart by the prefix that is their namespace.
        let frames = (format!("left/{}", arm.tool_frame), format!("right/{}", arm.tool_frame));
        ServoParameters::declare_cycle(p, &arm, 2, frames, arms, controller)?.checked().map(Self)
    }
}

fn controller(p: &mut Declarer, damping: Damping) -> Result<Controller, ParameterError> {
    let map = p
        .one_of("controller", Map::NAMES, Map::DampedInverse)
        .live("", "the form of the two-arm law: J^T K e (the paper) or J^+ K e");
    let primitive = p
        .one_of("primitive", Aim::RELATIVE_NAMES, Aim::Position.relative_name().to_owned())
        .live("", "what of the right tool's pose, seen from the left tool, is controlled");
    let aim = Aim::from_relative_name(&primitive).unwrap_or(Aim::Position);
    let transpose = p.double("gains.transpose", 10.0, POSITIVE..=1e4).live("", "K of the transposed form");
    let inverse =
        p.double("gains.damped_inverse", 1.0, POSITIVE..=100.0).live("1/s", "K of the inverse form");
    let gain = if map == Map::Transpose { transpose } else { inverse };
    Ok(Controller::of_two_arms(map, aim, gain, damping))
}

fn right_base(p: &mut Declarer) -> Result<UnitDualQuaternion, ParameterError> {
    let base = p
        .doubles("right_base", &NO_POSE)
        .fixed("", "the right arm's base in the left arm's base frame: x y z [m], then qx qy qz qw");
    pose(&base)
}
