//! Figures as SVG and PNG: charts over a coordinate, views of space, one style.

mod canvas;
mod chart;
mod curve;
mod labels;
mod marks;
mod space;
mod style;

pub use canvas::{Figure, Line, make_folder, save, write};
pub use chart::{Axis, Panel, Series, chart, over_time};
pub use marks::Mark;
pub use space::{Path, Place, Scene, frameplotter, scenes};
pub use style::{COMPONENTS, INK, LIMIT, law_color};

use thiserror::Error;

/// Why there is no figure.
#[derive(Debug, Error)]
pub enum DrawError {
    /// It could not be drawn.
    #[error("a figure could not be drawn: {0}")]
    Drawing(String),
    /// Its file could not be written.
    #[error("{file} cannot be written: {why}")]
    Output {
        /// The file's path.
        file: String,
        /// What the operating system says.
        why: String,
    },
}
