//! The parameters of the servo for two arms.

use super::common::{NO_POSE, PoseNumbers, check_names, pose};
use super::cycle::{CommonParameters, DampingParameters, Frames, RightArm};
use super::scene::RightBody;
use super::{ArmParameters, NodeParameters, ServoParameters, described};
use dq_algebra::UnitDualQuaternion;
use dq_core::servo::POSITIVE;
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
    #[parameter(group)]
    right: RightParameters,
    /// form of the law of two arms: J^T K e (as in the paper) or J^+ K e
    #[parameter(one_of = Map::NAMES, default = Map::DampedInverse)]
    controller: Map,
    /// what the law controls: this component of the relative pose, which is the pose of the right tool in the left tool's frame
    #[parameter(one_of = Aim::RELATIVE_NAMES, default = Aim::Position.relative_name())]
    primitive: String,
    /// gain K of the law in the form J^T K e
    #[parameter(name = "gains.transpose", default = 10.0, range = POSITIVE..=1e4)]
    transpose: f64,
    /// gain K of the law in the form J^+ K e [1/s]
    #[parameter(name = "gains.damped_inverse", default = 1.0, range = POSITIVE..=100.0)]
    inverse: f64,
    #[parameter(group)]
    damping: DampingParameters,
}

/// The parameters of the right arm. If none is set, the right arm is like the left arm.
#[derive(Parameters)]
#[parameters(prefix = "right_")]
struct RightParameters {
    /// joint names of the right arm, base first. Empty: the same names as those of the left arm, on the topics of the right arm
    #[parameter(fixed)]
    joints: Vec<String>,
    /// name of the frame of the right arm's base, if the right arm has a description of its own
    #[parameter(fixed)]
    base_frame: String,
    /// name of the frame of the right arm's tool; not needed if the right arm is like the left one
    #[parameter(fixed)]
    tool_frame: String,
    /// URDF of the right arm; not needed if robot_description has both arms, or if the right arm is like the left one
    #[parameter(fixed)]
    robot_description: String,
    /// file that contains the right_robot_description
    // The node reads the file when it starts; afterwards `right_robot_description` has the arm.
    #[parameter(name = "robot_file", fixed)]
    _robot_file: String,
    /// capsules around the links of the right arm, written as in body, the left arm's parameter. Empty: the left arm's capsules, if
    /// the right arm is like the left one; otherwise the defaults of body
    #[parameter()]
    body: Vec<String>,
}

impl RightParameters {
    /// Returns the right arm, whose base is at `base` in the left arm's base frame.
    fn arm(self, left: &ArmParameters, base: UnitDualQuaternion) -> Result<RightArm, ParameterError> {
        let Self { joints, base_frame, tool_frame, robot_description: text, body: texts, .. } = self;
        let joints = if joints.is_empty() { left.joints.clone() } else { joints };
        check_names("right_joints", &joints)?;
        if !text.is_empty() {
            let described = described::read(&text, "right_robot_description", &base_frame, &tool_frame)?;
            let chain = described::chain(&described, "right_joints", &joints)?.standing_at(&base);
            let links = described.arm.links().map(|joint| joint.name.clone()).collect();
            return Ok(RightArm { chain, joints, body: Some(RightBody { texts, joints: links, base }) });
        }
        for (name, frame) in [("right_base_frame", base_frame), ("right_tool_frame", tool_frame)] {
            if !frame.is_empty() {
                let expected = "empty without a description: give robot_description or robot_file";
                return Err(ParameterError::invalid(name, format!("{frame:?}"), expected));
            }
        }
        if joints.len() != left.joints.len() {
            let expected = format!("{} names, as the right arm is like the left one", left.joints.len());
            return Err(ParameterError::invalid("right_joints", format!("{joints:?}"), expected));
        }
        let body = (!texts.is_empty()).then(|| RightBody { texts, joints: left.link_joints(), base });
        Ok(RightArm { chain: left.chain.clone().standing_at(&base), joints, body })
    }
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
        let frames = frames(&arm.tool_frame, &two.right.tool_frame);
        let right = two.right.arm(&arm, pose("right_base", two.right_base)?)?;
        common.build(&arm, Some(right), frames).map(Self)
    }
}

/// Returns the names of the two tools' frames. If `right` is empty or equal to `left`, the names are `left` with the prefixes
/// `left/` and `right/`. These prefixes are the namespaces of the plants.
fn frames(left: &str, right: &str) -> Frames {
    if right.is_empty() || right == left {
        let [goal, tool] = ["left", "right"].map(|side| format!("{side}/{left}"));
        return Frames { goal, tool };
    }
    Frames { goal: left.to_owned(), tool: right.to_owned() }
}
