//! `dq_servo plot`: figures and metrics of recorded runs.

use super::table;
use crate::arm::{Chain, JointKind};
use crate::cli::arm::ArmChoice;
use crate::cli::print::print_line;
use crate::config::{DualParameters, ServoParameters};
use crate::draw;
use crate::nodes::{NodeError, Prepared};
use crate::record::{Bag, BagError};
use crate::ros::RosArgs;
use crate::runs::{Fallback, MotionRow, RecordedRun, Timeline, plot, recorded};
use crate::stderr;
use comfy_table::Table;
use serde_json::json;
use std::path::{Path, PathBuf};

/// Draw recorded runs and print the metrics of each motion; several bags are drawn over each other
#[derive(clap::Args)]
pub(in crate::cli) struct Plot {
    /// Bags: rosbag2 directories or their files (MCAP, SQLite)
    #[arg(required = true, value_name = "BAG")]
    bags: Vec<PathBuf>,
    /// Folder for the figures (SVG and PNG)
    #[arg(long, value_name = "DIR", default_value = "plots")]
    out: PathBuf,
    /// Print a JSON list instead of a table
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    arm: ArmChoice,
}

impl Plot {
    pub(super) fn run(&self, ros_args: &RosArgs) -> anyhow::Result<()> {
        let runs = read_all(&self.bags, &self.arm.and(ros_args))?;
        for run in &runs {
            if !run.parameters_known {
                stderr::line(format!(
                    "warning: {}: the bag does not have the servo's parameters; those of --ros-args are presumed, or else the PUMA 560's",
                    run.name
                ));
            }
            if !run.has_speeds() {
                stderr::line(format!(
                    "warning: {}: the bag has no joint velocities and no commands: peak and effort are not known, and joint_velocities has nothing to show",
                    run.name
                ));
            }
            if run.more_motions > 0 {
                stderr::line(format!(
                    "warning: {}: {} more motions are not listed",
                    run.name, run.more_motions
                ));
            }
            if let [(time, violation), ..] = run.violations.as_slice() {
                let count = run.violations.len();
                stderr::line(format!(
                    "{}: {count} commands break a rule, the first after {time:.3} s: {violation}",
                    run.name
                ));
            }
        }
        let figures = plot(&runs)?;
        draw::save(&figures, &self.out)?;
        let motions: Vec<_> = runs.iter().flat_map(|run| &run.motions).collect();
        if self.json {
            print_line!("{:#}", json!(motions))?;
        } else {
            let figures = format!("{} figures are in {}", figures.len(), self.out.display());
            let kinds = runs.iter().flat_map(|run| &run.arms).flat_map(Chain::kinds);
            let joints: Vec<_> = kinds.copied().collect();
            match motions.is_empty() {
                true => print_line!("no goals, and so no motions to measure\n\n{figures}")?,
                false => print_line!("{}{}\n\n{figures}", table(&motions, &joints), notes(&motions))?,
            }
        }
        Ok(())
    }
}

/// The runs of all bags; where one does not have its parameters, they are those with which nodes of these ROS arguments would start.
pub(super) fn read_all(bags: &[PathBuf], ros_args: &RosArgs) -> anyhow::Result<Vec<RecordedRun>> {
    let fallback = fallback(ros_args)?;
    let mut runs = Vec::new();
    for bag in bags {
        let timeline = timeline(bag)?;
        runs.extend(recorded(&timeline, &name(bag, bags), &fallback)?);
    }
    Ok(runs)
}

/// A bag's own name, or its path where another one of these bags has that name too.
fn name(bag: &Path, bags: &[PathBuf]) -> String {
    let is_shared = bags.iter().any(|other| other != bag && other.file_name() == bag.file_name());
    let name = bag.file_name().filter(|_| !is_shared).unwrap_or(bag.as_os_str());
    name.to_string_lossy().into_owned()
}

/// The parameters with which nodes of these ROS arguments would start.
fn fallback(ros_args: &RosArgs) -> Result<Fallback, NodeError> {
    let servo = Prepared::<ServoParameters>::new(ros_args)?;
    crate::cli::warn(servo.warnings());
    let dual = Prepared::<DualParameters>::new(ros_args)?;
    Ok(Fallback { servo: servo.parameters().clone(), dual: dual.parameters().clone() })
}

/// What is in a bag, after its losses have been listed on stderr.
pub(super) fn timeline(path: &Path) -> Result<Timeline, BagError> {
    let timeline = Timeline::read(Bag::open(path)?);
    timeline.losses().lines().for_each(|loss| stderr::line(format!("warning: {loss}")));
    Ok(timeline)
}

/// Lines below the table, one for each motion whose row has a star.
fn notes(motions: &[&MotionRow]) -> String {
    let note = |motion: &&MotionRow| {
        let (MotionRow { run, motion, .. }, missing) = (*motion, motion.missing_s?);
        Some(format!(
            "\n* {run} {motion}: by the servo's status its first {missing:.2} s are not in the bag; the figures are of the rest"
        ))
    };
    motions.iter().filter_map(note).collect()
}

fn table(motions: &[&MotionRow], joints: &[JointKind]) -> Table {
    let mut table = table::motions(&["run", "#", "law"], joints, &["stalls"]);
    for motion in motions {
        let law = table::in_lines(motion.law.as_deref().unwrap_or("-"));
        let star = if motion.missing_s.is_some() { "*" } else { "" };
        let before = [motion.run.clone(), format!("{}{star}", motion.motion), law];
        let figures = table::figures(&motion.figures);
        table.add_row(before.into_iter().chain(figures).chain([motion.stalls.to_string()]));
    }
    table
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bags_of_one_name_are_called_by_their_paths() {
        let bags = ["today/run", "yesterday/run", "yesterday/other"].map(PathBuf::from);
        let names = bags.each_ref().map(|bag| name(bag, &bags));
        assert_eq!(names, ["today/run", "yesterday/run", "other"]);
    }
}
