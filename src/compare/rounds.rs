//! How many tasks settle under the servo's limits where the arm may go to another configuration, and where it never may.
//!
//! Tasks are poses of joint angles within the limits, so that all can be reached. Each law runs each task twice, with the gain for equal
//! settling time.

use super::closed_loop::{ClosedLoop, Outcome};
use super::conditions::PLANTS;
use super::numbers::{percent, probability};
use super::summary::{Interval, Z};
use super::{CompareError, Matched, Study, sign_test};
use crate::control::Law;
use crate::servo::Reconfigure;
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::time::Duration;

/// A motion that goes round stalls first, which takes `progress_timeout`: both ways have this long.
const HORIZON: Duration = Duration::from_secs(60);

/// The tasks of one law on one arm, both ways.
#[derive(Clone, Debug, PartialEq)]
pub struct Round {
    /// The law's name.
    pub law: &'static str,
    /// The arm's name.
    pub arm: String,
    /// How many tasks there are.
    pub tasks: usize,
    /// How many of them settle where the arm never goes round, and where it always does.
    pub settled: [usize; 2],
    /// How many settle in the first way alone, and in the second.
    pub alone: [usize; 2],
    /// Those that do not settle in the second way, by why the servo had stalled, or its state, and what was known of another configuration.
    pub rest: BTreeMap<String, usize>,
}

impl Study {
    /// How many loops [`rounds`](Self::rounds) runs.
    pub fn round_count(&self) -> u64 {
        2 * (Law::all().len() * self.arms.len()) as u64 * u64::from(self.tasks)
    }

    /// Every law on every arm, both ways. `done` is called after each loop.
    ///
    /// # Errors
    /// As the loops.
    pub fn rounds(&self, done: impl Fn() + Sync) -> Result<Vec<Round>, CompareError> {
        let mut rounds = Vec::new();
        for law in Law::all() {
            for arm in &self.arms {
                let gain = self.gain(Matched::SettlingTime, &arm.name, law);
                let controller = arm.parameters.settings.controller.with_law(law, gain);
                let closed_loop = ClosedLoop { arm, controller, plant: PLANTS[0], limits: true };
                let both = |number: u32| {
                    let task = arm.task(self.seed, number)?;
                    let run = |way| {
                        let ended = closed_loop.run_round(&task, number, way, HORIZON);
                        done();
                        ended
                    };
                    Ok([run(Reconfigure::Never)?, run(Reconfigure::Always)?])
                };
                let tasks: Result<Vec<_>, CompareError> = (0..self.tasks).into_par_iter().map(both).collect();
                let mut round = Round::new(law.name(), &arm.name);
                for ends in tasks? {
                    let settled = ends.each_ref().map(|(ended, _)| ended.outcome == Outcome::Settled);
                    round.add(settled, &ends[1].1);
                }
                rounds.push(round);
            }
        }
        Ok(rounds)
    }
}

impl Round {
    fn new(law: &'static str, arm: &str) -> Self {
        let (settled, alone, rest) = ([0; 2], [0; 2], BTreeMap::new());
        Self { law, arm: arm.to_owned(), tasks: 0, settled, alone, rest }
    }

    /// Adds a task that has `settled` in the two ways, and ended so in the second.
    fn add(&mut self, settled: [bool; 2], end: &str) {
        self.tasks += 1;
        for (way, other) in [(0, 1), (1, 0)] {
            self.settled[way] += usize::from(settled[way]);
            self.alone[way] += usize::from(settled[way] && !settled[other]);
        }
        if !settled[1] {
            *self.rest.entry(end.to_owned()).or_default() += 1;
        }
    }

    /// A table of the rounds: shares with their 95 % intervals \[%\], in how many tasks the ways differ, and by chance how probably.
    pub fn table(rounds: &[Self]) -> String {
        let mut table = String::from(
            "| law | arm | tasks | settled, never [%] | settled, always [%] | only never, only always | p | not settled with always |\n\
             |---|---|---|---|---|---|---|---|\n",
        );
        for Self { law, arm, tasks, settled, alone: [never, always], rest } in rounds {
            let shares = settled.map(|count| percent(Some(Interval::share(count, *tasks, Z))));
            let rest: Vec<_> = rest.iter().map(|(end, count)| format!("{count} {end}")).collect();
            let _ = writeln!(
                table,
                "| {law} | {arm} | {tasks} | {} | {} | {never}, {always} | {} | {} |",
                shares[0],
                shares[1],
                probability(sign_test(*never, *always)),
                rest.join("; ")
            );
        }
        table
    }
}
