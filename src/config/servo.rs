//! The parameters of the servo for one arm.

use super::ranges::POSITIVE;
use super::{ArmParameters, NodeParameters, ServoParameters};
use crate::arm::bounds;
use crate::control::{Aim, Attenuation, Controller, Damping, Law, LqWeights, PredefinedTime, TwistGains};
use crate::params::{Declarer, ParameterError};
use crate::servo::{Arms, GoalFrameMode, GoalFrames, Posture};
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

fn controller(p: &mut Declarer, damping: Damping) -> Controller {
    Controller {
        law: p.one_of("controller", Law::NAMES, Law::Logc).live(
            "",
            "the control law in force; a switch takes effect in the next cycle, without a step in the command",
        ),
        aim: p.one_of("task", Aim::NAMES, Aim::Pose).live(
            "",
            "what of the goal's pose the tool is asked for: all of it, its position, or its position and where its z axis points; the rest is free",
        ),
        diffc_gain: p.double("diffc.gain", 185.0, POSITIVE..=1e4).live("1/s", "K of diffc"),
        diffc_inverse: inverse(p, ["diffc_inverse.gain_angular", "diffc_inverse.gain_linear"]),
        logc: inverse(p, ["logc.gain_angular", "logc.gain_linear"]),
        double_geodesic: inverse(p, ["double_geodesic.gain_angular", "double_geodesic.gain_linear"]),
        unit_quaternion: inverse(p, ["unit_quaternion.gain_angular", "unit_quaternion.gain_linear"]),
        logc_transpose: transpose(p, ["logc_transpose.gain_angular", "logc_transpose.gain_linear"]),
        double_geodesic_transpose: transpose(
            p,
            ["double_geodesic_transpose.gain_angular", "double_geodesic_transpose.gain_linear"],
        ),
        unit_quaternion_transpose: transpose(
            p,
            ["unit_quaternion_transpose.gain_angular", "unit_quaternion_transpose.gain_linear"],
        ),
        lq: lq(p),
        h_infinity: h_infinity(p),
        predefined_time: predefined_time(p),
        damping,
    }
}

fn inverse(p: &mut Declarer, names: [&'static str; 2]) -> TwistGains {
    twist_gains(p, names, 1.0, 100.0)
}

/// A transposed Jacobian shortens the error by its squared singular values, and needs the higher gains.
fn transpose(p: &mut Declarer, names: [&'static str; 2]) -> TwistGains {
    twist_gains(p, names, 50.0, 1e4)
}

fn twist_gains(p: &mut Declarer, [angular, linear]: [&'static str; 2], default: f64, max: f64) -> TwistGains {
    TwistGains {
        angular: p
            .double(angular, default, POSITIVE..=max)
            .live("1/s", "k_omega of the law before the dot: gain of the angular error"),
        linear: p
            .double(linear, default, POSITIVE..=max)
            .live("1/s", "k_v of the law before the dot: gain of the linear error"),
    }
}

fn lq(p: &mut Declarer) -> LqWeights {
    let default = LqWeights::with_gain(1.0);
    LqWeights {
        angular: p.double("lq.weight_angular", default.angular, POSITIVE..=1e4).live(
            "1/s^2",
            "weight of the angular error against an angular speed of 1 rad/s: k_omega is its root",
        ),
        linear: p
            .double("lq.weight_linear", default.linear, POSITIVE..=1e4)
            .live("1/s^2", "weight of the linear error against a speed of 1 m/s: k_v is its root"),
    }
}

fn h_infinity(p: &mut Declarer) -> Attenuation {
    let default = Attenuation::with_gain(2.0);
    Attenuation {
        angular: p
            .double("h_infinity.attenuation_angular", default.angular, 0.01..=1e3)
            .live("s", "bound of the angular error's energy by that of the disturbances"),
        linear: p
            .double("h_infinity.attenuation_linear", default.linear, 0.01..=1e3)
            .live("s", "bound of the linear error's energy by that of the disturbances"),
    }
}

fn predefined_time(p: &mut Declarer) -> PredefinedTime {
    PredefinedTime {
        settling_time: p
            .double("predefined_time.settling_time", 5.0, 0.1..=3600.0)
            .live("s", "bound of the time to arrive"),
        gain_limit: p
            .double("predefined_time.gain_limit", 20.0, POSITIVE..=100.0)
            .live("1/s", "largest gain near the goal, where the law's own has no bound"),
    }
}
