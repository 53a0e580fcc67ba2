//! A sheet to draw on in units of pixels, written as SVG and as PNG.

use super::DrawError;
use super::style::{FONT, FONT_FAMILY, FONT_FILE, INK};
use plotters::backend::SVGBackend;
use plotters::coord::Shift;
use plotters::element::{Circle, PathElement, Polygon, Text};
use plotters::prelude::{DrawingArea, IntoDrawingArea};
use plotters::style::text_anchor::{HPos, Pos, VPos};
use plotters::style::{
    Color, FontStyle, FontTransform, IntoFont, RGBColor, ShapeStyle, WHITE, register_font,
};
use resvg::{tiny_skia, usvg};
use std::io::ErrorKind;
use std::path::Path;
use std::sync::{Arc, Once};

/// The backend's coordinates are whole numbers: it draws this many times larger, and the SVG is scaled back.
const FINENESS: f64 = 10.0;

/// A PNG has this many pixels for one of the figure's.
const PNG_SCALE: f32 = 2.0;

/// What makes text legible where it stands on lines: a white edge 3 px wide, in the backend's units.
const HALO: &str = r##"paint-order="stroke" stroke="#FFFFFF" stroke-width="30" stroke-linejoin="round""##;

/// A point on the sheet: from the left and from the top [px].
pub type Point = (f64, f64);

/// How a line is drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Line {
    /// The line is drawn through.
    Solid,
    /// The line is drawn with gaps.
    Dashed,
    /// The points are drawn as dots, without a line.
    Dots,
}

/// Where text stands relative to its point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Anchor {
    /// The text begins at the point.
    Left,
    /// The text has its middle at the point.
    Center,
    /// The text ends at the point.
    Right,
    /// The text has its middle at the point and reads upwards.
    Upwards,
}

/// A drawn figure.
#[derive(Clone, Debug, PartialEq)]
pub struct Figure {
    /// The figure's file name without ending.
    pub name: String,
    /// The drawing as SVG.
    pub svg: String,
    /// The numbers that it shows.
    pub data: serde_json::Value,
}

/// A sheet being drawn on.
pub struct Canvas<'a> {
    area: DrawingArea<SVGBackend<'a>, Shift>,
}

/// Draws a figure of `width` × `height` pixels.
///
/// # Errors
/// [`DrawError::Drawing`].
pub fn draw(
    name: &str,
    data: serde_json::Value,
    (width, height): (u32, u32),
    paint: impl FnOnce(&Canvas) -> Result<(), DrawError>,
) -> Result<Figure, DrawError> {
    static FONT_KNOWN: Once = Once::new();
    FONT_KNOWN.call_once(|| {
        // A font that cannot be read shows at the first text.
        let _ = register_font(FONT, FontStyle::Normal, FONT_FILE);
    });
    let scale = FINENESS as u32;
    let mut svg = String::new();
    let canvas = Canvas {
        area: SVGBackend::with_string(&mut svg, (width * scale, height * scale)).into_drawing_area(),
    };
    canvas.area.fill(&WHITE).map_err(drawing)?;
    paint(&canvas)?;
    canvas.area.present().map_err(drawing)?;
    drop(canvas);
    let large = format!("width=\"{}\" height=\"{}\"", width * scale, height * scale);
    let svg = svg.replacen(&large, &format!("width=\"{width}\" height=\"{height}\""), 1);
    let svg = svg.replace("<text ", &format!("<text {HALO} "));
    Ok(Figure { name: name.to_owned(), svg, data })
}

impl Canvas<'_> {
    /// A line through `points`, `width` pixels wide.
    ///
    /// # Errors
    /// [`DrawError::Drawing`], as all that draws.
    pub fn line(&self, points: &[Point], color: RGBColor, width: f64, line: Line) -> Result<(), DrawError> {
        let style = stroke(color, width);
        match line {
            Line::Solid => self.path(points, style),
            Line::Dashed if length(points) > LONGEST_DASHED => self.path(points, style),
            Line::Dashed => dashes(points).iter().try_for_each(|dash| self.path(dash, style)),
            Line::Dots => points.iter().try_for_each(|point| self.dot(*point, color, DOT)),
        }
    }

    fn path(&self, points: &[Point], style: ShapeStyle) -> Result<(), DrawError> {
        let path: Vec<_> = points.iter().map(|point| fine(*point)).collect();
        self.area.draw(&PathElement::new(path, style)).map_err(drawing)
    }

    /// A dot of `radius` pixels.
    pub fn dot(&self, point: Point, color: RGBColor, radius: f64) -> Result<(), DrawError> {
        self.area.draw(&Circle::new(fine(point), (radius * FINENESS) as i32, color.filled())).map_err(drawing)
    }

    /// A filled area.
    pub fn fill(&self, outline: &[Point], color: RGBColor) -> Result<(), DrawError> {
        let outline: Vec<_> = outline.iter().map(|point| fine(*point)).collect();
        self.area.draw(&Polygon::new(outline, color.filled())).map_err(drawing)
    }

    /// Text of `size` pixels at `point`.
    pub fn text(&self, text: &str, point: Point, size: f64, anchor: Anchor) -> Result<(), DrawError> {
        let horizontal = match anchor {
            Anchor::Left => HPos::Left,
            Anchor::Center | Anchor::Upwards => HPos::Center,
            Anchor::Right => HPos::Right,
        };
        let font = (FONT, size * FINENESS).into_font();
        let font = if anchor == Anchor::Upwards { font.transform(FontTransform::Rotate270) } else { font };
        let style = font.color(&INK).pos(Pos::new(horizontal, VPos::Center));
        self.area.draw(&Text::new(text.to_owned(), fine(point), style)).map_err(drawing)
    }
}

