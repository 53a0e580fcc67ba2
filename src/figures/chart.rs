//! Curves over two axes.

use super::canvas::{Anchor, Canvas, Point, Rectangle};
use super::curve::{clip, decades, range_of, spaced, ticks};
use super::ends::{self, Names};
use super::line::Line;
use super::marks::{Mark, NamedMarks};
use super::series::Series;
use super::style::{FAINT, INK, LABEL, TICK};
use serde_json::{Value, json};
use std::ops::Range;

/// One of the two axes of a panel.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Axis {
    /// The quantity, with its unit.
    pub label: String,
    /// The range of values that is shown.
    pub range: Range<f64>,
    /// Whether the scale is logarithmic. The range must then be above 0.
    pub logarithmic: bool,
}

impl Axis {
    /// Creates a linear axis with this label and range.
    pub fn new(label: &str, range: Range<f64>) -> Self {
        Self { label: label.to_owned(), range, logarithmic: false }
    }

    /// Creates a logarithmic axis with this label and range.
    pub fn logarithmic(label: &str, range: Range<f64>) -> Self {
        Self { logarithmic: true, ..Self::new(label, range) }
    }

    /// Returns the position of a value on the axis, as a fraction: 0 at the start, 1 at the end.
    fn part(&self, value: f64) -> f64 {
        let Range { start, end } = self.range;
        match self.logarithmic {
            true => (value / start).ln() / (end / start).ln(),
            false => (value - start) / (end - start),
        }
    }

    /// Returns about `count` ticks, at least two. Each tick has its value and its text. A logarithmic axis may have up to three
    /// times `count` ticks, because they are not evenly spaced.
    fn ticks(&self, count: f64) -> Vec<(f64, String)> {
        let decades = if self.logarithmic { decades(&self.range, 3.0 * count) } else { Vec::new() };
        // A range of less than a decade has too few round values of its own.
        if decades.len() < 3 { ticks(&self.range, count.max(5.0)) } else { decades }
    }
}

/// Two axes with curves. The curves are clipped to the axes' ranges.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Panel {
    /// The text above the panel.
    pub title: String,
    /// The horizontal axis.
    pub x: Axis,
    /// The vertical axis.
    pub y: Axis,
    /// The curves. Later curves are drawn over earlier curves.
    pub series: Vec<Series>,
    /// The changes that are marked by vertical lines.
    pub marks: Vec<Mark>,
    /// Whether each curve has its name at its right end instead of in a legend. Curves that coincide are then drawn once.
    pub names_at_ends: bool,
}

/// Creates a panel of curves over the time axis `time`. The panel's vertical range contains all values of the curves in the range
/// of `time`.
pub fn over_time(title: &str, time: Axis, label: &str, series: Vec<Series>) -> Panel {
    let points = series.iter().flat_map(|series| &series.points);
    let range = range_of(points.filter(|point| time.range.contains(&point.0)).map(|point| point.1));
    Panel { title: title.to_owned(), x: time, y: Axis::new(label, range), series, ..Panel::default() }
}

/// The margin to the left of the curves \[px\], for numbers and labels.
const LEFT: f64 = 76.0;
/// The margin to the right of the curves \[px\]. Half of the last number on the horizontal axis extends into it.
const RIGHT: f64 = 16.0;

impl Panel {
    /// Returns the data of the panel as JSON: the title, the labels of the axes, and the visible points of each curve.
    pub(super) fn data(&self) -> Value {
        let series = |series: &Series| {
            let shown = clip(&series.points, &self.x.range, &self.y.range).concat();
            let points: Vec<_> = self.visible(&shown).into_iter().map(|(x, y)| [x, y]).collect();
            json!({ "name": series.name, "points": points })
        };
        let series: Vec<_> = self.series.iter().map(series).collect();
        json!({ "title": self.title, "x": self.x.label, "y": self.y.label, "series": series })
    }

