//! `dq_servo reproduce`: everything in the paper, offline.

use super::progress::Progress;
use super::table::{self, seconds};
use crate::batch::Part;
use crate::cli::arm::ArmChoice;
use crate::cli::count::count;
use crate::cli::print::{StdoutError, print_line};
use crate::config::ServoParameters;
use crate::draw;
use crate::nodes::Prepared;
use crate::paper::{Experiment, LAWS, Laboratory, Reproduction, Row, Sweep, reproduce};
use crate::ros::RosArgs;
use anyhow::Context;
use comfy_table::Table;
use std::path::PathBuf;

/// Repeat the paper's figures and comparison, and three results that it does not have
#[derive(clap::Args)]
pub(in crate::cli) struct Reproduce {
    /// Folder for the figures (SVG and PNG) and results.json
    #[arg(long, value_name = "DIR", default_value = "reproduced")]
    out: PathBuf,
    /// Constants of the experiments, in place of the paper's (msg_config/paper.yaml)
    #[arg(long, value_name = "FILE")]
    experiment: Option<PathBuf>,
    /// Random tasks of the sweep, in place of the experiment's 2000
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = count::<u32>(1..=u64::from(Experiment::MOST_PAIRS)))]
    tasks: Option<u32>,
    /// Only part K of N of the sweep, to sweep-K-of-N.jsonl: the parts of several machines, put together in order, are sweep.jsonl
    #[arg(long, value_name = "K/N")]
    part: Option<Part>,
    #[command(flatten)]
    arm: ArmChoice,
}

impl Reproduce {
    pub(super) fn run(&self, ros_args: &RosArgs) -> anyhow::Result<()> {
        let prepared = Prepared::<ServoParameters>::new(&self.arm.and(ros_args))?;
        crate::cli::warn(prepared.warnings());
        let parameters = prepared.parameters();
        let mut experiment = match &self.experiment {
            Some(file) => Experiment::from_file(file)?,
            None => Experiment::builtin()?,
        };
        experiment.sweep.pairs = self.tasks.unwrap_or(experiment.sweep.pairs);
        // What cannot be kept is not computed.
        draw::make_folder(&self.out)?;
        let (chain, settings) = (parameters.task.chain().clone(), parameters.settings.clone());
        let lab = Laboratory { chain, settings, experiment };
        if self.part.is_none() {
            lab.goal().context("--experiment FILE can give angles for another arm")?;
        }
        let name = self.part.map_or("sweep.jsonl".to_owned(), |part| part.file_name("sweep"));
        let sweep = Sweep { lab: &lab, file: &self.out.join(name) };
        self.sweep(&sweep)?;
        if self.part.is_some() {
            return Ok(());
        }
        let reproduction = reproduce(&lab, &sweep.read()?)?;
        reproduction.save(&self.out)?;
        print(&reproduction)?;
        let (count, place) = (reproduction.figures.len(), self.out.display());
        Ok(print_line!("\n{count} figures and results.json are in {place}")?)
    }

    /// Runs what is not in the file yet.
    fn sweep(&self, sweep: &Sweep) -> anyhow::Result<()> {
        let part = self.part.unwrap_or(Part::WHOLE);
        let runs = part.runs(u64::from(sweep.lab.experiment.sweep.pairs));
        let progress = Progress::new("tasks", runs.end - runs.start);
        sweep.write(part, |count| progress.add(count))?;
        let (loops, time) = (LAWS.len() as u64 * (runs.end - runs.start), progress.end().as_secs_f64());
        Ok(print_line!("{loops} closed loops are in {}, written in {time:.1} s", sweep.file.display())?)
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
    let mut table = table::motions(&["law", "gain"], &[], &[]);
    for row in rows {
        let figures = table::figures(&row.metrics.figures);
        table.add_row([row.law.to_owned(), row.gain.to_string()].into_iter().chain(figures));
    }
    table
}