impl Figure {
    /// Writes `<name>.svg` and `<name>.png` into `folder`.
    ///
    /// # Errors
    /// [`DrawError::Output`], [`DrawError::Drawing`].
    pub fn save(&self, folder: &Path) -> Result<(), DrawError> {
        write(&folder.join(format!("{}.svg", self.name)), self.svg.as_bytes())?;
        write(&folder.join(format!("{}.png", self.name)), &self.png()?)
    }

    /// The drawing in pixels, with the built-in font.
    ///
    /// # Errors
    /// [`DrawError::Drawing`].
    pub fn png(&self) -> Result<Vec<u8>, DrawError> {
        let mut fonts = usvg::fontdb::Database::new();
        fonts.load_font_data(FONT_FILE.to_vec());
        fonts.set_sans_serif_family(FONT_FAMILY);
        let options = usvg::Options { fontdb: Arc::new(fonts), ..usvg::Options::default() };
        let tree = usvg::Tree::from_str(&self.svg, &options).map_err(drawing)?;
        let size = tree.size().to_int_size().scale_by(PNG_SCALE).ok_or_else(|| drawing("no size"))?;
        let mut pixels =
            tiny_skia::Pixmap::new(size.width(), size.height()).ok_or_else(|| drawing("no size"))?;
        let scale = tiny_skia::Transform::from_scale(PNG_SCALE, PNG_SCALE);
        resvg::render(&tree, scale, &mut pixels.as_mut());
        pixels.encode_png().map_err(drawing)
    }
}

fn fine((x, y): Point) -> (i32, i32) {
    ((x * FINENESS).round() as i32, (y * FINENESS).round() as i32)
}

fn stroke(color: RGBColor, width: f64) -> ShapeStyle {
    color.stroke_width((width * FINENESS).round() as u32)
}

/// Writes a file at once: there is the whole one or what was there before.
///
/// # Errors
/// [`DrawError::Output`].
pub fn write(path: &Path, content: &[u8]) -> Result<(), DrawError> {
    let mut draft = path.as_os_str().to_owned();
    draft.push(".new");
    let written = std::fs::write(&draft, content).and_then(|()| std::fs::rename(&draft, path));
    written.map_err(|why| {
        // It may not be there, and what is said is why.
        let _ = std::fs::remove_file(&draft);
        DrawError::Output { file: path.display().to_string(), why: why.to_string() }
    })
}

/// Makes a folder if it is not there.
///
/// # Errors
/// [`DrawError::Output`].
pub fn make_folder(folder: &Path) -> Result<(), DrawError> {
    std::fs::create_dir_all(folder).map_err(|why| {
        let is_file = why.kind() == ErrorKind::AlreadyExists;
        let why = if is_file { "it is no folder".to_owned() } else { why.to_string() };
        DrawError::Output { file: folder.display().to_string(), why }
    })
}

/// Writes every figure into `folder`, which is made if it is not there.
///
/// # Errors
/// [`DrawError`].
pub fn save(figures: &[Figure], folder: &Path) -> Result<(), DrawError> {
    make_folder(folder)?;
    figures.iter().try_for_each(|figure| figure.save(folder))
}

fn drawing(why: impl std::fmt::Display) -> DrawError {
    DrawError::Drawing(why.to_string())
}

/// Radius of the dots of a dotted line [px].
const DOT: f64 = 2.1;

/// Dashes and gaps [px].
const DASH: f64 = 6.0;
const GAP: f64 = 4.0;

/// A line that is longer goes over its whole panel, and nobody sees its dashes [px]: it is drawn through.
const LONGEST_DASHED: f64 = 20_000.0;

fn length(points: &[Point]) -> f64 {
    points.windows(2).map(|ends| (ends[1].0 - ends[0].0).hypot(ends[1].1 - ends[0].1)).sum()
}

/// The dashes of a line through `points`.
fn dashes(points: &[Point]) -> Vec<Vec<Point>> {
    let mut dashes = Vec::new();
    let (mut dash, mut left, mut drawing) = (Vec::new(), DASH, true);
    for pair in points.windows(2) {
        let (mut from, to) = (pair[0], pair[1]);
        if drawing && dash.is_empty() {
            dash.push(from);
        }
        loop {
            let length = (to.0 - from.0).hypot(to.1 - from.1);
            if length < left {
                left -= length;
                if drawing && length > 0.0 {
                    dash.push(to);
                }
                break;
            }
            let part = left / length;
            from = (from.0 + part * (to.0 - from.0), from.1 + part * (to.1 - from.1));
            dash.push(from);
            if drawing {
                dashes.push(std::mem::take(&mut dash));
            }
            drawing = !drawing;
            left = if drawing { DASH } else { GAP };
        }
    }
    if dash.len() > 1 {
        dashes.push(dash);
    }
    dashes
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dashes_cover_their_part_of_a_line_and_stay_on_it() {
        let points: Vec<_> = (0..=100).map(|i| (f64::from(i), 2.0)).collect();
        let dashes = dashes(&points);
        let drawn: f64 = dashes.iter().map(|dash| dash[dash.len() - 1].0 - dash[0].0).sum();
        assert!((drawn - 60.0).abs() < 1e-9 && dashes.len() == 10, "{drawn}");
        assert!(dashes.iter().flatten().all(|(x, y)| (0.0..=100.0).contains(x) && *y == 2.0));
    }
}
