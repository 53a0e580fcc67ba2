//! A sheet for drawing in pixels, which is written as SVG.

use super::colors::Color;
use super::line::Line;
use super::style::INK;
use dq_common::text::escaped;
use std::fmt::Write;

/// A point on the sheet: its distances from the left and the top edge \[px\].
pub type Point = (f64, f64);

/// The position of text relative to its point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Anchor {
    /// The text begins at the point.
    Left,
    /// The text is centered at the point.
    Center,
    /// The text ends at the point.
    Right,
    /// The text is centered at the point and reads upward.
    Upwards,
}

/// A rectangle on the sheet \[px\].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rectangle {
    /// The distance from the sheet's left edge.
    pub left: f64,
    /// The distance from the sheet's top edge.
    pub top: f64,
    /// The width.
    pub width: f64,
    /// The height.
    pub height: f64,
}

impl Rectangle {
    /// Creates a rectangle around the center `(x, y)`.
    pub fn around((x, y): Point, width: f64, height: f64) -> Self {
        Self { left: x - 0.5 * width, top: y - 0.5 * height, width, height }
    }

    /// Returns the distance of the right edge from the sheet's left edge.
    pub fn right(&self) -> f64 {
        self.left + self.width
    }

    /// Returns the distance of the lower edge from the sheet's top edge.
    pub fn bottom(&self) -> f64 {
        self.top + self.height
    }

    /// Returns whether a point is inside the rectangle.
    pub fn contains(&self, (x, y): Point) -> bool {
        (self.left..=self.right()).contains(&x) && (self.top..=self.bottom()).contains(&y)
    }

    /// Returns whether `other` is completely inside this rectangle.
    pub fn encloses(&self, other: &Self) -> bool {
        self.contains((other.left, other.top)) && self.contains((other.right(), other.bottom()))
    }

    /// Returns whether the two rectangles overlap.
    pub fn overlaps(&self, other: &Self) -> bool {
        let apart = |a: &Self, b: &Self| a.right() < b.left || a.bottom() < b.top;
        !apart(self, other) && !apart(other, self)
    }
}

/// A drawing, as SVG elements.
#[derive(Default)]
pub struct Canvas(String);

impl Canvas {
    /// Returns the complete SVG of `width` × `height` pixels. `inches` is the width of the drawing on paper; `None` for a screen.
    pub fn finish(self, width: f64, height: f64, inches: Option<f64>) -> String {
        let (width, height) = (width.floor(), height.floor());
        let size = |pixels: f64| match inches {
            Some(inches) => format!("{:.3}in", pixels * inches / width),
            None => pixels.to_string(),
        };
        format!(
            r##"<svg width="{}" height="{}" viewBox="0 0 {width} {height}" xmlns="http://www.w3.org/2000/svg" font-family="sans-serif" stroke-linejoin="round" paint-order="stroke">
<rect width="{width}" height="{height}" fill="#FFFFFF"/>
{}</svg>
"##,
            size(width),
            size(height),
            self.0
        )
    }

    fn put(&mut self, element: std::fmt::Arguments) {
        // Writing into a string cannot fail.
        let _ = self.0.write_fmt(element);
        self.0.push('\n');
    }

    /// Draws a line through `points`, `width` pixels wide.
    pub fn line(&mut self, points: &[Point], color: Color, width: f64, line: Line) {
        /// A dashed line that is longer than this is drawn solid \[px\]. Such a line fills its panel, so nobody would see the
        /// dashes.
        const LONGEST_DASHED: f64 = 20_000.0;
        /// The radius of the dots of a dotted line \[px\].
        const DOT: f64 = 2.1;
        if line == Line::Dots {
            return points.iter().for_each(|point| self.dot(*point, color, DOT));
        }
        let length: f64 = points.windows(2).map(|ends| distance(ends[0], ends[1])).sum();
        let pattern = line.dashes().filter(|_| length < LONGEST_DASHED);
        let dashes = pattern.map_or(String::new(), |dashes| format!(r#" stroke-dasharray="{dashes}""#));
        let (points, color) = (coordinates(points), hex(color));
        self.put(format_args!(
            r#"<polyline fill="none" stroke="{color}" stroke-width="{width}"{dashes} points="{points}"/>"#
        ));
    }

    /// Draws a dot of `radius` pixels.
    pub fn dot(&mut self, (x, y): Point, color: Color, radius: f64) {
        let (x, y, color) = (number(x), number(y), hex(color));
        self.put(format_args!(r#"<circle cx="{x}" cy="{y}" r="{radius}" fill="{color}"/>"#));
    }

    /// Fills the area inside `outline`.
    pub fn fill(&mut self, outline: &[Point], color: Color) {
        let (points, color) = (coordinates(outline), hex(color));
        self.put(format_args!(r#"<polygon fill="{color}" points="{points}"/>"#));
    }

    /// Draws text of `size` pixels at `point`. A white outline keeps it legible on lines.
    pub fn text(&mut self, text: &str, (x, y): Point, size: f64, anchor: Anchor) {
        /// The distance from the middle of the letters to the baseline, as a multiple of the text's size.
        const TO_BASELINE: f64 = 0.32;
        let side = match anchor {
            Anchor::Left => "start",
            Anchor::Center | Anchor::Upwards => "middle",
            Anchor::Right => "end",
        };
        let is_upwards = anchor == Anchor::Upwards;
        let turn = format!(r#" transform="rotate(-90 {} {})""#, number(x), number(y));
        self.put(format_args!(
            r##"<text x="{}" y="{}" font-size="{size}" text-anchor="{side}" fill="{}" stroke="#FFFFFF" stroke-width="3"{}>{}</text>"##,
            number(x),
            number(y + TO_BASELINE * size),
            hex(INK),
            if is_upwards { &turn } else { "" },
            escaped(text)
        ));
    }
}

/// Returns the distance between two points \[px\].
pub fn distance(a: Point, b: Point) -> f64 {
    (b.0 - a.0).hypot(b.1 - a.1)
}

fn hex([red, green, blue]: Color) -> String {
    format!("#{red:02X}{green:02X}{blue:02X}")
}

fn coordinates(points: &[Point]) -> String {
    let pair = |(x, y): &Point| format!("{},{}", number(*x), number(*y));
    points.iter().map(pair).collect::<Vec<_>>().join(" ")
}

/// Rounds a coordinate to a tenth of a pixel. Replaces values that are far off the sheet, or not finite, by values that renderers
/// accept.
fn number(value: f64) -> f64 {
    const FAR: f64 = 1e6;
    if value.is_nan() { 0.0 } else { (10.0 * value.clamp(-FAR, FAR)).round() / 10.0 + 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sheet_is_well_formed_for_any_content() {
        let mut canvas = Canvas::default();
        canvas.text("a<b & c\u{0}>\"d\"", (1.0, 2.0), 10.0, Anchor::Upwards);
        canvas.line(&[(f64::NAN, 0.06), (f64::INFINITY, -1e300)], INK, 1.0, Line::Dashed);
        let svg = canvas.finish(100.9, 50.0, Some(2.0));
        let document = roxmltree::Document::parse(&svg).unwrap();
        let find = |name: &str| document.descendants().find(|node| node.has_tag_name(name)).unwrap();
        assert_eq!(find("text").text(), Some("a<b & c\u{fffd}>\"d\""));
        assert_eq!(find("polyline").attribute("points"), Some("0,0.1 1000000,-1000000"));
        assert_eq!(
            (find("svg").attribute("width"), find("svg").attribute("height")),
            (Some("2.000in"), Some("1.000in"))
        );
    }
}
