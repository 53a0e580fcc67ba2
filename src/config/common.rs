//! The parameters that nodes share: the cycle, the arm, its joints and its frames.

use super::described;
use dq_algebra::UnitDualQuaternion;
use dq_core::servo::{Goal, Interface};
use dq_description::Description;
use dq_kinematics::arm::{ArmError, Chain, Convention, DhRow};
use dq_params::{Declarer, ParameterError, Parameters, exactly};
use std::f64::consts::TAU;
use std::time::Duration;

/// An arm that parameters describe.
#[derive(Clone, Debug, PartialEq)]
pub struct ArmParameters {
    /// The kinematics of the arm.
    pub chain: Chain,
    /// The joint names, base first.
    pub joints: Vec<String>,
    /// The name of the base's frame.
    pub base_frame: String,
    /// The name of the tool's frame.
    pub tool_frame: String,
    /// The control period of the node.
    pub period: Duration,
    /// The SCHED_FIFO priority of the cycle's thread; 0 for a normal thread.
    pub realtime_priority: u8,
    /// Whether stamps follow `/clock`.
    pub simulated_time: bool,
    /// The robot description of the arm, as parsed and as text; `None` for an arm of DH rows.
    pub description: Option<(Description, String)>,
}

impl ArmParameters {
    /// Returns, for each link, the name of the joint that moves the link, base first. Mimic joints are included.
    pub(super) fn link_joints(&self) -> Vec<String> {
        match &self.description {
            None => self.joints.clone(),
            Some((described, _)) => described.arm.links().map(|joint| joint.name.clone()).collect(),
        }
    }
}

/// The parameters of the cycle. The guard declares them, too, so that one parameter file can set them for all nodes.
#[derive(Parameters)]
pub(super) struct CycleParameters {
    /// stamps follow /clock; timeouts and the cycle always follow the system's monotonic clock
    #[parameter(fixed)]
    use_sim_time: bool,
    /// rate of the cycle of the servo and of the simulated arm \[Hz\]
    #[parameter(default = 500, range = 1..=2000, fixed)]
    update_rate: i64,
    /// SCHED_FIFO priority of the cycle's thread. The DDS threads get the next lower priority, and the node's memory is locked. The
    /// system must allow real-time priorities and locked memory. 0: normal threads
    #[parameter(range = 0..=99, fixed)]
    realtime_priority: i64,
}

impl CycleParameters {
    /// Returns the control period.
    pub fn period(&self) -> Duration {
        period(self.update_rate)
    }

    /// Returns the SCHED_FIFO priority; 0 for a normal thread.
    pub fn priority(&self) -> u8 {
        u8::try_from(self.realtime_priority).unwrap_or(0)
    }
}

/// The rate of trajectories. Servo and guard declare it.
#[derive(Parameters)]
pub(super) struct TrajectoryParameters {
    /// rate of the servo's cycle and of the points that it sends, if interface is trajectory \[Hz\]
    #[parameter(default = 100, range = 1..=500, fixed)]
    trajectory_rate: i64,
}

impl TrajectoryParameters {
    /// Returns the control period of a servo with this `interface`: one period of `trajectory_rate` if it sends trajectories, and
    /// `other` if it sends any other kind of commands.
    pub fn period(&self, interface: Interface, other: Duration) -> Duration {
        if interface == Interface::Trajectory { period(self.trajectory_rate) } else { other }
    }
}

fn period(rate: i64) -> Duration {
    Duration::from_secs_f64(1.0 / rate.max(1) as f64)
}

/// The joint names. Every node declares them.
#[derive(Parameters)]
pub(super) struct JointParameters {
    /// joint names, base first
    #[parameter(required, fixed)]
    joints: Vec<String>,
}

impl JointParameters {
    /// Returns the joint names.
    ///
    /// # Errors
    /// [`ParameterError::Invalid`] if there are none, or if a name is empty or occurs twice.
    pub fn names(self) -> Result<Vec<String>, ParameterError> {
        check_names("joints", &self.joints).map(|()| self.joints)
    }
}

/// Checks joint names that are the value of the parameter `parameter`.
///
/// # Errors
/// [`ParameterError::Invalid`] if there are none, or if a name is empty or occurs twice.
pub(super) fn check_names(parameter: &'static str, names: &[String]) -> Result<(), ParameterError> {
    if names.is_empty() {
        return Err(ParameterError::invalid(parameter, "empty", "at least one joint name"));
    }
    match names.iter().enumerate().find(|(i, name)| name.is_empty() || names[..*i].contains(name)) {
        Some((_, name)) => {
            let expected = format!("names that are neither empty nor repeated, as {name:?} is");
            Err(ParameterError::invalid(parameter, format!("{names:?}"), expected))
        }
        None => Ok(()),
    }
}

