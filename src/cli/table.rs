//! Tables as every subcommand prints them.

use comfy_table::{Table, presets};

/// A table without lines under these column names.
pub(super) fn table<const N: usize>(header: [&str; N]) -> Table {
    let mut table = Table::new();
    table.load_style(presets::NOTHING);
    table.set_header(header);
    table
}

/// A time \[s\]; a dash for one that has not come.
pub(super) fn seconds(time: Option<f64>) -> String {
    time.map_or("-".to_owned(), |time| format!("{time:.2}"))
}
