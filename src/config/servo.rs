//! The parameters of the servo for one arm.

use super::cycle::{self, CycleParameters, POSITIVE, live};
use super::{ArmParameters, ConfigError, Constraint, Declaration, NodeParameters, ParameterStore, Value};
use crate::control::{Controller, Law, TwistGains};
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
            live("logc.gain_angular", 1.0, POSITIVE, 100.0, "1/s", "k_omega of logc"),
            live("logc.gain_linear", 1.0, POSITIVE, 100.0, "1/s", "k_v of logc"),
            live("double_geodesic.gain_angular", 1.0, POSITIVE, 100.0, "1/s", "k_omega of double_geodesic"),
            live("double_geodesic.gain_linear", 1.0, POSITIVE, 100.0, "1/s", "k_v of double_geodesic"),
        ]);
        all
    }

    fn from_store(store: &ParameterStore) -> Result<Self, ConfigError> {
        let arm = ArmParameters::from_store(store)?;
        let task = OneArm::new(arm.chain.clone());
        Self::new(store, &arm, 1, arm.base_frame.clone(), task, controller(store)?)
    }
}

fn controller(store: &ParameterStore) -> Result<Controller, ConfigError> {
    Ok(Controller {
        law: cycle::named(store, "controller")?,
        diffc_gain: store.double("diffc.gain")?,
        logc: TwistGains {
            angular: store.double("logc.gain_angular")?,
            linear: store.double("logc.gain_linear")?,
        },
        double_geodesic: TwistGains {
            angular: store.double("double_geodesic.gain_angular")?,
            linear: store.double("double_geodesic.gain_linear")?,
        },
        damping: cycle::damping(store)?,
    })
}
