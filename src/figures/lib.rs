#![doc = include_str!("README.md")]
#![warn(clippy::unwrap_used, clippy::expect_used)]
// Both macros panic if nobody reads the stream. Results go through `cli::print`, everything else through `stderr`.
#![warn(clippy::print_stdout, clippy::print_stderr)]

mod canvas;
mod chart;
mod colors;
mod curve;
mod ends;
mod figure;
mod files;
mod labels;
mod legend;
mod line;
mod marks;
mod projection;
mod series;
mod space;
mod style;

pub use chart::{Axis, Panel, over_time};
pub use colors::{AXES, COMPONENTS, Color, law_color, law_line};
pub use figure::{Figure, Width, chart, png, save, scenes};
pub use files::{make_folder, write};
pub use line::Line;
pub use marks::Mark;
pub use projection::Viewpoint;
pub use series::Series;
pub use space::{BOTH_SIDES, Path, Place, Scene, frameplotter};
pub use style::{INK, LIMIT};

use thiserror::Error;

/// The reason why a figure could not be created.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum DrawError {
    /// The figure could not be converted to pixels.
    #[error("a figure could not be drawn: {0}")]
    Drawing(String),
    /// The file could not be written.
    #[error("{file} cannot be written: {why}")]
    Output {
        /// The path of the file.
        file: String,
        /// The error of the operating system.
        why: String,
    },
}
