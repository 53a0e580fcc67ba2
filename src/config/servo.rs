//! The parameters of the servo for one arm.

use super::{ArmParameters, NodeParameters, ServoParameters};
use dq_core::servo::{Arms, GoalFrameMode, GoalFrames, Posture};
use dq_kinematics::arm::bounds;
use dq_kinematics::control::{Aim, Controller, Damping, Law, LawGains};
use dq_params::{Declarer, ParameterError};
use std::time::Duration;

impl NodeParameters for ServoParameters {
    const NODE_NAME: &'static str = "dq_servo";

    fn declare(p: &mut Declarer) -> Result<Self, ParameterError> {
        let arm = ArmParameters::declare(p)?;
        let arms = Arms::one(arm.chain.clone());
        let posture = posture(p, &arm);
        let frames = (arm.base_frame.clone(), arm.tool_frame.clone());
        let mut parameters = Self::declare_cycle(p, &arm, 1, frames, arms, controller)?;
        parameters.settings.posture = posture?;
        parameters.settings.goal_frames = goal_frames(p);
        parameters.checked()
    }
}

/// Of one arm alone: a relative goal of two has no frame but the left tool.
fn goal_frames(p: &mut Declarer) -> GoalFrames {
    let default = GoalFrames::default();
    let timeout = p
        .double("transform_timeout", default.transform_timeout.as_secs_f64(), 0.0..=2.0)
        .live("s", "how long a goal in a frame of TF waits for its transform, and how long a frame that is followed may be silent");
    let mode = p.one_of("goal_frame_mode", GoalFrameMode::NAMES, default.mode).live(
        "",
        "what becomes of the next goal in a frame of TF: latch, it stays where it was at its stamp; follow, it moves with its frame",
    );
    GoalFrames { mode, transform_timeout: Duration::from_secs_f64(timeout) }
}

fn posture(p: &mut Declarer, arm: &ArmParameters) -> Result<Posture, ParameterError> {
    let positions = p.doubles("posture.positions", &[]).within(-bounds::JOINT_ANGLE..=bounds::JOINT_ANGLE).live(
        "rad, m",
        "where the joints of an arm of more than the task needs go as far as the tool leaves them free, one a joint; empty: nowhere",
    );
    let gain = p.double("posture.gain", 0.0, 0.0..=10.0).live("1/s", "how fast they go there; 0: not at all");
    let positions = positions.exactly_or_none(arm.joints.len())?.unwrap_or_default();
    Ok(Posture { positions: positions.to_vec(), gain })
}

fn controller(p: &mut Declarer, damping: Damping) -> Result<Controller, ParameterError> {
    let law = p.one_of("controller", Law::names(), Law::Logc).live(
        "",
        "the control law in force; a switch takes effect in the next cycle, without a step in the command",
    );
    let aim = p.one_of("task", Aim::NAMES, Aim::Pose).live(
        "",
        "what of the goal's pose the tool is asked for, the rest is free: all of it, its position, its position and where its z axis points, its orientation, or its distance from the base",
    );
    let mut controller = Controller { law, aim, damping, ..Controller::default() };
    for law in Law::all() {
        controller.set_gains(law, gains(p, law)?);
    }
    Ok(controller)
}

fn gains(p: &mut Declarer, law: Law) -> Result<[f64; 2], ParameterError> {
    let LawGains { names, defaults, range, unit, about } = law.gains();
    match names.len() {
        1 => Ok([p.double(law.parameter(), defaults[0], range).live(unit, about), defaults[1]]),
        _ => p.doubles(law.parameter(), &defaults).within(range).live(unit, about).array(),
    }
}
