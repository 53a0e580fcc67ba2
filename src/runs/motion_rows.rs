//! The motions of a servo in a bag. Each motion is taken from its last report.

use super::run::MotionRow;
use dq_common::text::{NAME, shown};
use dq_wire::{MotionReport, Outcome};

/// The largest number of rows. Later motions have no row.
const MOST: usize = 10_000;

/// The largest difference between the start times in the reports of one motion \[s\]. If two reports with the same number differ by
/// more, the servo was restarted between them.
const SAME: f64 = 0.5;

/// The motions of one servo.
pub(super) struct MotionRows {
    run: String,
    rows: Vec<MotionRow>,
    /// The number that the servo gave to the last motion. The servo counts motions from its start.
    last: u64,
}

impl MotionRows {
    /// Creates an empty list for the run with this name.
    pub fn new(run: &str) -> Self {
        Self { run: run.to_owned(), rows: Vec::new(), last: 0 }
    }

    /// Expects that the next report has motion number 1, because the servo was restarted.
    pub fn start_over(&mut self) {
        self.last = 0;
    }

    /// Processes a report that was recorded at `time` \[s\], counted from `origin` \[ns\]. If it is the first report of a motion,
    /// adds a row, and returns when the motion began \[s\]. Otherwise updates the motion's row, and returns `None`. Also returns
    /// `None` for a rejected goal.
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
            row.update(&report);
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
        row.update(&report);
        self.rows.push(row);
        Some(began)
    }

    /// Returns the motions in the order of their starts. Leaves out motions that ended before the recording: the bag has their reports
    /// only because the topic is latched.
    pub fn finish(self) -> Vec<MotionRow> {
        let is_over = |row: &MotionRow| {
            row.outcome != Outcome::Underway.name() && row.start_s + row.figures.elapsed < 0.0
        };
        let rows = self.rows.into_iter().filter(|row| !is_over(row));
        rows.zip(1..).map(|(row, motion)| MotionRow { motion, ..row }).collect()
    }
}

impl MotionRow {
    fn update(&mut self, report: &MotionReport) {
        self.outcome = report.outcome.name().to_owned();
        self.why = report.why.as_ref().map(|why| shown(why, NAME));
        self.reconfigured = report.reconfigured;
        self.asked_by = report.asked_by.as_ref().map(|by| shown(by, NAME));
        (self.goal, self.figures) = (report.goal, report.figures);
        self.peak_joint_speeds_of_limits.clone_from(&report.peak_speeds);
    }
}
