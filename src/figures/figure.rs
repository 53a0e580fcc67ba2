//! A figure: panels or scenes on a sheet, as SVG and PNG.

use super::DrawError;
use super::canvas::{Anchor, Canvas, Point, Rectangle};
use super::chart::{Panel, Series};
use super::files::{make_folder, write};
use super::space::Scene;
use super::style::{FONT_FAMILY, FONT_FILE, LABEL, TITLE, text_width};
use dq_common::named;
use resvg::{tiny_skia, usvg};
use serde_json::{Value, json};
use std::path::Path;
use std::sync::Arc;

named! {
    /// The width of a figure.
    "width" Width {
        /// As wide as the figure's panels, for a screen.
        Screen = "screen",
        /// The width of a column of an IEEE paper, 3.5 in. Text has 8 pt, and there is no title.
        OneColumn = "one-column",
        /// The width of both columns of an IEEE paper, 7.16 in. Text has 8 pt, and there is no title.
        TwoColumns = "two-columns",
    }
}

impl Width {
    /// Returns the width on paper \[in\], and the number of panels in a row; `None` for a screen.
    fn paper(self) -> Option<(f64, usize)> {
        match self {
            Self::Screen => None,
            Self::OneColumn => Some((3.5, 1)),
            Self::TwoColumns => Some((7.16, 2)),
        }
    }
}

/// Number of pixels per inch of paper. Labels have 8 pt, and an inch has 72 pt.
const PAPER: f64 = 72.0 * LABEL / 8.0;

/// The largest height of a figure on paper \[px\]: the height of a page's text without the caption.
const PAGE: f64 = 9.0 * PAPER;

/// A figure.
#[derive(Clone, Debug, PartialEq)]
pub struct Figure {
    /// The file name of the figure without its extension.
    pub name: String,
    /// The data that the figure shows.
    pub data: Value,
    title: String,
    rows: Vec<Vec<View>>,
}

#[derive(Clone, Debug, PartialEq)]
enum View {
    Panel(Panel),
    Scene(Scene),
}

/// Creates a figure of rows of panels under a title. One legend at the right is for all panels.
pub fn chart(name: &str, title: &str, rows: &[Vec<Panel>]) -> Figure {
    let data =
        json!({ "title": title, "panels": rows.iter().flatten().map(Panel::data).collect::<Vec<_>>() });
    Figure::new(name, title, data, rows, View::Panel)
}

/// Creates a figure of rows of scenes under a title. One legend below the title is for all scenes.
pub fn scenes(name: &str, title: &str, rows: &[Vec<Scene>]) -> Figure {
    let data =
        json!({ "title": title, "scenes": rows.iter().flatten().map(Scene::data).collect::<Vec<_>>() });
    Figure::new(name, title, data, rows, View::Scene)
}

impl View {
    fn legend(&self) -> Vec<Series> {
        match self {
            Self::Panel(panel) => panel.series.clone(),
            Self::Scene(scene) => scene.legend(),
        }
    }

    /// Returns the height that the names of marks need in a view of this width \[px\].
    fn band(&self, width: f64) -> f64 {
        match self {
            Self::Panel(panel) => panel.named_marks(width).height(),
            Self::Scene(_) => 0.0,
        }
    }

    fn draw(&self, canvas: &mut Canvas, frame: Rectangle, band: f64) {
        match self {
            Self::Panel(panel) => panel.draw(canvas, frame, band),
            Self::Scene(scene) => scene.draw(canvas, frame),
        }
    }
}

impl Figure {
    fn new<V: Clone>(name: &str, title: &str, data: Value, rows: &[Vec<V>], view: fn(V) -> View) -> Self {
        let rows = rows.iter().map(|row| row.iter().cloned().map(view).collect()).collect();
        Self { name: name.to_owned(), data, title: title.to_owned(), rows }
    }

