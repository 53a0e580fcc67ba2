//! Names at the right ends of curves. Curves that coincide are drawn as one curve, with all of their names at its end.

use super::canvas::{Anchor, Canvas, Point, Rectangle, distance};
use super::legend::{SAMPLE, draw_sample};
use super::line::Line;
use super::series::Series;
use super::style::{LABEL, LIMIT, text_width};

/// The horizontal space for the line from the end of a curve to its name \[px\].
const LEADER: f64 = 16.0;
/// The height of a line of text \[px\].
const LINE: f64 = 11.5;

/// The texts at the ends of curves.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Names {
    /// The names of the curves. If curves coincide, their names stand one below the other.
    Full,
    /// Letters instead of the names, which would be too wide. The legend explains the letters. The strings are the names in the
    /// legend: the first name belongs to the letter `a`, the second to `b`, and so on.
    Letters(Vec<String>),
}

impl Names {
    /// Returns the letter of the entry with this index.
    pub fn letter(index: usize) -> char {
        char::from_u32('a' as u32 + index as u32).unwrap_or('?')
    }

    /// Returns the width of the names of these curves \[px\].
    pub fn width(&self, series: &[Series]) -> f64 {
        let widest = series.iter().map(|series| text_width(&series.name, LABEL)).fold(0.0, f64::max);
        match self {
            Self::Full => LEADER + SAMPLE + 8.0 + widest,
            Self::Letters(entries) => LEADER + text_width(&"a".repeat(entries.len().min(6)), LABEL),
        }
    }
}

/// Curves that coincide on the sheet.
struct Bundle<'a> {
    series: Vec<&'a Series>,
    /// The visible parts of the curves.
    parts: Vec<Vec<Point>>,
}

/// Draws curves and the names at their ends. `curves` has each curve with its visible parts. The names are at the right of the
/// rectangle `plot`.
pub(super) fn draw(
    canvas: &mut Canvas,
    plot: &Rectangle,
    names: &Names,
    curves: Vec<(&Series, Vec<Vec<Point>>)>,
) {
    let bundles = bundles(curves);
    for Bundle { series, parts } in &bundles {
        parts.iter().for_each(|part| canvas.line(part, series[0].color, 1.6, series[0].line));
    }
    let mut ends: Vec<_> =
        bundles.iter().filter_map(|bundle| Some((bundle, *bundle.parts.last()?.last()?))).collect();
    ends.sort_by(|(_, a), (_, b)| a.1.total_cmp(&b.1));
    let lines = |bundle: &Bundle| if *names == Names::Full { bundle.series.len() } else { 1 };
    let heights: Vec<_> = ends.iter().map(|(bundle, _)| LINE * lines(bundle) as f64).collect();
    let places: Vec<_> = ends.iter().map(|(_, end)| end.1).collect();
    let left = plot.right() + LEADER;
    for ((bundle, end), y) in ends.iter().zip(spread(&places, &heights, plot.top..plot.bottom())) {
        let top = y - 0.5 * LINE * (lines(bundle) - 1) as f64;
        canvas.line(&[*end, (left - 3.0, y)], LIMIT, 0.6, Line::Solid);
        match names {
            Names::Full => {
                for (number, series) in bundle.series.iter().enumerate() {
                    let at = (left, top + LINE * number as f64);
                    draw_sample(canvas, series, at);
                    canvas.text(&series.name, (at.0 + SAMPLE + 6.0, at.1), LABEL, Anchor::Left);
                }
            }
            Names::Letters(entries) => {
                let letter = |series: &&Series| {
                    entries.iter().position(|name| *name == series.name).map(Names::letter)
                };
                let letters: String = bundle.series.iter().filter_map(letter).collect();
                canvas.text(&letters, (left, y), LABEL, Anchor::Left);
            }
        }
    }
}

/// Joins the curves that coincide on the sheet.
fn bundles<'a>(curves: Vec<(&'a Series, Vec<Vec<Point>>)>) -> Vec<Bundle<'a>> {
    let mut bundles: Vec<Bundle<'a>> = Vec::new();
    for (series, parts) in curves.into_iter().filter(|(_, parts)| !parts.is_empty()) {
        match bundles
            .iter_mut()
            .find(|bundle| is_near(&bundle.parts, &parts) && is_near(&parts, &bundle.parts))
        {
            Some(bundle) => bundle.series.push(series),
            None => bundles.push(Bundle { series: vec![series], parts }),
        }
    }
    bundles
}

