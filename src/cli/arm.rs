//! The choice of an arm: `--arm NAME` for a built-in one, or a robot description.

use clap::builder::PossibleValuesParser;
use dq_config::{ARMS, PLANT_NAMES, arm_file};
use dq_params::Value;
use dq_ros::ros::RosArgs;
use dq_ros::ros::args::{Override, Remap};

/// The choice of a built-in arm. Without a choice, the arm is the one that ROS arguments describe, or the PUMA 560 if they describe
/// none.
#[derive(clap::Args, Default)]
pub(super) struct ArmChoice {
    /// A built-in arm; ROS arguments override its parameter file
    #[arg(long, value_name = "NAME", value_parser = PossibleValuesParser::new(ARMS.map(|(name, _)| name)))]
    arm: Option<String>,
}

impl ArmChoice {
    /// Returns whether an arm was chosen.
    pub fn is_some(&self) -> bool {
        self.arm.is_some()
    }

    /// Returns the parameters of the chosen arm, followed by `ros_args`. If both set a parameter, the value in `ros_args` counts.
    pub fn and(&self, ros_args: &RosArgs) -> RosArgs {
        let mut all = ros_args.clone();
        if let Some((name, text)) = self.arm.as_deref().and_then(arm_file) {
            all.overrides.insert(0, Override::Builtin { name, text });
        }
        all
    }
}

/// The choice of an arm, or of a robot description.
#[derive(clap::Args, Default)]
pub(super) struct RobotChoice {
    #[command(flatten)]
    arm: ArmChoice,
    /// A robot description instead of a built-in arm; its base and tool are guessed unless ROS arguments name them
    #[arg(value_name = "URDF", conflicts_with = "arm", value_parser = description)]
    robot: Option<String>,
}

/// Parses the file name of a robot description. Rejects a ROS argument that is not after `--ros-args`.
fn description(text: &str) -> Result<String, &'static str> {
    if text.contains(":=") { Err("ROS arguments come after --ros-args") } else { Ok(text.to_owned()) }
}

impl RobotChoice {
    /// Returns the parameters of the chosen arm or description, followed by `ros_args`. If both set a parameter, the value in
    /// `ros_args` counts.
    pub fn and(&self, ros_args: &RosArgs) -> RosArgs {
        let mut all = self.arm.and(ros_args);
        if let Some(file) = &self.robot {
            let (name, value) = ("robot_file".to_owned(), Value::String(file.clone()));
            all.overrides.insert(0, Override::Value { node: None, name, value });
        }
        all
    }

    /// Returns whether an arm or a robot description was chosen.
    pub fn is_some(&self) -> bool {
        self.arm.is_some() || self.robot.is_some()
    }

    /// Returns the arguments of a plant. The plant is called `arm` unless `ros_args` rename it.
    pub fn of_plant(&self, ros_args: &RosArgs) -> RosArgs {
        let mut all = self.and(ros_args);
        all.remaps.push(Remap { node: None, from: "__node".to_owned(), to: PLANT_NAMES[1].to_owned() });
        all
    }
}
