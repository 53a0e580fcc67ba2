//! The parameters that the nodes share: the arm, its joints and its frames.

use super::described;
use dq_algebra::UnitDualQuaternion;
use dq_core::servo::Goal;
use dq_kinematics::arm::{ArmError, Chain, Convention, Description, DhRow};
use dq_params::{Declarer, List, ParameterError};
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
    /// Of SCHED_FIFO for the cycle's thread; 0 for none.
    pub realtime_priority: u8,
    /// Whether stamps follow `/clock`.
    pub simulated_time: bool,
    /// The robot description that the arm is from, as it was read and as text; none for an arm of DH rows.
    pub description: Option<(Description, String)>,
}

impl ArmParameters {
    /// No default names a robot that is not there: the arm comes from a file, at least from the built-in one.
    pub(super) fn declare(p: &mut Declarer) -> Result<Self, ParameterError> {
        let simulated_time = simulated_time(p);
        let period = update_rate(p);
        let realtime_priority = realtime_priority(p);
        let joints = joints(p);
        let base_frame = p.string("base_frame").fixed("", "frame of the arm's base");
        let tool_frame = p.string("tool_frame").fixed("", "frame of the arm's tool");
        let text = p.string("robot_description").fixed(
            "",
            "URDF of the robot: the arm is what it has between base_frame and tool_frame, in place of arm.*",
        );
        // Read before: what of it counts is in robot_description.
        p.string("robot_file").fixed("", "file with the robot_description");
        let rows = chain(p, &joints);
        let description = match text.is_empty() {
            true => None,
            false => Some((described::read(&text, "robot_description", &base_frame, &tool_frame)?, text)),
        };
        Ok(Self {
            realtime_priority,
            simulated_time,
            base_frame,
            tool_frame,
            period,
            chain: match &description {
                None => rows?,
                Some((described, _)) => described::chain(described, &joints)?,
            },
            joints: joints.items().to_vec(),
            description,
        })
    }
}

/// Of every node.
pub(super) fn simulated_time(p: &mut Declarer) -> bool {
    p.boolean("use_sim_time", false).fixed(
        "",
        "stamps follow /clock; timeouts and the cycle keep to the system's monotonic clock, whatever it does",
    )
}

/// The period of the cycle of servo and plant. The guard has it too, so that one file can set all.
pub(super) fn update_rate(p: &mut Declarer) -> Duration {
    let rate =
        p.integer("update_rate", 500, 1..=2000).fixed("Hz", "rate of the cycle of servo and simulated arm");
    Duration::from_secs_f64(1.0 / rate.max(1) as f64)
}

/// Of every node that has a cycle.
pub(super) fn realtime_priority(p: &mut Declarer) -> u8 {
    let priority = p.integer("realtime_priority", 0, 0..=99).fixed(
        "",
        "SCHED_FIFO priority of the cycle's thread, that of the DDS threads is one less, with the node's memory locked; the system must allow both. 0: threads like others",
    );
    u8::try_from(priority).unwrap_or(0)
}

fn joints(p: &mut Declarer) -> List<String> {
    p.strings("joints").required().fixed("", "joint names, base first")
}

/// The joint names of an arm of which nothing else is needed.
pub(super) fn joint_names(p: &mut Declarer) -> Result<Vec<String>, ParameterError> {
    let joints = joints(p);
    check_names(&joints)?;
    Ok(joints.items().to_vec())
}

/// The arm of the Denavit-Hartenberg rows.
fn chain(p: &mut Declarer, joints: &List<String>) -> Result<Chain, ParameterError> {
    let convention = p
        .one_of("arm.convention", &["modified_dh", "standard_dh"], "modified_dh".to_owned())
        .required()
        .fixed("", "Denavit-Hartenberg convention of the rows");
    let alpha = p.doubles("arm.alpha", &[]).required().fixed("rad", "link twists, one a joint");
    let a = p.doubles("arm.a", &[]).required().fixed("m", "link lengths, one a joint");
    let d = p.doubles("arm.d", &[]).required().fixed("m", "link offsets, one a joint");
    let theta_offset = p
        .doubles("arm.theta_offset", &[])
        .fixed("rad", "offsets of the joint angles, one a joint; empty: zeros");

    check_names(joints)?;
    let count = joints.items().len();
    let convention: Convention = convention.parse().map_err(arm_error)?;
    let (alphas, a, d) = (alpha.exactly(count)?, a.exactly(count)?, d.exactly(count)?);
    let offsets = theta_offset.exactly_or_none(count)?;
    check_radians(&alpha)?;
    check_radians(&theta_offset)?;
    let row =
        |i| DhRow { alpha: alphas[i], a: a[i], d: d[i], theta_offset: offsets.map_or(0.0, |all| all[i]) };
    Chain::new(convention, &(0..count).map(row).collect::<Vec<_>>()).map_err(arm_error)
}

/// No table of an arm has an angle of more than a turn, but in degrees.
fn check_radians(angles: &List<f64>) -> Result<(), ParameterError> {
    match angles.items().iter().find(|angle| angle.abs() > TAU) {
        Some(angle) => Err(angles.invalid(angle, "radians, -2π to 2π (are these degrees?)")),
        None => Ok(()),
    }
}

/// The numbers of a pose that moves nothing: x y z \[m\], then qx qy qz qw.
pub(super) const NO_POSE: [f64; 7] = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0];

/// The numbers of that pose, as [`NO_POSE`] has them.
pub(super) fn numbers_of(pose: &UnitDualQuaternion) -> [f64; 7] {
    let (t, r) = (pose.translation(), pose.real());
    [t.x, t.y, t.z, r.i, r.j, r.k, r.w]
}

/// The pose of seven numbers, as [`NO_POSE`] has them.
pub(super) fn pose(list: &List<f64>) -> Result<UnitDualQuaternion, ParameterError> {
    let numbers @ [x, y, z, orientation @ ..] = list.array::<7>()?;
    let invalid = |why| list.invalid(format!("{numbers:?}"), format!("a pose: {why}"));
    let pose = Goal::new([x, y, z], orientation, "", "").map_err(invalid)?;
    Ok(*pose.base_from_goal())
}

fn arm_error(error: ArmError) -> ParameterError {
    ParameterError::Invalid {
        name: "arm",
        value: "as given".to_owned(),
        expected: format!("an arm: {error}"),
    }
}

fn check_names(joints: &List<String>) -> Result<(), ParameterError> {
    let names = joints.items();
    if names.is_empty() {
        return Err(joints.invalid("empty", "at least one joint name"));
    }
    match names.iter().enumerate().find(|(i, name)| name.is_empty() || names[..*i].contains(name)) {
        Some((_, name)) => Err(joints.invalid(
            format!("{names:?}"),
            format!("names that are not empty nor there twice, as {name:?} is"),
        )),
        None => Ok(()),
    }
}
