//! From the name of an arm, its robot description or its chain to its servo.

use super::common::numbers_of;
use super::{ARMS, DualParameters, NodeParameters, ServoParameters, arm_file};
use dq_algebra::UnitDualQuaternion;
use dq_core::servo::{Arms, JointOrder, Limits, PositionLimits, Servo, Settings, SettingsError};
use dq_kinematics::arm::Chain;
use dq_params::{ParameterError, Value, parameters_for};
use std::time::Duration;
use thiserror::Error;

/// Why there is no such arm, or no servo for it.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum SetupError {
    /// There is no built-in arm of this name.
    #[error("no built-in arm is called {0:?}: expected one of {names}", names = ARMS.map(|(name, _)| name).join(", "))]
    UnknownArm(String),
    /// What describes the arm is wrong.
    #[error(transparent)]
    Parameters(#[from] ParameterError),
    /// The settings do not fit the arm.
    #[error(transparent)]
    Settings(#[from] SettingsError),
}

/// What a built-in arm has, by the arm's name in [`ARMS`].
pub trait ForArm: Sized {
    /// Makes it of the arm with this name, with the settings of that arm's parameter file.
    ///
    /// # Errors
    /// [`SetupError::UnknownArm`].
    fn for_arm(name: &str) -> Result<Self, SetupError>;
}

impl ForArm for ServoParameters {
    fn for_arm(name: &str) -> Result<Self, SetupError> {
        Ok(Self::from_values(values::<Self>(name)?, name)?)
    }
}

impl ForArm for Chain {
    fn for_arm(name: &str) -> Result<Self, SetupError> {
        Ok(ServoParameters::for_arm(name)?.arms.chain().clone())
    }
}

impl ForArm for Servo {
    fn for_arm(name: &str) -> Result<Self, SetupError> {
        Ok(ServoParameters::for_arm(name)?.build()?)
    }
}

impl ServoParameters {
    /// Two of the built-in arm with that name, the right one's base in the left one's base frame. What is controlled is the right tool as
    /// seen from the left one.
    ///
    /// # Errors
    /// [`SetupError::UnknownArm`].
    pub fn for_two_arms(
        name: &str,
        left_base_from_right_base: &UnitDualQuaternion,
    ) -> Result<Self, SetupError> {
        let mut values = values::<DualParameters>(name)?;
        let base = numbers_of(left_base_from_right_base).to_vec();
        values.push(("right_base".to_owned(), Value::DoubleArray(base)));
        Ok(DualParameters::from_values(values, name)?.0)
    }

    /// The arm that a robot description has from the link `base_frame` to the link `tool_frame`, with its limits; where it names no
    /// accelerations, those that take the joints to their velocity limits in half a second.
    ///
    /// # Errors
    /// [`SetupError::Parameters`] for a text that is no robot description, has no arm between these links, or no velocity limit for a joint.
    pub fn from_urdf(text: &str, base_frame: &str, tool_frame: &str) -> Result<Self, SetupError> {
        let values = [("robot_description", text), ("base_frame", base_frame), ("tool_frame", tool_frame)];
        let values = values.map(|(name, text)| (name.to_owned(), Value::String(text.to_owned())));
        Ok(Self::from_values(values.into(), "robot_description")?)
    }

    /// An arm of one's own, whose joints may move at `velocity` [rad/s, prismatic: m/s] and change that by `acceleration`
    /// [rad/s², prismatic: m/s²], one number a joint, and have no position limits. They are called joint1, joint2 and so on.
    ///
    /// # Errors
    /// [`SettingsError`] where there are not as many numbers as joints, or a number is no limit.
    pub fn for_chain(chain: Chain, velocity: &[f64], acceleration: &[f64]) -> Result<Self, SetupError> {
        let mut parameters = Self::from_values(Vec::new(), "")?;
        let (count, limits) = (chain.joint_count(), &mut parameters.settings.limits);
        *limits = Limits {
            joint_velocity: velocity.to_vec(),
            joint_acceleration: acceleration.to_vec(),
            joint_deceleration: acceleration.to_vec(),
            joint_jerk: vec![f64::INFINITY; count],
            position: PositionLimits { margin: limits.position.margin, ..PositionLimits::none(count) },
            ..limits.clone()
        };
        parameters.settings.check(count, parameters.settings.interface)?;
        parameters.joints = vec![JointOrder::new((1..=count).map(|i| format!("joint{i}")).collect())];
        parameters.arms = Arms::one(chain);
        let frames = [&mut parameters.goal_frame, &mut parameters.tool_frame];
        frames.into_iter().zip(["base", "tool"]).for_each(|(frame, name)| name.clone_into(frame));
        Ok(parameters)
    }

    /// These with other settings: limits, law and gains, tolerances, what kind of commands the robot takes.
    pub fn with(mut self, change: impl FnOnce(&mut Settings)) -> Self {
        change(&mut self.settings);
        self
    }

    /// These with another time from one cycle to the next.
    pub fn with_period(self, period: Duration) -> Self {
        Self { period, ..self }
    }

    /// The servo of these parameters.
    ///
    /// # Errors
    /// [`SettingsError`].
    pub fn build(&self) -> Result<Servo, SettingsError> {
        let Self { arms, joints, goal_frame, tool_frame, settings, period, .. } = self;
        let servo = Servo::new(arms.clone(), joints.clone(), goal_frame, settings.clone(), *period)?;
        Ok(servo.with_tool_frame(tool_frame))
    }
}

/// What the parameter file of that built-in arm gives a node.
fn values<P: NodeParameters>(name: &str) -> Result<Vec<(String, Value)>, SetupError> {
    let (_, text) = arm_file(name).ok_or_else(|| SetupError::UnknownArm(name.to_owned()))?;
    Ok(parameters_for(text, name, &format!("/{}", P::NODE_NAME))?)
}
