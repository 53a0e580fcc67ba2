//! The curves of a run as CSV files for spreadsheets and plotting programs.

use super::{RecordedRun, Sample};
use dq_wire::pose_numbers;

/// Returns tables of the run, each with its name: the samples, the pose errors, the clearances, and the commands of each arm. The
/// first line of a table has the names of the columns with their units. The field of an unknown number is empty.
pub fn csv(run: &RecordedRun) -> Vec<(String, String)> {
    let joints =
        |what: &str, names: &[String]| names.iter().map(|name| format!("{what} {name}")).collect::<Vec<_>>();
    let pose =
        ["x [m]", "y [m]", "z [m]", "qx", "qy", "qz", "qw", "smallest singular value"].map(str::to_owned);
    let heads = [joints("position", &run.joints), joints("velocity", &run.joints), pose.to_vec()].concat();
    let sample = |sample: &Sample| {
        let Sample { time, positions, velocities, pose, smallest_singular_value, .. } = sample;
        let pose = pose_numbers(pose);
        (*time, [positions, velocities, pose.as_slice(), &[*smallest_singular_value]].concat())
    };
    let mut tables = vec![("samples".to_owned(), table(&heads, run.samples.iter().map(sample)))];
    if !run.errors.is_empty() {
        let errors = run.errors.iter().map(|(time, error)| (*time, vec![error.position, error.rotation]));
        let heads = ["distance from the goal [m]", "angle from the goal [rad]"].map(str::to_owned);
        tables.push(("pose_error".to_owned(), table(&heads, errors)));
    }
    if !run.clearances.is_empty() {
        let rows = run.clearances.iter().map(|(time, clearance)| (*time, vec![*clearance]));
        tables.push(("clearance".to_owned(), table(&["distance of the closest pair [m]".to_owned()], rows)));
    }
    for (number, commands) in (1..).zip(&run.commands) {
        let end = run.commands.get(number).map_or(run.joints.len(), |next| next.first_joint);
        let names = &run.joints[commands.first_joint..end];
        for (kind, sent) in [("velocity", &commands.velocities), ("position", &commands.positions)] {
            if !sent.is_empty() {
                let name = if run.commands.len() > 1 { format!("_arm{number}") } else { String::new() };
                tables.push((
                    format!("{kind}_commands{name}"),
                    table(&joints(kind, names), sent.iter().cloned()),
                ));
            }
        }
    }
    tables
}

/// Returns a CSV table. The first line has the names of the columns: the time \[s\], then `heads`. Each row is another line.
fn table(heads: &[String], rows: impl Iterator<Item = (f64, Vec<f64>)>) -> String {
    let mut writer = csv::Writer::from_writer(Vec::new());
    let known = |number: &f64| Some(*number).filter(|number| number.is_finite());
    // Writing to memory cannot fail.
    let _ = writer.write_record(std::iter::once("time [s]").chain(heads.iter().map(String::as_str)));
    rows.for_each(|(time, numbers)| {
        let _ = writer.serialize((time, numbers.iter().map(known).collect::<Vec<_>>()));
    });
    String::from_utf8(writer.into_inner().unwrap_or_default()).unwrap_or_default()
}
