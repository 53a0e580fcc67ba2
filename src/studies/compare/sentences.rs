//! Writes the sentences at the top of the page "What the laws do". They say which law to take, with which gain, and up to which age
//! of the joint states. Each sentence has an interval or a p-value.

use super::numbers::{median, percent, probability, range, signed, time};
use super::tables::age;
use super::{ALL_ARMS, Cell, Comparison, Findings, Interval, Matched, Quantity, REFERENCE};
use dq_kinematics::control::Law;

/// The laws under the servo's limits, with fresh joint states and gains for equal settling time.
struct Laws<'a> {
    findings: &'a Findings,
    /// The law that settles the most tasks.
    best: Law,
    /// The best law, and the laws that do not differ from it significantly.
    good: Vec<Law>,
    /// The other laws.
    rest: Vec<Law>,
}

pub(super) fn sentences(findings: &Findings) -> Vec<String> {
    let cell = |law| findings.cell(Matched::SettlingTime, law, ALL_ARMS, true, "ideal");
    let share = |law: Law| cell(law).map_or(0.0, |cell| cell.settled_percent.value);
    let best = Law::all().max_by(|a, b| share(*a).total_cmp(&share(*b))).unwrap_or(REFERENCE.0);
    let laws = Laws { findings, best, good: Vec::new(), rest: Vec::new() };
    let (good, rest) = Law::all().partition(|law| {
        *law == best || !laws.compared(Quantity::Settled, best, *law).is_some_and(|compared| compared.tells())
    });
    let laws = Laws { good, rest, ..laws };
    let mut sentences = vec![laws.settle()];
    sentences.extend(laws.on_each_arm());
    if !laws.rest.is_empty() {
        let path = |cell: &Cell| cell.path_ratio;
        sentences.push(laws.least(
            Quantity::PathRatio,
            "takes the shortest path",
            "times the straight line",
            path,
        ));
        sentences.push(
            laws.least(Quantity::PeakSpeed, "is the gentlest", "rad/s at the peak", |cell| cell.peak_rad_s),
        );
    }
    sentences.push(laws.time());
    sentences.push(laws.age());
    sentences
}

fn names(laws: &[Law]) -> String {
    laws.iter().map(|law| format!("`{law}`")).collect::<Vec<_>>().join(", ")
}

/// Formats a difference and its probability.
fn told(compared: &Comparison) -> String {
    format!("{} ({})", signed(compared.difference), probability(compared.p_holm))
}

