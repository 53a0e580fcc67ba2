//! Vertical lines at changes, with names above the curves.

use super::canvas::{Anchor, Canvas, Rectangle};
use super::colors::Color;
use super::line::Line;
use super::style::{TICK, text_width};
use std::ops::Range;

/// A vertical line at a change.
#[derive(Clone, Debug, PartialEq)]
pub struct Mark {
    /// The position of the change on the horizontal axis.
    pub x: f64,
    /// The name of the change, which is written above the curves if it fits there. Empty if the change has no name.
    pub text: String,
    /// The color of the line.
    pub color: Color,
    /// The style of the line.
    pub line: Line,
}

/// The vertical lines at changes in a panel ([`Mark`]). Each comes with its distance from the left edge of the curves \[px\], and with
/// the place of its name. The place is `None` if the name is not written.
pub(super) struct NamedMarks<'a> {
    marks: Vec<(&'a Mark, f64, Option<Place>)>,
    lines: usize,
}

/// The position of a name: its line of text, counted from the top, and the end of the text that is at the mark.
type Place = (usize, Anchor);

/// The largest number of lines of names.
const MOST_LINES: usize = 4;
/// The distance between lines of names \[px\].
const LINE: f64 = 12.0;

/// The largest distance by which a name may extend beyond the right edge of the curves \[px\].
const BEYOND: f64 = 14.0;
/// The least distance of a name from its mark and from the next name \[px\].
const GAP: f64 = 3.0;

impl<'a> NamedMarks<'a> {
    /// Finds places at which the names overlap neither each other nor a mark. `marks` yields each mark with its distance from the left
    /// edge of the curves \[px\]. `width` is the width of the curves \[px\].
    ///
    /// Names without a place are not written. Solid marks come first: if the name of a solid mark has no place, this function starts
    /// again, and places only the names of solid marks.
    pub fn new(marks: impl Iterator<Item = (&'a Mark, f64)>, width: f64) -> Self {
        let mut marks: Vec<_> = marks.collect();
        marks.sort_by(|(_, a), (_, b)| a.total_cmp(b));
        let placed = |is_named: &dyn Fn(&Mark) -> bool| {
            let mut lines = Vec::new();
            let mut place = |mark: &'a Mark, x: f64| {
                let named = !mark.text.is_empty() && is_named(mark);
                let place = || find_place(&mut lines, x, text_width(&mark.text, TICK), width + BEYOND);
                (mark, x, named.then(place).flatten())
            };
            let marks = marks.iter().map(|(mark, x)| place(mark, *x)).collect();
            Self { marks, lines: lines.len() }
        };
        let all = placed(&|_| true);
        let is_solid = |mark: &Mark| mark.line == Line::Solid;
        let misses = |(mark, _, place): &(&Mark, f64, Option<Place>)| {
            is_solid(mark) && !mark.text.is_empty() && place.is_none()
        };
        if all.marks.iter().any(misses) { placed(&is_solid) } else { all }
    }

    /// Returns the height of all names, which are above the curves \[px\].
    pub fn height(&self) -> f64 {
        if self.lines > 0 { self.lines as f64 * LINE + 4.0 } else { 0.0 }
    }

    /// Draws the lines over the whole height of the curves. Draws their names in the `band` above the curves \[px\].
    pub fn draw(&self, canvas: &mut Canvas, curves: &Rectangle, band: f64) {
        for (mark, x, place) in &self.marks {
            let x = curves.left + x;
            let above = place.map_or(0.0, |(line, _)| band - LINE * line as f64 - 6.0);
            let top = curves.top - above;
            canvas.line(&[(x, top), (x, curves.top + curves.height)], mark.color, 0.6, mark.line);
            if let Some((_, anchor)) = *place {
                let side = if anchor == Anchor::Left { GAP } else { -GAP };
                canvas.text(&mark.text, (x + side, top), TICK, anchor);
            }
        }
    }
}

/// Finds the first line of text in which a name of this width fits: to the right of its mark or, near the right end, to the left.
/// Adds a line if necessary. Returns `None` if the name fits into no line, and there are [`MOST_LINES`] lines already.
fn find_place(lines: &mut Vec<Vec<Range<f64>>>, x: f64, width: f64, right: f64) -> Option<Place> {
    let room = width + 2.0 * GAP;
    let (name, anchor) =
        if x + room <= right { (x..x + room, Anchor::Left) } else { (x - room..x, Anchor::Right) };
    let is_free = |other: &Range<f64>| name.end <= other.start || other.end <= name.start;
    let line = lines.iter().position(|names| names.iter().all(is_free)).unwrap_or(lines.len());
    if line == MOST_LINES {
        return None;
    }
    if line == lines.len() {
        lines.push(Vec::new());
    }
    lines[line].push(name);
    Some((line, anchor))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::INK;

    #[test]
    fn names_take_lines_of_their_own_and_stay_in_the_panel() {
        let mut lines = Vec::new();
        let mut place = |x| find_place(&mut lines, x, 50.0, 200.0);
        assert_eq!(place(10.0), Some((0, Anchor::Left)));
        assert_eq!(place(12.0), Some((1, Anchor::Left)));
        assert_eq!(place(70.0), Some((0, Anchor::Left)));
        assert_eq!(place(190.0), Some((0, Anchor::Right)), "at the end");
        (2..MOST_LINES).for_each(|line| assert_eq!(place(10.0), Some((line, Anchor::Left))));
        assert_eq!(place(10.0), None, "no line is free");
    }

    #[test]
    fn where_there_is_no_room_for_all_solid_marks_alone_are_named() {
        let mark = |x, text: &str, line| Mark { x, text: text.to_owned(), color: INK, line };
        let named = |states: usize| {
            let states = (0..states).map(|_| mark(1.0, "tracking", Line::Dashed));
            let marks: Vec<_> = states.chain([mark(1.1, "goal", Line::Solid)]).collect();
            let named = NamedMarks::new(marks.iter().map(|mark| (mark, 150.0 * mark.x)), 300.0);
            let names = named.marks.iter().filter(|(.., place)| place.is_some());
            (named.marks.len(), names.count(), named.height())
        };
        assert_eq!(named(3), (4, 4, 4.0 * LINE + 4.0));
        assert_eq!(named(20), (21, 1, LINE + 4.0));
        let nameless = mark(1.0, "", Line::Solid);
        assert_eq!(NamedMarks::new([(&nameless, 150.0)].into_iter(), 300.0).height(), 0.0);
    }
}
