//! Legends: a sample of each curve with its name.

use super::canvas::{Anchor, Canvas, Point};
use super::series::Series;
use super::style::{LABEL, text_width};

/// The distance between the lines of a legend \[px\].
const LINE: f64 = 19.0;
/// The width of a sample of a curve \[px\].
pub(super) const SAMPLE: f64 = 24.0;

/// The entries of a legend with their places.
pub(super) struct Legend {
    entries: Vec<(Series, Point)>,
    /// The vertical position at which the legend ends \[px\].
    pub bottom: f64,
}

impl Legend {
    /// Places the entries of a legend that begins at `start`. Its lines end before `right`. If `right` is not to the right of
    /// `start`, each entry has its own line.
    pub fn new(all: impl IntoIterator<Item = Series>, start: Point, right: f64) -> Self {
        let (mut entries, mut at) = (Vec::new(), start);
        for series in all {
            let width = entry_width(&series);
            if (at.0 > start.0 && at.0 + width > right) || (right <= start.0 && !entries.is_empty()) {
                at = (start.0, at.1 + LINE);
            }
            entries.push((series, at));
            at.0 += width;
        }
        Self { entries, bottom: at.1 + 16.0 }
    }

    /// Returns the right edge of the legend; 0 for an empty legend.
    pub fn right(&self) -> f64 {
        self.entries.iter().map(|(series, at)| at.0 + entry_width(series)).fold(0.0, f64::max)
    }

    pub fn draw(&self, canvas: &mut Canvas) {
        for (series, at) in &self.entries {
            draw_sample(canvas, series, *at);
            canvas.text(&series.name, (at.0 + SAMPLE + 8.0, at.1), LABEL, Anchor::Left);
        }
    }
}

/// Returns the named curves. Curves with the same name and style occur once.
pub(super) fn entries(all: impl Iterator<Item = Series>) -> Vec<Series> {
    let mut entries: Vec<Series> = Vec::new();
    for series in all.filter(|series| !series.name.is_empty()) {
        if !entries.iter().any(|other| is_same(other, &series)) {
            entries.push(Series { points: Vec::new(), ..series });
        }
    }
    entries
}

/// Returns whether two curves share an entry of a legend.
pub(super) fn is_same(one: &Series, other: &Series) -> bool {
    (&one.name, one.line) == (&other.name, other.line)
}

pub(super) fn draw_sample(canvas: &mut Canvas, series: &Series, (left, y): Point) {
    let sample: Vec<_> = (0..=3).map(|k| (left + SAMPLE / 3.0 * f64::from(k), y)).collect();
    canvas.line(&sample, series.color, 2.0, series.line);
}

/// Returns the width of an entry \[px\].
fn entry_width(series: &Series) -> f64 {
    SAMPLE + 24.0 + text_width(&series.name, LABEL)
}
