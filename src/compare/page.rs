//! The page "What the laws do", written from the findings.

use super::summary::{Cell, Interval};
use super::{Findings, Matched, Outcome, PLANTS};
use crate::control::Law;
use std::fmt::Write as _;

/// The page in Markdown. Every number in it comes from the findings.
pub fn page(findings: &Findings) -> String {
    let mut page = String::from("# What the laws do\n\n");
    for sentence in sentences(findings) {
        page += &sentence;
        page.push('\n');
    }
    page += &how(findings);
    for (matched, title) in
        [(Matched::SettlingTime, "## Equal settling time"), (Matched::PeakSpeed, "## Equal peak speed")]
    {
        let _ = writeln!(
            page,
            "\n{title}\n\nFresh joint states, no limits: the laws themselves. Medians of the runs that settled.\n"
        );
        page += &figures(findings, matched);
    }
    page += "\n## What settles\n\nShare of the tasks that settled, with gains for equal settling time.\n\n";
    page += &settled(findings);
    page += "\n## Why the others fail\n\nTasks under the servo's limits with fresh joint states, with gains for equal settling time.\n\n";
    page += &failures(findings);
    page += "\n## How old joint states may be\n\nThe greatest age up to which at least 95 % as many pilot tasks settle as with fresh ones, \
             with gains for equal settling time.\n\n";
    page += &ages(findings);
    page
}

/// Which law, when, with which gain, up to which latency.
fn sentences(findings: &Findings) -> [String; 3] {
    let cell = |law, limits, plant: &str| findings.pooled(Matched::SettlingTime, law, limits, plant);
    let settled = |law: Law| cell(law, true, "ideal").map(|cell| cell.settled_percent);
    let share = |law: Law| settled(law).map_or(0.0, |share| share.value);
    let value = |law: Law, of: fn(&Cell) -> Option<Interval>| {
        cell(law, true, "ideal").and_then(of).map_or(f64::INFINITY, |interval| interval.value)
    };
    let best = least(Law::ALL.into_iter(), |law| -share(law));
    let low_of_best = settled(best).map_or(0.0, |share| share.low);
    let (good, rest): (Vec<_>, Vec<_>) =
        Law::ALL.into_iter().partition(|law| settled(*law).is_some_and(|share| share.high >= low_of_best));
    let names: Vec<_> = good.iter().map(|law| format!("`{law}`")).collect();
    let next = least(rest.into_iter(), |law| -share(law));
    let shortest = least(good.iter().copied(), |law| value(law, |cell| cell.path_ratio));
    let gentlest = least(good.into_iter(), |law| value(law, |cell| cell.peak_rad_s));
    let (low, high) = findings.gain_range(Matched::SettlingTime, shortest);
    let age = |limits| findings.ageing(shortest, limits).map_or(0.0, |ageing| ageing.holds_up_to_ms);
    [
        format!(
            "**Take one of {}**: of {} random tasks on {} arms under the servo's limits {} settled with `{best}`, from which the \
             others of these cannot be told apart, and {} with `{next}`, the best of the rest.",
            names.join(", "),
            cell(best, true, "ideal").map_or(0, |cell| cell.runs),
            findings.arms.len(),
            percent(settled(best)),
            percent(settled(next)),
        ),
        format!(
            "Among them `{shortest}` takes the shortest path ({} times the straight line) and `{gentlest}` is the gentlest (a median \
             peak of {} rad/s); with gain {} [1/s] `{shortest}` settles in {} s where no limit slows it.",
            number(value(shortest, |cell| cell.path_ratio)),
            number(value(gentlest, |cell| cell.peak_rad_s)),
            range(low, high),
            median(cell(shortest, false, "ideal").and_then(|cell| cell.settling_s)),
        ),
        format!(
            "At that gain joint states may be {:.0} ms old ({:.0} ms under the limits), a gain times age of {}; at 20 ms {} settle.",
            age(false),
            age(true),
            number(1e-3 * age(false) * high),
            percent(cell(shortest, true, "latency_20ms").map(|cell| cell.settled_percent)),
        ),
    ]
}

/// The law with the least value; logc where there is none.
fn least(laws: impl Iterator<Item = Law>, value: impl Fn(Law) -> f64) -> Law {
    laws.min_by(|a, b| value(*a).total_cmp(&value(*b))).unwrap_or(Law::Logc)
}

