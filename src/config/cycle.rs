//! The parameters of every node that runs the servo cycle, for one arm or for two.

use super::{ArmParameters, NodeParameters, common};
use crate::control::Damping;
use crate::params::{Constraint, Declaration, ParameterError, ParameterStore, Value};
use crate::servo::{JointOrder, Limits, PositionLimits, STOP_TIME, Settings, Task, Tolerance};
use std::time::Duration;

/// A servo node's parameters, typed and checked as a whole.
#[derive(Clone, Debug, PartialEq)]
pub struct CycleParameters<T: Task> {
    /// What is controlled.
    pub task: T,
    /// The joint names of each arm.
    pub joints: Vec<JointOrder>,
    /// The frame in which goals come.
    pub goal_frame: String,
    /// What may change while the servo runs.
    pub settings: Settings<T::Controller>,
    /// Whether joint states are subscribed best effort.
    pub best_effort_joint_states: bool,
    /// The node's cycle.
    pub period: Duration,
}

const DECELERATION: &str = "limits.joint_deceleration";

/// Gains [1/s] and limits are above zero by at least this.
pub(super) const POSITIVE: f64 = 1e-6;

/// A number that may change while the node runs.
pub(super) fn live(
    name: &'static str,
    default: f64,
    min: f64,
    max: f64,
    unit: &'static str,
    description: &'static str,
) -> Declaration {
    Declaration::live(name, Value::Double(default), Constraint::Range { min, max }, unit, description)
}

