//! The parameters of the servo for two arms.

use super::common::{NO_POSE, pose};
use super::cycle::CycleParameters;
use super::ranges::POSITIVE;
use super::{ArmParameters, NodeParameters};
use crate::control::{Cooperative, Damping, Feedback, Primitive};
use crate::dq::UnitDualQuaternion;
use crate::params::{Declarer, ParameterError};
use crate::servo::TwoArms;

/// The two-arm servo's parameters.
pub type DualParameters = CycleParameters<TwoArms>;

impl NodeParameters for DualParameters {
    const NODE_NAME: &'static str = "dq_dual_servo";

    fn declare(p: &mut Declarer) -> Result<Self, ParameterError> {
        let arm = ArmParameters::declare(p)?;
        let right = arm.chain.clone().standing_at(&right_base(p)?);
        let task = TwoArms::new(arm.chain.clone(), right);
        // The plants' frames are told apart by the prefix that is their namespace.
        let frames = (format!("left/{}", arm.tool_frame), format!("right/{}", arm.tool_frame));
        Self::declare_cycle(p, &arm, 2, frames, task, controller)?.checked()
    }
}

fn controller(p: &mut Declarer, damping: Damping) -> Result<Cooperative, ParameterError> {
    Ok(Cooperative {
        feedback: p
            .one_of("controller", Feedback::NAMES, Feedback::DampedInverse)
            .live("", "the form of the two-arm law: J^T K e (the paper) or J^+ K e"),
        primitive: p
            .one_of("primitive", Primitive::NAMES, Primitive::RelativePosition)
            .live("", "what of the right tool's pose, seen from the left tool, is controlled"),
        transpose_gain: p
            .double("gains.transpose", 10.0, POSITIVE..=1e4)
            .live("", "K of the transposed form"),
        inverse_gain: p
            .double("gains.damped_inverse", 1.0, POSITIVE..=100.0)
            .live("1/s", "K of the inverse form"),
        damping,
    })
}

fn right_base(p: &mut Declarer) -> Result<UnitDualQuaternion, ParameterError> {
    let base = p
        .doubles("right_base", &NO_POSE)
        .fixed("", "the right arm's base in the left arm's base frame: x y z [m], then qx qy qz qw");
    pose(&base)
}
