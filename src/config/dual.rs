//! The parameters of the servo for two arms.

use super::common::{NO_POSE, PoseNumbers, pose};
use super::cycle::{CommonParameters, DampingParameters, Frames};
use super::{ArmParameters, NodeParameters, ServoParameters};
use dq_core::servo::{Arms, POSITIVE};
use dq_kinematics::control::{Aim, Controller, Map};
use dq_params::{Declarer, ParameterError, Parameters};

/// The parameters of the servo for two arms, typed and checked as a whole.
#[derive(Clone, Debug, PartialEq)]
pub struct DualParameters(pub ServoParameters);

/// The parameters that only the servo for two arms has.
#[derive(Parameters)]
struct TwoArmParameters {
    /// pose of the right arm's base in the left arm's base frame: x y z \[m\], then qx qy qz qw
    #[parameter(default = NO_POSE, fixed)]
    right_base: PoseNumbers,
    /// form of the law of two arms: J^T K e (as in the paper) or J^+ K e
    #[parameter(one_of = Map::NAMES, default = Map::DampedInverse)]
    controller: Map,
    /// component of the right tool's pose relative to the left tool that the law controls
    #[parameter(one_of = Aim::RELATIVE_NAMES, default = Aim::Position.relative_name())]
    primitive: String,
    /// gain K of the transposed form
    #[parameter(name = "gains.transpose", default = 10.0, range = POSITIVE..=1e4)]
    transpose: f64,
    /// gain K of the inverse form [1/s]
    #[parameter(name = "gains.damped_inverse", default = 1.0, range = POSITIVE..=100.0)]
    inverse: f64,
    #[parameter(group)]
    damping: DampingParameters,
}

impl NodeParameters for DualParameters {
    const NODE_NAME: &'static str = "dq_dual_servo";
}

impl Parameters for DualParameters {
    fn declare(p: &mut Declarer) -> Result<Self, ParameterError> {
        let arm = ArmParameters::declare(p)?;
        let two = TwoArmParameters::declare(p)?;
        let mut common = CommonParameters::declare(p)?;
        let aim = Aim::from_relative_name(&two.primitive).unwrap_or(Aim::Position);
        let gain = if two.controller == Map::Transpose { two.transpose } else { two.inverse };
        common.settings.controller = Controller::of_two_arms(two.controller, aim, gain, two.damping.into());
        let right = arm.chain.clone().standing_at(&pose("right_base", two.right_base)?);
        // The frames of the two plants differ by a prefix: the namespace of the plant.
        let [goal, tool] = ["left", "right"].map(|side| format!("{side}/{}", arm.tool_frame));
        common.build(&arm, Arms::two(arm.chain.clone(), right), Frames { goal, tool }).map(Self)
    }
}
