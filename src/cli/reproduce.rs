//! `dq_servo reproduce`: everything in the paper, offline.

use super::arm::ArmChoice;
use super::print::{StdoutError, print_line};
use super::table::{self, seconds};
use crate::config::ServoParameters;
use crate::nodes::Prepared;
use crate::paper::{Experiment, Laboratory, Reproduction, Row, reproduce};
use crate::ros::RosArgs;
use anyhow::Context;
use comfy_table::Table;
use indicatif::{ProgressBar, ProgressStyle};
use std::path::PathBuf;

/// Repeat the paper's figures and comparison, and three results that it does not have
#[derive(clap::Args)]
pub(super) struct Reproduce {
    /// Folder for the figures (SVG and PNG) and results.json
    #[arg(long, value_name = "DIR", default_value = "reproduced")]
    out: PathBuf,
    /// Constants of the experiments, in place of the paper's (msg_config/paper.yaml)
    #[arg(long, value_name = "FILE")]
    experiment: Option<PathBuf>,
    #[command(flatten)]
    arm: ArmChoice,
}

impl Reproduce {
    pub(super) fn run(&self, ros_args: &RosArgs) -> anyhow::Result<()> {
        let prepared = Prepared::<ServoParameters>::new(&self.arm.and(ros_args))?;
        super::warn(prepared.warnings());
        let parameters = prepared.parameters();
        let experiment = match &self.experiment {
            Some(file) => Experiment::from_file(file)?,
            None => Experiment::builtin()?,
        };
        // What cannot be kept is not computed.
        std::fs::create_dir_all(&self.out).with_context(|| self.out.display().to_string())?;
        let bar = progress(u64::from(experiment.sweep.pairs));
        let (chain, settings) = (parameters.task.chain().clone(), parameters.settings.clone());
        let reproduction = reproduce(&Laboratory { chain, settings, experiment }, || bar.inc(1))?;
        bar.finish_and_clear();
        reproduction.save(&self.out)?;
        print(&reproduction)?;
        let (count, place) = (reproduction.figures.len(), self.out.display());
        Ok(print_line!("\n{count} figures and results.json are in {place}")?)
    }
}

/// On a terminal only.
fn progress(pairs: u64) -> ProgressBar {
    // The template is a constant; without it the default one serves.
    match ProgressStyle::with_template("sweep {bar:40} {pos}/{len} pairs, {eta} left") {
        Ok(style) => ProgressBar::new(pairs).with_style(style),
        Err(_) => ProgressBar::new(pairs),
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
    let mut table = table::table(["law", "gain", "joints to 2 %\n[s]", "least\nσ", "step\n[ns]"]);
    for row in rows {
        let metrics = &row.metrics;
        let joints: Vec<_> =
            metrics.settling_time_2_percent_joints_s.iter().map(|time| seconds(*time)).collect();
        table.add_row([
            row.law.to_owned(),
            row.gain.to_string(),
            joints.join(" "),
            if metrics.singularity_crossed {
                "crossed".to_owned()
            } else {
                format!("{:.1e}", metrics.smallest_singular_value)
            },
            format!("{:.0}", row.computation_ns),
        ]);
    }
    table
}

fn motions(rows: &[Row]) -> Table {
    let mut table = table::motions(&["law", "gain"], &[]);
    for row in rows {
        let figures = table::figures(&row.metrics.figures, row.metrics.path_ratio);
        table.add_row([row.law.to_owned(), row.gain.to_string()].into_iter().chain(figures));
    }
    table
}
