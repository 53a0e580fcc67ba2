//! Writes the page "What the laws do" from the findings.

use super::latency::FIRST;
use super::matching::PILOTS;
use super::numbers::percent;
use super::sentences::sentences;
use super::summary::Z;
use super::templates::fill;
use super::{ALL_ARMS, Findings, Interval, Matched, REFERENCE, Unmatched, tables};
use dq_kinematics::control::{Law, Map};

/// Returns the page as Markdown. All its numbers come from the findings.
pub fn page(findings: &Findings) -> String {
    let off = |matched, map| {
        let off = findings.most_off(matched, |law| law.map() == map);
        off.map_or("more than half of the tasks".to_owned(), |off| format!("{off:.1} %"))
    };
    let conditions = [Matched::SettlingTime, Matched::PeakSpeed]
        .map(|matched| [false, true].map(|limits| condition(findings, matched, limits)).concat());
    let arm = |arm: &String| fill("arm", &[("arm", arm), ("table", &tables::of_arm(findings, arm))]);
    fill(
        "page",
        &[
            ("sentences", &sentences(findings).iter().map(|it| format!("- {it}\n")).collect::<String>()),
            ("tasks", &findings.tasks),
            ("seed", &findings.seed),
            ("arms", &findings.arms.join(", ")),
            ("period", &(1e3 * findings.period_s)),
            ("horizon", &findings.horizon_s),
            ("law", &REFERENCE.0),
            ("gain", &REFERENCE.1),
            ("time_inverse", &off(Matched::SettlingTime, Map::DampedInverse)),
            ("time_transpose", &off(Matched::SettlingTime, Map::Transpose)),
            ("speed_inverse", &off(Matched::PeakSpeed, Map::DampedInverse)),
            ("speed_transpose", &off(Matched::PeakSpeed, Map::Transpose)),
            ("unmatched", &(unmatched_times(findings) + &unmatched_speeds(findings))),
            ("comparisons", &findings.comparisons.len()),
            ("conditions", &conditions.concat()),
            ("settled", &tables::settled(findings)),
            ("each_arm", &findings.arms.iter().map(arm).collect::<String>()),
            ("failures", &tables::failures(findings)),
            ("first", &FIRST),
            ("ages", &tables::ages(findings)),
            ("peers", &peers(findings)),
        ],
    )
}

/// Returns the section about the laws on the ideal plant, with gains that make the quantity `matched` equal.
fn condition(findings: &Findings, matched: Matched, limits: bool) -> String {
    let cell = |law| findings.cell(matched, law, ALL_ARMS, limits, "ideal");
    let common = Law::all().filter_map(cell).find_map(|cell| Some((cell.common?, cell.runs)));
    let (common, runs) = common.unwrap_or((0, 0));
    let title = match matched {
        Matched::SettlingTime => "Equal settling time",
        Matched::PeakSpeed => "Equal peak speed",
    };
    fill(
        "condition",
        &[
            ("title", &title),
            ("under", &if limits { "the servo's limits" } else { "no limits" }),
            ("horizon", &findings.horizon_s),
            ("common", &common),
            ("share", &percent(Some(Interval::share(common, runs, Z)))),
            ("figures", &tables::figures(findings, matched, limits)),
            ("law", &REFERENCE.0),
            ("differences", &tables::differences(findings, matched, limits)),
        ],
    )
}

/// Returns the section about other programs; empty if no other program has run.
fn peers(findings: &Findings) -> String {
    let Some(tasks) = findings.peers.iter().map(|peer| peer.cell.runs).max() else { return String::new() };
    let law = REFERENCE.0;
    let conditions = [(false, "No limits"), (true, "Under limits")].map(|(limits, under)| {
        let [figures, differences] = tables::peers(findings, limits);
        let values: [(&str, &dyn std::fmt::Display); 4] =
            [("under", &under), ("law", &law), ("figures", &figures), ("differences", &differences)];
        fill("peers_condition", &values)
    });
    fill("peers", &[("tasks", &tasks), ("law", &law), ("conditions", &conditions.concat())])
}

/// Explains why gains miss the settling time. Returns a sentence and a space, or an empty text if no gain misses it.
fn unmatched_times(findings: &Findings) -> String {
    let of = |unmatched: &&Unmatched| unmatched.gain.matched == Matched::SettlingTime;
    let all: Vec<_> = findings.unmatched.iter().filter(of).collect();
    let fastest = all.iter().filter(|unmatched| unmatched.is_fastest()).count();
    match all.is_empty() {
        true => String::new(),
        false => fill("unmatched_times", &[("all", &all.len()), ("fastest", &fastest)]) + " ",
    }
}

/// Explains why gains miss the peak speed. Returns a sentence and a space, or an empty text if no gain misses it.
fn unmatched_speeds(findings: &Findings) -> String {
    let of = |unmatched: &&Unmatched| unmatched.gain.matched == Matched::PeakSpeed;
    let all: Vec<_> = findings.unmatched.iter().filter(of).collect();
    let most = |value: fn(&Unmatched) -> f64| all.iter().map(|it| value(it)).fold(0.0, f64::max);
    let uncertain = format!("{:.1}", most(Unmatched::uncertain_percent));
    let needed = format!("{:.0}", most(Unmatched::tasks_needed));
    let values: [(&str, &dyn std::fmt::Display); 4] =
        [("pilots", &PILOTS), ("all", &all.len()), ("most", &uncertain), ("needed", &needed)];
    if all.is_empty() { String::new() } else { fill("unmatched_speeds", &values) + " " }
}
