//! `--arm NAME`: an arm from the box.

use crate::config::{ARMS, PLANT_NAMES, arm_file};
use crate::ros::RosArgs;
use crate::ros::args::{Override, Remap};
use clap::builder::PossibleValuesParser;

/// Which arm, where it is not the built-in PUMA 560 nor one that ROS arguments describe.
#[derive(clap::Args, Default)]
pub(super) struct ArmChoice {
    /// An arm with a parameter file in the box; ROS arguments override what is in it
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

    /// Whether one was chosen.
    #[cfg(feature = "tools")]
    pub fn is_some(&self) -> bool {
        self.arm.is_some()
    }

    /// The same for a plant, which is called `arm` where nobody gives it a name.
    pub fn of_plant(&self, ros_args: &RosArgs) -> RosArgs {
        let mut all = self.and(ros_args);
        all.remaps.push(Remap { node: None, from: "__node".to_owned(), to: PLANT_NAMES[1].to_owned() });
        all
    }
}
