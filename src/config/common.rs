//! The parameters that the nodes share: the arm, its joints and its frames.

use crate::arm::{ArmError, Chain, Convention, DhRow};
use crate::params::{Constraint, Declaration, ParameterError, ParameterStore, Value};
use std::f64::consts::TAU;
use std::time::Duration;

/// The arm as parameters give it.
#[derive(Clone, Debug, PartialEq)]
pub struct ArmParameters {
    /// Its kinematics.
    pub chain: Chain,
    /// Joint names, base first.
    pub joints: Vec<String>,
    /// Frame of the base.
    pub base_frame: String,
    /// Frame of the tool.
    pub tool_frame: String,
    /// The node's cycle.
    pub period: Duration,
}

/// The declarations that the nodes share. No default names a robot that is not there: the arm comes from a file, at
/// least from the built-in one.
pub(super) fn declarations() -> Vec<Declaration> {
    let fixed = Declaration::fixed;
    let (list, none) = (Value::DoubleArray(Vec::new()), Constraint::None);
    vec![
        Declaration::live(
            "use_sim_time",
            Value::Bool(false),
            Constraint::Only(false),
            "",
            "declared by every ROS 2 node; this one keeps to the system's clocks",
        ),
        fixed(
            "update_rate",
            Value::Integer(500),
            Constraint::IntegerRange { min: 1, max: 2000 },
            "Hz",
            "rate of the node's cycle",
        ),
        fixed("joints", Value::StringArray(Vec::new()), none, "", "joint names, base first").of_every_arm(),
        fixed("base_frame", Value::String(String::new()), none, "", "frame of the arm's base"),
        fixed("tool_frame", Value::String(String::new()), none, "", "frame of the arm's tool"),
        fixed(
            "arm.convention",
            Value::String("modified_dh".to_owned()),
            Constraint::OneOf(&["modified_dh", "standard_dh"]),
            "",
            "Denavit-Hartenberg convention of the rows",
        )
        .of_every_arm(),
        fixed("arm.alpha", list.clone(), none, "rad", "link twists, one a joint").of_every_arm(),
        fixed("arm.a", list.clone(), none, "m", "link lengths, one a joint").of_every_arm(),
        fixed("arm.d", list.clone(), none, "m", "link offsets, one a joint").of_every_arm(),
        fixed(
            "arm.theta_offset",
            list,
            none,
            "rad",
            "offsets of the joint angles, one a joint; empty: zeros",
        ),
    ]
}

impl ArmParameters {
    pub(super) fn from_store(store: &ParameterStore) -> Result<Self, ParameterError> {
        let joints = store.strings("joints")?.to_vec();
        check_joint_names(&joints)?;
        let convention: Convention = store.string("arm.convention")?.parse().map_err(arm_error)?;
        let column = |name: &'static str| store.doubles(name, joints.len());
        let (alpha, a, d) = (column("arm.alpha")?, column("arm.a")?, column("arm.d")?);
        let theta_offset = match store.doubles("arm.theta_offset", 0) {
            Ok(_) => vec![0.0; joints.len()],
            Err(_) => column("arm.theta_offset")?.to_vec(),
        };
        check_radians("arm.alpha", alpha)?;
        check_radians("arm.theta_offset", &theta_offset)?;
        let rows: Vec<_> = (0..joints.len())
            .map(|i| DhRow { alpha: alpha[i], a: a[i], d: d[i], theta_offset: theta_offset[i] })
            .collect();
        Ok(Self {
            chain: Chain::new(convention, &rows).map_err(arm_error)?,
            base_frame: store.string("base_frame")?.to_owned(),
            tool_frame: store.string("tool_frame")?.to_owned(),
            period: Duration::from_secs_f64(1.0 / store.integer("update_rate")?.max(1) as f64),
            joints,
        })
    }
}

/// No table of an arm has an angle of more than a turn, but in degrees.
fn check_radians(name: &'static str, angles: &[f64]) -> Result<(), ParameterError> {
    match angles.iter().find(|angle| angle.abs() > TAU) {
        Some(angle) => Err(ParameterError::Invalid {
            name,
            value: angle.to_string(),
            expected: "radians, -2π to 2π (are these degrees?)".to_owned(),
        }),
        None => Ok(()),
    }
}

fn arm_error(error: ArmError) -> ParameterError {
    ParameterError::Invalid {
        name: "arm",
        value: "as given".to_owned(),
        expected: format!("an arm: {error}"),
    }
}

fn check_joint_names(joints: &[String]) -> Result<(), ParameterError> {
    let bad = |value: String, expected: &str| {
        Err(ParameterError::Invalid { name: "joints", value, expected: expected.to_owned() })
    };
    if joints.is_empty() {
        return bad("empty".to_owned(), "at least one joint name");
    }
    match joints.iter().enumerate().find(|(i, name)| name.is_empty() || joints[..*i].contains(name)) {
        Some((_, name)) => {
            bad(format!("{joints:?}"), &format!("names that are not empty nor there twice, as {name:?} is"))
        }
        None => Ok(()),
    }
}
