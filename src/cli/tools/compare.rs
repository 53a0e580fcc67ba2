//! `dq_servo compare`: the laws compared on many arms, tasks and plants, offline.

use super::progress::Progress;
use crate::cli::count::count;
use crate::cli::print::print_line;
use dq_figures::Width;
use dq_studies::compare::{
    Arm, Findings, Paired, Part, PeerRuns, Peers, REFERENCE, Study, Summary, Switch, figures, page,
};
use std::path::{Path, PathBuf};

/// Compare the laws on several arms, random tasks and plants; resumes an interrupted run
#[derive(clap::Args)]
pub(in crate::cli) struct Compare {
    /// Folder for gains.json, compare.jsonl (a line a run), tasks.jsonl, compare.json (the summary), figures and the page; peers.jsonl there is read
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
    /// Only part K of N, to compare-K-of-N.jsonl, on one of several machines
    #[arg(long, value_name = "K/N")]
    part: Option<Part>,
    /// Check the N parts in the folder, join them as compare.jsonl, and continue as without parts
    #[arg(long, value_name = "N", conflicts_with = "part", value_parser = count::<u64>(1..=Part::MOST))]
    merge: Option<u64>,
    /// Only count how many tasks settle under the servo's limits with `reconfigure` at `always` and at `never`, and write
    /// reconfigure.md
    #[arg(long, conflicts_with_all = ["part", "merge"])]
    reconfigure: bool,
    /// Only count how many tasks settle with `constraints` at `false` and at `true`, and with the programs in peers.jsonl, and
    /// write constraints.md
    #[arg(long, conflicts_with_all = ["part", "merge", "reconfigure"])]
    constraints: bool,
    /// Only count how many tasks settle with `posture.gain` at 0 and at 1, and write posture.gain.md
    #[arg(long, conflicts_with_all = ["part", "merge", "reconfigure", "constraints"])]
    posture: bool,
}

impl Compare {
    pub(super) fn run(&self) -> crate::cli::Result<()> {
        let arms = match self.arm.as_slice() {
            [] => Arm::builtin()?,
            arms => arms.iter().map(|arm| Arm::named(arm)).collect::<Result<_, _>>()?,
        };
        dq_figures::make_folder(&self.out)?;
        let progress = Progress::new("gains", Study::gain_count(arms.len()));
        let study =
            Study::new(arms, self.tasks, self.seed, &self.out.join("gains.json"), || progress.add(1))?;
        progress.end();
        if let Some(switch) = self.switch() {
            return self.switched(&study, switch);
        }
        // The tasks are written first, so that other programs can run them at the same time.
        study.write_tasks(&self.out.join("tasks.jsonl"))?;
        let part = self.part.unwrap_or(Part::WHOLE);
        let name = self.part.map_or("compare.jsonl".to_owned(), |part| part.file_name());
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

    fn switch(&self) -> Option<Switch> {
        match () {
            () if self.reconfigure => Some(Switch::Reconfigure),
            () if self.constraints => Some(Switch::Constraints),
            () if self.posture => Some(Switch::Posture),
            () => None,
        }
    }

    fn switched(&self, study: &Study, switch: Switch) -> crate::cli::Result<()> {
        // Only the study of the constraints is compared with other programs.
        let peers = match switch == Switch::Constraints {
            true => PeerRuns::read(study, &self.out)?,
            false => PeerRuns::default(),
        };
        let progress = Progress::new("runs", study.switched_count());
        let rows = study.switched(switch, || progress.add(1))?;
        progress.end();
        let names = switch.names();
        let past: Vec<_> = rows.iter().map(Paired::past_itself).collect();
        let (all, past) = (Paired::table(&rows, &names), Paired::table(&past, &names));
        let mut tables = format!("{all}\nWhere no way through the arm itself counts:\n\n{past}");
        for (program, rows) in peers.beside(&rows) {
            let ours = format!("{} with {} {}", REFERENCE.0, switch.parameter(), names[1]);
            tables += &format!("\n{}", Paired::table(&rows, &[ours, program]));
        }
        let file = self.out.join(format!("{}.md", switch.parameter()));
        dq_figures::write(&file, tables.as_bytes())?;
        Ok(print_line!("{tables}")?)
    }

    fn summarize(&self, study: &Study, file: &Path) -> crate::cli::Result<()> {
        let summary = Summary::read(study, file)?;
        let peers = Peers::read(study, &summary, &self.out.join("peers.jsonl"))?;
        let findings = Findings::new(study, &summary, &peers)?;
        dq_figures::save(&figures(&findings, &summary), &self.out, Width::Screen)?;
        let json = serde_json::to_string(&findings).map_err(std::io::Error::from)? + "\n";
        dq_figures::write(&self.out.join("compare.json"), json.as_bytes())?;
        let page = page(&findings);
        dq_figures::write(&self.out.join("what_the_laws_do.md"), page.as_bytes())?;
        print_line!(
            "{page}\ncompare.jsonl, compare.json, figures and this page are in {}",
            self.out.display()
        )?;
        Ok(())
    }
}
