//! Writes the sentences at the top of the page "What the laws do". They say which law to take, with which gain, and up to which age
//! of the joint states. Each sentence has an interval or a p-value.

use super::numbers::{median, percent, probability, range, signed, time};
use super::tables::age;
use super::templates::fill;
use super::{ALL_ARMS, Cell, Comparison, Findings, Interval, Matched, Quantity, REFERENCE};
use dq_kinematics::control::Law;
use std::fmt::Display;

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
        let path = ("takes the shortest path", "times the straight line");
        sentences.push(laws.least(Quantity::PathRatio, path, |cell| cell.path_ratio));
        let speed = ("is the gentlest", "rad/s at the peak");
        sentences.push(laws.least(Quantity::PeakSpeed, speed, |cell| cell.peak_rad_s));
    }
    sentences.extend([laws.time(), laws.age()]);
    sentences
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

    /// Returns the law among `others` whose difference from `law` is the least significant, with the comparison of the two; `None`
    /// if there is no comparison.
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
        let Self { findings, best, good, rest } = self;
        let cell = self.cell(*best, true);
        let settled = fill(
            "settled",
            &[
                ("runs", &cell.map_or(0, |cell| cell.runs)),
                ("arms", &findings.arms.len()),
                ("settled", &percent(cell.map(|cell| cell.settled_percent))),
                ("best", best),
            ],
        );
        let Some((next, compared)) = self.nearest(Quantity::Settled, *best, rest) else {
            let of_all = Law::all().filter_map(|law| self.compared(Quantity::Settled, *best, law));
            let surest = of_all.map(|compared| compared.p_holm).fold(1.0, f64::min);
            return fill("too_few", &[("settled", &settled), ("p", &probability(surest))]);
        };
        let among = self.nearest(Quantity::Settled, *best, good).map_or(String::new(), |(law, compared)| {
            let others = if good.len() == 2 { "other" } else { "others of these" };
            fill("among", &[("others", &others), ("law", &law), ("told", &told(&compared.reversed()))])
        });
        let one_of = if good.len() > 1 { "one of " } else { "" };
        let names = good.iter().map(|law| format!("`{law}`")).collect::<Vec<_>>().join(", ");
        let values: [(&str, &dyn Display); 5] = [
            ("laws", &(one_of.to_owned() + &names)),
            ("settled", &settled),
            ("among", &among),
            ("next", &next),
            ("told", &told(&compared.reversed())),
        ];
        fill("take", &values)
    }

    /// Returns a sentence about the arms on which a law differs from the reference in the opposite direction than on all arms
    /// together, or the sentence that there are no such arms. Returns `None` if there is only one arm, or no law in `rest`.
    fn on_each_arm(&self) -> Option<String> {
        let Self { findings, rest, .. } = self;
        let reversed = |(arm, law): (&String, Law)| {
            let of = |arm: &str| {
                let (quantity, matched) = (Quantity::Settled, Matched::SettlingTime);
                findings.comparison(quantity, matched, arm, true, law.name(), REFERENCE.0.name())
            };
            let (here, all) = (of(arm)?, of(ALL_ARMS)?);
            let is_reversed =
                here.tells() && all.tells() && here.difference.value * all.difference.value < 0.0;
            let values: [(&str, &dyn Display); 3] = [("law", &law), ("arm", arm), ("told", &told(&here))];
            is_reversed.then(|| fill("arm_reversed", &values))
        };
        let each = findings.arms.iter().flat_map(|arm| Law::all().map(move |law| (arm, law)));
        let reversed: Vec<_> = each.filter_map(reversed).collect();
        let name = if reversed.is_empty() { "no_arm_reversed" } else { "arms_reversed" };
        (findings.arms.len() > 1 && !rest.is_empty())
            .then(|| fill(name, &[("law", &REFERENCE.0), ("reversed", &reversed.join("; "))]))
    }

    /// Returns a sentence about the law in `good` with the smallest value, if the difference is significant.
    fn least(
        &self,
        quantity: Quantity,
        (is, unit): (&str, &str),
        of: fn(&Cell) -> Option<Interval>,
    ) -> String {
        let value =
            |law: Law| self.cell(law, true).and_then(of).map_or(f64::INFINITY, |interval| interval.value);
        let least =
            self.good.iter().copied().min_by(|a, b| value(*a).total_cmp(&value(*b))).unwrap_or(self.best);
        let is_told = |law: &Law| {
            self.compared(quantity, least, *law).is_some_and(|c| c.tells() && c.difference.value < 0.0)
        };
        let others: Vec<_> = self.good.iter().copied().filter(|law| *law != least).collect();
        let untold: Vec<_> = others.iter().copied().filter(|law| !is_told(law)).collect();
        let nearest = self.nearest(quantity, least, if untold.is_empty() { &others } else { &untold });
        let name = match nearest {
            None => "least_alone",
            Some(_) if untold.is_empty() => "least_of_all",
            Some(_) => "least_untold",
        };
        let (next, told) = nearest.map_or((least, String::new()), |(next, compared)| (next, told(&compared)));
        let median = median(self.cell(least, true).and_then(of));
        let values: [(&str, &dyn Display); 6] = [
            ("least", &least),
            ("is", &is),
            ("median", &median),
            ("unit", &unit),
            ("next", &next),
            ("told", &told),
        ];
        fill(name, &values)
    }

    fn time(&self) -> String {
        let (low, high) = self.findings.gain_range(Matched::SettlingTime, self.best);
        let of = |limits| {
            time(self.cell(self.best, limits).and_then(|cell| cell.settling_s), self.findings.horizon_s)
        };
        let values: [(&str, &dyn Display); 4] =
            [("gain", &range(low, high)), ("best", &self.best), ("free", &of(false)), ("limited", &of(true))];
        fill("time", &values)
    }

    fn age(&self) -> String {
        let cell = self.findings.cell(Matched::SettlingTime, self.best, ALL_ARMS, true, "latency_20ms");
        let of = |limits| age(self.findings, self.best, limits);
        let settled = percent(cell.map(|cell| cell.settled_percent));
        fill("age", &[("free", &of(false)), ("limited", &of(true)), ("settled", &settled)])
    }
}
