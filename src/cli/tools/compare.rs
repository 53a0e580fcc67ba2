//! `dq_servo compare`: compares the laws on many arms, tasks and plants. Does not join a ROS graph.

use super::figure_width::FigureWidth;
use super::progress::Progress;
use crate::cli::count::count;
use crate::cli::print::print_line;
use clap::builder::{PossibleValuesParser, TypedValueParser};
use dq_kinematics::control::Law;
use dq_ros::stderr;
use dq_studies::compare::{
    Arm, CompareError, Findings, Paired, Part, Peers, Study, Summary, Switch, SwitchFindings, figures, latex,
    page,
};
use serde::Serialize;
use std::fs::File;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::time::Duration;

/// Compare the laws on several arms, random tasks and plants; resumes an interrupted run
#[derive(clap::Args)]
pub(in crate::cli) struct Compare {
    /// Folder for the results: gains.json, compare.jsonl (a line for each run), tasks.jsonl, compare.json (the summary), figures and
    /// what_the_laws_do.md. If the folder has peers.jsonl (results of other programs), what_the_laws_do.md shows these results too
    #[arg(short, long, value_name = "DIR")]
    out: PathBuf,
    /// Tasks for each arm
    #[arg(long, value_name = "N", default_value_t = 2000, allow_negative_numbers = true, value_parser = count::<u32>(1..=10_000_000))]
    tasks: u32,
    /// Seed of the random tasks
    #[arg(long, value_name = "N", default_value_t = 1, allow_negative_numbers = true, value_parser = count::<u64>(0..=u64::MAX))]
    seed: u64,
    /// Names of built-in arms, or parameter files of arms, instead of the PUMA 560, UR5e, Panda, iiwa 14 and xArm 6
    #[arg(long, value_name = "NAME|FILE", num_args = 1..)]
    arm: Vec<PathBuf>,
    /// Names of the laws to compare; all laws if left out
    #[arg(long, value_name = "LAW,…", value_delimiter = ',', value_parser = PossibleValuesParser::new(Law::names()).try_map(|name| name.parse::<Law>()))]
    laws: Vec<Law>,
    /// Write the runs as compare.csv too, with a row for each run
    #[arg(long, conflicts_with_all = ["part", "reconfigure", "constraints", "posture"])]
    csv: bool,
    /// Write the tables as LaTeX too, with booktabs
    #[arg(long, conflicts_with = "part")]
    latex: bool,
    #[command(flatten)]
    width: FigureWidth,
    /// Compute only part K of N on this machine, and write it to compare-K-of-N.jsonl
    #[arg(long, value_name = "K/N")]
    part: Option<Part>,
    /// Check the N parts in the folder, join them into compare.jsonl, and compute the results from it
    #[arg(long, value_name = "N", conflicts_with = "part", value_parser = count::<u64>(1..=Part::MOST))]
    merge: Option<u64>,
    /// Only count how many tasks settle under the servo's limits with `reconfigure` at `never` and at `always`, and write
    /// reconfigure.md and reconfigure.json
    #[arg(long, conflicts_with_all = ["part", "merge"])]
    reconfigure: bool,
    /// Only count how many tasks settle with `constraints` at `false` and at `true`, and write constraints.md and
    /// constraints.json
    #[arg(long, conflicts_with_all = ["part", "merge", "reconfigure"])]
    constraints: bool,
    /// Only count how many tasks settle with `posture.gain` at 0 and at 1, and write posture.gain.md and posture.gain.json
    #[arg(long, conflicts_with_all = ["part", "merge", "reconfigure", "constraints"])]
    posture: bool,
}

impl Compare {
    pub(super) fn run(&self) -> crate::cli::Result<()> {
        let arms = match self.arm.as_slice() {
            [] => Arm::builtin()?,
            arms => arms.iter().map(|arm| Arm::named(arm)).collect::<Result<_, _>>()?,
        };
        let (part, switch) = (self.part.unwrap_or(Part::WHOLE), self.switch());
        let laws: Vec<_> = Law::all().filter(|law| self.laws.is_empty() || self.laws.contains(law)).collect();
        if let ([law], None, None) = (laws.as_slice(), self.part, switch) {
            return Err(CompareError::OneLaw(law.name().to_owned()).into());
        }
        dq_figures::make_folder(&self.out)?;
        let mut study = Study::new(arms, laws, self.tasks, self.seed)?;
        let gains = self.out.join("gains.json");
        study.read_gains(&gains)?;
        self.announce(&study, part, switch)?;
        if study.gains.is_empty() {
            let progress = Progress::new("gains", study.gain_count());
            study.choose_gains(&gains, || progress.add(1))?;
            progress.end();
        }
        if let Some(switch) = switch {
            return self.switched(&study, switch);
        }
        // The tasks are written first, so that other programs can run them at the same time.
        study.write_tasks(&self.out.join("tasks.jsonl"))?;
        let name = self.runs_name();
        if let Some(parts) = self.merge {
            study.merge(&self.out, parts, &self.out.join(&name))?;
        }
        let (file, runs) = (self.out.join(name), part.runs(study.run_count()));
        let count = runs.end - runs.start;
        let progress = Progress::new("runs", count);
        study.write(&file, part, |count| progress.add(count))?;
        progress.end();
        match self.part {
            Some(_) => Ok(print_line!("{count} runs are in {}", file.display())?),
            None => self.summarize(&study, &file),
        }
    }

