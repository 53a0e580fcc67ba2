//! The tables of all subcommands.

use comfy_table::{CellAlignment, ColumnConstraint, ContentArrangement, Table, presets};
use dq_kinematics::arm::JointKind;
use dq_metrics::Figures;
use rustix::stdio::stdout;
use rustix::termios::tcgetwinsize;

/// The default width of a terminal.
const WIDTH: u16 = 80;

/// The columns that contain names. All other columns contain numbers, which are right-aligned and never wrapped.
const NAMES: [&str; 2] = ["run", "law"];

/// Creates a table with these column names, and without ruling lines. If stdout is a terminal, wraps the names in the columns
/// [`NAMES`], so that the table fits into the terminal.
pub(super) fn table<'a>(header: impl IntoIterator<Item = &'a str>) -> Table {
    let terminal = tcgetwinsize(stdout()).ok().map(|size| size.ws_col.max(WIDTH));
    table_in(terminal, header)
}

fn table_in<'a>(width: Option<u16>, header: impl IntoIterator<Item = &'a str>) -> Table {
    let header: Vec<_> = header.into_iter().collect();
    let mut table = Table::new();
    table
        .load_style(presets::NOTHING)
        .set_header(header.clone())
        .set_content_arrangement(ContentArrangement::Dynamic);
    if let Some(width) = width {
        table.set_width(width);
    }
    for (column, name) in table.column_iter_mut().zip(header) {
        column.set_padding((0, 1));
        if !NAMES.contains(&name) {
            column.set_constraint(ColumnConstraint::ContentWidth);
            column.set_cell_alignment(CellAlignment::Right);
        }
    }
    if let Some(last) = table.column_iter_mut().last() {
        last.set_padding((0, 0));
    }
    table
}

/// Returns the column names of the metrics of a motion, in the order of [`figures`]. The kinds of the joints decide the units of
/// speed and effort.
fn heads(joints: &[JointKind]) -> [&'static str; 9] {
    let [peak, effort] = match [JointKind::Revolute, JointKind::Prismatic].map(|kind| joints.contains(&kind))
    {
        [_, false] => ["peak\n\nrad/s", "effort\n\nrad²/s"],
        [false, true] => ["peak\n\nm/s", "effort\n\nm²/s"],
        [true, true] => ["peak\nrad/s,\nm/s", "effort\nrad²/s,\nm²/s"],
    };
    [
        "settled\nrotation\ns",
        "settled\nposition\ns",
        "path\n\nm",
        "path/\nline\n",
        "overshoot\n\nmm",
        peak,
        effort,
        "final\nerror\nmm",
        "final\nerror\nmrad",
    ]
}

/// The column of the time at which the goal's tolerances were met.
pub(super) const AT_GOAL: &str = "at\ngoal\ns";

/// Creates a table of motions of arms with these kinds of joints. The columns of the metrics are between the columns `before` and
/// the columns `after`.
pub(super) fn motions(before: &[&str], joints: &[JointKind], after: &[&str]) -> Table {
    table([before, &heads(joints), after].concat())
}

/// Returns the metrics of a motion as table cells, in the order of the [`heads`].
pub(super) fn figures(figures: &Figures) -> [String; 9] {
    let known =
        |figure: f64, digits| if figure.is_finite() { format!("{figure:.digits$}") } else { "-".to_owned() };
    // If the error of a component is exactly 0 from the start to the end, the task leaves this component free: print a dash.
    let controlled = |error: f64, settled: Option<f64>| match (error, settled) {
        (0.0, Some(0.0)) => (f64::NAN, None),
        other => other,
    };
    let (rotation, rotation_settled) = controlled(figures.rotation_error, figures.settling_time_rotation);
    let (position, position_settled) = controlled(figures.position_error, figures.settling_time_position);
    [
        seconds(rotation_settled),
        seconds(position_settled),
        format!("{:.3}", figures.path_length),
        known(figures.path_ratio.unwrap_or(f64::NAN), 3),
        format!("{:.1}", 1e3 * figures.overshoot),
        known(figures.peak_joint_speed, 2),
        known(figures.effort, 1),
        known(1e3 * position, 2),
        known(1e3 * rotation, 2),
    ]
}

/// Formats a time \[s\]; a dash for `None`.
pub(super) fn seconds(time: Option<f64>) -> String {
    time.map_or("-".to_owned(), |time| format!("{time:.2}"))
}

/// Wraps a name into short lines. Lines end after underscores and spaces.
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
    fn a_component_that_the_task_leaves_free_has_no_figures() {
        let times = [Some(0.0), Some(1.5)];
        let [settling_time_rotation, settling_time_position] = times;
        let motion = Figures {
            settling_time_rotation,
            settling_time_position,
            position_error: 1e-3,
            ..Figures::default()
        };
        let cells = figures(&motion);
        assert_eq!([&cells[0], &cells[1], &cells[7], &cells[8]], ["-", "1.50", "1.00", "-"]);
    }

    #[test]
    fn joints_that_slide_have_their_own_units() {
        use JointKind::{Prismatic, Revolute};
        let units = |joints: &[JointKind]| {
            let head = |column: usize| heads(joints)[column].split_once('\n').unwrap().1.replace('\n', "");
            [5, 6].map(head)
        };
        assert_eq!(units(&[Revolute; 2]), ["rad/s", "rad²/s"]);
        assert_eq!(units(&[Prismatic; 2]), ["m/s", "m²/s"]);
        assert_eq!(units(&[Prismatic, Revolute]), ["rad/s,m/s", "rad²/s,m²/s"]);
    }

    #[test]
    fn no_line_is_wider_than_a_terminal_and_no_number_is_broken() {
        let heads = heads(&[JointKind::Prismatic, JointKind::Revolute]);
        let header = [["run", "law"].as_slice(), heads.as_slice()].concat();
        let numbers = ["12.345"; 9];
        let row =
            [["a_bag_with_a_name_as_long_as_half_a_line", "relative_position"].as_slice(), &numbers].concat();
        let text = |width| {
            let mut table = table_in(width, header.clone());
            table.add_row(row.clone());
            table.to_string()
        };
        let narrow = text(Some(WIDTH));
        assert!(narrow.lines().all(|line| line.chars().count() <= usize::from(WIDTH)), "{narrow}");
        assert_eq!(narrow.matches("12.345").count(), numbers.len(), "{narrow}");
        assert!(text(None).contains(row[0]) && text(None).contains(row[1]), "where there is no terminal");
    }
}
