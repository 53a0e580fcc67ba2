//! The page "What the laws do", written from the findings.

use super::latency::AGED;
use super::sentences::sentences;
use super::{ALL_ARMS, Findings, Interval, Matched, REFERENCE, tables};
use crate::control::{Law, Map};
use std::fmt::Write as _;

/// The page in Markdown. Every number in it comes from the findings.
pub fn page(findings: &Findings) -> String {
    let mut page = String::from("# What the laws do\n\n");
    for sentence in sentences(findings) {
        let _ = writeln!(page, "- {sentence}");
    }
    page += &how(findings);
    for (matched, title) in
        [(Matched::SettlingTime, "Equal settling time"), (Matched::PeakSpeed, "Equal peak speed")]
    {
        for (limits, under) in [(false, "no limits"), (true, "the servo's limits")] {
            let _ = write!(
                page,
                "\n## {title}, {under}\n\nFresh joint states. {}\n\n",
                on_common(findings, matched, limits)
            );
            page += &tables::figures(findings, matched, limits);
            let _ = write!(page, "\nEach law less `{}`, on the tasks that both settle:\n\n", REFERENCE.0);
            page += &tables::differences(findings, matched, limits);
        }
    }
    page += "\n## What settles\n\nShare of the tasks that settled, with gains for equal settling time. Under limits the servo predicts where \
             the arm is by the age of the joint states, and lowers gains that their age makes unstable: these columns show that as well as \
             the laws.\n\n";
    page += &tables::settled(findings);
    for arm in &findings.arms {
        let _ = write!(
            page,
            "\n## {arm}\n\nFresh joint states, gains for equal settling time; differences in points.\n\n"
        );
        page += &tables::of_arm(findings, arm);
    }
    page += "\n## Why the others fail\n\nTasks under the servo's limits with fresh joint states, with gains for equal settling time.\n\n";
    page += &tables::failures(findings);
    page += "\n## How old joint states may be\n\nThe greatest age at which at least 95 % of the tasks settle that settle with fresh joint \
             states, with gains for equal settling time. The brackets reach from the greatest age at which that is sure to the least at \
             which it is sure not to be so, by Wilson's 95 % intervals; ages are tried in half octaves";
    let _ = write!(page, ", on at most {AGED} tasks of each arm.\n\n");
    page += &tables::ages(findings);
    page
}

fn how(findings: &Findings) -> String {
    let off = |matched, map| {
        let off = findings.most_off(matched, |law| law.cell().1 == map);
        off.map_or("more than half of the tasks".to_owned(), |off| format!("{off:.1} %"))
    };
    format!(
        "\nEach number on this page was written by `dq_servo compare --out DIR --tasks {} --seed {}`. The arms are {}; start and goal of \
         a task are poses of random joint angles between the arm's position limits. Every loop runs in cycles of {} ms and \
         ends when the error has been within 2 % of its initial value (or the goal tolerances) for half a second, or after {} s as a \
         failure. The gains of the laws are chosen for each arm on tasks of their own, so that the median settling time is that of \
         `{}` with gain {}, and again so that the median peak joint speed is. On as many other tasks the settling times are off by at most {} \
         with the damped inverse and {} with the transpose, the peak speeds by {} and {}; † marks a law that is off by more than 2 % on some arm. \
         A law with the transpose may go unstable before it is as fast, and then has the best gain that was tried. \
         `lq` and `h_infinity` are `diffc_inverse` and `unit_quaternion` with a gain for the translation that is twice that for the \
         rotation. With the transpose such gains lie at the edge of what this cycle allows: joint states that are one cycle old undo them.\n\n\
         All laws run the same tasks, so they are compared pair by pair: shares by the exact test of McNemar, other figures by the exact \
         sign test on the tasks that both settle. A p is by Holm for all {} comparisons that were made; ∗ marks a difference with a p below 0.05 \
         whose interval leaves out zero. Brackets hold 95 % confidence intervals: Wilson's for shares, those of Agresti and Min for \
         differences of shares, order statistics for medians.\n",
        findings.tasks,
        findings.seed,
        findings.arms.join(", "),
        1e3 * findings.period_s,
        findings.horizon_s,
        REFERENCE.0,
        REFERENCE.1,
        off(Matched::SettlingTime, Map::DampedInverse),
        off(Matched::SettlingTime, Map::Transpose),
        off(Matched::PeakSpeed, Map::DampedInverse),
        off(Matched::PeakSpeed, Map::Transpose),
        findings.comparisons.len(),
    )
}

/// What the medians are of.
fn on_common(findings: &Findings, matched: Matched, limits: bool) -> String {
    let cell = |law| findings.cell(matched, law, ALL_ARMS, limits, "ideal");
    let common = Law::ALL.into_iter().filter_map(cell).find_map(|cell| Some((cell.common?, cell.runs)));
    let (common, runs) = common.unwrap_or((0, 0));
    let share = percent(Some(Interval::share(common, runs, super::summary::Z)));
    format!(
        "Settling time is the median of all tasks, where one that failed settles later than {} s. The figures after it are medians on the \
         same tasks for all laws: the {common} ({share}) that every law settles which settles at least half of all.",
        findings.horizon_s
    )
}

/// Three digits, as many as the intervals leave.
pub(super) fn number(value: f64) -> String {
    match value.abs() {
        v if !v.is_finite() => "-".to_owned(),
        v if v < 0.0005 => "0".to_owned(),
        v if v < 1.0 => format!("{value:.3}"),
        v if v < 10.0 => format!("{value:.2}"),
        v if v < 100.0 => format!("{value:.1}"),
        _ => format!("{value:.0}"),
    }
}

pub(super) fn range(low: f64, high: f64) -> String {
    match number(low) == number(high) {
        true => number(low),
        false => format!("{} to {}", number(low), number(high)),
    }
}

pub(super) fn median(interval: Option<Interval>) -> String {
    interval.map_or("-".to_owned(), |interval| bracketed(interval, number))
}

/// A time that is told up to the horizon \[s\].
pub(super) fn time(interval: Option<Interval>, horizon: f64) -> String {
    let told = |time: f64| if time < horizon { number(time) } else { format!("> {horizon}") };
    match interval {
        Some(interval) if interval.low >= horizon => told(interval.low),
        Some(interval) => bracketed(interval, told),
        None => "-".to_owned(),
    }
}

pub(super) fn percent(interval: Option<Interval>) -> String {
    let Some(Interval { value, low, high }) = interval else { return "-".to_owned() };
    format!("{value:.1} % [{low:.1}, {high:.1}]")
}

/// A difference with its sign.
pub(super) fn signed(interval: Interval) -> String {
    bracketed(interval, |value| match number(value) {
        text if value > 0.0 && text != "0" => format!("+{text}"),
        text => text.replace('-', "−"),
    })
}

fn bracketed(Interval { value, low, high }: Interval, write: impl Fn(f64) -> String) -> String {
    format!("{} [{}, {}]", write(value), write(low), write(high))
}

/// A probability.
pub(super) fn probability(p: f64) -> String {
    match p {
        p if p < 1e-99 => "p < 1e-99".to_owned(),
        p if p < 0.001 => format!("p = {p:.0e}"),
        p => format!("p = {p:.3}"),
    }
}
