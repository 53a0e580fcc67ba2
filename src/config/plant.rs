//! The plant's parameters.

use super::common::exactly_or_none;
use super::limits::check_ranges;
use super::{ArmParameters, NodeParameters};
use dq_core::servo::{Interface, JOINT_SPEEDS};
use dq_description::{DescribedArm, JointLimits};
use dq_kinematics::arm::{JointKind, bounds};
use dq_params::{Declarer, ParameterError, Parameters, exactly};
use dq_plant::Realism;
use std::time::Duration;

/// What a simulated arm is called where nobody names it: the built-in one, and any other.
pub const PLANT_NAMES: [&str; 2] = ["puma560", "arm"];

/// The plant's parameters, typed and checked as a whole.
#[derive(Clone, Debug, PartialEq)]
pub struct PlantParameters {
    /// The arm.
    pub arm: ArmParameters,
    /// Joint positions at the start and after a reset \[rad, prismatic: m\].
    pub initial_positions: Vec<f64>,
    /// What its robot_description says of the limits of joints of Denavit-Hartenberg rows; it keeps to none of them.
    pub limits: Vec<JointLimits>,
    /// Age at which a command counts as zero.
    pub command_timeout: Duration,
    /// What the robot is like.
    pub realism: Realism,
    /// What kind of commands it takes.
    pub interface: Interface,
    /// Put before every frame name on `/tf`.
    pub frame_prefix: String,
}

/// The parameters that the plant has besides those of the arm.
#[derive(Parameters)]
struct Given {
    /// joint positions at the start and after ~/reset, one a joint \[rad, m\]
    #[parameter(range = -bounds::JOINT_ANGLE..=bounds::JOINT_ANGLE, required, fixed)]
    initial_positions: Vec<f64>,
    #[parameter(group)]
    limits: LimitParameters,
    #[parameter(group)]
    interface: Interface,
    // These can be set while the plant runs, so that a law can be watched while its robot gets worse.
    #[parameter(group)]
    realism: Realism,
    /// rate of the joint states, no more than update_rate; 0: update_rate \[Hz\]
    #[parameter(range = 0.0..=2000.0)]
    state_rate: f64,
    /// put before every frame name on /tf, so that two arms are told apart
    #[parameter(fixed)]
    frame_prefix: String,
    /// age at which a command counts as zero: the arm stops by itself \[s\]
    #[parameter(default = 0.1, range = 0.001..=10.0)]
    command_timeout: Duration,
}

/// The servo's limits, of the same parameter file: the plant only writes them into its robot_description.
#[derive(Parameters)]
#[parameters(prefix = "limits.joint_")]
struct LimitParameters {
    /// smallest joint positions that the robot_description of DH rows has, one a joint; empty: none \[rad, m\]
    #[parameter(range = -bounds::JOINT_ANGLE..=bounds::JOINT_ANGLE, fixed)]
    position_lower: Vec<f64>,
    /// largest joint positions that the robot_description of DH rows has, one a joint; empty: none \[rad, m\]
    #[parameter(range = -bounds::JOINT_ANGLE..=bounds::JOINT_ANGLE, fixed)]
    position_upper: Vec<f64>,
    /// largest joint speeds that the robot_description of DH rows has, one a joint; empty: none [rad/s, m/s]
    #[parameter(range = JOINT_SPEEDS, fixed)]
    velocity: Vec<f64>,
}

impl LimitParameters {
    /// The limits of each of these joints.
    fn each(&self, joints: &[JointKind]) -> Result<Vec<JointLimits>, ParameterError> {
        let Self { position_lower: lower, position_upper: upper, velocity } = self;
        exactly_or_none("limits.joint_position_lower", lower, joints.len())?;
        exactly_or_none("limits.joint_position_upper", upper, joints.len())?;
        exactly_or_none("limits.joint_velocity", velocity, joints.len())?;
        check_ranges(lower.iter().copied().zip(upper.iter().copied()), joints)?;
        let of = |list: &[f64], joint: usize| list.get(joint).copied();
        let limits = |i| JointLimits {
            lower: of(lower, i),
            upper: of(upper, i),
            velocity: of(velocity, i),
            ..JointLimits::default()
        };
        Ok((0..joints.len()).map(limits).collect())
    }
}

impl NodeParameters for PlantParameters {
    const NODE_NAME: &'static str = PLANT_NAMES[0];

    /// All of it: it is published.
    fn description_in_force(text: String, _arm: &DescribedArm) -> String {
        text
    }
}

impl Parameters for PlantParameters {
    fn declare(p: &mut Declarer) -> Result<Self, ParameterError> {
        let arm = ArmParameters::declare(p)?;
        let Given {
            initial_positions,
            limits,
            interface,
            mut realism,
            state_rate,
            frame_prefix,
            command_timeout,
        } = Given::declare(p)?;
        exactly("initial_positions", &initial_positions, arm.joints.len())?;
        if state_rate > 0.0 {
            realism.state_interval = Duration::from_secs_f64(1.0 / state_rate.max(1e-3));
        }
        let limits = limits.each(arm.chain.kinds())?;
        Ok(Self { arm, initial_positions, limits, command_timeout, realism, interface, frame_prefix })
    }
}

impl PlantParameters {
    /// Which joints start beyond their position limits; none where none does. The arm is moved from there all the same, as a real one is
    /// that somebody has pushed there.
    pub fn beyond_limits(&self) -> Option<String> {
        let joints = self.arm.joints.iter().zip(self.arm.chain.kinds());
        let beyond = joints.zip(self.initial_positions.iter().zip(&self.limits)).filter_map(
            |((name, kind), (position, JointLimits { lower, upper, .. }))| {
                let (unit, position) = (kind.unit(), *position);
                let below =
                    lower.filter(|lower| position < *lower).map(|lower| format!("below {lower} {unit}"));
                let above =
                    upper.filter(|upper| position > *upper).map(|upper| format!("above {upper} {unit}"));
                Some(format!("{name:?} at {position} {unit}, {}", below.or(above)?))
            },
        );
        let beyond = beyond.collect::<Vec<_>>().join("; ");
        (!beyond.is_empty()).then(|| {
            format!("initial_positions are beyond the position limits: {beyond}: a servo with these limits moves such a joint only back")
        })
    }
}
