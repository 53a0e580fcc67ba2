//! `dq_servo replay`: passes a recorded run through the servo cycle, without DDS.

use super::plot;
use crate::cli::error::bail;
use crate::cli::print::print_line;
use dq_bags::Bag;
use dq_ros::ros::RosArgs;
use dq_ros::stderr;
use dq_runs::{Replayed, replay};
use serde_json::json;
use std::path::PathBuf;

/// Replay the recorded inputs of a bag's servos (~/events) through the servo cycle, and compare the commands with those recorded
#[derive(clap::Args)]
pub(in crate::cli) struct Replay {
    /// The bag: a rosbag2 directory or one of its files
    bag: PathBuf,
    /// Also print a table of the replayed motions, for bags without the servo's own reports
    #[arg(long)]
    motions: bool,
    /// Print a JSON list
    #[arg(long)]
    json: bool,
}

impl Replay {
    pub(super) fn run(&self, ros_args: &RosArgs) -> crate::cli::Result<()> {
        if *ros_args != RosArgs::default() {
            let why = "replay takes no ROS arguments: names and parameters are those of the bag";
            return Err(crate::cli::Usage(why.to_owned()).into());
        }
        let mut bag = Bag::open(&self.bag)?;
        let replayed = replay(&mut bag);
        bag.losses().lines().for_each(|loss| stderr::line(format!("warning: {loss}")));
        let replayed = replayed?;
        if self.json {
            print_line!("{:#}", json!(replayed))?;
        }
        for servo in replayed.iter().filter(|_| !self.json) {
            match &servo.why_not {
                Some(why) => stderr::line(format!("warning: {why}")),
                None => print_line!("{}", line(servo))?,
            }
        }
        let motions: Vec<_> = replayed.iter().flat_map(|servo| &servo.motions).collect();
        if !self.json && self.motions {
            print_line!("\n{}", plot::table(&motions, &[]))?;
        }
        match replayed.iter().find(|servo| servo.different > 0) {
            Some(servo) => bail!("the replay of {} has other commands than the recording", servo.node),
            None => Ok(()),
        }
    }
}

/// Returns a line with the result of one servo.
fn line(servo: &Replayed) -> String {
    let Replayed { node, commands, different, largest_difference, unit, .. } = servo;
    let mut judged =
        format!("{node}: {commands} commands, {different} differ, by {largest_difference} at most [{unit}]");
    if let Some(first) = servo.first_difference_s {
        judged += &format!(", the first after {first:.3} s");
    }
    if servo.not_sent > 0 {
        judged += &format!(", {} of them not sent by the replay", servo.not_sent);
    }
    judged + &skipped(servo)
}

/// Returns a text about the commands that were not compared, with the reasons; empty if all were compared.
fn skipped(servo: &Replayed) -> String {
    let Replayed { judged_s, not_judged, inputs_missing, repeated, damaged, .. } = servo;
    const SHOWN: usize = 5;
    let mut said = String::new();
    if *not_judged > 0 || judged_s.len() > 1 {
        let part = |(from, to): &(f64, f64)| format!("{from:.3} to {to:.3} s");
        let mut parts: Vec<_> = judged_s.iter().take(SHOWN).map(part).collect();
        if judged_s.len() > SHOWN {
            parts.push(format!("{} more parts", judged_s.len() - SHOWN));
        }
        said += &format!(
            "; compared: {}; {inputs_missing} cycles are not in the bag, and {not_judged} commands until the next saved state were skipped",
            parts.join(", ")
        );
    }
    if *repeated > 0 {
        said += &format!(
            "; {repeated} cycles are in the bag twice or out of order, as if it were two recordings: they count once"
        );
    }
    if *damaged > 0 {
        said += &format!("; {damaged} messages are damaged");
    }
    said
}
