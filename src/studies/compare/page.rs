//! Writes the page "What the laws do" from the findings, and its tables as LaTeX.

use super::latency::FIRST;
use super::matching::PILOTS;
use super::numbers::percent;
use super::sentences::sentences;
use super::summary::Z;
use super::tables::{self, Table};
use super::templates::fill;
use super::{ALL_ARMS, Findings, Interval, Key, Matched, REFERENCE, Unmatched};
use dq_kinematics::control::Map;

/// A section of the page.
struct Section {
    title: String,
    note: String,
    table: Table,
}

/// Returns the page as Markdown. All its numbers come from the findings.
pub fn page(findings: &Findings) -> String {
    let section = |Section { title, note, table }| format!("\n## {title}\n\n{note}\n\n{}", table.markdown());
    introduction(findings) + "\n" + &sections(findings).into_iter().map(section).collect::<String>()
}

/// Returns the tables of the page as LaTeX.
pub fn latex(findings: &Findings) -> String {
    let table = |Section { title, table, .. }| table.latex(&title);
    sections(findings).into_iter().map(table).collect::<Vec<_>>().join("\n")
}

fn introduction(findings: &Findings) -> String {
    let off = |matched, map| {
        let off = findings.most_off(matched, map);
        off.map_or("more than half of the tasks".to_owned(), |off| format!("{off:.1} %"))
    };
    fill(
        "page",
        &[
            ("sentences", &sentences(findings).iter().map(|it| format!("- {it}\n")).collect::<String>()),
            ("tasks", &findings.tasks),
            ("seed", &findings.seed),
            ("arms", &findings.arms.join(", ")),
            ("period", &(1e3 * findings.period_s)),
            ("horizon", &findings.horizon_s),
            ("reference", &REFERENCE.0),
            ("gain", &REFERENCE.1),
            ("pilots", &PILOTS),
            ("time_inverse", &off(Matched::SettlingTime, Map::DampedInverse)),
            ("time_transpose", &off(Matched::SettlingTime, Map::Transpose)),
            ("speed_inverse", &off(Matched::PeakSpeed, Map::DampedInverse)),
            ("speed_transpose", &off(Matched::PeakSpeed, Map::Transpose)),
            ("unmatched", &unmatched(findings)),
            ("law", &findings.baseline()),
            ("comparisons", &findings.comparisons.len()),
        ],
    )
}

fn sections(findings: &Findings) -> Vec<Section> {
    let section = |title: &str, note: String, table| Section { title: title.to_owned(), note, table };
    let both = [(false, "no limits"), (true, "the servo's limits")];
    let conditions =
        Matched::ALL.into_iter().flat_map(|matched| both.map(|(limits, under)| (matched, limits, under)));
    let mut all: Vec<_> = conditions
        .map(|(matched, limits, under)| {
            let matched_words = matched.name().replace('_', " ");
            let title = fill("condition_title", &[("matched", &matched_words), ("under", &under)]);
            section(&title, note(findings, matched, limits), tables::condition(findings, matched, limits))
        })
        .collect();
    all.extend([
        section("What settles on each arm", fill("by_arm", &[]), tables::by_arm(findings)),
        section(
            "What settles with old or noisy joint states",
            fill("by_plant", &[]),
            tables::by_plant(findings),
        ),
        section("Why tasks fail", fill("failures", &[]), tables::failures(findings)),
        section("How old joint states may be", fill("ages", &[("first", &FIRST)]), tables::ages(findings)),
    ]);
    if let Some(tasks) = findings.peers.iter().map(|peer| peer.cell.runs).max() {
        all.extend(both.map(|(limits, under)| {
            let note = fill(if limits { "peers_limited" } else { "peers" }, &[("tasks", &tasks)]);
            section(&format!("Other programs, {under}"), note, tables::peers(findings, limits))
        }));
    }
    all
}

/// Returns the note about the tasks that all laws settle.
fn note(findings: &Findings, matched: Matched, limits: bool) -> String {
    let cell = |law| findings.cell(&Key::fresh(matched, law, ALL_ARMS, limits));
    let common =
        findings.laws().into_iter().filter_map(cell).find_map(|cell| Some((cell.common?, cell.runs)));
    let (common, runs) = common.unwrap_or((0, 0));
    let share = percent(Interval::share(common, runs, Z));
    fill("condition", &[("horizon", &findings.horizon_s), ("common", &common), ("share", &share)])
}

/// Explains why gains miss their targets; empty if all gains reach them.
fn unmatched(findings: &Findings) -> String {
    let of = |matched| findings.unmatched.iter().filter(move |it| it.gain.matched == matched);
    let [times, speeds] = [Matched::SettlingTime, Matched::PeakSpeed].map(|matched| of(matched).count());
    let mut sentences = Vec::new();
    if times > 0 {
        let fastest = of(Matched::SettlingTime).filter(|it| it.is_fastest()).count();
        sentences.push(fill("unmatched_times", &[("all", &times), ("fastest", &fastest)]));
    }
    if speeds > 0 {
        let most = of(Matched::PeakSpeed).map(Unmatched::uncertain_percent).fold(0.0, f64::max);
        let most = format!("{most:.1}");
        sentences.push(fill("unmatched_speeds", &[("all", &speeds), ("pilots", &PILOTS), ("most", &most)]));
    }
    sentences.join(" ")
}
