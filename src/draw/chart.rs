//! Curves over two axes.

use super::DrawError;
use super::canvas::{Anchor, Canvas, Figure, Line, Point, draw};
use super::curve::{clip, decades, range_of, spaced, ticks};
use super::marks::{Mark, NamedMarks};
use super::style::{FAINT, INK, LABEL, TICK, TITLE, text_width};
use plotters::style::RGBColor;
use serde_json::{Value, json};
use std::ops::Range;

/// A curve over two axes.
#[derive(Clone, Debug, PartialEq)]
pub struct Series {
    /// The curve's name in the legend, where curves of one name and look are there once.
    pub name: String,
    /// The curve's colour.
    pub color: RGBColor,
    /// How the curve is drawn.
    pub line: Line,
    /// The curve's points in the units of the axes.
    pub points: Vec<(f64, f64)>,
}

/// One of the two axes of a panel.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Axis {
    /// The quantity with its unit.
    pub label: String,
    /// The values between which the axis is shown.
    pub range: Range<f64>,
    /// Whether equal ratios of values are equally far apart, not equal differences; the range is then above 0.
    pub logarithmic: bool,
}

impl Axis {
    /// An axis with this label and range.
    pub fn new(label: &str, range: Range<f64>) -> Self {
        Self { label: label.to_owned(), range, logarithmic: false }
    }

    /// The same with equal ratios equally far apart.
    pub fn logarithmic(label: &str, range: Range<f64>) -> Self {
        Self { logarithmic: true, ..Self::new(label, range) }
    }

    /// Where a value stands: 0 at the start of the axis, 1 at its end.
    fn part(&self, value: f64) -> f64 {
        let Range { start, end } = self.range;
        match self.logarithmic {
            true => (value / start).ln() / (end / start).ln(),
            false => (value - start) / (end - start),
        }
    }

    fn ticks(&self, count: usize) -> Vec<(f64, String)> {
        if self.logarithmic { decades(&self.range) } else { ticks(&self.range, count) }
    }
}

/// Two axes with curves; what is outside is cut off.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Panel {
    /// The text above the panel.
    pub title: String,
    /// The horizontal axis.
    pub x: Axis,
    /// The vertical axis.
    pub y: Axis,
    /// The curves, later ones over earlier ones.
    pub series: Vec<Series>,
    /// The marked changes.
    pub marks: Vec<Mark>,
}

/// A rectangle on the sheet [px].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rectangle {
    /// Distance from the sheet's left edge.
    pub left: f64,
    /// Distance from the sheet's top edge.
    pub top: f64,
    /// Extent to the right.
    pub width: f64,
    /// Extent downwards.
    pub height: f64,
}

impl Rectangle {
    /// Whether a point lies inside.
    pub fn contains(&self, (x, y): Point) -> bool {
        (self.left..=self.left + self.width).contains(&x) && (self.top..=self.top + self.height).contains(&y)
    }

    /// Whether all of another rectangle lies inside.
    pub fn encloses(&self, other: &Self) -> bool {
        self.contains((other.left, other.top))
            && self.contains((other.left + other.width, other.top + other.height))
    }

    /// Whether the two have a point in common.
    pub fn overlaps(&self, other: &Self) -> bool {
        let apart = |start: f64, size: f64, other: f64, other_size: f64| {
            start + size < other || other + other_size < start
        };
        !apart(self.left, self.width, other.left, other.width)
            && !apart(self.top, self.height, other.top, other.height)
    }
}

/// Curves over time, with the vertical range that shows all of them in that time.
pub fn over_time(title: &str, time: Axis, label: &str, series: Vec<Series>) -> Panel {
    let points = series.iter().flat_map(|series| &series.points);
    let range = range_of(points.filter(|point| time.range.contains(&point.0)).map(|point| point.1));
    Panel { title: title.to_owned(), x: time, y: Axis::new(label, range), series, marks: Vec::new() }
}