    /// Says on stderr how long the runs will take.
    fn announce(&self, study: &Study, part: Part, switch: Option<Switch>) -> crate::cli::Result<()> {
        let runs = part.runs(study.run_count());
        let count = runs.end - runs.start;
        let lines = File::open(self.out.join(self.runs_name()));
        let existing = lines.map_or(0, |file| BufReader::new(file).split(b'\n').count() as u64);
        let (count, estimate) = match switch {
            Some(switch) => (study.switched_count(), study.estimate_switched(switch)?),
            None if self.merge.is_some() => (count, study.estimate(part, count)?),
            None => (count, study.estimate(part, existing)?),
        };
        stderr::line(format!("{count} runs, about {} on this machine", about(estimate)));
        Ok(())
    }

    /// Returns the name of the file of runs.
    fn runs_name(&self) -> String {
        self.part.map_or("compare.jsonl".to_owned(), |part| part.file_name())
    }

    fn switch(&self) -> Option<Switch> {
        match () {
            () if self.reconfigure => Some(Switch::Reconfigure),
            () if self.constraints => Some(Switch::Constraints),
            () if self.posture => Some(Switch::Posture),
            () => None,
        }
    }

    fn switched(&self, study: &Study, switch: Switch) -> crate::cli::Result<()> {
        let progress = Progress::new("runs", study.switched_count());
        let rows = study.switched(switch, || progress.add(1))?;
        progress.end();
        let (name, names) = (switch.parameter(), switch.names());
        self.write_json(name, &SwitchFindings::new(study, &rows))?;
        let past: Vec<_> = rows.iter().map(Paired::past_itself).collect();
        let tables = [
            (format!("What settles with {name}"), Paired::table(&rows, &names)),
            ("If a path through the arm itself does not count".to_owned(), Paired::table(&past, &names)),
        ];
        let markdown = tables.each_ref().map(|(title, table)| format!("{title}:\n\n{}", table.markdown()));
        let latex = || tables.each_ref().map(|(title, table)| table.latex(title)).join("\n");
        let markdown = markdown.join("\n");
        self.write(name, &markdown, latex)?;
        Ok(print_line!("{markdown}")?)
    }

    fn write_json(&self, name: &str, findings: &impl Serialize) -> crate::cli::Result<()> {
        let json = serde_json::to_string(findings).map_err(std::io::Error::from)? + "\n";
        Ok(dq_figures::write(&self.out.join(format!("{name}.json")), json.as_bytes())?)
    }

    /// Writes tables as Markdown, and as LaTeX if that was requested.
    fn write(&self, name: &str, markdown: &str, latex: impl FnOnce() -> String) -> crate::cli::Result<()> {
        dq_figures::write(&self.out.join(format!("{name}.md")), markdown.as_bytes())?;
        if self.latex {
            dq_figures::write(&self.out.join(format!("{name}.tex")), latex().as_bytes())?;
        }
        Ok(())
    }

    fn summarize(&self, study: &Study, file: &Path) -> crate::cli::Result<()> {
        let summary = Summary::read(study, file)?;
        let peers = Peers::read(study, &summary, &self.out.join("peers.jsonl"))?;
        let findings = Findings::new(study, &summary, &peers)?;
        dq_figures::save(&figures(&findings, &summary), &self.out, self.width.width)?;
        if self.csv {
            study.write_csv(file, &self.out.join("compare.csv"))?;
        }
        self.write_json("compare", &findings)?;
        let page = page(&findings);
        self.write("what_the_laws_do", &page, || latex(&findings))?;
        print_line!(
            "{page}\ncompare.jsonl, compare.json, figures and this page are in {}",
            self.out.display()
        )?;
        Ok(())
    }
}

/// Formats a duration roughly.
fn about(duration: Duration) -> String {
    match duration.as_secs_f64() {
        s if s < 90.0 => format!("{:.0} s", s.max(1.0)),
        s if s < 5400.0 => format!("{:.0} min", s / 60.0),
        s => format!("{:.1} h", s / 3600.0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn durations_have_the_unit_that_a_reader_expects() {
        let texts = [0.2, 59.6, 100.0, 5000.0, 9000.0].map(|s| about(Duration::from_secs_f64(s)));
        assert_eq!(texts, ["1 s", "60 s", "2 min", "83 min", "2.5 h"]);
    }
}