impl Laws<'_> {
    fn cell(&self, law: Law, limits: bool) -> Option<&Cell> {
        self.findings.cell(Matched::SettlingTime, law, ALL_ARMS, limits, "ideal")
    }

    fn compared(&self, quantity: Quantity, law: Law, other: Law) -> Option<Comparison> {
        let (law, other) = (law.name(), other.name());
        self.findings.comparison(quantity, Matched::SettlingTime, ALL_ARMS, true, law, other)
    }

    /// Returns the law among `others` whose difference from `law` is the least significant.
    fn nearest(&self, quantity: Quantity, law: Law, others: &[Law]) -> Option<(Law, Comparison)> {
        let compared = |other: &Law| Some((*other, self.compared(quantity, law, *other)?));
        let each = others.iter().filter(|other| **other != law).filter_map(compared);
        each.max_by(|a, b| {
            a.1.p_holm
                .total_cmp(&b.1.p_holm)
                .then(b.1.difference.value.abs().total_cmp(&a.1.difference.value.abs()))
        })
    }

    fn settle(&self) -> String {
        let Self { findings, best, .. } = self;
        let cell = self.cell(*best, true);
        let of = format!(
            "of {} random tasks on {} arms under the servo's limits {} settled with `{best}`",
            cell.map_or(0, |cell| cell.runs),
            findings.arms.len(),
            percent(cell.map(|cell| cell.settled_percent)),
        );
        let among = self.nearest(Quantity::Settled, *best, &self.good);
        let Some((next, compared)) = self.nearest(Quantity::Settled, *best, &self.rest) else {
            let of_all = Law::all().filter_map(|law| self.compared(Quantity::Settled, *best, law));
            let surest = of_all.map(|compared| compared.p_holm).fold(1.0, f64::min);
            return format!(
                "**Too few tasks to tell the laws apart**: {of}, and no other law settles so many fewer that it could not be chance ({} at \
                 the least).",
                probability(surest)
            );
        };
        let among = among.map_or(String::new(), |(law, compared)| {
            let how =
                if self.good.len() == 2 { "from which the other" } else { "from which the others of these" };
            format!(", {how} cannot be told apart (`{law}`: {} points)", told(&compared.reversed()))
        });
        format!(
            "**Take {}{}**: {of}{among}. Of the rest `{next}` comes nearest, with {} points.",
            if self.good.len() > 1 { "one of " } else { "" },
            names(&self.good),
            told(&compared.reversed()),
        )
    }

    /// Returns sentences about the arms on which a law differs from the reference in another direction than on all arms together.
    fn on_each_arm(&self) -> Vec<String> {
        let mut reversed = Vec::new();
        for (arm, law) in self.findings.arms.iter().flat_map(|arm| Law::all().map(move |law| (arm, law))) {
            let of = |arm: &str| {
                let (quantity, matched) = (Quantity::Settled, Matched::SettlingTime);
                self.findings.comparison(quantity, matched, arm, true, law.name(), REFERENCE.0.name())
            };
            let (Some(here), Some(all)) = (of(arm), of(ALL_ARMS)) else { continue };
            if here.tells() && all.tells() && here.difference.value * all.difference.value < 0.0 {
                reversed.push(format!("`{law}` on {arm} with {} points", told(&here)));
            }
        }
        match reversed.is_empty() {
            _ if self.findings.arms.len() < 2 || self.rest.is_empty() => Vec::new(),
            true => vec![format!(
                "On no arm does a law differ from `{}` the other way round than on all of them, with p < 0.05.",
                REFERENCE.0
            )],
            false => vec![format!(
                "**The result depends on the arm.** On one arm, some laws differ from `{}` in the opposite direction than on all arms together: {}.",
                REFERENCE.0,
                reversed.join("; ")
            )],
        }
    }

    /// Returns a sentence about the law in `good` with the smallest value, if the difference is significant.
    fn least(&self, quantity: Quantity, is: &str, unit: &str, of: fn(&Cell) -> Option<Interval>) -> String {
        let value =
            |law: Law| self.cell(law, true).and_then(of).map_or(f64::INFINITY, |interval| interval.value);
        let least =
            self.good.iter().copied().min_by(|a, b| value(*a).total_cmp(&value(*b))).unwrap_or(self.best);
        let median = median(self.cell(least, true).and_then(of));
        let others: Vec<_> = self.good.iter().copied().filter(|law| *law != least).collect();
        let untold: Vec<_> = others
            .iter()
            .filter(|law| {
                !self.compared(quantity, least, **law).is_some_and(|c| c.tells() && c.difference.value < 0.0)
            })
            .copied()
            .collect();
        let nearest = if untold.is_empty() { &others } else { &untold };
        match self.nearest(quantity, least, nearest) {
            None => format!("`{least}`: a median of {median} {unit}."),
            Some((next, compared)) if untold.is_empty() => format!(
                "Among them `{least}` {is}: a median of {median} {unit}, against `{next}`, the nearest, {} task by task.",
                told(&compared)
            ),
            Some((next, compared)) => format!(
                "Which of them {is} cannot be told: `{least}` has a median of {median} {unit}, against `{next}` {} task by task.",
                told(&compared)
            ),
        }
    }

    fn time(&self) -> String {
        let (low, high) = self.findings.gain_range(Matched::SettlingTime, self.best);
        let of = |limits| {
            time(self.cell(self.best, limits).and_then(|cell| cell.settling_s), self.findings.horizon_s)
        };
        format!(
            "With gain {} [1/s] `{}` settles in {} s where no limit slows it, and in {} s under the limits, the medians of all tasks.",
            range(low, high),
            self.best,
            of(false),
            of(true),
        )
    }

    fn age(&self) -> String {
        let cell = self.findings.cell(Matched::SettlingTime, self.best, ALL_ARMS, true, "latency_20ms");
        format!(
            "With that gain joint states may be {} ms old without limits and {} ms under them; at 20 ms {} settle under the limits.",
            age(self.findings, self.best, false),
            age(self.findings, self.best, true),
            percent(cell.map(|cell| cell.settled_percent)),
        )
    }
}