/// The frames and the description of the arm. They have no defaults, because a default would name a robot that does not exist.
/// Parameter files, such as the built-in file, set them.
#[derive(Parameters)]
struct FrameParameters {
    /// name of the frame of the arm's base
    #[parameter(fixed)]
    base_frame: String,
    /// name of the frame of the arm's tool
    #[parameter(fixed)]
    tool_frame: String,
    /// URDF of the robot. The arm is the part of it between base_frame and tool_frame, and replaces arm.*
    #[parameter(fixed)]
    robot_description: String,
    /// file that contains the robot_description
    // The node reads the file when it starts; afterwards `robot_description` has the arm.
    #[parameter(name = "robot_file", fixed)]
    _robot_file: String,
}

/// The rows of Denavit-Hartenberg parameters.
#[derive(Parameters)]
#[parameters(prefix = "arm.")]
struct RowParameters {
    /// Denavit-Hartenberg convention of the rows
    #[parameter(one_of = &["modified_dh", "standard_dh"], default = "modified_dh", required, fixed)]
    convention: Convention,
    /// link twists, one per joint \[rad\]
    #[parameter(required, fixed)]
    alpha: Vec<f64>,
    /// link lengths, one per joint \[m\]
    #[parameter(required, fixed)]
    a: Vec<f64>,
    /// link offsets, one per joint \[m\]
    #[parameter(required, fixed)]
    d: Vec<f64>,
    /// offsets of the joint angles, one per joint; empty: zeros \[rad\]
    #[parameter(fixed)]
    theta_offset: Vec<f64>,
}

impl RowParameters {
    /// Returns the kinematics of the arm with these rows. There must be one row for each of `count` joints.
    fn chain(&self, count: usize) -> Result<Chain, ParameterError> {
        for (name, list) in [("arm.alpha", &self.alpha), ("arm.a", &self.a), ("arm.d", &self.d)] {
            exactly(name, list, count)?;
        }
        exactly_or_none("arm.theta_offset", &self.theta_offset, count)?;
        check_radians("arm.alpha", &self.alpha)?;
        check_radians("arm.theta_offset", &self.theta_offset)?;
        let offset = |i: usize| self.theta_offset.get(i).copied().unwrap_or_default();
        let row = |i| DhRow { alpha: self.alpha[i], a: self.a[i], d: self.d[i], theta_offset: offset(i) };
        let error = |why: ArmError| ParameterError::invalid("arm", "as given", format!("an arm: {why}"));
        Chain::new(self.convention, &(0..count).map(row).collect::<Vec<_>>()).map_err(error)
    }
}

impl Parameters for ArmParameters {
    fn declare(p: &mut Declarer) -> Result<Self, ParameterError> {
        let cycle = CycleParameters::declare(p)?;
        let joints = JointParameters::declare(p)?;
        let FrameParameters { base_frame, tool_frame, robot_description: text, .. } =
            FrameParameters::declare(p)?;
        let rows = RowParameters::declare(p)?;
        let joints = joints.names()?;
        let description = match text.is_empty() {
            true => None,
            false => Some((described::read(&text, "robot_description", &base_frame, &tool_frame)?, text)),
        };
        Ok(Self {
            chain: match &description {
                None => rows.chain(joints.len())?,
                Some((described, _)) => described::chain(described, "joints", &joints)?,
            },
            realtime_priority: cycle.priority(),
            simulated_time: cycle.use_sim_time,
            period: cycle.period(),
            joints,
            base_frame,
            tool_frame,
            description,
        })
    }
}

/// Checks that a list has `count` items or is empty.
///
/// # Errors
/// [`ParameterError::Invalid`] for a list of any other length.
pub(super) fn exactly_or_none(name: &'static str, list: &[f64], count: usize) -> Result<(), ParameterError> {
    if list.is_empty() { Ok(()) } else { exactly(name, list, count) }
}

/// Checks that no angle is larger than a full turn. A larger angle is probably in degrees.
fn check_radians(name: &'static str, angles: &[f64]) -> Result<(), ParameterError> {
    let expected = "radians, -2π to 2π (are these degrees?)";
    let large = angles.iter().find(|angle| angle.abs() > TAU);
    large.map_or(Ok(()), |angle| Err(ParameterError::invalid(name, angle, expected)))
}

/// The numbers of a pose: x y z \[m\], then qx qy qz qw.
pub(super) type PoseNumbers = [f64; 7];

/// The numbers of the identity pose: no translation, no rotation.
pub(super) const NO_POSE: PoseNumbers = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0];

/// Returns x y z \[m\] and qx qy qz qw of `pose`.
pub(super) fn numbers_of(pose: &UnitDualQuaternion) -> PoseNumbers {
    let (t, r) = (pose.translation(), pose.real());
    [t.x, t.y, t.z, r.i, r.j, r.k, r.w]
}

/// Returns the pose with these `numbers`, which are the value of the parameter `name`.
pub(super) fn pose(name: &'static str, numbers: PoseNumbers) -> Result<UnitDualQuaternion, ParameterError> {
    let [x, y, z, orientation @ ..] = numbers;
    let invalid = |why| ParameterError::invalid(name, format!("{numbers:?}"), format!("a pose: {why}"));
    let pose = Goal::new([x, y, z], orientation, "", "").map_err(invalid)?;
    Ok(*pose.base_from_goal())
}
