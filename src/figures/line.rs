//! The styles of lines.

/// The style of a line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Line {
    /// A solid line through the points.
    Solid,
    /// A dashed line through the points.
    Dashed,
    /// A line of dashes and dots through the points.
    DashDotted,
    /// A line of short dashes through the points.
    Dotted,
    /// Dots at the points, without a line.
    Dots,
}

impl Line {
    /// Returns the lengths of dashes and gaps for SVG \[px\]; `None` for a line without gaps.
    pub(super) fn dashes(self) -> Option<&'static str> {
        match self {
            Self::Dashed => Some("6 4"),
            Self::DashDotted => Some("7 3 1.6 3"),
            Self::Dotted => Some("1.6 2.4"),
            Self::Solid | Self::Dots => None,
        }
    }
}
