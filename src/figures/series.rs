//! A curve over two axes.

use super::colors::Color;
use super::line::Line;

/// A curve over two axes.
#[derive(Clone, Debug, PartialEq)]
pub struct Series {
    /// The name of the curve in the legend. Curves with the same name and style share an entry.
    pub name: String,
    /// The color of the curve.
    pub color: Color,
    /// The style of the line.
    pub line: Line,
    /// The points of the curve, in the units of the axes.
    pub points: Vec<(f64, f64)>,
}

impl Series {
    /// Creates a curve with a solid line.
    pub fn solid(
        name: impl Into<String>,
        color: Color,
        points: impl IntoIterator<Item = (f64, f64)>,
    ) -> Self {
        Self { name: name.into(), color, line: Line::Solid, points: points.into_iter().collect() }
    }

    /// Makes the line dashed.
    #[must_use]
    pub fn dashed(self) -> Self {
        Self { line: Line::Dashed, ..self }
    }
}
