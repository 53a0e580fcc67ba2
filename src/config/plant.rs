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

/// The default node names of a simulated arm: first for the built-in `puma560`, then for any other arm.
pub const PLANT_NAMES: [&str; 2] = ["puma560", "arm"];

/// The plant's parameters, typed and checked as a whole.
#[derive(Clone, Debug, PartialEq)]
pub struct PlantParameters {
    /// The simulated arm.
    pub arm: ArmParameters,
    /// The joint positions at the start and after a reset \[rad, prismatic: m\].
    pub initial_positions: Vec<f64>,
    /// The limits in the robot_description that the plant makes from Denavit-Hartenberg rows. The plant itself ignores them.
    pub limits: Vec<JointLimits>,
    /// The age from which the plant treats a command as zero, so that the arm stops.
    pub command_timeout: Duration,
    /// The simulated imperfections of the robot.
    pub realism: Realism,
    /// The kind of commands that the plant takes.
    pub interface: Interface,
    /// The prefix of every frame name on `/tf`.
    pub frame_prefix: String,
}

/// The parameters that the plant has besides the parameters of the arm.
#[derive(Parameters)]
struct DeclaredPlant {
    /// joint positions at the start and after ~/reset, one per joint \[rad, m\]
    #[parameter(range = -bounds::JOINT_ANGLE..=bounds::JOINT_ANGLE, required, fixed)]
    initial_positions: Vec<f64>,
    #[parameter(group)]
    limits: LimitParameters,
    #[parameter(group)]
    interface: Interface,
    // These can change while the plant runs, to show how a law copes with a robot that becomes worse.
    #[parameter(group)]
    realism: Realism,
    /// rate of the joint states, at most update_rate; 0: update_rate \[Hz\]
    #[parameter(range = 0.0..=2000.0)]
    state_rate: f64,
    /// prefix of every frame name on /tf, by which two arms can be told apart
    #[parameter(fixed)]
    frame_prefix: String,
    /// age from which a command counts as zero, so that the arm stops \[s\]
    #[parameter(default = 0.1, range = 0.001..=10.0)]
    command_timeout: Duration,
}

/// The servo's limits from the same parameter file. The plant only writes them into its robot_description.
#[derive(Parameters)]
#[parameters(prefix = "limits.joint_")]
struct LimitParameters {
    /// smallest joint positions to write into the robot_description that the plant makes from DH rows, one per joint; empty: none
    /// \[rad, m\]
    #[parameter(range = -bounds::JOINT_ANGLE..=bounds::JOINT_ANGLE, fixed)]
    position_lower: Vec<f64>,
    /// largest joint positions to write into the robot_description that the plant makes from DH rows, one per joint; empty: none
    /// \[rad, m\]
    #[parameter(range = -bounds::JOINT_ANGLE..=bounds::JOINT_ANGLE, fixed)]
    position_upper: Vec<f64>,
    /// largest joint speeds to write into the robot_description that the plant makes from DH rows, one per joint; empty: none
    /// [rad/s, m/s]
    #[parameter(range = JOINT_SPEEDS, fixed)]
    velocity: Vec<f64>,
}

impl LimitParameters {
    /// Returns the limits of each of these joints.
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

    /// Returns the whole text, because the plant publishes it.
    fn description_in_force(text: String, _arm: &DescribedArm) -> String {
        text
    }
}

impl Parameters for PlantParameters {
    fn declare(p: &mut Declarer) -> Result<Self, ParameterError> {
        let arm = ArmParameters::declare(p)?;
        let DeclaredPlant {
            initial_positions,
            limits,
            interface,
            mut realism,
            state_rate,
            frame_prefix,
            command_timeout,
        } = DeclaredPlant::declare(p)?;
        exactly("initial_positions", &initial_positions, arm.joints.len())?;
        if state_rate > 0.0 {
            realism.state_interval = Duration::from_secs_f64(1.0 / state_rate.max(1e-3));
        }
        let limits = limits.each(arm.chain.kinds())?;
        Ok(Self { arm, initial_positions, limits, command_timeout, realism, interface, frame_prefix })
    }
}

impl PlantParameters {
    /// Returns a message about joints that start beyond their position limits; `None` if there are none. The simulated arm starts
    /// there nevertheless, like a real arm that somebody has pushed there.
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
