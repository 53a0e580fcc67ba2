//! Tables as every subcommand prints them.

use crate::servo::Figures;
use comfy_table::{ContentArrangement, Table, presets};

/// The width of a terminal that nobody has made wider.
const WIDTH: u16 = 80;

/// A table without lines under these column names, no wider than a terminal: cells that would make it so are wrapped.
pub(super) fn table<'a>(header: impl IntoIterator<Item = &'a str>) -> Table {
    let mut table = Table::new();
    table
        .load_style(presets::NOTHING)
        .set_header(header.into_iter().collect::<Vec<_>>())
        .set_content_arrangement(ContentArrangement::Dynamic)
        .set_width(WIDTH);
    for column in table.column_iter_mut() {
        column.set_padding((0, 1));
    }
    table
}

/// The columns of the figures of a motion, in every table: as [`figures`] fills them.
const FIGURES: [&str; 9] = [
    "2 %\nrot.\n[s]",
    "2 %\npos.\n[s]",
    "path\n\n[m]",
    "by\nline",
    "over-\nshoot\n[m]",
    "peak\n[rad\n/s]",
    "effort\n[rad²\n/s]",
    "left\n\n[m]",
    "left\n\n[rad]",
];

/// A table of motions: their figures between the columns `before` and `after`.
pub(super) fn motions(before: &[&str], after: &[&str]) -> Table {
    table([before, &FIGURES, after].concat())
}

/// The figures of a motion as cells; `path_ratio` is the path's length by the line that the table means.
pub(super) fn figures(figures: &Figures, path_ratio: f64) -> [String; 9] {
    [
        seconds(figures.settling_time_rotation),
        seconds(figures.settling_time_position),
        format!("{:.3}", figures.path_length),
        if path_ratio.is_finite() { format!("{path_ratio:.3}") } else { "-".to_owned() },
        format!("{:.4}", figures.overshoot),
        format!("{:.2}", figures.peak_joint_speed),
        format!("{:.1}", figures.effort),
        format!("{:.5}", figures.position_error),
        format!("{:.5}", figures.rotation_error),
    ]
}

/// A time \[s\]; a dash for one that has not come.
pub(super) fn seconds(time: Option<f64>) -> String {
    time.map_or("-".to_owned(), |time| format!("{time:.2}"))
}

/// A name in lines of a few letters, broken after its underscores and spaces.
pub(super) fn in_lines(name: &str) -> String {
    const WIDTH: usize = 12;
    let mut lines: Vec<String> = Vec::new();
    for part in name.split_inclusive(['_', ' ']) {
        match lines.last_mut() {
            Some(line) if line.chars().count() + part.chars().count() <= WIDTH => line.push_str(part),
            _ => lines.push(part.to_owned()),
        }
    }
    lines.join("\n")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_broken_where_words_end() {
        assert_eq!(in_lines("logc"), "logc");
        assert_eq!(in_lines("double_geodesic"), "double_\ngeodesic");
        assert_eq!(in_lines("transpose relative_position"), "transpose \nrelative_\nposition");
    }

    #[test]
    fn no_line_is_wider_than_a_terminal() {
        let mut table = table(["run", "path\n[m]", "law"]);
        table.add_row(["a_bag_with_a_name_as_long_as_half_a_line", "0.633", "transpose\nrelative_position"]);
        table.add_row(["another", "0.7", "a_law_with_a_name_that_is_as_long_as_half_a_line"]);
        let text = table.to_string();
        assert!(text.lines().all(|line| line.chars().count() <= usize::from(WIDTH)), "{text}");
        assert!(text.contains("0.633") && text.contains("[m]"), "{text}");
    }
}