/// Returns whether each point of a curve is so near to the other curve that nobody can distinguish the two.
fn is_near(curve: &[Vec<Point>], other: &[Vec<Point>]) -> bool {
    /// Two points that are closer together than this look like one \[px\]. This distance is smaller than the width of a line.
    const NEAR: f64 = 1.2;
    let segments = || other.iter().flat_map(|part| part.windows(2));
    curve.iter().flatten().all(|point| segments().any(|ends| distance_to(*point, ends[0], ends[1]) < NEAR))
}

/// Returns the distance of a point from a segment.
fn distance_to(point: Point, from: Point, to: Point) -> f64 {
    let (dx, dy) = (to.0 - from.0, to.1 - from.1);
    let along = (point.0 - from.0) * dx + (point.1 - from.1) * dy;
    let part = (along / (dx * dx + dy * dy).max(1e-12)).clamp(0.0, 1.0);
    distance(point, (from.0 + part * dx, from.1 + part * dy))
}

/// Places names with these `heights` one below the other, without overlaps, within the vertical range `room`. Returns the vertical
/// positions of the middles of the names. `places` are the vertical positions of the ends of the curves, in ascending order. The
/// middles are as near to `places` as possible: the sum of the squared distances is minimal (pool adjacent violators). If the names
/// do not fit into `room`, they extend beyond both of its ends.
fn spread(places: &[f64], heights: &[f64], room: std::ops::Range<f64>) -> Vec<f64> {
    let mut below = 0.0;
    // The distance of each name from the top of the first name, if there are no gaps.
    let offsets: Vec<_> = heights.iter().map(|height| (below += height, below - 0.5 * height).1).collect();
    // Groups of names without gaps between them: the number of names, and the mean of the positions that their tops should have.
    let mut blocks: Vec<(usize, f64)> = Vec::new();
    for (place, offset) in places.iter().zip(&offsets) {
        blocks.push((1, place - offset));
        while let [.., (n, first), (m, last)] = *blocks
            && last < first
        {
            blocks.truncate(blocks.len() - 2);
            blocks.push((n + m, (n as f64 * first + m as f64 * last) / (n + m) as f64));
        }
    }
    let spare = room.end - room.start - below;
    let tops = if spare > 0.0 {
        room.start..room.start + spare
    } else {
        room.start + 0.5 * spare..room.start + 0.5 * spare
    };
    let each = blocks.iter().flat_map(|(n, top)| std::iter::repeat_n(top.clamp(tops.start, tops.end), *n));
    each.zip(&offsets).map(|(top, offset)| top + offset).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::INK;

    fn series(name: &str) -> Series {
        Series::solid(name, INK, [])
    }

    #[test]
    fn curves_that_coincide_are_joined_and_others_are_not() {
        let line = |y: f64| vec![vec![(0.0, y), (50.0, y + 10.0), (100.0, y)]];
        let straight = vec![vec![(0.0, 0.5), (100.0, 0.5)]];
        let all = ["a", "b", "c", "d", "e"].map(series);
        let curves = all.iter().zip([line(0.0), line(0.4), line(30.0), straight, Vec::new()]).collect();
        let names: Vec<Vec<_>> = bundles(curves)
            .iter()
            .map(|bundle| bundle.series.iter().map(|it| it.name.as_str()).collect())
            .collect();
        assert_eq!(names, [vec!["a", "b"], vec!["c"], vec!["d"]]);
    }

    #[test]
    fn names_do_not_overlap_and_stay_near_their_curves() {
        let spread = |places: &[f64], heights: &[f64]| spread(places, heights, 0.0..100.0);
        assert_eq!(spread(&[20.0, 60.0], &[10.0; 2]), [20.0, 60.0]);
        assert_eq!(spread(&[20.0, 22.0], &[10.0; 2]), [16.0, 26.0]);
        assert_eq!(spread(&[95.0, 96.0, 97.0], &[10.0, 30.0, 10.0]), [55.0, 75.0, 95.0]);
        assert_eq!(spread(&[0.0, 50.0, 50.0], &[40.0; 3]), [10.0, 50.0, 90.0], "too many for the room");
    }
}
