//! Writes the sentences at the top of the page "What the laws do": which law to take, with which gain, and up to which age of the
//! joint states. Each sentence has an interval or a p-value.

use super::numbers::{brief, percent, probability, range, signed, time};
use super::tables::age;
use super::templates::fill;
use super::{ALL_ARMS, Cell, Comparison, Findings, Key, Matched, Quantity};

/// The laws under the servo's limits, with fresh joint states and gains for equal settling time.
struct Laws<'a> {
    findings: &'a Findings,
    /// The law that settles the most tasks.
    best: &'a str,
    /// The best law, and the laws that do not differ from it significantly.
    good: Vec<&'a str>,
    /// The other laws.
    rest: Vec<&'a str>,
}

pub(super) fn sentences(findings: &Findings) -> Vec<String> {
    let share = |law: &str| findings.cell(&key(law, ALL_ARMS)).map_or(0.0, |cell| cell.settled_percent.value);
    let Some(best) = findings.laws().into_iter().max_by(|a, b| share(a).total_cmp(&share(b))) else {
        return Vec::new();
    };
    let is_worse = |law: &str| {
        let compared = findings.comparison(Quantity::Settled, &key(best, ALL_ARMS), law);
        law != best && compared.is_some_and(|compared| compared.tells())
    };
    let (rest, good) = findings.laws().into_iter().partition(|law| is_worse(law));
    let laws = Laws { findings, best, good, rest };
    let which = [laws.settle(), laws.on_each_arm(), laws.straightest()];
    which.into_iter().flatten().chain([laws.time(), laws.age()]).collect()
}

fn key(law: &str, arm: &str) -> Key {
    Key::fresh(Matched::SettlingTime, law, arm, true)
}

/// The unit of differences of shares.
const POINTS: &str = " points";

/// Formats a difference and its probability. `unit` has a space in front.
fn told(compared: &Comparison, unit: &str) -> String {
    format!("{}{unit} ({})", signed(compared.difference), probability(compared.p_holm))
}

impl Laws<'_> {
    fn cell(&self, law: &str, limits: bool) -> Option<&Cell> {
        self.findings.cell(&Key { limits, ..key(law, ALL_ARMS) })
    }

    /// Returns the law among `others` whose difference from `law` is the least significant, with their comparison.
    fn nearest<'a>(
        &self,
        quantity: Quantity,
        law: &str,
        others: &[&'a str],
    ) -> Option<(&'a str, Comparison)> {
        let compared =
            |other: &&'a str| Some((*other, self.findings.comparison(quantity, &key(other, ALL_ARMS), law)?));
        let size = |compared: &Comparison| compared.difference.value.abs();
        others
            .iter()
            .filter_map(compared)
            .max_by(|(_, a), (_, b)| a.p_holm.total_cmp(&b.p_holm).then(size(b).total_cmp(&size(a))))
    }

    fn settle(&self) -> Option<String> {
        let Self { findings, best, good, rest } = self;
        let cell = self.cell(best, true)?;
        let (runs, settled) = (&cell.runs, &percent(cell.settled_percent));
        let Some((next, compared)) = self.nearest(Quantity::Settled, best, rest) else {
            return Some(fill("too_few", &[("best", best), ("runs", runs), ("settled", settled)]));
        };
        let names = good.iter().map(|law| format!("`{law}`")).collect::<Vec<_>>().join(", ");
        let [one_of, alike] = if good.len() > 1 { ["one of ", &fill("alike", &[])] } else { [""; 2] };
        Some(fill(
            "take",
            &[
                ("laws", &(one_of.to_owned() + &names)),
                ("best", best),
                ("runs", runs),
                ("arms", &findings.arms.len()),
                ("settled", settled),
                ("alike", &alike),
                ("next", &next),
                ("told", &told(&compared, POINTS)),
            ],
        ))
    }

    /// Returns a sentence about the arms on which a law differs from the baseline in the opposite direction than on all arms
    /// together; `None` if there are no such arms.
    fn on_each_arm(&self) -> Option<String> {
        let (findings, baseline) = (self.findings, self.findings.baseline());
        let compared = |law: &str, arm: &str| {
            findings.comparison(Quantity::Settled, &key(law, arm), baseline).filter(Comparison::tells)
        };
        let reversed = |(arm, law): (&String, &str)| {
            let (here, all) = (compared(law, arm)?, compared(law, ALL_ARMS)?);
            let is_reversed = here.difference.value * all.difference.value < 0.0;
            is_reversed
                .then(|| fill("arm_reversed", &[("law", &law), ("arm", arm), ("told", &told(&here, POINTS))]))
        };
        let each =
            findings.arms.iter().flat_map(|arm| findings.laws().into_iter().map(move |law| (arm, law)));
        let reversed: Vec<_> = each.filter_map(reversed).collect();
        (!reversed.is_empty())
            .then(|| fill("arms_reversed", &[("law", &baseline), ("reversed", &reversed.join("; "))]))
    }

    /// Returns a sentence about the law in `good` with the straightest path; `None` if it does not differ significantly from all
    /// others, or if no law is worse than those in `good`.
    fn straightest(&self) -> Option<String> {
        let path = |law: &str| self.cell(law, true)?.path_ratio;
        let value = |law: &str| path(law).map_or(f64::INFINITY, |path| path.value);
        let best = self.good.iter().copied().min_by(|a, b| value(a).total_cmp(&value(b)))?;
        let others: Vec<_> = self.good.iter().copied().filter(|law| *law != best).collect();
        let (next, compared) = self.nearest(Quantity::PathRatio, best, &others)?;
        let compared = compared.reversed();
        (!self.rest.is_empty() && compared.tells() && compared.difference.high < 0.0).then(|| {
            let median = brief(path(best));
            fill(
                "path",
                &[("best", &best), ("median", &median), ("next", &next), ("told", &told(&compared, ""))],
            )
        })
    }

    fn time(&self) -> String {
        let gain = range(self.findings.gain_range(Matched::SettlingTime, self.best));
        let [free, limited] = [false, true].map(|limits| {
            time(self.cell(self.best, limits).and_then(|cell| cell.settling_s), self.findings.horizon_s)
        });
        fill("time", &[("gain", &gain), ("best", &self.best), ("free", &free), ("limited", &limited)])
    }

    fn age(&self) -> String {
        let [free, limited] = [false, true].map(|limits| age(self.findings, self.best, limits));
        fill("age", &[("free", &free), ("limited", &limited)])
    }
}
