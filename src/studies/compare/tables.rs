//! Formats the tables of the page "What the laws do".

use super::matching::others;
use super::numbers::{median, number, percent, probability, range, signed, time};
use super::{ALL_ARMS, Cell, Comparison, Findings, Matched, Outcome, PLANTS, Peer, Quantity, REFERENCE};
use dq_kinematics::control::Law;

/// The columns of a cell.
const FIGURES: &str =
    "settled [%] | settling [s] | path / straight | overshoot [mm] | effort [rad²/s] | peak [rad/s]";

/// The columns of a table of differences.
const DIFFERENCES: &str = "law | settled [points] | settling [s] | path / straight | overshoot [mm] | effort [rad²/s] | peak [rad/s]";

/// Returns a table with these names of columns and these rows.
fn table(head: &str, rows: impl Iterator<Item = Vec<String>>) -> String {
    let rows = rows.map(|row| format!("| {} |\n", row.join(" | ")));
    let line = "---|".repeat(head.split(" | ").count());
    format!("| {head} |\n|{line}\n{}", rows.collect::<String>())
}

/// Returns the table of each law's results on all arms together.
pub(super) fn figures(findings: &Findings, matched: Matched, limits: bool) -> String {
    let row = |law: Law| {
        let cell = findings.cell(matched, law, ALL_ARMS, limits, "ideal")?;
        let (low, high) = findings.gain_range(matched, law);
        let gain = range(low, high) + mark(findings.is_matched(matched, law));
        let step = findings.step_ns(law).map_or("-".to_owned(), number);
        Some(vec![law.to_string(), gain, of_cell(cell, findings), step])
    };
    table(&format!("law | gain [1/s] | {FIGURES} | step [ns]"), Law::all().filter_map(row))
}

/// Returns the mark of a gain that is not matched.
fn mark(is_matched: bool) -> &'static str {
    if is_matched { "" } else { " †" }
}

/// Returns the table columns from `settled` to `peak` for a cell.
fn of_cell(cell: &Cell, findings: &Findings) -> String {
    let settled = [percent(Some(cell.settled_percent)), time(cell.settling_s, findings.horizon_s)];
    let figures = [cell.path_ratio, cell.overshoot_mm, cell.effort, cell.peak_rad_s].map(median);
    [&settled[..], &figures].concat().join(" | ")
}

/// Returns the table of each law's differences from the reference, on all arms together.
pub(super) fn differences(findings: &Findings, matched: Matched, limits: bool) -> String {
    table(DIFFERENCES, others().map(|law| row_of_differences(findings, matched, limits, law.name())))
}

/// Returns the row of a law's or another program's differences from the reference, on all arms together.
fn row_of_differences(findings: &Findings, matched: Matched, limits: bool, law: &str) -> Vec<String> {
    const OF: [Quantity; 6] = [
        Quantity::Settled,
        Quantity::SettlingTime,
        Quantity::PathRatio,
        Quantity::Overshoot,
        Quantity::Effort,
        Quantity::PeakSpeed,
    ];
    let of = |quantity| findings.comparison(quantity, matched, ALL_ARMS, limits, law, REFERENCE.0.name());
    [&[law.to_owned()][..], &OF.map(|quantity| difference(of(quantity).as_ref()))].concat()
}

fn difference(comparison: Option<&Comparison>) -> String {
    let Some(comparison) = comparison else { return "-".to_owned() };
    format!("{}{}", signed(comparison.difference), if comparison.tells() { " ∗" } else { "" })
}

/// Returns the tables of the other programs and of the reference law, on the same tasks: their results and their differences.
pub(super) fn peers(findings: &Findings, limits: bool) -> [String; 2] {
    let peers = || findings.peers.iter().filter(|peer| peer.cell.key.limits == limits);
    let row = |Peer { cell, gains: [least, greatest] }: &Peer| {
        vec![cell.key.law.clone(), range(*least, *greatest), of_cell(cell, findings)]
    };
    let others = peers().filter(|peer| peer.cell.key.law != REFERENCE.0.name());
    let differences =
        others.map(|peer| row_of_differences(findings, Matched::SettlingTime, limits, &peer.cell.key.law));
    [table(&format!("program | gain [1/s] | {FIGURES}"), peers().map(row)), table(DIFFERENCES, differences)]
}

