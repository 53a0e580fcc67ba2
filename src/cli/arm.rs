//! Which arm: `--arm NAME` of those that are built in, or a robot description.

use clap::builder::PossibleValuesParser;
use dq_config::{ARMS, PLANT_NAMES, arm_file};
use dq_params::Value;
use dq_ros::ros::RosArgs;
use dq_ros::ros::args::{Override, Remap};

/// Which arm, where it is not the built-in PUMA 560 nor one that ROS arguments describe.
#[derive(clap::Args, Default)]
pub(super) struct ArmChoice {
    /// A built-in arm; ROS arguments override what its parameter file has
    #[arg(long, value_name = "NAME", value_parser = PossibleValuesParser::new(ARMS.map(|(name, _)| name)))]
    arm: Option<String>,
}

impl ArmChoice {
    /// These ROS arguments after the arm's own parameters.
    pub fn and(&self, ros_args: &RosArgs) -> RosArgs {
        let mut all = ros_args.clone();
        if let Some((name, text)) = self.arm.as_deref().and_then(arm_file) {
            all.overrides.insert(0, Override::Builtin { name, text });
        }
        all
    }
}

/// The same, or the robot description of any other.
#[derive(clap::Args, Default)]
pub(super) struct RobotChoice {
    #[command(flatten)]
    arm: ArmChoice,
    /// A robot description, in place of a built-in arm: its base and its tool are guessed where ROS arguments do not name them
    #[arg(value_name = "URDF", conflicts_with = "arm", value_parser = description)]
    robot: Option<String>,
}

/// The name of a robot description, which no ROS argument is.
fn description(text: &str) -> Result<String, &'static str> {
    if text.contains(":=") { Err("ROS arguments come after --ros-args") } else { Ok(text.to_owned()) }
}

impl RobotChoice {
    /// These ROS arguments after the arm's own parameters.
    pub fn and(&self, ros_args: &RosArgs) -> RosArgs {
        let mut all = self.arm.and(ros_args);
        if let Some(file) = &self.robot {
            let yaml = Value::String(file.clone()).to_string();
            let name = "robot_file".to_owned();
            all.overrides.insert(0, Override::Parameter { node: None, name, yaml });
        }
        all
    }

    /// Whether one was chosen.
    pub fn is_some(&self) -> bool {
        self.arm.arm.is_some() || self.robot.is_some()
    }

    /// The same for a plant, which is called `arm` where nobody gives it a name.
    pub fn of_plant(&self, ros_args: &RosArgs) -> RosArgs {
        let mut all = self.and(ros_args);
        all.remaps.push(Remap { node: None, from: "__node".to_owned(), to: PLANT_NAMES[1].to_owned() });
        all
    }
}
