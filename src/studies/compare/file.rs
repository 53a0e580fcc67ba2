//! The file of runs, which has one line per run in a fixed order. All cores compute the runs. After an interruption, the program
//! continues the file.

use super::part::Part;
use super::record::Record;
use super::{CompareError, Study};
use rayon::prelude::*;
use std::fs::{File, OpenOptions};
use std::io::{BufRead, BufReader, BufWriter, Seek, SeekFrom, Write};
use std::ops::Range;
use std::path::Path;

/// Number of runs that are computed and then written together. An interruption loses at most this number of runs.
const BATCH: u64 = 2048;

/// The number and the total length of the complete lines of a file of runs.
pub(super) struct WholeLines {
    pub count: u64,
    pub bytes: u64,
}

impl Study {
    /// Writes the runs of `part` to the file, one line each, after the existing lines. Calls `done` with the number of finished
    /// runs.
    ///
    /// # Errors
    /// [`CompareError::File`]; [`CompareError::OtherRuns`] and [`CompareError::Damaged`] for existing lines; the first error of a
    /// simulated run. In practice, no simulated run fails.
    pub fn write(&self, file: &Path, part: Part, done: impl Fn(u64)) -> Result<(), CompareError> {
        let error = |why| CompareError::file(file, why);
        let runs = part.runs(self.run_count());
        let options = OpenOptions::new().read(true).write(true).create(true).truncate(false).open(file);
        let mut lines = options.map_err(error)?;
        let WholeLines { count: have, bytes } = self.check(file, &lines, &runs)?;
        // Removes the incomplete line that an interruption has left.
        lines.set_len(bytes).and_then(|()| lines.seek(SeekFrom::End(0))).map_err(error)?;
        done(have);
        let mut writer = BufWriter::new(lines);
        let mut next = runs.start + have;
        while next < runs.end {
            let batch = next..runs.end.min(next + BATCH);
            let count = batch.end - batch.start;
            next = batch.end;
            let line = |number| Ok(serde_json::to_string(&self.record(number)?)? + "\n");
            let batch = batch.into_par_iter().map(line).collect::<Result<String, CompareError>>()?;
            writer.write_all(batch.as_bytes()).and_then(|()| writer.flush()).map_err(error)?;
            done(count);
        }
        Ok(())
    }

    /// Calls `each` with all runs, line by line.
    ///
    /// # Errors
    /// [`CompareError::File`], [`CompareError::OtherRuns`], [`CompareError::Damaged`]; [`CompareError::Count`] if runs are missing.
    pub fn read(&self, file: &Path, each: impl FnMut(Record)) -> Result<(), CompareError> {
        let error = |why| CompareError::file(file, why);
        let (lines, expected) = (File::open(file).map_err(error)?, self.run_count());
        let WholeLines { count, bytes } = self.lines(file, &lines, &(0..expected), each)?;
        match count == expected {
            _ if bytes < lines.metadata().map_err(error)?.len() => Err(CompareError::damaged(file, count)),
            true => Ok(()),
            false => Err(CompareError::Count { file: file.display().to_string(), count, expected }),
        }
    }

    /// Writes the runs in `lines` to `csv`, one row per run. The first row has the names of the columns. An unknown number is empty.
    ///
    /// # Errors
    /// [`CompareError::File`], and the errors of [`read`](Self::read).
    pub fn write_csv(&self, lines: &Path, csv: &Path) -> Result<(), CompareError> {
        let error = |why: csv::Error| CompareError::file(csv, why.into());
        let mut writer = csv::Writer::from_path(csv).map_err(error)?;
        let mut written = Ok(());
        self.read(lines, |record| {
            if written.is_ok() {
                written = writer.serialize(record);
            }
        })?;
        written.and_then(|()| Ok(writer.flush()?)).map_err(error)
    }

    /// Checks the complete lines. The first line, the last line, and one line of each cell must equal the results of this program.
    /// A cell has the runs of one law under the same conditions.
    pub(super) fn check(
        &self,
        file: &Path,
        lines: &File,
        runs: &Range<u64>,
    ) -> Result<WholeLines, CompareError> {
        let mut sampled = self.sampled().skip_while(|number| *number < runs.start).peekable();
        let (mut next, mut last, mut looked_at) = (runs.start, None, Vec::new());
        let have = self.lines(file, lines, runs, |record| {
            let is_sampled = sampled.next_if_eq(&next).is_some();
            if is_sampled || next == runs.start {
                looked_at.push((next, record))
            } else {
                last = Some((next, record))
            };
            next += 1;
        })?;
        looked_at.extend(last);
        let other = |(number, record): &&(u64, Record)| match self.record(*number) {
            Ok(again) => again != *record,
            Err(_) => true,
        };
        match looked_at.par_iter().find_first(other) {
            Some((number, _)) => Err(CompareError::other_runs(file, number - runs.start)),
            None => Ok(have),
        }
    }

    /// Calls `each` with the run of each complete line, after a check that the line belongs to the expected run.
    fn lines(
        &self,
        file: &Path,
        lines: &File,
        runs: &Range<u64>,
        mut each: impl FnMut(Record),
    ) -> Result<WholeLines, CompareError> {
        let (mut count, mut bytes, mut line) = (0, 0, Vec::new());
        let mut reader = BufReader::new(lines);
        let error = |why| CompareError::file(file, why);
        while reader.read_until(b'\n', &mut line).map_err(error)? > 0 && line.ends_with(b"\n") {
            let record: Record =
                serde_json::from_slice(&line).map_err(|_| CompareError::damaged(file, count))?;
            let number = runs.start + count;
            if number >= runs.end || !record.is_of(&self.run(number)) {
                return Err(CompareError::other_runs(file, count));
            }
            each(record);
            (count, bytes) = (count + 1, bytes + line.len() as u64);
            line.clear();
        }
        Ok(WholeLines { count, bytes })
    }
}
