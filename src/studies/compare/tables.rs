//! The tables of the comparison, as Markdown and as LaTeX.

use super::numbers::{brief, number, range, share, signed, time};
use super::{ALL_ARMS, Cell, Findings, Key, Matched, Outcome, PLANTS, Peer, Quantity};

/// A table of texts.
#[derive(Clone, Debug, PartialEq)]
pub struct Table {
    head: Vec<String>,
    rows: Vec<Vec<String>>,
}

impl Table {
    /// Creates a table with these names of columns and these rows.
    pub(super) fn new(
        head: impl IntoIterator<Item = impl Into<String>>,
        rows: impl IntoIterator<Item = Vec<String>>,
    ) -> Self {
        Self { head: head.into_iter().map(Into::into).collect(), rows: rows.into_iter().collect() }
    }

    /// Returns the table as Markdown.
    pub fn markdown(&self) -> String {
        let line = |row: &Vec<String>| format!("| {} |\n", row.join(" | "));
        let rows: String = self.rows.iter().map(line).collect();
        format!("{}|{}\n{rows}", line(&self.head), "---|".repeat(self.head.len()))
    }

    /// Returns the table as LaTeX with this caption. It needs the packages `booktabs` and `makecell`.
    pub fn latex(&self, caption: &str) -> String {
        let line = |row: &[String]| {
            format!("{} \\\\\n", row.iter().map(|it| cell(it)).collect::<Vec<_>>().join(" & "))
        };
        let rows: String = self.rows.iter().map(|row| line(row)).collect();
        format!(
            "\\begin{{table*}}\n\\caption{{{}}}\n\\footnotesize\n\\begin{{tabular}}{{l{}}}\n\\toprule\n{}\\midrule\n{rows}\\bottomrule\n\\end{{tabular}}\n\\end{{table*}}\n",
            escaped(caption),
            "r".repeat(self.head.len().saturating_sub(1)),
            line(&self.head)
        )
    }
}

/// Returns the text of a cell as LaTeX. Brackets with their content get a line of their own.
fn cell(text: &str) -> String {
    match text.split_once(" [").and_then(|(value, rest)| Some((value, rest.split_once(']')?))) {
        Some((value, (inside, after))) => {
            format!(
                "\\makecell[r]{{{}{}\\\\{{\\scriptsize[{}]}}}}",
                escaped(value),
                escaped(after),
                escaped(inside)
            )
        }
        None => escaped(text),
    }
}

/// Escapes the special characters of LaTeX.
fn escaped(text: &str) -> String {
    const SIGNS: [(char, &str); 10] = [
        ('_', r"\_"),
        ('%', r"\%"),
        ('&', r"\&"),
        ('`', ""),
        ('†', r"$^\dagger$"),
        ('∗', r"$^\ast$"),
        ('²', "$^2$"),
        ('−', "$-$"),
        ('≥', r"$\ge$"),
        ('>', "$>$"),
    ];
    let sign = |c: char| SIGNS.iter().find(|(sign, _)| *sign == c).map(|(_, text)| (*text).to_owned());
    text.chars().map(|c| sign(c).unwrap_or(c.into())).collect()
}

/// The mark of a significant difference from the baseline.
const STAR: &str = " ∗";

/// Returns the names of the columns for the results of a cell.
fn columns(baseline: &str) -> [String; 7] {
    [
        "settled [%]",
        &format!("less `{baseline}`"),
        "settling [s]",
        "path / straight",
        "overshoot [mm]",
        "effort [rad²/s]",
        "peak [rad/s]",
    ]
    .map(str::to_owned)
}

/// Returns the results of a cell, with a star at those in which the law differs significantly from the baseline.
fn results(findings: &Findings, cell: &Cell) -> [String; 7] {
    let less = |quantity| findings.comparison(quantity, &cell.key, findings.baseline());
    let starred = |text: String, quantity| match less(quantity) {
        Some(less) if less.tells() && text != "-" => text + STAR,
        _ => text,
    };
    let difference = less(Quantity::Settled).map_or("-".to_owned(), |less| signed(less.difference));
    [
        share(cell.settled_percent),
        starred(difference, Quantity::Settled),
        starred(time(cell.settling_s, findings.horizon_s), Quantity::SettlingTime),
        starred(brief(cell.path_ratio), Quantity::PathRatio),
        starred(brief(cell.overshoot_mm), Quantity::Overshoot),
        starred(brief(cell.effort), Quantity::Effort),
        starred(brief(cell.peak_rad_s), Quantity::PeakSpeed),
    ]
}

