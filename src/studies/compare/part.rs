//! Splits the runs into parts for several machines, and merges the parts.

use super::{CompareError, Study};
use std::fs::File;
use std::io::copy;
use std::ops::Range;
use std::path::Path;
use std::str::FromStr;

/// A part of the runs, for one of several machines.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Part {
    /// The number of the part, counted from 1.
    number: u64,
    /// The number of parts.
    of: u64,
}

impl Part {
    /// Largest number of parts. A larger number is probably a typing error.
    pub const MOST: u64 = 100_000;

    /// The part that has all runs.
    pub const WHOLE: Self = Self { number: 1, of: 1 };

    /// Yields all parts of a study that is split into `of` parts, in order.
    fn each(of: u64) -> impl Iterator<Item = Self> {
        (1..=of).map(move |number| Self { number, of })
    }

    /// Returns the numbers of the runs in this part, if there are `count` runs in all parts together.
    pub fn runs(&self, count: u64) -> Range<u64> {
        let bound = |part: u64| (u128::from(count) * u128::from(part) / u128::from(self.of)) as u64;
        bound(self.number - 1)..bound(self.number)
    }

    /// Returns the name of the part's file, `compare-K-of-N.jsonl`. The names sort in the order of the parts.
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
            Some((number, of)) if 1 <= number && number <= of && of <= Self::MOST => Ok(Self { number, of }),
            _ => Err(format!("expected K/N with K from 1 to N, N up to {}", Self::MOST)),
        }
    }
}

impl Study {
    /// Checks that the files of the parts 1 to `of` in `folder` are complete and belong to this study. Then joins them into `file`.
    ///
    /// # Errors
    /// [`CompareError::File`] if a part is missing, or if `file` cannot be written; [`CompareError::Count`] if a part has too few runs;
    /// [`CompareError::OtherRuns`] if a part has a run of another study or of another part; [`CompareError::Damaged`] if a line of a
    /// part is not a valid run.
    pub fn merge(&self, folder: &Path, of: u64, file: &Path) -> Result<(), CompareError> {
        let mut parts = Vec::new();
        for part in Part::each(of) {
            let (path, runs) = (folder.join(part.file_name()), part.runs(self.run_count()));
            let lines = File::open(&path).map_err(|why| CompareError::file(&path, why))?;
            let count = self.check(&path, &lines, &runs)?.count;
            let expected = runs.end - runs.start;
            if count != expected {
                return Err(CompareError::Count { file: path.display().to_string(), count, expected });
            }
            parts.push(path);
        }
        let mut together = File::create(file).map_err(|why| CompareError::file(file, why))?;
        for part in parts {
            let lines = File::open(&part).and_then(|mut lines| copy(&mut lines, &mut together));
            lines.map_err(|why| CompareError::file(&part, why))?;
        }
        Ok(())
    }
}
