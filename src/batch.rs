//! Many runs, a line of text each, in one order: on all cores, in parts, and gone on with after a kill.

use rayon::prelude::*;
use serde::Serialize;
use serde::de::{DeserializeOwned, IgnoredAny};
use std::fs::{File, OpenOptions};
use std::io::{self, BufRead, BufReader, BufWriter, Seek, SeekFrom, Write};
use std::ops::Range;
use std::path::Path;
use std::str::FromStr;
use thiserror::Error;

/// So many runs are done at once, then written: what a kill costs at most.
const BATCH: u64 = 2048;

/// Why there is no file of runs.
#[derive(Debug, Error)]
pub enum BatchError {
    /// A file that cannot be read or written.
    #[error("{file}: {why}")]
    File {
        /// The file.
        file: String,
        /// Why.
        why: io::Error,
    },
    /// A line of another run than expected there.
    #[error(
        "{file}: line {line} is of another run than expected there: parts are put together in their order, each once; other constants, arms, tasks or another seed need a new folder"
    )]
    OtherRuns {
        /// The file.
        file: String,
        /// The line, counted from 1.
        line: u64,
    },
    /// A line that is no run.
    #[error(
        "{file}: line {line} is damaged: delete it and those after it, and run the same again, which goes on from there"
    )]
    Damaged {
        /// The file.
        file: String,
        /// The line, counted from 1.
        line: u64,
    },
    /// A file with too few or too many runs.
    #[error("{file}: {count} runs, expected {expected}")]
    Count {
        /// The file.
        file: String,
        /// Its runs.
        count: u64,
        /// Those expected.
        expected: u64,
    },
    /// A run that cannot be written as a line.
    #[error("a run cannot be written: {0}")]
    Unwritable(#[from] serde_json::Error),
}

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

    /// The name of this part's file: `stem-K-of-N.jsonl`, which sorts as the parts do.
    pub fn file_name(&self, stem: &str) -> String {
        let Self { number, of } = self;
        format!("{stem}-{number:0width$}-of-{of}.jsonl", width = of.to_string().len())
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

/// Runs, of which each makes its line, with the end of the line, by its number alone.
pub struct Batch<'a, H, L> {
    /// The file of their lines.
    pub file: &'a Path,
    /// The runs' numbers.
    pub runs: Range<u64>,
    /// What the line of a run begins with, which says which run it is: found without doing the run.
    pub head: H,
    /// Makes the line of a run.
    pub line: L,
}

impl<E, H, L> Batch<'_, H, L>
where
    E: From<BatchError> + Send,
    H: Fn(u64) -> String,
    L: Fn(u64) -> Result<String, E> + Sync,
{
    /// Writes the lines to the file, going on after those that it has; `done` is called with how many are done.
    ///
    /// # Errors
    /// [`BatchError::File`]; [`BatchError::OtherRuns`] and [`BatchError::Damaged`] for what the file has; what a run fails with.
    pub fn write(&self, done: impl Fn(u64)) -> Result<(), E> {
        let mut options = OpenOptions::new();
        let file = options.read(true).write(true).create(true).truncate(false).open(self.file);
        let mut file = file.map_err(|why| self.error(why))?;
        let have = self.keep_whole_lines(&mut file)?;
        done(have);
        let mut writer = BufWriter::new(file);
        let mut next = self.runs.start + have;
        while next < self.runs.end {
            let batch = next..self.runs.end.min(next + BATCH);
            let count = batch.end - batch.start;
            next = batch.end;
            let lines = batch.into_par_iter().map(&self.line).collect::<Result<Vec<_>, _>>()?;
            let write = |line: &String| writer.write_all(line.as_bytes());
            lines.iter().try_for_each(write).and_then(|()| writer.flush()).map_err(|why| self.error(why))?;
            done(count);
        }
        Ok(())
    }

    /// Cuts off the half line that a kill may have left, and counts the whole ones. Each must say that it is of the run that belongs
    /// there, and the first and the last must be what these runs make.
    fn keep_whole_lines(&self, lines: &mut File) -> Result<u64, E> {
        let error = |why| self.error(why);
        let (mut count, mut bytes, mut last, mut line) = (0, 0, Vec::new(), Vec::new());
        let mut reader = BufReader::new(&mut *lines);
        while reader.read_until(b'\n', &mut line).map_err(error)? > 0 && line.ends_with(b"\n") {
            self.check_head(count, &last, &line)?;
            if count == 0 {
                self.check_line(0, &line)?;
            }
            (count, bytes) = (count + 1, bytes + line.len() as u64);
            std::mem::swap(&mut last, &mut line);
            line.clear();
        }
        if count > 1 {
            self.check_line(count - 1, &last)?;
        }
        lines.set_len(bytes).map_err(error)?;
        lines.seek(SeekFrom::End(0)).map_err(error)?;
        Ok(count)
    }

    /// Checks a line by what it begins and ends with: a million are looked at in a second so, and parsed in many.
    fn check_head(&self, index: u64, before: &[u8], line: &[u8]) -> Result<(), BatchError> {
        let number = self.runs.start + index;
        let is_there = number < self.runs.end && line.starts_with((self.head)(number).as_bytes());
        if is_there && line.ends_with(b"}\n") {
            return Ok(());
        }
        // Of a half line that another follows without an end, only the next line is not where it belongs.
        match index.checked_sub(1).map(|index| self.wrong(index, before)) {
            Some(damaged @ BatchError::Damaged { .. }) => Err(damaged),
            _ => Err(self.wrong(index, line)),
        }
    }

    fn check_line(&self, index: u64, line: &[u8]) -> Result<(), E> {
        match (self.line)(self.runs.start + index)?.as_bytes() == line {
            true => Ok(()),
            false => Err(self.wrong(index, line).into()),
        }
    }

    /// What is wrong with a line that is not as expected.
    fn wrong(&self, index: u64, text: &[u8]) -> BatchError {
        let (file, line) = (self.file.display().to_string(), index + 1);
        match serde_json::from_slice::<IgnoredAny>(text) {
            Ok(_) => BatchError::OtherRuns { file, line },
            Err(_) => BatchError::Damaged { file, line },
        }
    }

    fn error(&self, why: io::Error) -> E {
        file_error(self.file, why).into()
    }
}

fn file_error(file: &Path, why: io::Error) -> BatchError {
    BatchError::File { file: file.display().to_string(), why }
}

/// The line of a run, with its end.
///
/// # Errors
/// None in practice: what is written has names for its fields.
pub fn line(run: &impl Serialize) -> Result<String, BatchError> {
    Ok(serde_json::to_string(run)? + "\n")
}

/// Gives `each` the runs of a file that has so many, line after line.
///
/// # Errors
/// [`BatchError::File`]; [`BatchError::Damaged`] for what is no run, [`BatchError::Count`] where runs are missing.
pub fn read<R: DeserializeOwned>(
    file: &Path,
    expected: u64,
    mut each: impl FnMut(R),
) -> Result<(), BatchError> {
    let reader = BufReader::new(File::open(file).map_err(|why| file_error(file, why))?);
    let mut count = 0;
    let name = || file.display().to_string();
    for line in reader.lines() {
        let line = line.map_err(|why| file_error(file, why))?;
        count += 1;
        let run = serde_json::from_str(&line);
        each(run.map_err(|_| BatchError::Damaged { file: name(), line: count })?);
    }
    match count == expected {
        true => Ok(()),
        false => Err(BatchError::Count { file: name(), count, expected }),
    }
}
