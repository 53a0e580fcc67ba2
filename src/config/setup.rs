//! Creates a servo from the name of a built-in arm, from a robot description, or from a kinematic chain.

use super::common::numbers_of;
use super::{ARMS, DualParameters, NodeParameters, ServoParameters, arm_file};
use dq_algebra::UnitDualQuaternion;
use dq_core::servo::{Arms, JointOrder, Limits, PositionLimits, Servo, Settings, SettingsError};
use dq_kinematics::arm::Chain;
use dq_params::{ParameterError, Value, parameters_for};
use std::time::Duration;
use thiserror::Error;

/// The reason why the servo of an arm cannot be created.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum SetupError {
    /// There is no built-in arm with this name.
    #[error("no built-in arm is called {0:?}: expected one of {names}", names = ARMS.map(|(name, _)| name).join(", "))]
    UnknownArm(String),
    /// The description of the arm is invalid.
    #[error(transparent)]
    Parameters(#[from] ParameterError),
    /// The settings do not match the arm.
    #[error(transparent)]
    Settings(#[from] SettingsError),
}

/// A type that can be created for a built-in arm, by the arm's name in [`ARMS`].
pub trait ForArm: Sized {
    /// Creates the value for the arm `name`, with the settings of its parameter file.
    ///
    /// # Errors
    /// [`SetupError::UnknownArm`] for an unknown name.
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
    /// Creates the parameters for two arms, each like the built-in arm `name`. The base of the right arm is at
    /// `left_base_from_right_base`. The controlled pose is the pose of the right tool relative to the left tool.
    ///
    /// # Errors
    /// [`SetupError::UnknownArm`] for an unknown name.
    pub fn for_two_arms(
        name: &str,
        left_base_from_right_base: &UnitDualQuaternion,
    ) -> Result<Self, SetupError> {
        let mut values = values::<DualParameters>(name)?;
        let base = numbers_of(left_base_from_right_base).to_vec();
        values.push(("right_base".to_owned(), Value::DoubleArray(base)));
        Ok(DualParameters::from_values(values, name)?.0)
    }

    /// Creates the parameters for the arm between the links `base_frame` and `tool_frame` in a robot description, with its limits.
    /// A joint without an acceleration limit gets the acceleration with which it reaches its velocity limit in half a second.
    ///
    /// # Errors
    /// [`SetupError::Parameters`] for a text that is not a robot description, has no arm between these links, or has no velocity
    /// limit for a joint.
    pub fn from_urdf(text: &str, base_frame: &str, tool_frame: &str) -> Result<Self, SetupError> {
        let values = [("robot_description", text), ("base_frame", base_frame), ("tool_frame", tool_frame)];
        let values = values.map(|(name, text)| (name.to_owned(), Value::String(text.to_owned())));
        Ok(Self::from_values(values.into(), "robot_description")?)
    }

    /// Creates the parameters for an arm of your own, with the kinematics `chain`. `velocity` [rad/s, prismatic: m/s] and
    /// `acceleration` [rad/s², prismatic: m/s²] are its limits, one number per joint. The acceleration limits apply to the deceleration
    /// too. There are no position limits and no jerk limits. The joints are called joint1, joint2 and so on.
    ///
    /// # Errors
    /// [`SettingsError`] if the number of limits differs from the number of joints, or a limit is invalid.
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

    /// Returns these parameters after `change` has changed their settings, such as limits, law and gains, tolerances, or the kind
    /// of commands that the robot takes.
    pub fn with(mut self, change: impl FnOnce(&mut Settings)) -> Self {
        change(&mut self.settings);
        self
    }

    /// Returns these parameters with another control period.
    pub fn with_period(self, period: Duration) -> Self {
        Self { period, ..self }
    }

    /// Creates the servo with these parameters.
    ///
    /// # Errors
    /// [`SettingsError`] if the settings are invalid.
    pub fn build(&self) -> Result<Servo, SettingsError> {
        let Self { arms, joints, goal_frame, tool_frame, settings, period, .. } = self;
        let servo = Servo::new(arms.clone(), joints.clone(), goal_frame, settings.clone(), *period)?;
        Ok(servo.with_tool_frame(tool_frame))
    }
}

/// Returns the values for a node from the parameter file of the built-in arm `name`.
fn values<P: NodeParameters>(name: &str) -> Result<Vec<(String, Value)>, SetupError> {
    let (_, text) = arm_file(name).ok_or_else(|| SetupError::UnknownArm(name.to_owned()))?;
    Ok(parameters_for(text, name, &format!("/{}", P::NODE_NAME))?)
}
