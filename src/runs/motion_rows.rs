//! The motions of a servo as a bag has them: what the servo said of each last.

use super::run::MotionRow;
use dq_common::text::{NAME, shown};
use dq_wire::{MotionReport, Outcome};

/// So many motions have a row: nobody reads more of them.
const MOST: usize = 10_000;

/// Motions of one number that began farther apart are two, of a servo that was new in between \[s\]: of one, when it began is told a
/// little later or earlier each time.
const SAME: f64 = 0.5;

/// The motions of one servo.
pub(super) struct MotionRows {
    run: String,
    rows: Vec<MotionRow>,
    /// The last motion's number since the servo's start.
    last: u64,
}

impl MotionRows {
    /// None yet, of the run of that name.
    pub fn new(run: &str) -> Self {
        Self { run: run.to_owned(), rows: Vec::new(), last: 0 }
    }

    /// The servo is a new one from now on, which counts its motions from 1.
    pub fn start_over(&mut self) {
        self.last = 0;
    }

    /// Takes what was recorded at `time` \[s\], counted from `origin` \[ns\]: when it began, where that is a motion of which nothing was
    /// said before.
    pub fn take(&mut self, time: f64, origin: i64, report: MotionReport) -> Option<f64> {
        let began = report.began.map_or(time, |began| (i128::from(began) - i128::from(origin)) as f64 * 1e-9);
        if report.outcome == Outcome::Rejected {
            return None;
        }
        let law = shown(&report.law_and_aim(), NAME);
        if report.number == self.last
            && let Some(row) = self.rows.last_mut()
            && (report.began.is_none() || (began - row.start_s).abs() < SAME)
        {
            if !row.law.split(", ").any(|known| known == law) && row.law.len() < NAME {
                row.law += &format!(", {law}");
            }
            row.tell(&report);
            return None;
        }
        self.last = report.number;
        if self.rows.len() >= MOST {
            return None;
        }
        let mut row = MotionRow {
            run: self.run.clone(),
            law,
            gains: shown(&report.gains, NAME),
            start_s: began,
            ..MotionRow::default()
        };
        row.tell(&report);
        self.rows.push(row);
        Some(began)
    }

    /// The motions in the order in which they began. Those that had ended before the recording, which the latched topic still has, are
    /// not of it.
    pub fn finish(self) -> Vec<MotionRow> {
        let is_over = |row: &MotionRow| {
            row.outcome != Outcome::Underway.name() && row.start_s + row.figures.elapsed < 0.0
        };
        let rows = self.rows.into_iter().filter(|row| !is_over(row));
        rows.zip(1..).map(|(row, motion)| MotionRow { motion, ..row }).collect()
    }
}

impl MotionRow {
    fn tell(&mut self, report: &MotionReport) {
        self.outcome = report.outcome.name().to_owned();
        self.why = report.why.as_ref().map(|why| shown(why, NAME));
        self.reconfigured = report.reconfigured;
        self.asked_by = report.asked_by.as_ref().map(|by| shown(by, NAME));
        (self.goal, self.figures) = (report.goal, report.figures);
        self.peak_joint_speeds_of_limits.clone_from(&report.peak_speeds);
    }
}