/// Width and height of a panel without marks [px].
const PANEL: (f64, f64) = (430.0, 260.0);

/// The room of a panel beside its curves [px].
const BESIDE: f64 = 92.0;

/// Height of the title [px].
const TOP: f64 = 40.0;

/// Rows of panels under a title, with one legend for all at the right.
///
/// # Errors
/// [`DrawError::Drawing`].
pub fn chart(name: &str, title: &str, rows: &[Vec<Panel>]) -> Result<Figure, DrawError> {
    let entries = legend(rows);
    let legend_width = entries.iter().map(|series| entry_width(series) + 12.0).fold(20.0, f64::max);
    let columns = rows.iter().map(Vec::len).max().unwrap_or(1) as f64;
    let named: Vec<Vec<_>> =
        rows.iter().map(|panels| panels.iter().map(Panel::named_marks).collect()).collect();
    let bands: Vec<_> =
        named.iter().map(|panels| panels.iter().map(NamedMarks::height).fold(0.0, f64::max)).collect();
    let height = TOP + bands.iter().map(|band| PANEL.1 + band).sum::<f64>();
    let width = (columns * PANEL.0 + legend_width).max(28.0 + text_width(title, TITLE));
    let data =
        json!({ "title": title, "panels": rows.iter().flatten().map(Panel::data).collect::<Vec<_>>() });
    draw(name, data, (width as u32, height as u32), |canvas| {
        canvas.text(title, (14.0, 0.6 * TOP), TITLE, Anchor::Left)?;
        let mut top = TOP;
        for ((panels, named), band) in rows.iter().zip(&named).zip(bands) {
            for (column, (panel, marks)) in panels.iter().zip(named).enumerate() {
                let left = column as f64 * PANEL.0;
                let frame = Rectangle { left, top, width: PANEL.0, height: PANEL.1 + band };
                panel.draw(canvas, frame, marks, band)?;
            }
            top += PANEL.1 + band;
        }
        draw_legend(canvas, &entries, (columns * PANEL.0 + 12.0, TOP + 34.0))
    })
}

/// What the legend names: each name and look once, in order.
fn legend(rows: &[Vec<Panel>]) -> Vec<&Series> {
    let mut entries: Vec<&Series> = Vec::new();
    for series in rows.iter().flatten().flat_map(|panel| &panel.series) {
        let known = entries.iter().any(|entry| entry.name == series.name && entry.line == series.line);
        if !known && !series.name.is_empty() {
            entries.push(series);
        }
    }
    entries
}

fn draw_legend(canvas: &Canvas, entries: &[&Series], (left, top): Point) -> Result<(), DrawError> {
    entries
        .iter()
        .enumerate()
        .try_for_each(|(i, series)| draw_entry(canvas, series, (left, top + 19.0 * i as f64)))
}

pub(super) fn draw_entry(canvas: &Canvas, series: &Series, (left, y): Point) -> Result<(), DrawError> {
    let sample: Vec<_> = (0..=3).map(|k| (left + 8.0 * f64::from(k), y)).collect();
    canvas.line(&sample, series.color, 2.0, series.line)?;
    canvas.text(&series.name, (left + 32.0, y), LABEL, Anchor::Left)
}

/// How much room an entry of a legend takes [px].
pub(super) fn entry_width(series: &Series) -> f64 {
    48.0 + text_width(&series.name, LABEL)
}

impl Panel {
    fn data(&self) -> Value {
        let series = |series: &Series| {
            let shown = clip(&series.points, &self.x.range, &self.y.range, series.line).concat();
            let points: Vec<_> = self.visible(&shown).into_iter().map(|(x, y)| [x, y]).collect();
            json!({ "name": series.name, "points": points })
        };
        let series: Vec<_> = self.series.iter().map(series).collect();
        json!({ "title": self.title, "x": self.x.label, "y": self.y.label, "series": series })
    }

