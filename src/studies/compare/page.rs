//! Writes the page "What the laws do" from the findings, and its tables as LaTeX.

use super::numbers::percent;
use super::summary::Z;
use super::tables::{self, Table};
use super::templates::{Values, fill};
use super::values::values;
use super::{ALL_ARMS, Findings, Interval, Key, Matched};

/// A section of the page.
struct Section {
    title: String,
    note: String,
    table: Table,
}

/// Returns the page as Markdown. All its numbers come from the findings. A sentence is left out if it needs a missing value.
pub fn page(findings: &Findings) -> String {
    let mut values = values(findings);
    let texts = |names: &[&str]| names.iter().filter_map(|name| fill(name, &values)).collect::<Vec<_>>();
    let sentences = texts(&["take", "too_few", "arms_reversed", "straightest", "time", "age"]);
    let unmatched = texts(&["unmatched_times", "unmatched_speeds"]).join(" ");
    let sections = sections(findings, &values);
    values.insert("sentences", sentences.iter().map(|it| format!("- {it}\n")).collect());
    values.insert("unmatched", unmatched);
    let section = |Section { title, note, table }| format!("\n## {title}\n\n{note}\n\n{}", table.markdown());
    let introduction = fill("page", &values).unwrap_or_default();
    introduction + "\n" + &sections.into_iter().map(section).collect::<String>()
}

/// Returns the tables of the page as LaTeX.
pub fn latex(findings: &Findings) -> String {
    let table = |Section { title, table, .. }| table.latex(&title);
    sections(findings, &values(findings)).into_iter().map(table).collect::<Vec<_>>().join("\n")
}

fn sections(findings: &Findings, values: &Values) -> Vec<Section> {
    let section = |title: &str, note: &str, table| {
        fill(note, values).map(|note| Section { title: title.to_owned(), note, table })
    };
    let [free, limited] = ["no limits", "the servo's limits"];
    let condition = |(matched, limits, under): (Matched, bool, &str)| Section {
        title: format!("Equal {}, {under}", matched.name().replace('_', " ")),
        note: note(findings, values, matched, limits).unwrap_or_default(),
        table: tables::condition(findings, matched, limits),
    };
    let conditions =
        Matched::ALL.into_iter().flat_map(|matched| [(matched, false, free), (matched, true, limited)]);
    let others = [
        section("What settles on each arm", "by_arm", tables::by_arm(findings)),
        section("What settles with old or noisy joint states", "by_plant", tables::by_plant(findings)),
        section("Why tasks fail", "failures", tables::failures(findings)),
        section("How old joint states may be", "ages", tables::ages(findings)),
        section(&format!("Other programs, {free}"), "peers", tables::peers(findings, false)),
        section(&format!("Other programs, {limited}"), "peers_limited", tables::peers(findings, true)),
    ];
    conditions.map(condition).chain(others.into_iter().flatten()).collect()
}

/// Returns the note about the number of tasks that settle under every law.
fn note(findings: &Findings, values: &Values, matched: Matched, limits: bool) -> Option<String> {
    let cell = |law| findings.cell(&Key::fresh(matched, law, ALL_ARMS, limits));
    let common =
        findings.laws().into_iter().filter_map(cell).find_map(|cell| Some((cell.common?, cell.runs)));
    let (common, runs) = common.unwrap_or((0, 0));
    let mut values = values.clone();
    values.insert("common", common.to_string());
    values.insert("share", percent(Interval::share(common, runs, Z)));
    fill("condition", &values)
}
