//! The servo's parameters.

use super::{ArmParameters, ConfigError, Constraint, Declaration, ParameterStore, Value, common, plant};
use crate::control::{Controller, Damping, Law, TwistGains};
use crate::servo::{Limits, Settings, Tolerance};
use std::time::Duration;

/// The servo's parameters, typed and checked as a whole.
#[derive(Clone, Debug, PartialEq)]
pub struct ServoParameters {
    /// The arm.
    pub arm: ArmParameters,
    /// What may change while the servo runs.
    pub settings: Settings,
    /// Whether joint states are subscribed best effort.
    pub best_effort_joint_states: bool,
}

/// Gains [1/s] and limits are above zero by at least this.
const POSITIVE: f64 = 1e-6;

pub(super) fn declarations() -> Vec<Declaration> {
    let live = |name, default, min, max, unit, description| {
        Declaration::live(name, Value::Double(default), Constraint::Range { min, max }, unit, description)
    };
    let each_joint = |name, unit, description| {
        let range = Constraint::Range { min: POSITIVE, max: 1e4 };
        Declaration::live(name, Value::DoubleArray(Vec::new()), range, unit, description)
    };
    let mut all = common::declarations();
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
        live("sign_hysteresis", 0.1, 0.0, 0.9, "", "how far past a half turn the sign of the goal is kept"),
        live("damping.max", 0.05, 0.0, 1.0, "", "lambda of the damped inverse at a singularity"),
        live("damping.threshold", 0.05, POSITIVE, 1.0, "", "smallest singular value below which damping begins"),
        each_joint("limits.joint_velocity", "rad/s", "largest joint speeds, one a joint"),
        each_joint("limits.joint_acceleration", "rad/s^2", "largest joint accelerations, one a joint"),
        live("limits.linear_speed", 2.0, POSITIVE, 100.0, "m/s", "largest speed of the tool point"),
        live("limits.angular_speed", 6.0, POSITIVE, 100.0, "rad/s", "largest angular speed of the tool"),
        live("goal_tolerance.linear", 0.001, POSITIVE, 1.0, "m", "distance to the goal that counts as arrived"),
        live("goal_tolerance.angular", 0.01, POSITIVE, 3.0, "rad", "angle to the goal that counts as arrived"),
        live("state_timeout", 0.1, 0.001, 10.0, "s", "age at which a joint state is stale: the arm decelerates"),
        live("goal_timeout", 0.0, 0.0, 3600.0, "s", "age at which a goal is stale; 0: goals are latched"),
        Declaration::fixed(
            "joint_states_reliability",
            Value::String("reliable".to_owned()),
            Constraint::OneOf(&["reliable", "best_effort"]),
            "",
            "QoS with which joint states are subscribed",
        ),
    ]);
    all
}

impl ServoParameters {
    /// A store with the servo's declarations at their defaults.
    pub fn store() -> ParameterStore {
        ParameterStore::new(declarations(), plant::declarations().iter().map(|d| d.name).collect())
    }

    /// The typed parameters of `store`.
    ///
    /// # Errors
    /// [`ConfigError`] where values do not fit each other.
    pub fn from_store(store: &ParameterStore) -> Result<Self, ConfigError> {
        let arm = ArmParameters::from_store(store)?;
        let goal_timeout = store.double("goal_timeout")?;
        let settings = Settings {
            controller: controller(store)?,
            sign_hysteresis: store.double("sign_hysteresis")?,
            limits: limits(store, arm.joints.len())?,
            goal_tolerance: Tolerance {
                linear: store.double("goal_tolerance.linear")?,
                angular: store.double("goal_tolerance.angular")?,
            },
            state_timeout: Duration::from_secs_f64(store.double("state_timeout")?),
            goal_timeout: (goal_timeout > 0.0).then(|| Duration::from_secs_f64(goal_timeout)),
        };
        let best_effort_joint_states = store.string("joint_states_reliability")? == "best_effort";
        Ok(Self { arm, settings, best_effort_joint_states })
    }
}

fn controller(store: &ParameterStore) -> Result<Controller, ConfigError> {
    let law = store.string("controller")?;
    Ok(Controller {
        law: law.parse().map_err(|error: crate::control::UnknownLaw| ConfigError::Invalid {
            name: "controller",
            value: law.to_owned(),
            expected: error.to_string(),
        })?,
        diffc_gain: store.double("diffc.gain")?,
        logc: TwistGains {
            angular: store.double("logc.gain_angular")?,
            linear: store.double("logc.gain_linear")?,
        },
        double_geodesic: TwistGains {
            angular: store.double("double_geodesic.gain_angular")?,
            linear: store.double("double_geodesic.gain_linear")?,
        },
        damping: Damping { max: store.double("damping.max")?, threshold: store.double("damping.threshold")? },
    })
}

fn limits(store: &ParameterStore, joint_count: usize) -> Result<Limits, ConfigError> {
    Ok(Limits {
        joint_velocity: store.doubles("limits.joint_velocity", joint_count)?.to_vec(),
        joint_acceleration: store.doubles("limits.joint_acceleration", joint_count)?.to_vec(),
        linear_speed: store.double("limits.linear_speed")?,
        angular_speed: store.double("limits.angular_speed")?,
    })
}
