//! Formats the tables of the page "What the laws do".

use super::matching::others;
use super::numbers::{median, number, percent, probability, range, signed, time};
use super::{ALL_ARMS, Cell, Comparison, Findings, Matched, Outcome, PLANTS, Peer, Quantity, REFERENCE};
use dq_kinematics::control::Law;
use std::fmt::Write as _;

/// Returns the table of each law's results on all arms together.
pub(super) fn figures(findings: &Findings, matched: Matched, limits: bool) -> String {
    let mut table = String::from(
        "| law | gain [1/s] | settled [%] | settling [s] | path / straight | overshoot [mm] | effort [rad²/s] | peak [rad/s] | step [ns] |\n\
         |---|---|---|---|---|---|---|---|---|\n",
    );
    for law in Law::all() {
        let Some(cell) = findings.cell(matched, law, ALL_ARMS, limits, "ideal") else { continue };
        let (low, high) = findings.gain_range(matched, law);
        let _ = writeln!(
            table,
            "| {law} | {}{} | {} | {} |",
            range(low, high),
            if findings.is_matched(matched, law) { "" } else { " †" },
            of_cell(cell, findings),
            findings.step_ns(law).map_or("-".to_owned(), number),
        );
    }
    table
}

/// Returns the table columns from `settled` to `peak` for a cell.
fn of_cell(cell: &Cell, findings: &Findings) -> String {
    let settled = [percent(Some(cell.settled_percent)), time(cell.settling_s, findings.horizon_s)];
    let figures = [cell.path_ratio, cell.overshoot_mm, cell.effort, cell.peak_rad_s].map(median);
    [&settled[..], &figures].concat().join(" | ")
}

/// The head of a table of differences.
const DIFFERENCES: &str = "| law | settled [points] | settling [s] | path / straight | overshoot [mm] | effort [rad²/s] | peak [rad/s] |\n\
     |---|---|---|---|---|---|---|\n";

/// Returns the table of each law's differences from the reference, on all arms together.
pub(super) fn differences(findings: &Findings, matched: Matched, limits: bool) -> String {
    let mut table = String::from(DIFFERENCES);
    for law in others() {
        table += &row_of_differences(findings, matched, limits, law.name());
    }
    table
}

/// Returns the row of a law's or another program's differences from the reference, on all arms together.
fn row_of_differences(findings: &Findings, matched: Matched, limits: bool, law: &str) -> String {
    const OF: [Quantity; 6] = [
        Quantity::Settled,
        Quantity::SettlingTime,
        Quantity::PathRatio,
        Quantity::Overshoot,
        Quantity::Effort,
        Quantity::PeakSpeed,
    ];
    let of = |quantity| findings.comparison(quantity, matched, ALL_ARMS, limits, law, REFERENCE.0.name());
    format!("| {law} | {} |\n", OF.map(|quantity| difference(of(quantity).as_ref())).join(" | "))
}

/// Returns the tables of the other programs and of the reference law, on the same tasks: their results and their differences.
pub(super) fn peers(findings: &Findings, limits: bool) -> String {
    let peers = || findings.peers.iter().filter(|peer| peer.cell.key.limits == limits);
    let mut table = String::from(
        "| program | gain [1/s] | settled [%] | settling [s] | path / straight | overshoot [mm] | effort [rad²/s] | peak [rad/s] |\n\
         |---|---|---|---|---|---|---|---|\n",
    );
    for Peer { cell, gains: [least, greatest] } in peers() {
        let gains = range(*least, *greatest);
        let _ = writeln!(table, "| {} | {gains} | {} |", cell.key.law, of_cell(cell, findings));
    }
    let _ = write!(table, "\nEach less `{}`, on the tasks that both settle:\n\n{DIFFERENCES}", REFERENCE.0);
    for Peer { cell, .. } in peers().filter(|peer| peer.cell.key.law != REFERENCE.0.name()) {
        table += &row_of_differences(findings, Matched::SettlingTime, limits, &cell.key.law);
    }
    table
}