    /// Returns the panel's marks, with the positions of their names in a panel of this width \[px\].
    pub(super) fn named_marks(&self, width: f64) -> NamedMarks<'_> {
        let shown =
            self.marks.iter().filter(|mark| (self.x.range.start..=self.x.range.end).contains(&mark.x));
        let width = width - LEFT - RIGHT;
        NamedMarks::new(shown.map(|mark| (mark, width * self.x.part(mark.x))), width)
    }

    /// Returns the width of the names at the ends of the curves \[px\].
    pub(super) fn names_width(&self, names: &Names) -> f64 {
        if self.names_at_ends { names.width(&self.series) } else { 0.0 }
    }

    /// Leaves out points that are too close to the previous point to be distinguished in the panel.
    fn visible(&self, points: &[(f64, f64)]) -> Vec<(f64, f64)> {
        let apart = |axis: &Axis, a: f64, b: f64| axis.part(a) - axis.part(b);
        spaced(points, |a, b| (400.0 * apart(&self.x, a.0, b.0)).hypot(250.0 * apart(&self.y, a.1, b.1)))
    }

    /// Draws the panel into the rectangle `frame`. The upper `band` pixels, below the title, are for the names of marks.
    pub(super) fn draw(&self, canvas: &mut Canvas, frame: Rectangle, band: f64, names: &Names) {
        /// The approximate distances between ticks, on the horizontal and the vertical axis \[px\].
        const APART: (f64, f64) = (56.0, 36.0);
        let plot = Rectangle {
            left: frame.left + LEFT,
            top: frame.top + 26.0 + band,
            width: frame.width - LEFT - RIGHT - self.names_width(names),
            height: frame.height - 78.0 - band,
        };
        let (right, bottom) = (plot.right(), plot.bottom());
        let across = |x: f64| plot.left + plot.width * self.x.part(x);
        let up = |y: f64| bottom - plot.height * self.y.part(y);
        canvas.text(&self.title, (plot.left, frame.top + 14.0), LABEL, Anchor::Left);
        for (x, text) in self.x.ticks(plot.width / APART.0) {
            canvas.line(&[(across(x), plot.top), (across(x), bottom)], FAINT, 0.8, Line::Solid);
            canvas.text(&text, (across(x), bottom + 12.0), TICK, Anchor::Center);
        }
        for (y, text) in self.y.ticks(plot.height / APART.1) {
            canvas.line(&[(plot.left, up(y)), (right, up(y))], FAINT, 0.8, Line::Solid);
            canvas.text(&text, (plot.left - 6.0, up(y)), TICK, Anchor::Right);
        }
        // The axes are below the curves, so that a curve along an axis is visible.
        let corners = [(plot.left, plot.top), (plot.left, bottom), (right, bottom)];
        canvas.line(&corners, INK, 1.0, Line::Solid);
        self.named_marks(frame.width).draw(canvas, &plot, band);
        let on_sheet = |part: Vec<(f64, f64)>| -> Vec<Point> {
            self.visible(&part).iter().map(|(x, y)| (across(*x), up(*y))).collect()
        };
        let parts =
            |series: &Series| clip(&series.points, &self.x.range, &self.y.range).into_iter().map(on_sheet);
        if self.names_at_ends {
            let curves = self.series.iter().map(|series| (series, parts(series).collect())).collect();
            ends::draw(canvas, &plot, names, curves);
        } else {
            for series in &self.series {
                parts(series).for_each(|part| canvas.line(&part, series.color, 1.6, series.line));
            }
        }
        canvas.text(&self.x.label, (plot.left + 0.5 * plot.width, bottom + 32.0), LABEL, Anchor::Center);
        canvas.text(&self.y.label, (frame.left + 16.0, plot.top + 0.5 * plot.height), LABEL, Anchor::Upwards);
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
        let texts: Vec<_> = axis.ticks(5.0).into_iter().map(|(_, text)| text).collect();
        assert_eq!(texts, ["0.5", "1", "2", "5", "10", "20", "50", "100", "200"]);
        let few = axis.ticks(2.0).into_iter().map(|(_, text)| text);
        assert_eq!(few.collect::<Vec<_>>(), ["1", "10", "100"], "where there is no room for all");
        let narrow = Axis::logarithmic("", 1.01..1.32).ticks(5.0).into_iter().map(|(_, text)| text);
        assert_eq!(narrow.collect::<Vec<_>>(), ["1.1", "1.2", "1.3"], "less than a decade");
        assert_eq!(Axis::new("", 0.51..1.47).ticks(1.6).len(), 5, "one alone says nothing");
    }

    #[test]
    fn the_vertical_range_is_that_of_the_time_shown() {
        let points = vec![(0.0, 1.0), (1.0, 2.0), (5.0, 100.0)];
        let curve = Series::solid("", INK, points);
        let panel = over_time("", Axis::new("time [s]", 0.0..2.0), "", vec![curve]);
        assert!(panel.y.range.contains(&1.0) && panel.y.range.contains(&2.0) && panel.y.range.end < 3.0);
    }
}