fn how(findings: &Findings) -> String {
    format!(
        "\nEach number on this page was written by `dq_servo compare --out DIR --tasks {} --seed {}`. The arms are {}; start and goal of \
         a task are poses of random joint angles between the arm's position limits. Every loop runs in cycles of {} ms and \
         ends when the error has been within 2 % of its initial value (or the goal tolerances) for half a second, or after {} s as a \
         failure. The gains of the laws are chosen for each arm on tasks of their own, so that the median settling time is that of \
         `logc` with gain {}, and again so that the median peak joint speed is; † marks a law that goes unstable before on some arm, and has the \
         best gain that was tried. Brackets hold 95 % confidence intervals: Wilson's for \
         shares, order statistics for medians.\n",
        findings.tasks,
        findings.seed,
        findings.arms.join(", "),
        1e3 * findings.period_s,
        findings.horizon_s,
        super::REFERENCE.1,
    )
}

fn figures(findings: &Findings, matched: Matched) -> String {
    let mut table = String::from(
        "| law | gain [1/s] | settled [%] | settling [s] | path / straight | overshoot [mm] | effort [rad²/s] | peak [rad/s] | step [ns] |\n\
         |---|---|---|---|---|---|---|---|---|\n",
    );
    for law in Law::ALL {
        let Some(cell) = findings.pooled(matched, law, false, "ideal") else { continue };
        let (low, high) = findings.gain_range(matched, law);
        let _ = writeln!(
            table,
            "| {law} | {}{} | {} | {} | {} | {} | {} | {} | {} |",
            range(low, high),
            if findings.is_matched(matched, law) { "" } else { " †" },
            percent(Some(cell.settled_percent)),
            median(cell.settling_s),
            median(cell.path_ratio),
            median(cell.overshoot_mm),
            median(cell.effort),
            median(cell.peak_rad_s),
            findings.step_ns(law).map_or("-".to_owned(), number),
        );
    }
    table
}

fn settled(findings: &Findings) -> String {
    let mut table = String::from("| law |");
    for limits in ["no limits", "limits"] {
        PLANTS.iter().for_each(|plant| {
            let _ = write!(table, " {limits}, {} |", plant.name.replace('_', " "));
        });
    }
    let _ = writeln!(table, "\n|{}", "---|".repeat(1 + 2 * PLANTS.len()));
    for law in Law::ALL {
        let _ = write!(table, "| {law} |");
        for limits in [false, true] {
            for plant in PLANTS {
                let cell = findings.pooled(Matched::SettlingTime, law, limits, plant.name);
                let _ = write!(table, " {} |", percent(cell.map(|cell| cell.settled_percent)));
            }
        }
        table.push('\n');
    }
    table
}

fn failures(findings: &Findings) -> String {
    let reasons: Vec<_> = Outcome::failures().collect();
    let names: Vec<_> = reasons.iter().map(|reason| reason.replace('_', " ")).collect();
    let mut table = format!("| law | {} |\n|---|{}\n", names.join(" | "), "---|".repeat(reasons.len()));
    for law in Law::ALL {
        let cell = findings.pooled(Matched::SettlingTime, law, true, "ideal");
        let count = |reason: &&str| cell.and_then(|cell| cell.failures.get(*reason)).copied().unwrap_or(0);
        let counts: Vec<_> = reasons.iter().map(|reason| count(reason).to_string()).collect();
        let _ = writeln!(table, "| {law} | {} |", counts.join(" | "));
    }
    table
}

fn ages(findings: &Findings) -> String {
    let mut table = String::from("| law | no limits [ms] | limits [ms] |\n|---|---|---|\n");
    for law in Law::ALL {
        let age = |limits| findings.ageing(law, limits).map_or(0.0, |ageing| ageing.holds_up_to_ms);
        let _ = writeln!(table, "| {law} | {:.0} | {:.0} |", age(false), age(true));
    }
    table
}

/// Three digits, as many as the intervals leave.
fn number(value: f64) -> String {
    match value.abs() {
        v if !v.is_finite() => "-".to_owned(),
        v if v < 0.0005 => "0".to_owned(),
        v if v < 1.0 => format!("{value:.3}"),
        v if v < 10.0 => format!("{value:.2}"),
        v if v < 100.0 => format!("{value:.1}"),
        _ => format!("{value:.0}"),
    }
}

fn range(low: f64, high: f64) -> String {
    match number(low) == number(high) {
        true => number(low),
        false => format!("{} to {}", number(low), number(high)),
    }
}

fn median(interval: Option<Interval>) -> String {
    let Some(Interval { value, low, high }) = interval else { return "-".to_owned() };
    format!("{} [{}, {}]", number(value), number(low), number(high))
}

fn percent(interval: Option<Interval>) -> String {
    let Some(Interval { value, low, high }) = interval else { return "-".to_owned() };
    format!("{value:.1} % [{low:.1}, {high:.1}]")
}