/// Returns the table of each law's results on all arms together, with joint states that are exact and have no delay.
pub(super) fn condition(findings: &Findings, matched: Matched, limits: bool) -> Table {
    let row = |law: &str| {
        let cell = findings.cell(&Key::fresh(matched, law, ALL_ARMS, limits))?;
        let mark = if findings.is_matched(matched, law) { "" } else { " †" };
        let gain = range(findings.gain_range(matched, law)) + mark;
        let step = findings.step_ns(law).map_or("-".to_owned(), number);
        Some([&[law.to_owned(), gain][..], &results(findings, cell), &[step]].concat())
    };
    let ends = [["law", "gain [1/s]"].map(str::to_owned).to_vec(), vec!["step [ns]".to_owned()]];
    let head = [&ends[0], &columns(findings.baseline())[..], &ends[1]].concat();
    Table::new(head, findings.laws().into_iter().filter_map(row))
}

/// Returns the table of the results of other programs, and of the baseline on the tasks that these programs have run.
pub(super) fn peers(findings: &Findings, limits: bool) -> Table {
    let peers = findings.peers.iter().filter(|peer| peer.cell.key.limits == limits);
    let row = |Peer { cell, gains }: &Peer| {
        [&[cell.key.law.clone(), range(*gains)][..], &results(findings, cell)].concat()
    };
    let head = [["program", "gain [1/s]"].map(str::to_owned).to_vec(), columns(findings.baseline()).to_vec()];
    Table::new(head.concat(), peers.map(row))
}

/// Returns the table of the percentages of tasks that settle on each arm.
pub(super) fn by_arm(findings: &Findings) -> Table {
    let columns = findings.arms.iter().flat_map(|arm| {
        [(false, "no limits"), (true, "limits")]
            .map(|(limits, under)| (format!("{arm}, {under}"), arm, limits))
    });
    shares(
        findings,
        true,
        columns.map(|(head, arm, limits)| (head, Key::fresh(Matched::SettlingTime, "", arm, limits))),
    )
}

/// Returns the table of the percentages of tasks that settle with each plant.
pub(super) fn by_plant(findings: &Findings) -> Table {
    let columns = [(false, "no limits"), (true, "limits")].into_iter().flat_map(|(limits, under)| {
        PLANTS.map(|plant| {
            let head = format!("{under}, {}", plant.name.replace('_', " "));
            (head, Key::new(Matched::SettlingTime, "", ALL_ARMS, limits, plant.name))
        })
    });
    shares(findings, false, columns)
}

/// Returns the table of the percentages of tasks that settle, with a row for each law. For each column after the names of the laws,
/// `columns` yields the heading, and the key of its cells. The law in this key is ignored.
fn shares(findings: &Findings, has_stars: bool, columns: impl Iterator<Item = (String, Key)>) -> Table {
    let (heads, keys): (Vec<_>, Vec<_>) = columns.unzip();
    let text = |law: &str, key: &Key| {
        let key = Key { law: law.to_owned(), ..key.clone() };
        // The comparisons of plants are not made.
        let less = findings.comparison(Quantity::Settled, &key, findings.baseline()).filter(|_| has_stars);
        let star = if less.is_some_and(|less| less.tells()) { STAR } else { "" };
        findings.cell(&key).map_or("-".to_owned(), |cell| share(cell.settled_percent) + star)
    };
    let row = |law: &str| [law.to_owned()].into_iter().chain(keys.iter().map(|key| text(law, key))).collect();
    Table::new(["law".to_owned()].into_iter().chain(heads), findings.laws().into_iter().map(row))
}

/// Returns the table of the reasons why tasks failed.
pub(super) fn failures(findings: &Findings) -> Table {
    let row = |law: &str| {
        let cell = findings.cell(&Key::fresh(Matched::SettlingTime, law, ALL_ARMS, true));
        let count = |reason| cell.and_then(|cell| cell.failures.get(reason)).copied().unwrap_or(0);
        let counts = Outcome::failures().map(|reason| count(reason).to_string());
        std::iter::once(law.to_owned()).chain(counts).collect()
    };
    let reasons = Outcome::failures().map(|reason| reason.replace('_', " "));
    Table::new(["law".to_owned()].into_iter().chain(reasons), findings.laws().into_iter().map(row))
}

/// Returns the table of the largest acceptable age of joint states for each law.
pub(super) fn ages(findings: &Findings) -> Table {
    let row = |law: &str| vec![law.to_owned(), age(findings, law, false), age(findings, law, true)];
    Table::new(["law", "no limits [ms]", "limits [ms]"], findings.laws().into_iter().map(row))
}

/// Returns the largest acceptable age of joint states for the law \[ms\], with its confidence limits ([`Ageing`](super::Ageing)).
pub(super) fn age(findings: &Findings, law: &str, limits: bool) -> String {
    let Some(ageing) = findings.ageing(law, limits) else { return "-".to_owned() };
    let at_least = if ageing.holds_to_the_end() { "≥ " } else { "" };
    let high = ageing.high_ms.map_or("-".to_owned(), |high| format!("{high:.0}"));
    format!("{at_least}{:.0} [{:.0}, {high}]", ageing.holds_up_to_ms, ageing.low_ms)
}
