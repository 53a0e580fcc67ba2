//! The file of runs: a line each, in one order, written on all cores, in parts, and gone on with after a kill.

use super::record::Record;
use super::{CompareError, Study};
use rayon::prelude::*;
use std::fs::{File, OpenOptions};
use std::io::{BufRead, BufReader, BufWriter, Seek, SeekFrom, Write};
use std::ops::Range;
use std::path::Path;
use std::str::FromStr;

/// So many runs are done at once, then written: what a kill costs at most.
const BATCH: u64 = 2048;

/// A part of the runs, for one of several machines.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Part {
    /// Which, counted from 1.
    number: u64,
    /// Of how many.
    of: u64,
}

impl Part {
    /// All runs.
    pub const WHOLE: Self = Self { number: 1, of: 1 };

    /// The runs of this part out of so many: all parts together are all of them.
    pub fn runs(&self, count: u64) -> Range<u64> {
        let bound = |part: u64| (u128::from(count) * u128::from(part) / u128::from(self.of)) as u64;
        bound(self.number - 1)..bound(self.number)
    }

    /// The name of this part's file: `compare-K-of-N.jsonl`, which sorts as the parts do.
    pub fn file_name(&self) -> String {
        let Self { number, of } = self;
        format!("compare-{number:0width$}-of-{of}.jsonl", width = of.to_string().len())
    }
}

impl FromStr for Part {
    type Err = String;
    fn from_str(text: &str) -> Result<Self, String> {
        let numbers =
            text.split_once('/').and_then(|(number, of)| Some((number.parse().ok()?, of.parse().ok()?)));
        match numbers {
            Some((number, of)) if 1 <= number && number <= of && of <= 100_000 => Ok(Self { number, of }),
            _ => Err("expected K/N with K from 1 to N, N up to 100000".to_owned()),
        }
    }
}

impl Study {
    /// Writes the lines of `part` of the runs to the file, going on after those that it has; `done` is called with how many are done.
    ///
    /// # Errors
    /// [`CompareError::File`]; [`CompareError::OtherRuns`] and [`CompareError::Damaged`] for what the file has; as the loops.
    pub fn write(&self, file: &Path, part: Part, done: impl Fn(u64)) -> Result<(), CompareError> {
        let error = |why| CompareError::file(file, why);
        let runs = part.runs(self.run_count());
        let options = OpenOptions::new().read(true).write(true).create(true).truncate(false).open(file);
        let mut lines = options.map_err(error)?;
        let (have, bytes) = self.check(file, &lines, &runs)?;
        // What a kill left of a line.
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

    /// Gives `each` all runs, line after line.
    ///
    /// # Errors
    /// [`CompareError::File`], [`CompareError::OtherRuns`], [`CompareError::Damaged`]; [`CompareError::Count`] where runs are missing.
    pub fn read(&self, file: &Path, each: impl FnMut(Record<'static>)) -> Result<(), CompareError> {
        let error = |why| CompareError::file(file, why);
        let (lines, expected) = (File::open(file).map_err(error)?, self.run_count());
        let (count, bytes) = self.lines(file, &lines, &(0..expected), each)?;
        match count == expected {
            _ if bytes < lines.metadata().map_err(error)?.len() => Err(CompareError::damaged(file, count)),
            true => Ok(()),
            false => Err(CompareError::Count { file: file.display().to_string(), count, expected }),
        }
    }

    /// Checks the whole lines: the first and the last must be what these runs make. Returns how many there are, and of how many bytes.
    fn check(&self, file: &Path, lines: &File, runs: &Range<u64>) -> Result<(u64, u64), CompareError> {
        let (mut first, mut last) = (None, None);
        let have = self.lines(file, lines, runs, |record| {
            match first {
                None => first = Some(record),
                Some(_) => last = Some(record),
            };
        })?;
        for (index, record) in [(0, first), (have.0.saturating_sub(1), last)] {
            if let Some(record) = record
                && self.record(runs.start + index)? != record
            {
                return Err(CompareError::other_runs(file, index));
            }
        }
        Ok(have)
    }

    /// Gives `each` the whole lines, each of which must be of the run that belongs there.
    fn lines(
        &self,
        file: &Path,
        lines: &File,
        runs: &Range<u64>,
        mut each: impl FnMut(Record<'static>),
    ) -> Result<(u64, u64), CompareError> {
        let (mut count, mut bytes, mut line) = (0, 0, Vec::new());
        let mut reader = BufReader::new(lines);
        let error = |why| CompareError::file(file, why);
        while reader.read_until(b'\n', &mut line).map_err(error)? > 0 && line.ends_with(b"\n") {
            let record: Record<'static> =
                serde_json::from_slice(&line).map_err(|_| CompareError::damaged(file, count))?;
            let number = runs.start + count;
            if number >= runs.end || !record.is_of(&self.run(number)) {
                return Err(CompareError::other_runs(file, count));
            }
            each(record);
            (count, bytes) = (count + 1, bytes + line.len() as u64);
            line.clear();
        }
        Ok((count, bytes))
    }
}
