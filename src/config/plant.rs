//! The plant's parameters.

use super::cycle::{check_range, command_interface};
use super::ranges::JOINT_SPEEDS;
use super::{ArmParameters, NodeParameters};
use dq_core::plant::Realism;
use dq_core::servo::Interface;
use dq_kinematics::arm::{DescribedArm, JointKind, JointLimits, bounds};
use dq_params::{Declarer, List, ParameterError};
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

impl NodeParameters for PlantParameters {
    const NODE_NAME: &'static str = PLANT_NAMES[0];

    /// All of it: it is published.
    fn description_in_force(text: String, _arm: &DescribedArm) -> String {
        text
    }

    fn declare(p: &mut Declarer) -> Result<Self, ParameterError> {
        let arm = ArmParameters::declare(p)?;
        let initial_positions = p
            .doubles("initial_positions", &[])
            .within(-bounds::JOINT_ANGLE..=bounds::JOINT_ANGLE)
            .required()
            .fixed("rad, m", "joint positions at the start and after ~/reset, one a joint");
        let limits = limits(p, arm.chain.kinds());
        Ok(Self {
            limits: limits?,
            interface: command_interface(p),
            realism: realism(p),
            frame_prefix: p
                .string("frame_prefix")
                .fixed("", "put before every frame name on /tf, so that two arms are told apart"),
            command_timeout: Duration::from_secs_f64(
                p.double("command_timeout", 0.1, 0.001..=10.0)
                    .live("s", "age at which a command counts as zero: the arm stops by itself"),
            ),
            initial_positions: initial_positions.exactly(arm.joints.len())?.to_vec(),
            arm,
        })
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

/// For who looks at the robot_description: the servo's limits, of the same parameter file.
fn limits(p: &mut Declarer, joints: &[JointKind]) -> Result<Vec<JointLimits>, ParameterError> {
    let mut list =
        |name, range, unit, description| p.doubles(name, &[]).within(range).fixed(unit, description);
    let angle = -bounds::JOINT_ANGLE..=bounds::JOINT_ANGLE;
    let lower = list(
        "limits.joint_position_lower",
        angle.clone(),
        "rad, m",
        "smallest joint positions that the robot_description of DH rows has, one a joint; empty: none",
    );
    let upper = list(
        "limits.joint_position_upper",
        angle,
        "rad, m",
        "largest joint positions that the robot_description of DH rows has, one a joint; empty: none",
    );
    let velocity = list(
        "limits.joint_velocity",
        JOINT_SPEEDS,
        "rad/s, m/s",
        "largest joint speeds that the robot_description of DH rows has, one a joint; empty: none",
    );
    let each = |list: &List<f64>| list.exactly_or_none(joints.len()).map(|given| given.map(<[f64]>::to_vec));
    let [lowest, highest, fastest] = [each(&lower)?, each(&upper)?, each(&velocity)?];
    let of = |list: &Option<Vec<f64>>, joint: usize| list.as_ref().map(|list| list[joint]);
    let limits = |(joint, kind): (usize, &JointKind)| {
        let (lower, highest) = (of(&lowest, joint), of(&highest, joint));
        check_range(&upper, lower.zip(highest), kind.unit())?;
        Ok(JointLimits { lower, upper: highest, velocity: of(&fastest, joint), ..JointLimits::default() })
    };
    joints.iter().enumerate().map(limits).collect()
}

/// All live, so that a law can be watched while its robot gets worse.
fn realism(p: &mut Declarer) -> Realism {
    let mut time = |name, most, description| {
        Duration::from_secs_f64(p.double(name, 0.0, 0.0..=most).live("s", description))
    };
    let command_latency = time("command_latency", 1.0, "a command takes effect so much after it came");
    let state_latency = time("state_latency", 1.0, "a joint state comes out so much after it was measured");
    let velocity_time_constant = time(
        "velocity_time_constant",
        10.0,
        "a joint goes after a velocity command as a system of first order with it",
    );
    let state_rate = p
        .double("state_rate", 0.0, 0.0..=2000.0)
        .live("Hz", "rate of the joint states, no more than update_rate; 0: update_rate");
    Realism {
        command_latency,
        state_latency,
        velocity_time_constant,
        position_noise: p
            .double("position_noise", 0.0, 0.0..=1.0)
            .live("rad, m", "each measured position is off by up to this either way"),
        encoder_resolution: p
            .double("encoder_resolution", 0.0, 0.0..=1.0)
            .live("rad, m", "what one count of the encoders is; 0: they do not count"),
        state_interval: if state_rate > 0.0 {
            Duration::from_secs_f64(1.0 / state_rate.max(1e-3))
        } else {
            Duration::ZERO
        },
    }
}
