//! `dq_servo reproduce`: everything in the paper, offline.

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
}

impl Reproduce {
    pub(super) fn run(&self, ros_args: &RosArgs) -> anyhow::Result<()> {
        let prepared = Prepared::<ServoParameters>::new(ros_args)?;
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
    print_line!("{}\n\n{}\n", settling(&reproduction.comparison), motions(&reproduction.comparison))?;
    for claim in &reproduction.claims {
        let verdict = if claim.holds { "holds" } else { "does not hold" };
        print_line!("{}: {verdict}; {}", claim.claim, claim.evidence)?;
    }
    Ok(())
}

fn settling(rows: &[Row]) -> Table {
    let mut table =
        table::table(["law", "gain", "settling 2 %:\njoints [s]", "\nrotation [s]", "\nposition [s]"]);
    for row in rows {
        let times = &row.metrics.settling_time_s;
        let joints: Vec<_> = times.joints.iter().map(|time| seconds(*time)).collect();
        table.add_row([
            row.law.to_owned(),
            row.gain.to_string(),
            joints.join(" "),
            seconds(times.rotation),
            seconds(times.position),
        ]);
    }
    table
}

fn motions(rows: &[Row]) -> Table {
    let mut table = table::table([
        "law",
        "gain",
        "path\n[m]",
        "by\nline",
        "over-\nshoot\n[mm]",
        "peak\n[rad/s]",
        "effort\n[rad²/s]",
        "least\nσ",
        "left\n[mm]",
        "step\n[ns]",
    ]);
    for row in rows {
        let metrics = &row.metrics;
        table.add_row([
            row.law.to_owned(),
            row.gain.to_string(),
            format!("{:.3}", metrics.path_length_m),
            format!("{:.3}", metrics.path_ratio),
            format!("{:.1}", metrics.overshoot_mm),
            format!("{:.2}", metrics.peak_joint_speed_rad_s),
            format!("{:.1}", metrics.effort),
            if metrics.singularity_crossed {
                "crossed".to_owned()
            } else {
                format!("{:.1e}", metrics.smallest_singular_value)
            },
            format!("{:.2}", metrics.position_error_mm),
            format!("{:.0}", row.computation_ns),
        ]);
    }
    table
}
