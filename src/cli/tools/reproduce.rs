//! `dq_servo reproduce`: repeats the paper's simulations and figures. Does not join a ROS graph.

use super::table::{self, seconds};
use crate::cli::arm::ArmChoice;
use crate::cli::error::{Error, failed};
use crate::cli::print::{StdoutError, print_line};
use comfy_table::Table;
use dq_ros::ros::RosArgs;
use dq_studies::paper::{Experiment, Laboratory, Reproduction, Row, reproduce};
use std::path::PathBuf;

/// Reproduce the paper's figures and comparison, and two further results
#[derive(clap::Args)]
pub(in crate::cli) struct Reproduce {
    /// Folder for the figures (SVG and PNG) and results.json
    #[arg(short, long, value_name = "DIR", default_value = "reproduced")]
    out: PathBuf,
    /// Constants of the experiments, in place of the paper's (msg_config/paper.yaml)
    #[arg(long, value_name = "FILE")]
    experiment: Option<PathBuf>,
    #[command(flatten)]
    arm: ArmChoice,
}

impl Reproduce {
    pub(super) fn run(&self, ros_args: &RosArgs) -> crate::cli::Result<()> {
        let prepared = crate::cli::offline(self.arm.and(ros_args))?;
        let parameters = prepared.parameters();
        let experiment = match &self.experiment {
            Some(file) => Experiment::from_file(file)?,
            None => Experiment::builtin()?,
        };
        // Create the folder first: if the results cannot be saved, they need not be computed.
        dq_figures::make_folder(&self.out)?;
        let (chain, settings) = (parameters.arms.chain().clone(), parameters.settings.clone());
        let lab = Laboratory { chain, settings, experiment };
        lab.goal().map_err(|why| {
            failed!("--experiment FILE can give angles for another arm: {}", Error::from(why).line())
        })?;
        let reproduction = reproduce(&lab)?;
        reproduction.save(&self.out)?;
        print(&reproduction)?;
        let (count, place) = (reproduction.figures.len(), self.out.display());
        Ok(print_line!("\n{count} figures and results.json are in {place}")?)
    }
}

fn print(reproduction: &Reproduction) -> Result<(), StdoutError> {
    print_line!("{}\n\n{}\n", joints(&reproduction.comparison), motions(&reproduction.comparison))?;
    for claim in &reproduction.claims {
        let verdict = if claim.holds { "holds" } else { "does not hold" };
        print_line!("{}: {verdict}; {}", claim.claim, claim.evidence)?;
    }
    Ok(())
}

fn joints(rows: &[Row]) -> Table {
    let mut table = table::table(["law", "gain", "joints to 2 %\n[s]", "least\nσ"]);
    for row in rows {
        let metrics = &row.metrics;
        let joints: Vec<_> =
            metrics.settling_time_2_percent_joints_s.iter().map(|time| seconds(*time)).collect();
        table.add_row([
            row.law.to_owned(),
            row.gain.to_string(),
            joints.join(" "),
            match metrics.figures.smallest_singular_value {
                Some(sigma) if !metrics.singularity_crossed => format!("{sigma:.1e}"),
                _ => "crossed".to_owned(),
            },
        ]);
    }
    table
}

fn motions(rows: &[Row]) -> Table {
    let mut table = table::motions(&["law", "gain"], &[], &[]);
    for row in rows {
        let figures = table::figures(&row.metrics.figures);
        table.add_row([row.law.to_owned(), row.gain.to_string()].into_iter().chain(figures));
    }
    table
}
