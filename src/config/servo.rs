//! The parameters of the servo for one arm.

use super::common::exactly_or_none;
use super::cycle::{CommonParameters, DampingParameters, Frames};
use super::{ArmParameters, NodeParameters, ServoParameters};
use dq_core::servo::{Compliance, GoalFrames, Posture};
use dq_kinematics::control::{Aim, Controller, Law, LawGains};
use dq_params::{Constraint, Declaration, Declarer, ParameterError, Parameters, Value};

/// The parameters that only the servo of one arm has. The servo of two arms has no [`GoalFrames`], because its goal is always the
/// pose of the right tool relative to the left tool.
#[derive(Parameters)]
struct OneArmParameters {
    /// control law; a switch takes effect in the next cycle, without a step in the command
    #[parameter(one_of = Law::names(), default = Law::Logc)]
    controller: Law,
    /// what the tool must share with the goal: the whole pose, the position, the position and the direction of the z axis, the
    /// orientation, or the distance from the base. The rest of the tool's pose is free
    #[parameter(one_of = Aim::NAMES, default = Aim::Pose)]
    task: Aim,
    #[parameter(group)]
    damping: DampingParameters,
    #[parameter(group)]
    posture: Posture,
    #[parameter(group)]
    goal_frames: GoalFrames,
    /// whether goals yield to the wrench at the tool
    #[parameter(name = "contact.compliance")]
    compliance: bool,
    #[parameter(group)]
    contact: Compliance,
}

impl NodeParameters for ServoParameters {
    const NODE_NAME: &'static str = "dq_servo";
}

impl Parameters for ServoParameters {
    fn declare(p: &mut Declarer) -> Result<Self, ParameterError> {
        let arm = ArmParameters::declare(p)?;
        let one_arm = OneArmParameters::declare(p)?;
        let gains = Law::all().map(|law| Ok((law, gains(p, law)?))).collect::<Result<Vec<_>, _>>()?;
        let mut common = CommonParameters::declare(p)?;
        let OneArmParameters {
            controller: law,
            task: aim,
            damping,
            posture,
            goal_frames,
            compliance,
            contact,
        } = one_arm;
        let mut controller = Controller { law, aim, damping: damping.into(), ..Controller::default() };
        gains.into_iter().for_each(|(law, gains)| controller.set_gains(law, gains));
        exactly_or_none("posture.positions", &posture.positions, arm.joints.len())?;
        (common.settings.controller, common.settings.posture) = (controller, posture);
        common.settings.goal_frames = goal_frames;
        common.settings.contact = compliance.then_some(contact);
        let frames = Frames { goal: arm.base_frame.clone(), tool: arm.tool_frame.clone() };
        common.build(&arm, None, frames)
    }
}

fn gains(p: &mut Declarer, law: Law) -> Result<[f64; 2], ParameterError> {
    let LawGains { names, defaults, range, unit, about } = law.gains();
    let declaration = |default| Declaration {
        name: law.parameter(),
        default,
        constraint: Constraint::from(range),
        unit,
        description: about,
        read_only: false,
        required: false,
    };
    match names.len() {
        1 => Ok([p.read(declaration(Value::from(defaults[0])))?, defaults[1]]),
        _ => p.read(declaration(Value::from(defaults))),
    }
}
