//! `dq_servo replay`: a recorded run through the servo cycle, without DDS.

use super::print::print_line;
use crate::record::Bag;
use crate::ros::RosArgs;
use crate::runs::replay;
use anyhow::bail;
use serde_json::json;
use std::path::PathBuf;

/// Feed a bag's goals, joint states and parameters through the servo cycle and compare its commands with those recorded
#[derive(clap::Args)]
pub(super) struct Replay {
    /// The bag: a rosbag2 directory or one of its files
    bag: PathBuf,
    /// Print a JSON list
    #[arg(long)]
    json: bool,
}

impl Replay {
    pub(super) fn run(&self, ros_args: &RosArgs) -> anyhow::Result<()> {
        if *ros_args != RosArgs::default() {
            let why = "replay takes no ROS arguments: names and parameters are those of the bag";
            return Err(super::Usage(why.to_owned()).into());
        }
        let replayed = replay(&Bag::open(&self.bag)?)?;
        if self.json {
            print_line!("{:#}", json!(replayed))?;
        }
        for servo in &replayed {
            let told = format!(
                "{}: {} commands, {} differ, by {} rad/s at most; {} inputs missing in the bag",
                servo.node, servo.commands, servo.different, servo.largest_difference, servo.inputs_missing
            );
            if !self.json {
                print_line!("{told}")?;
            }
        }
        match replayed.iter().find(|servo| servo.different > 0) {
            Some(servo) => bail!("{} replays to other commands than those recorded", servo.node),
            None => Ok(()),
        }
    }
}