/// The declarations of the arm and of the cycle; those of the law come in addition.
pub(super) fn declarations() -> Vec<Declaration> {
    let each_joint = |name, min, max, unit, description| {
        let range = Constraint::Range { min, max };
        Declaration::live(name, Value::DoubleArray(Vec::new()), range, unit, description)
    };
    let mut all = common::declarations();
    all.extend([
        live("sign_hysteresis", 0.1, 0.0, 0.9, "", "how far past a half turn the sign of the goal is kept"),
        live("damping.max", 0.05, 0.0, 1.0, "", "lambda of the damped inverse at a singularity"),
        live(
            "damping.threshold",
            0.05,
            POSITIVE,
            1.0,
            "",
            "smallest singular value below which damping begins",
        ),
        each_joint("limits.joint_velocity", POSITIVE, 1e4, "rad/s", "largest joint speeds, one a joint")
            .of_every_arm(),
        each_joint(
            "limits.joint_acceleration",
            POSITIVE,
            1e4,
            "rad/s^2",
            "largest joint accelerations, one a joint",
        )
        .of_every_arm(),
        each_joint(
            DECELERATION,
            POSITIVE,
            1e4,
            "rad/s^2",
            "joint decelerations in a stop and before a position limit, one a joint; empty: the accelerations, or what stops in 1 s where that is more",
        ),
        each_joint(
            "limits.joint_position_lower",
            -1e3,
            1e3,
            "rad",
            "smallest joint angles, one a joint; empty: none",
        ),
        each_joint(
            "limits.joint_position_upper",
            -1e3,
            1e3,
            "rad",
            "largest joint angles, one a joint; empty: none",
        ),
        live(
            "limits.position_margin",
            0.1,
            0.0,
            3.0,
            "rad",
            "distance from a position limit inside which the joint is slowed",
        ),
        live("limits.linear_speed", 2.0, POSITIVE, 100.0, "m/s", "largest speed of a tool point"),
        live("limits.angular_speed", 6.0, POSITIVE, 100.0, "rad/s", "largest angular speed of a tool"),
        live(
            "goal_tolerance.linear",
            0.001,
            POSITIVE,
            1.0,
            "m",
            "distance to the goal that counts as arrived",
        ),
        live(
            "goal_tolerance.angular",
            0.01,
            POSITIVE,
            3.0,
            "rad",
            "angle to the goal that counts as arrived",
        ),
        live(
            "state_timeout",
            0.1,
            0.001,
            10.0,
            "s",
            "age at which a joint state is stale: the arm decelerates",
        ),
        live(
            "rearm_timeout",
            1.0,
            0.1,
            3600.0,
            "s",
            "a robot that was away for longer, or is elsewhere, is driven again only by a new goal or ~/pause (false)",
        ),
        live(
            "latency",
            0.0,
            0.0,
            0.5,
            "s",
            "time from a command to the joint state that shows it; 0: estimated from stamps and motion",
        ),
        live("goal_timeout", 0.0, 0.0, 3600.0, "s", "age at which a goal is stale; 0: goals are latched"),
        live(
            "progress_timeout",
            5.0,
            0.0,
            3600.0,
            "s",
            "time without progress after which a motion is given up: the arm holds; 0: never",
        ),
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

impl<T: Task> CycleParameters<T>
where
    Self: NodeParameters,
{
    /// The parameters of `task` with `controller`, whose arms are `count` times the arm of the parameters.
    pub(super) fn new(
        store: &ParameterStore,
        arm: &ArmParameters,
        count: usize,
        goal_frame: String,
        task: T,
        controller: T::Controller,
    ) -> Result<Self, ParameterError> {
        Ok(Self {
            task,
            joints: vec![JointOrder::new(arm.joints.clone()); count],
            goal_frame,
            settings: settings(store, arm.joints.len(), count, controller)?,
            best_effort_joint_states: store.string("joint_states_reliability")? == "best_effort",
            period: arm.period,
        })
    }
}

fn settings<C>(
    store: &ParameterStore,
    joint_count: usize,
    arm_count: usize,
    controller: C,
) -> Result<Settings<C>, ParameterError> {
    // Of these 0 means none.
    let timeout = |name| {
        let seconds = store.double(name)?;
        Ok::<_, ParameterError>((seconds > 0.0).then(|| Duration::from_secs_f64(seconds)))
    };
    let each_arm = |name| Ok::<_, ParameterError>(store.doubles(name, joint_count)?.repeat(arm_count));
    let joint_velocity = each_arm("limits.joint_velocity")?;
    let joint_acceleration = each_arm("limits.joint_acceleration")?;
    let given = optional(store, DECELERATION, joint_count, arm_count)?;
    Ok(Settings {
        controller,
        sign_hysteresis: store.double("sign_hysteresis")?,
        limits: Limits {
            joint_deceleration: decelerations(given, &joint_velocity, &joint_acceleration)?,
            joint_velocity,
            joint_acceleration,
            linear_speed: store.double("limits.linear_speed")?,
            angular_speed: store.double("limits.angular_speed")?,
            position: position_limits(store, joint_count, arm_count)?,
        },
        goal_tolerance: Tolerance {
            linear: store.double("goal_tolerance.linear")?,
            angular: store.double("goal_tolerance.angular")?,
        },
        state_timeout: Duration::from_secs_f64(store.double("state_timeout")?),
        rearm_timeout: Duration::from_secs_f64(store.double("rearm_timeout")?),
        latency: timeout("latency")?,
        goal_timeout: timeout("goal_timeout")?,
        progress_timeout: timeout("progress_timeout")?,
    })
}

/// As given, where they stop the joints in time; where none are given, the accelerations.
fn decelerations(
    given: Option<Vec<f64>>,
    velocity: &[f64],
    acceleration: &[f64],
) -> Result<Vec<f64>, ParameterError> {
    let Some(given) = given else { return Ok(acceleration.to_vec()) };
    match given.iter().zip(velocity).position(|(given, velocity)| given * STOP_TIME < *velocity) {
        Some(joint) => Err(ParameterError::Invalid {
            name: DECELERATION,
            value: given[joint].to_string(),
            expected: format!(
                "at least {} rad/s^2, which stops joint {} from its velocity limit in {STOP_TIME} s",
                velocity[joint] / STOP_TIME,
                joint + 1
            ),
        }),
        None => Ok(given),
    }
}

/// A list of one number a joint, for each arm; none where it is empty.
fn optional(
    store: &ParameterStore,
    name: &'static str,
    joint_count: usize,
    arm_count: usize,
) -> Result<Option<Vec<f64>>, ParameterError> {
    match store.doubles(name, 0) {
        Ok(_) => Ok(None),
        Err(_) => Ok(Some(store.doubles(name, joint_count)?.repeat(arm_count))),
    }
}

fn position_limits(
    store: &ParameterStore,
    joint_count: usize,
    arm_count: usize,
) -> Result<PositionLimits, ParameterError> {
    const UPPER: &str = "limits.joint_position_upper";
    let each_arm = |name, none: f64| {
        let given = optional(store, name, joint_count, arm_count)?;
        Ok::<_, ParameterError>(given.unwrap_or_else(|| vec![none; joint_count * arm_count]))
    };
    let lower = each_arm("limits.joint_position_lower", f64::NEG_INFINITY)?;
    let upper = each_arm(UPPER, f64::INFINITY)?;
    match lower.iter().zip(&upper).find(|(lower, upper)| lower >= upper) {
        Some((lower, upper)) => Err(ParameterError::Invalid {
            name: UPPER,
            value: upper.to_string(),
            expected: format!("an angle above the joint's lower limit, {lower} rad"),
        }),
        None => Ok(PositionLimits { lower, upper, margin: store.double("limits.position_margin")? }),
    }
}

pub(super) fn damping(store: &ParameterStore) -> Result<Damping, ParameterError> {
    Ok(Damping { max: store.double("damping.max")?, threshold: store.double("damping.threshold")? })
}

/// The variant that a string parameter names.
pub(super) fn named<V>(store: &ParameterStore, name: &'static str) -> Result<V, ParameterError>
where
    V: std::str::FromStr<Err = crate::control::UnknownName>,
{
    let value = store.string(name)?;
    value.parse().map_err(|unknown: crate::control::UnknownName| ParameterError::Invalid {
        name,
        value: value.to_owned(),
        expected: format!("one of {}", unknown.expected),
    })
}
