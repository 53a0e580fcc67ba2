//! Compares, task by task, whether tasks settle under two conditions.

use super::numbers::{probability, share, signed};
use super::summary::{Interval, Z};
use super::{Table, sign_test};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// How a task ended.
#[derive(Clone, Debug, Deserialize, PartialEq, Serialize)]
pub struct End {
    /// The settling time \[s\]; `None` if the task has not settled.
    pub settled: Option<f64>,
    /// Whether parts of the arm passed through each other in the motion.
    pub through_itself: bool,
    /// How the task ended, in words.
    pub words: String,
}

/// The numbers of tasks that settle with one law on one arm, under each of two conditions.
#[derive(Clone, Debug, Deserialize, PartialEq, Serialize)]
pub struct Counts {
    /// The name of the law.
    pub law: String,
    /// The name of the arm.
    pub arm: String,
    /// The number of tasks.
    pub tasks: usize,
    /// The number of tasks that settle under each condition.
    pub settled: [usize; 2],
    /// The number of tasks that settle under the first condition only, and under the second only.
    pub alone: [usize; 2],
    /// The number of tasks under each condition that settle, and in which the arm does not pass through itself.
    pub past_itself: [usize; 2],
    /// How the first task ended under each condition. A later version of this program can repeat this task, and check that the
    /// result is the same.
    pub sample: Option<[End; 2]>,
}

/// The tasks of one law on one arm, each under two conditions.
#[derive(Clone, Debug, PartialEq)]
pub struct Paired {
    /// The name of the law.
    pub law: String,
    /// The name of the arm.
    pub arm: String,
    /// How each task ended under each of the two conditions.
    pub tasks: Vec<[End; 2]>,
}

impl Paired {
    /// Returns the number of tasks that settle under each condition.
    pub fn settled(&self) -> [usize; 2] {
        [0, 1].map(|way| self.tasks.iter().filter(|both| both[way].settled.is_some()).count())
    }

    /// Returns the number of tasks that settle under the first condition only, and under the second only.
    pub fn alone(&self) -> [usize; 2] {
        let alone = |way: usize| {
            move |both: &&[End; 2]| both[way].settled.is_some() && both[1 - way].settled.is_none()
        };
        [0, 1].map(|way| self.tasks.iter().filter(alone(way)).count())
    }

    /// Counts the tasks that settle.
    pub fn counts(&self) -> Counts {
        Counts {
            law: self.law.clone(),
            arm: self.arm.clone(),
            tasks: self.tasks.len(),
            settled: self.settled(),
            alone: self.alone(),
            past_itself: self.past_itself().settled(),
            sample: self.tasks.first().cloned(),
        }
    }

    /// Returns how much later tasks settle under the second condition than under the first \[s\]. This is the median difference
    /// over the tasks that settle under both conditions; `None` if there are no such tasks.
    pub fn later(&self) -> Option<Interval> {
        let both = self.tasks.iter().filter_map(|[first, second]| Some(second.settled? - first.settled?));
        let mut differences: Vec<_> = both.collect();
        differences.sort_by(f64::total_cmp);
        Interval::median(&differences, Z)
    }

    /// Counts the tasks that do not settle under the second condition, grouped by how they ended.
    pub fn rest(&self) -> BTreeMap<&str, usize> {
        let mut rest = BTreeMap::new();
        for [_, end] in self.tasks.iter().filter(|[_, end]| end.settled.is_none()) {
            *rest.entry(&*end.words).or_default() += 1;
        }
        rest
    }

    /// Returns a copy in which every run counts as not settled if the arm passed through itself.
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

    /// Returns a table of the `rows`. `first` and `second` are the names of the two conditions.
    ///
    /// The columns are: the percentages of tasks that settle, with 95 % intervals; the numbers of tasks that settle under one
    /// condition only; the probability that the difference is chance; and how much later tasks settle under the second condition.
    pub fn table(rows: &[Self], [first, second]: &[String; 2]) -> Table {
        let row = |row: &Self| {
            let (tasks, [only_first, only_second]) = (row.tasks.len(), row.alone());
            let shares = row.settled().map(|count| share(Interval::share(count, tasks, Z)));
            let rest: Vec<_> = row.rest().iter().map(|(end, count)| format!("{count} {end}")).collect();
            let later = row.later().map_or("-".to_owned(), signed);
            let p = probability(sign_test(only_first, only_second));
            let only = format!("{only_first}, {only_second}");
            [
                &[row.law.clone(), row.arm.clone(), tasks.to_string()][..],
                &shares,
                &[only, p, later, rest.join("; ")],
            ]
            .concat()
        };
        let head = [
            "law",
            "arm",
            "tasks",
            &format!("settled, {first} [%]"),
            &format!("settled, {second} [%]"),
            &format!("only {first}, only {second}"),
            "p",
            &format!("{second} later [s]"),
            &format!("not settled, {second}"),
        ];
        Table::new(head, rows.iter().map(row))
    }
}