    fn named_marks(&self) -> NamedMarks<'_> {
        let shown =
            self.marks.iter().filter(|mark| (self.x.range.start..=self.x.range.end).contains(&mark.x));
        let width = PANEL.0 - BESIDE;
        NamedMarks::new(shown.map(|mark| (mark, width * self.x.part(mark.x))), width)
    }

    /// The points that can be distinguished in the panel.
    fn visible(&self, points: &[(f64, f64)]) -> Vec<(f64, f64)> {
        let apart = |axis: &Axis, a: f64, b: f64| axis.part(a) - axis.part(b);
        spaced(points, |a, b| (400.0 * apart(&self.x, a.0, b.0)).hypot(250.0 * apart(&self.y, a.1, b.1)))
    }

    /// Draws the panel into a rectangle whose upper `band` pixels, below the title, are for the names of marks.
    fn draw(
        &self,
        canvas: &Canvas,
        frame: Rectangle,
        marks: &NamedMarks,
        band: f64,
    ) -> Result<(), DrawError> {
        let plot = Rectangle {
            left: frame.left + 76.0,
            top: frame.top + 26.0 + band,
            width: frame.width - BESIDE,
            height: frame.height - 78.0 - band,
        };
        let right = plot.left + plot.width;
        let bottom = plot.top + plot.height;
        let at = |x: f64, y: f64| -> Point {
            (plot.left + plot.width * self.x.part(x), bottom - plot.height * self.y.part(y))
        };
        canvas.text(&self.title, (plot.left, frame.top + 14.0), LABEL, Anchor::Left)?;
        for (value, text) in self.x.ticks(6) {
            let x = at(value, self.y.range.start).0;
            canvas.line(&[(x, plot.top), (x, bottom)], FAINT, 0.8, Line::Solid)?;
            canvas.text(&text, (x, bottom + 12.0), TICK, Anchor::Center)?;
        }
        for (value, text) in self.y.ticks(5) {
            let y = at(self.x.range.start, value).1;
            canvas.line(&[(plot.left, y), (right, y)], FAINT, 0.8, Line::Solid)?;
            canvas.text(&text, (plot.left - 6.0, y), TICK, Anchor::Right)?;
        }
        // Below the curves, so that one along an axis is seen.
        let corners = [(plot.left, plot.top), (plot.left, bottom), (right, bottom)];
        canvas.line(&corners, INK, 1.0, Line::Solid)?;
        marks.draw(canvas, &plot, band)?;
        for series in &self.series {
            for part in clip(&series.points, &self.x.range, &self.y.range, series.line) {
                let points: Vec<_> = self.visible(&part).iter().map(|(x, y)| at(*x, *y)).collect();
                canvas.line(&points, series.color, 1.6, series.line)?;
            }
        }
        canvas.text(&self.x.label, (plot.left + 0.5 * plot.width, bottom + 32.0), LABEL, Anchor::Center)?;
        canvas.text(&self.y.label, (frame.left + 16.0, plot.top + 0.5 * plot.height), LABEL, Anchor::Upwards)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ratios_are_equally_far_apart_on_a_logarithmic_axis() {
        let axis = Axis::logarithmic("", 0.5..200.0);
        assert_eq!((axis.part(0.5), axis.part(200.0)), (0.0, 1.0));
        assert!((axis.part(10.0) - 0.5).abs() < 1e-12);
        let texts: Vec<_> = axis.ticks(5).into_iter().map(|(_, text)| text).collect();
        assert_eq!(texts, ["0.5", "1", "2", "5", "10", "20", "50", "100", "200"]);
    }

    #[test]
    fn the_vertical_range_is_that_of_the_time_shown() {
        let points = vec![(0.0, 1.0), (1.0, 2.0), (5.0, 100.0)];
        let curve = Series { name: String::new(), color: INK, line: Line::Solid, points };
        let panel = over_time("", Axis::new("time [s]", 0.0..2.0), "", vec![curve]);
        assert!(panel.y.range.contains(&1.0) && panel.y.range.contains(&2.0) && panel.y.range.end < 3.0);
    }
}
