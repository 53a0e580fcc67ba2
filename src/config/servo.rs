//! The parameters of the servo for one arm.

use super::cycle::CycleParameters;
use super::ranges::POSITIVE;
use super::{ArmParameters, NodeParameters};
use crate::arm::bounds;
use crate::control::{Aim, Attenuation, Controller, Damping, Law, LqWeights, PredefinedTime, TwistGains};
use crate::params::{Declarer, ParameterError};
use crate::servo::{GoalFrameMode, GoalFrames, OneArm, Posture};
use std::time::Duration;

/// The servo's parameters.
pub type ServoParameters = CycleParameters<OneArm>;

impl NodeParameters for ServoParameters {
    const NODE_NAME: &'static str = "dq_servo";

    fn declare(p: &mut Declarer) -> Result<Self, ParameterError> {
        let arm = ArmParameters::declare(p)?;
        let task = OneArm::new(arm.chain.clone());
        let posture = posture(p, &arm);
        let frames = (arm.base_frame.clone(), arm.tool_frame.clone());
        let mut parameters = Self::declare_cycle(p, &arm, 1, frames, task, controller)?;
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
    Ok(Controller {
        law: p.one_of("controller", Law::NAMES, Law::Logc).live(
            "",
            "the control law in force; a switch takes effect in the next cycle, without a step in the command",
        ),
        aim: p.one_of("task", Aim::NAMES, Aim::Pose).live(
            "",
            "what of the goal's pose the tool is asked for: all of it, its position, or its position and where its z axis points; the rest is free",
        ),
        diffc_gain: p.double("gains.diffc", 185.0, POSITIVE..=1e4).live("1/s", "K of diffc"),
        diffc_inverse: inverse(p, "gains.diffc_inverse")?,
        logc: inverse(p, "gains.logc")?,
        double_geodesic: inverse(p, "gains.double_geodesic")?,
        unit_quaternion: inverse(p, "gains.unit_quaternion")?,
        logc_transpose: transpose(p, "gains.logc_transpose")?,
        double_geodesic_transpose: transpose(p, "gains.double_geodesic_transpose")?,
        unit_quaternion_transpose: transpose(p, "gains.unit_quaternion_transpose")?,
        lq: lq(p)?,
        h_infinity: h_infinity(p)?,
        predefined_time: predefined_time(p)?,
        damping,
    })
}

fn inverse(p: &mut Declarer, name: &'static str) -> Result<TwistGains, ParameterError> {
    twist_gains(p, name, 1.0, 100.0)
}

/// A transposed Jacobian shortens the error by its squared singular values, and needs the higher gains.
fn transpose(p: &mut Declarer, name: &'static str) -> Result<TwistGains, ParameterError> {
    twist_gains(p, name, 50.0, 1e4)
}

fn twist_gains(
    p: &mut Declarer,
    name: &'static str,
    default: f64,
    max: f64,
) -> Result<TwistGains, ParameterError> {
    let gains = p
        .doubles(name, &[default; 2])
        .within(POSITIVE..=max)
        .live("1/s", "k_omega and k_v: gains of the angular and of the linear error");
    let [angular, linear] = gains.array()?;
    Ok(TwistGains { angular, linear })
}

fn lq(p: &mut Declarer) -> Result<LqWeights, ParameterError> {
    let default = LqWeights::with_gain(1.0);
    let weights = p.doubles("gains.lq", &[default.angular, default.linear]).within(POSITIVE..=1e4).live(
        "1/s^2",
        "weights of the angular and of the linear error against speeds of 1 rad/s and 1 m/s: k_omega and k_v are their roots",
    );
    let [angular, linear] = weights.array()?;
    Ok(LqWeights { angular, linear })
}

fn h_infinity(p: &mut Declarer) -> Result<Attenuation, ParameterError> {
    let default = Attenuation::with_gain(2.0);
    let bounds = p.doubles("gains.h_infinity", &[default.angular, default.linear]).within(0.01..=1e3).live(
        "s",
        "attenuation: bounds of the angular and of the linear error's energy by that of the disturbances",
    );
    let [angular, linear] = bounds.array()?;
    Ok(Attenuation { angular, linear })
}

fn predefined_time(p: &mut Declarer) -> Result<PredefinedTime, ParameterError> {
    let bounds = p.doubles("gains.predefined_time", &[5.0, 20.0]).within(0.1..=100.0).live(
        "s, 1/s",
        "bound of the time to arrive, and the largest gain near the goal, where the law's own has no bound",
    );
    let [settling_time, gain_limit] = bounds.array()?;
    Ok(PredefinedTime { settling_time, gain_limit })
}