    /// Returns the drawing as SVG. On a screen, panels have their legend at the right; otherwise the legend is at the top. On paper
    /// there is no title.
    pub fn svg(&self, width: Width) -> String {
        let (mut canvas, paper) = (Canvas::default(), width.paper());
        let is_of_scenes = matches!(self.rows.iter().flatten().next(), Some(View::Scene(_)));
        let mut rows: Vec<Vec<_>> = self.rows.iter().map(|row| row.iter().collect()).collect();
        let (mut wide, mut high) = if is_of_scenes { (500.0, 420.0) } else { (430.0, 260.0) };
        if let Some((inches, beside)) = paper {
            wide = inches * PAPER / beside as f64;
            rows = rows.concat().chunks(beside).map(<[_]>::to_vec).collect();
        }
        let right = rows.iter().map(Vec::len).max().unwrap_or_default() as f64 * wide;
        let (legend, mut top) = match (paper, is_of_scenes) {
            (Some(_), _) => self.legend((10.0, 14.0), right),
            (None, true) => self.legend((18.0, 54.0), right),
            (None, false) => (self.legend((right + 12.0, 74.0), 0.0).0, 40.0),
        };
        let beside = legend.iter().map(|(series, at)| at.0 + entry_width(series)).fold(right, f64::max);
        let width = match paper {
            Some((inches, _)) => inches * PAPER,
            None => beside.max(28.0 + text_width(&self.title, TITLE)),
        };
        let bands: Vec<_> =
            rows.iter().map(|row| row.iter().map(|view| view.band(wide)).fold(0.0, f64::max)).collect();
        if paper.is_some() {
            // At most so high that all rows fit on a page.
            high = (if is_of_scenes { 0.75 } else { 0.55 } * wide)
                .min((PAGE - top - bands.iter().sum::<f64>()) / rows.len() as f64);
        } else {
            canvas.text(&self.title, (14.0, 24.0), TITLE, Anchor::Left);
        }
        legend.iter().for_each(|(series, at)| draw_entry(&mut canvas, series, *at));
        for (row, band) in rows.iter().zip(bands) {
            for (column, view) in row.iter().enumerate() {
                let frame = Rectangle { left: column as f64 * wide, top, width: wide, height: high + band };
                view.draw(&mut canvas, frame, band);
            }
            top += high + band;
        }
        canvas.finish(width, top, paper.map(|(inches, _)| inches))
    }

    /// Returns the entries of the legend with their places, and the vertical position at which the legend ends \[px\]. The legend
    /// begins at `start`, and its lines end before `right`. Curves with the same name and style share one entry.
    fn legend(&self, start: Point, right: f64) -> (Vec<(Series, Point)>, f64) {
        let (mut placed, mut at): (Vec<(Series, Point)>, _) = (Vec::new(), start);
        for series in self.rows.iter().flatten().flat_map(View::legend) {
            let is_known =
                placed.iter().any(|(other, _)| (&other.name, other.line) == (&series.name, series.line));
            if is_known || series.name.is_empty() {
                continue;
            }
            let width = entry_width(&series);
            if at.0 > start.0 && at.0 + width > right {
                at = (start.0, at.1 + 19.0);
            }
            placed.push((series, at));
            at.0 += width;
        }
        (placed, at.1 + 16.0)
    }

    /// Writes `<name>.svg` and `<name>.png` into `folder`.
    ///
    /// # Errors
    /// [`DrawError`] if a file cannot be drawn or written.
    pub fn save(&self, folder: &Path, width: Width) -> Result<(), DrawError> {
        let svg = self.svg(width);
        write(&folder.join(format!("{}.svg", self.name)), svg.as_bytes())?;
        write(&folder.join(format!("{}.png", self.name)), &png(&svg, width)?)
    }
}

/// Writes every figure into `folder`. Creates the folder if necessary.
///
/// # Errors
/// [`DrawError`] if a file cannot be drawn or written.
pub fn save(figures: &[Figure], folder: &Path, width: Width) -> Result<(), DrawError> {
    make_folder(folder)?;
    figures.iter().try_for_each(|figure| figure.save(folder, width))
}

fn draw_entry(canvas: &mut Canvas, series: &Series, (left, y): Point) {
    let sample: Vec<_> = (0..=3).map(|k| (left + 8.0 * f64::from(k), y)).collect();
    canvas.line(&sample, series.color, 2.0, series.line);
    canvas.text(&series.name, (left + 32.0, y), LABEL, Anchor::Left);
}

/// Returns the width of an entry of a legend \[px\].
fn entry_width(series: &Series) -> f64 {
    48.0 + text_width(&series.name, LABEL)
}

/// Returns a drawing as PNG with the built-in font. For a screen the PNG has twice the figure's pixels; for paper it has 600 pixels
/// per inch.
///
/// # Errors
/// [`DrawError::Drawing`].
pub fn png(svg: &str, width: Width) -> Result<Vec<u8>, DrawError> {
    let mut fonts = usvg::fontdb::Database::new();
    fonts.load_font_data(FONT_FILE.to_vec());
    fonts.set_sans_serif_family(FONT_FAMILY);
    let options = usvg::Options { fontdb: Arc::new(fonts), ..usvg::Options::default() };
    let tree = usvg::Tree::from_str(svg, &options).map_err(drawing)?;
    let scale = if width == Width::Screen { 2.0 } else { 600.0 / options.dpi };
    let size = tree.size().to_int_size().scale_by(scale).ok_or_else(|| drawing("no size"))?;
    let mut pixels = tiny_skia::Pixmap::new(size.width(), size.height()).ok_or_else(|| drawing("no size"))?;
    resvg::render(&tree, tiny_skia::Transform::from_scale(scale, scale), &mut pixels.as_mut());
    pixels.encode_png().map_err(drawing)
}

fn drawing(why: impl std::fmt::Display) -> DrawError {
    DrawError::Drawing(why.to_string())
}