/// Returns the table of the percentages that settle with each plant.
pub(super) fn settled(findings: &Findings) -> String {
    let columns = || [false, true].into_iter().flat_map(|limits| PLANTS.map(|plant| (limits, plant.name)));
    let name = |(limits, plant): (bool, &str)| {
        format!(" | {}, {}", if limits { "limits" } else { "no limits" }, plant.replace('_', " "))
    };
    let row = |law: Law| {
        let cell = |(limits, plant)| findings.cell(Matched::SettlingTime, law, ALL_ARMS, limits, plant);
        let shares = columns().map(|of| percent(cell(of).map(|cell| cell.settled_percent)));
        std::iter::once(law.to_string()).chain(shares).collect()
    };
    table(&format!("law{}", columns().map(name).collect::<String>()), Law::all().map(row))
}

/// Returns the table of each law's results on one arm.
pub(super) fn of_arm(findings: &Findings, arm: &str) -> String {
    let (matched, reference) = (Matched::SettlingTime, REFERENCE.0.name());
    let row = |law: Law| {
        let gain = findings
            .gains
            .iter()
            .find(|gain| (gain.matched, &*gain.law, &*gain.arm) == (matched, law.name(), arm));
        let gain = gain.map_or("-".to_owned(), |gain| number(gain.gain) + mark(gain.is_matched()));
        let cell = |limits| findings.cell(matched, law, arm, limits, "ideal");
        let settled = [false, true].map(|limits| {
            let less = findings.comparison(Quantity::Settled, matched, arm, limits, law.name(), reference);
            let p = less.as_ref().map_or("-".to_owned(), |less| probability(less.p_holm));
            let p = p.trim_start_matches("p = ").trim_start_matches("p ").to_owned();
            [percent(cell(limits).map(|cell| cell.settled_percent)), difference(less.as_ref()), p]
        });
        let limited = cell(true);
        let figures = [
            time(limited.and_then(|cell| cell.settling_s), findings.horizon_s),
            median(limited.and_then(|cell| cell.path_ratio)),
            median(limited.and_then(|cell| cell.peak_rad_s)),
        ];
        [&[law.to_string(), gain][..], &settled.concat(), &figures].concat()
    };
    let settled = ["no limits", "limits"].map(|of| format!("settled, {of} [%] | less {reference} | p"));
    let head = format!(
        "law | gain [1/s] | {} | settling, limits [s] | path / straight, limits | peak, limits [rad/s]",
        settled.join(" | ")
    );
    table(&head, Law::all().map(row))
}

/// Returns the table of the reasons why tasks failed.
pub(super) fn failures(findings: &Findings) -> String {
    let name = |reason: &str| format!(" | {}", reason.replace('_', " "));
    let row = |law: Law| {
        let cell = findings.cell(Matched::SettlingTime, law, ALL_ARMS, true, "ideal");
        let count = |reason| cell.and_then(|cell| cell.failures.get(reason)).copied().unwrap_or(0);
        let counts = Outcome::failures().map(|reason| count(reason).to_string());
        std::iter::once(law.to_string()).chain(counts).collect()
    };
    table(&format!("law{}", Outcome::failures().map(name).collect::<String>()), Law::all().map(row))
}

/// Returns the table of the largest age of joint states at which each law works.
pub(super) fn ages(findings: &Findings) -> String {
    let row = |law: Law| vec![law.to_string(), age(findings, law, false), age(findings, law, true)];
    table("law | no limits [ms] | limits [ms]", Law::all().map(row))
}

/// Returns the largest age of joint states at which the law works \[ms\], with its interval.
pub(super) fn age(findings: &Findings, law: Law, limits: bool) -> String {
    let Some(ageing) = findings.ageing(law, limits) else { return "-".to_owned() };
    let (age, low) = (ageing.holds_up_to_ms, ageing.low_ms);
    match ageing.high_ms {
        Some(high) => format!("{age:.0} [{low:.0}, {high:.0}]"),
        None if ageing.holds_to_the_end() => format!("≥ {age:.0} [{low:.0}, -]"),
        None => format!("{age:.0} [{low:.0}, -]"),
    }
}
