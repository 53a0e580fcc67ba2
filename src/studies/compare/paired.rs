//! How many tasks settle in two ways, task by task.

use super::numbers::{percent, probability, signed};
use super::sign_test;
use super::summary::{Interval, Z};
use std::collections::BTreeMap;
use std::fmt::Write as _;

/// How a task ended.
#[derive(Clone, Debug, PartialEq)]
pub struct End {
    /// When it had settled \[s\]; none where it has not.
    pub settled: Option<f64>,
    /// Whether parts of the arm went into each other on the way.
    pub through_itself: bool,
    /// How it ended, in words.
    pub words: String,
}

/// The tasks of one law on one arm, each in two ways.
#[derive(Clone, Debug, PartialEq)]
pub struct Paired {
    /// The law's name.
    pub law: String,
    /// The arm's name.
    pub arm: String,
    /// How each task ended in either way.
    pub tasks: Vec<[End; 2]>,
}

impl Paired {
    /// How many tasks settle in each way.
    pub fn counts(&self) -> [usize; 2] {
        [0, 1].map(|way| self.tasks.iter().filter(|both| both[way].settled.is_some()).count())
    }

    /// How many settle in the first way alone, and in the second.
    pub fn alone(&self) -> [usize; 2] {
        let alone = |way: usize| {
            move |both: &&[End; 2]| both[way].settled.is_some() && both[1 - way].settled.is_none()
        };
        [0, 1].map(|way| self.tasks.iter().filter(alone(way)).count())
    }

    /// By how much later tasks settle in the second way \[s\]: the median of those that settle in both.
    pub fn later(&self) -> Option<Interval> {
        let both = self.tasks.iter().filter_map(|[first, second]| Some(second.settled? - first.settled?));
        let mut differences: Vec<_> = both.collect();
        differences.sort_by(f64::total_cmp);
        Interval::median(&differences, Z)
    }

    /// How many of the tasks that do not settle in the second way end so.
    pub fn rest(&self) -> BTreeMap<&str, usize> {
        let mut rest = BTreeMap::new();
        for [_, end] in self.tasks.iter().filter(|[_, end]| end.settled.is_none()) {
            *rest.entry(&*end.words).or_default() += 1;
        }
        rest
    }

    /// The same where no way through the arm itself counts.
    #[must_use]
    pub fn past_itself(&self) -> Self {
        let mut paired = self.clone();
        for end in paired.tasks.iter_mut().flatten().filter(|end| end.through_itself) {
            if end.settled.take().is_some() {
                "through itself".clone_into(&mut end.words);
            }
        }
        paired
    }

    /// A table of the `rows`, whose two ways are called so: shares with their 95 % intervals \[%\], in how many tasks the ways differ, by
    /// chance how probably, and by how much later the second settles.
    pub fn table(rows: &[Self], [first, second]: &[String; 2]) -> String {
        let mut table = format!(
            "| law | arm | tasks | settled, {first} [%] | settled, {second} [%] | only {first}, only {second} | p | {second} later [s] | not \
             settled, {second} |\n|---|---|---|---|---|---|---|---|---|\n"
        );
        for row in rows {
            let (tasks, alone) = (row.tasks.len(), row.alone());
            let shares = row.counts().map(|count| percent(Some(Interval::share(count, tasks, Z))));
            let rest: Vec<_> = row.rest().iter().map(|(end, count)| format!("{count} {end}")).collect();
            let _ = writeln!(
                table,
                "| {} | {} | {tasks} | {} | {} | {}, {} | {} | {} | {} |",
                row.law,
                row.arm,
                shares[0],
                shares[1],
                alone[0],
                alone[1],
                probability(sign_test(alone[0], alone[1])),
                row.later().map_or("-".to_owned(), signed),
                rest.join("; ")
            );
        }
        table
    }
}