fn difference(comparison: Option<&Comparison>) -> String {
    let Some(comparison) = comparison else { return "-".to_owned() };
    format!("{}{}", signed(comparison.difference), if comparison.tells() { " ∗" } else { "" })
}

/// Returns the table of the percentages that settle with each plant.
pub(super) fn settled(findings: &Findings) -> String {
    let mut table = String::from("| law |");
    for limits in ["no limits", "limits"] {
        PLANTS.iter().for_each(|plant| {
            let _ = write!(table, " {limits}, {} |", plant.name.replace('_', " "));
        });
    }
    let _ = writeln!(table, "\n|{}", "---|".repeat(1 + 2 * PLANTS.len()));
    for law in Law::all() {
        let _ = write!(table, "| {law} |");
        for limits in [false, true] {
            for plant in PLANTS {
                let cell = findings.cell(Matched::SettlingTime, law, ALL_ARMS, limits, plant.name);
                let _ = write!(table, " {} |", percent(cell.map(|cell| cell.settled_percent)));
            }
        }
        table.push('\n');
    }
    table
}

/// Returns the table of each law's results on one arm.
pub(super) fn of_arm(findings: &Findings, arm: &str) -> String {
    let mut table = format!(
        "| law | gain [1/s] | settled, no limits [%] | less {law} | p | settled, limits [%] | less {law} | p | settling, limits [s] | \
         path / straight, limits | peak, limits [rad/s] |\n|{}\n",
        "---|".repeat(11),
        law = REFERENCE.0,
    );
    for law in Law::all() {
        let gain = findings
            .gains
            .iter()
            .find(|gain| (gain.matched, &*gain.law, &*gain.arm) == (Matched::SettlingTime, law.name(), arm));
        let gain = gain.map_or("-".to_owned(), |gain| {
            format!("{}{}", number(gain.gain), if gain.is_matched() { "" } else { " †" })
        });
        let _ = write!(table, "| {law} | {gain} |");
        let cell = |limits| findings.cell(Matched::SettlingTime, law, arm, limits, "ideal");
        for limits in [false, true] {
            let less = findings.comparison(
                Quantity::Settled,
                Matched::SettlingTime,
                arm,
                limits,
                law.name(),
                REFERENCE.0.name(),
            );
            let p = less.as_ref().map_or("-".to_owned(), |less| probability(less.p_holm));
            let settled = percent(cell(limits).map(|cell| cell.settled_percent));
            let _ = write!(
                table,
                " {settled} | {} | {} |",
                difference(less.as_ref()),
                p.trim_start_matches("p = ").trim_start_matches("p ")
            );
        }
        let limited = cell(true);
        let _ = writeln!(
            table,
            " {} | {} | {} |",
            time(limited.and_then(|cell| cell.settling_s), findings.horizon_s),
            median(limited.and_then(|cell| cell.path_ratio)),
            median(limited.and_then(|cell| cell.peak_rad_s)),
        );
    }
    table
}

/// Returns the table of the reasons why tasks failed.
pub(super) fn failures(findings: &Findings) -> String {
    let reasons: Vec<_> = Outcome::failures().collect();
    let names: Vec<_> = reasons.iter().map(|reason| reason.replace('_', " ")).collect();
    let mut table = format!("| law | {} |\n|---|{}\n", names.join(" | "), "---|".repeat(reasons.len()));
    for law in Law::all() {
        let cell = findings.cell(Matched::SettlingTime, law, ALL_ARMS, true, "ideal");
        let count = |reason: &&str| cell.and_then(|cell| cell.failures.get(*reason)).copied().unwrap_or(0);
        let counts: Vec<_> = reasons.iter().map(|reason| count(reason).to_string()).collect();
        let _ = writeln!(table, "| {law} | {} |", counts.join(" | "));
    }
    table
}

/// Returns the table of the largest age of joint states at which each law works.
pub(super) fn ages(findings: &Findings) -> String {
    let mut table = String::from("| law | no limits [ms] | limits [ms] |\n|---|---|---|\n");
    for law in Law::all() {
        let _ = writeln!(table, "| {law} | {} | {} |", age(findings, law, false), age(findings, law, true));
    }
    table
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
