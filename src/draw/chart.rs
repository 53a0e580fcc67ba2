//! Curves over two axes.

use super::DrawError;
use super::canvas::{Anchor, Canvas, Figure, Line, Point, draw};
use super::curve::{clip, range_of, spaced, ticks};
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
}

impl Axis {
    /// An axis with this label and range.
    pub fn new(label: &str, range: Range<f64>) -> Self {
        Self { label: label.to_owned(), range }
    }
}

/// A vertical line where something changed.
#[derive(Clone, Debug, PartialEq)]
pub struct Mark {
    /// Where on the horizontal axis the change was.
    pub x: f64,
    /// What changed, written above the curves where there is room; empty where nothing is to be written.
    pub text: String,
    /// The line's colour.
    pub color: RGBColor,
    /// How the line is drawn.
    pub line: Line,
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
    let bands: Vec<_> = rows.iter().map(|panels| band(panels)).collect();
    let height = TOP + bands.iter().map(|band| PANEL.1 + band).sum::<f64>();
    let width = (columns * PANEL.0 + legend_width).max(28.0 + text_width(title, TITLE));
    let data =
        json!({ "title": title, "panels": rows.iter().flatten().map(Panel::data).collect::<Vec<_>>() });
    draw(name, data, (width as u32, height as u32), |canvas| {
        canvas.text(title, (14.0, 0.6 * TOP), TITLE, Anchor::Left)?;
        let mut top = TOP;
        for (panels, band) in rows.iter().zip(bands) {
            for (column, panel) in panels.iter().enumerate() {
                let left = column as f64 * PANEL.0;
                let frame = Rectangle { left, top, width: PANEL.0, height: PANEL.1 + band };
                panel.draw(canvas, frame, band)?;
            }
            top += PANEL.1 + band;
        }
        draw_legend(canvas, &entries, (columns * PANEL.0 + 12.0, TOP + 34.0))
    })
}

/// Lines of text that name marks, above the curves, and how far they are apart [px].
const MARK_LINES: usize = 5;
const MARK_LINE: f64 = 12.0;

/// The room above the curves of a row for the names of its marks [px].
fn band(panels: &[Panel]) -> f64 {
    let named = panels.iter().flat_map(|panel| &panel.marks).any(|mark| !mark.text.is_empty());
    if named { MARK_LINES as f64 * MARK_LINE + 4.0 } else { 0.0 }
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

    /// The points that can be distinguished in the panel.
    fn visible(&self, points: &[(f64, f64)]) -> Vec<(f64, f64)> {
        let size = |range: &Range<f64>| range.end - range.start;
        spaced(points, |a, b| {
            (400.0 * (a.0 - b.0) / size(&self.x.range)).hypot(250.0 * (a.1 - b.1) / size(&self.y.range))
        })
    }

    /// Draws the panel into a rectangle whose upper `band` pixels, below the title, are for the names of marks.
    fn draw(&self, canvas: &Canvas, frame: Rectangle, band: f64) -> Result<(), DrawError> {
        let plot = Rectangle {
            left: frame.left + 76.0,
            top: frame.top + 26.0 + band,
            width: frame.width - 92.0,
            height: frame.height - 78.0 - band,
        };
        let right = plot.left + plot.width;
        let bottom = plot.top + plot.height;
        let at = |x: f64, y: f64| -> Point {
            let part = |value: f64, range: &Range<f64>| (value - range.start) / (range.end - range.start);
            (plot.left + plot.width * part(x, &self.x.range), bottom - plot.height * part(y, &self.y.range))
        };
        canvas.text(&self.title, (plot.left, frame.top + 14.0), LABEL, Anchor::Left)?;
        for (value, text) in ticks(&self.x.range, 6) {
            let x = at(value, self.y.range.start).0;
            canvas.line(&[(x, plot.top), (x, bottom)], FAINT, 0.8, Line::Solid)?;
            canvas.text(&text, (x, bottom + 12.0), TICK, Anchor::Center)?;
        }
        for (value, text) in ticks(&self.y.range, 5) {
            let y = at(self.x.range.start, value).1;
            canvas.line(&[(plot.left, y), (right, y)], FAINT, 0.8, Line::Solid)?;
            canvas.text(&text, (plot.left - 6.0, y), TICK, Anchor::Right)?;
        }
        // Below the curves, so that one along an axis is seen.
        let corners = [(plot.left, plot.top), (plot.left, bottom), (right, bottom)];
        canvas.line(&corners, INK, 1.0, Line::Solid)?;
        self.draw_marks(canvas, plot, band, &at)?;
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

impl Panel {
    /// Lines over the whole height, and in the band above them their names where they do not run into each other.
    fn draw_marks(
        &self,
        canvas: &Canvas,
        plot: Rectangle,
        band: f64,
        at: &impl Fn(f64, f64) -> Point,
    ) -> Result<(), DrawError> {
        let mut marks: Vec<_> = self.marks.iter().filter(|mark| self.x.range.contains(&mark.x)).collect();
        marks.sort_by(|a, b| a.x.total_cmp(&b.x));
        let right = plot.left + plot.width + 14.0;
        let mut free = [f64::NEG_INFINITY; MARK_LINES];
        for mark in marks {
            let x = at(mark.x, 0.0).0;
            let place = Some(mark).filter(|mark| band > 0.0 && !mark.text.is_empty());
            let place = place.and_then(|mark| mark_place(&mut free, x, text_width(&mark.text, TICK), right));
            let top = place.map_or(0.0, |(line, _)| band - MARK_LINE * line as f64 - 6.0);
            canvas.line(&[(x, plot.top - top), (x, plot.top + plot.height)], mark.color, 0.6, mark.line)?;
            if let Some((_, anchor)) = place {
                let side = if anchor == Anchor::Left { 3.0 } else { -3.0 };
                canvas.text(&mark.text, (x + side, plot.top - top), TICK, anchor)?;
            }
        }
        Ok(())
    }
}

/// The line in which a mark's name of that width has room, right of the mark or, at the panel's end, left of it.
fn mark_place(free: &mut [f64], x: f64, width: f64, right: f64) -> Option<(usize, Anchor)> {
    let fits_right = x + width + 7.0 <= right;
    let start = if fits_right { x } else { x - width - 7.0 };
    let line = free.iter().position(|free| *free <= start)?;
    free[line] = if fits_right { x + width + 7.0 } else { x + 1.0 };
    Some((line, if fits_right { Anchor::Left } else { Anchor::Right }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_vertical_range_is_that_of_the_time_shown() {
        let points = vec![(0.0, 1.0), (1.0, 2.0), (5.0, 100.0)];
        let curve = Series { name: String::new(), color: INK, line: Line::Solid, points };
        let panel = over_time("", Axis::new("time [s]", 0.0..2.0), "", vec![curve]);
        assert!(panel.y.range.contains(&1.0) && panel.y.range.contains(&2.0) && panel.y.range.end < 3.0);
    }

    #[test]
    fn names_of_marks_take_lines_of_their_own_and_stay_in_the_panel() {
        let mut free = [f64::NEG_INFINITY; 2];
        assert_eq!(mark_place(&mut free, 10.0, 50.0, 200.0), Some((0, Anchor::Left)));
        assert_eq!(mark_place(&mut free, 12.0, 50.0, 200.0), Some((1, Anchor::Left)));
        assert_eq!(mark_place(&mut free, 14.0, 50.0, 200.0), None, "no line is free");
        assert_eq!(mark_place(&mut free, 190.0, 50.0, 200.0), Some((0, Anchor::Right)), "at the end");
    }
}
