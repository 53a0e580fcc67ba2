//! The parameters of the servo for one arm.

use super::cycle::{self, CycleParameters, POSITIVE, live};
use super::{ArmParameters, NodeParameters};
use crate::control::{Attenuation, Controller, Law, LqWeights, PredefinedTime, TwistGains};
use crate::params::{Constraint, Declaration, ParameterError, ParameterStore, Value};
use crate::servo::OneArm;

/// The servo's parameters.
pub type ServoParameters = CycleParameters<OneArm>;

impl NodeParameters for ServoParameters {
    const NODE_NAME: &'static str = "dq_servo";

    fn declarations() -> Vec<Declaration> {
        let mut all = cycle::declarations();
        all.extend([
            Declaration::live(
                "controller",
                Value::String(Law::Logc.name().to_owned()),
                Constraint::OneOf(Law::NAMES),
                "",
                "the control law in force; a switch takes effect in the next cycle, without a step in the command",
            ),
            live("diffc.gain", 185.0, POSITIVE, 1e4, "1/s", "K of diffc"),
        ]);
        all.extend(twist_gains());
        all.extend(derived_gains());
        all
    }

    fn from_store(store: &ParameterStore) -> Result<Self, ParameterError> {
        let arm = ArmParameters::from_store(store)?;
        let task = OneArm::new(arm.chain.clone());
        Self::new(store, &arm, 1, arm.base_frame.clone(), task, controller(store)?)
    }
}

/// `k_ω` and `k_v` of each law that has the two.
const DIFFC_INVERSE: [&str; 2] = ["diffc_inverse.gain_angular", "diffc_inverse.gain_linear"];
const LOGC: [&str; 2] = ["logc.gain_angular", "logc.gain_linear"];
const LOGC_TRANSPOSE: [&str; 2] = ["logc_transpose.gain_angular", "logc_transpose.gain_linear"];
const DOUBLE_GEODESIC: [&str; 2] = ["double_geodesic.gain_angular", "double_geodesic.gain_linear"];
const DOUBLE_GEODESIC_TRANSPOSE: [&str; 2] =
    ["double_geodesic_transpose.gain_angular", "double_geodesic_transpose.gain_linear"];
const UNIT_QUATERNION: [&str; 2] = ["unit_quaternion.gain_angular", "unit_quaternion.gain_linear"];
const UNIT_QUATERNION_TRANSPOSE: [&str; 2] =
    ["unit_quaternion_transpose.gain_angular", "unit_quaternion_transpose.gain_linear"];

fn twist_gains() -> impl Iterator<Item = Declaration> {
    let inverse = [DIFFC_INVERSE, LOGC, DOUBLE_GEODESIC, UNIT_QUATERNION].map(|names| (names, 1.0, 100.0));
    // A transposed Jacobian shortens the error by its squared singular values, and needs the higher gains.
    let transpose = [LOGC_TRANSPOSE, DOUBLE_GEODESIC_TRANSPOSE, UNIT_QUATERNION_TRANSPOSE]
        .map(|names| (names, 50.0, 1e4));
    inverse.into_iter().chain(transpose).flat_map(|([angular, linear], default, max)| {
        let of_law = |name, about| live(name, default, POSITIVE, max, "1/s", about);
        [
            of_law(angular, "k_omega of the law before the dot: gain of the angular error"),
            of_law(linear, "k_v of the law before the dot: gain of the linear error"),
        ]
    })
}

/// What the gains of the other laws derive from.
fn derived_gains() -> [Declaration; 6] {
    let (lq, bounds) = (LqWeights::with_gain(1.0), Attenuation::with_gain(2.0));
    [
        live(
            "lq.weight_angular",
            lq.angular,
            POSITIVE,
            1e4,
            "1/s^2",
            "weight of the angular error against an angular speed of 1 rad/s: k_omega is its root",
        ),
        live(
            "lq.weight_linear",
            lq.linear,
            POSITIVE,
            1e4,
            "1/s^2",
            "weight of the linear error against a speed of 1 m/s: k_v is its root",
        ),
        live(
            "h_infinity.attenuation_angular",
            bounds.angular,
            0.01,
            1e3,
            "s",
            "bound of the angular error's energy by that of the disturbances",
        ),
        live(
            "h_infinity.attenuation_linear",
            bounds.linear,
            0.01,
            1e3,
            "s",
            "bound of the linear error's energy by that of the disturbances",
        ),
        live("predefined_time.settling_time", 5.0, 0.1, 3600.0, "s", "bound of the time to arrive"),
        live(
            "predefined_time.gain_limit",
            20.0,
            POSITIVE,
            100.0,
            "1/s",
            "largest gain near the goal, where the law's own has no bound",
        ),
    ]
}

fn controller(store: &ParameterStore) -> Result<Controller, ParameterError> {
    let gains = |[angular, linear]: [&'static str; 2]| {
        Ok::<_, ParameterError>(TwistGains { angular: store.double(angular)?, linear: store.double(linear)? })
    };
    Ok(Controller {
        law: cycle::named(store, "controller")?,
        diffc_gain: store.double("diffc.gain")?,
        diffc_inverse: gains(DIFFC_INVERSE)?,
        logc: gains(LOGC)?,
        logc_transpose: gains(LOGC_TRANSPOSE)?,
        double_geodesic: gains(DOUBLE_GEODESIC)?,
        double_geodesic_transpose: gains(DOUBLE_GEODESIC_TRANSPOSE)?,
        unit_quaternion: gains(UNIT_QUATERNION)?,
        unit_quaternion_transpose: gains(UNIT_QUATERNION_TRANSPOSE)?,
        lq: LqWeights {
            angular: store.double("lq.weight_angular")?,
            linear: store.double("lq.weight_linear")?,
        },
        h_infinity: Attenuation {
            angular: store.double("h_infinity.attenuation_angular")?,
            linear: store.double("h_infinity.attenuation_linear")?,
        },
        predefined_time: PredefinedTime {
            settling_time: store.double("predefined_time.settling_time")?,
            gain_limit: store.double("predefined_time.gain_limit")?,
        },
        damping: cycle::damping(store)?,
    })
}
