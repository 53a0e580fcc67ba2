//! A figure: panels or scenes on a sheet, as SVG and PNG.

use super::DrawError;
use super::canvas::{Anchor, Canvas, Rectangle};
use super::chart::Panel;
use super::ends::Names;
use super::files::{make_folder, write};
use super::legend::{Legend, entries, is_same};
use super::series::Series;
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
        /// The width of a column of an IEEE paper, 3.4 in. Text has 8 pt, and there is no title.
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
            Self::OneColumn => Some((3.4, 1)),
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

/// Creates a figure of rows of panels under a title.
pub fn chart(name: &str, title: &str, rows: &[Vec<Panel>]) -> Figure {
    let data =
        json!({ "title": title, "panels": rows.iter().flatten().map(Panel::data).collect::<Vec<_>>() });
    Figure::new(name, title, data, rows, View::Panel)
}

/// Creates a figure of rows of scenes under a title.
pub fn scenes(name: &str, title: &str, rows: &[Vec<Scene>]) -> Figure {
    let data =
        json!({ "title": title, "scenes": rows.iter().flatten().map(Scene::data).collect::<Vec<_>>() });
    Figure::new(name, title, data, rows, View::Scene)
}

impl View {
    /// Returns the entries of the legend.
    fn legend(&self) -> Vec<Series> {
        match self {
            Self::Panel(panel) => entries(panel.series.iter().cloned()),
            Self::Scene(scene) => entries(scene.legend().into_iter()),
        }
    }

    fn has_names_at_ends(&self) -> bool {
        matches!(self, Self::Panel(panel) if panel.names_at_ends)
    }

    /// Returns the width of the names at the ends of the curves \[px\].
    fn names_width(&self, names: &Names) -> f64 {
        match self {
            Self::Panel(panel) => panel.names_width(names),
            Self::Scene(_) => 0.0,
        }
    }

    /// Returns the height that the names of marks need in a view of this width \[px\].
    fn band(&self, width: f64) -> f64 {
        match self {
            Self::Panel(panel) => panel.named_marks(width).height(),
            Self::Scene(_) => 0.0,
        }
    }

    fn draw(&self, canvas: &mut Canvas, frame: Rectangle, band: f64, names: &Names) {
        match self {
            Self::Panel(panel) => panel.draw(canvas, frame, band, names),
            Self::Scene(scene) => scene.draw(canvas, frame),
        }
    }
}

impl Figure {
    fn new<V: Clone>(name: &str, title: &str, data: Value, rows: &[Vec<V>], view: fn(V) -> View) -> Self {
        let rows = rows.iter().map(|row| row.iter().cloned().map(view).collect()).collect();
        Self { name: name.to_owned(), data, title: title.to_owned(), rows }
    }

    /// Returns the drawing as SVG. The legend is at the right of panels, but at the top of scenes. If no view has the entries of all
    /// views, each view has its own legend. A drawing for paper has one legend, at the top, and no title.
    pub fn svg(&self, width: Width) -> String {
        let (mut canvas, paper) = (Canvas::default(), width.paper());
        let is_of_scenes = matches!(self.views().next(), Some(View::Scene(_)));
        let mut rows: Vec<Vec<_>> = self.rows.iter().map(|row| row.iter().collect()).collect();
        let (mut wide, mut high) = if is_of_scenes { (500.0, 420.0) } else { (430.0, 260.0) };
        let all = entries(self.views().flat_map(View::legend));
        let names = match paper {
            Some(_) => Names::Letters(all.iter().map(|series| series.name.clone()).collect()),
            None => Names::Full,
        };
        let is_shared = paper.is_some() || self.shares_legend(&all);
        let names_width = self.views().map(|view| view.names_width(&names)).fold(0.0, f64::max);
        let legend_width =
            if is_shared || is_of_scenes { 0.0 } else { Legend::new(all.clone(), (0.0, 0.0), 0.0).right() };
        if let Some((inches, beside)) = paper {
            wide = inches * PAPER / beside as f64;
            rows = rows.concat().chunks(beside).map(<[_]>::to_vec).collect();
        } else {
            wide += names_width;
        }
        let full = wide + legend_width;
        let right = rows.iter().map(Vec::len).max().unwrap_or_default() as f64 * full;
        let shown = self.shown_in_legend(all, is_shared, paper.is_some());
        let (legend, mut top) = placed_legend(shown, paper.is_some(), is_of_scenes, right);
        let width = match paper {
            Some((inches, _)) => inches * PAPER,
            None => legend.right().max(right).max(28.0 + text_width(&self.title, TITLE)),
        };
        let bands: Vec<_> = rows
            .iter()
            .map(|row| row.iter().map(|view| view.band(wide - names_width)).fold(0.0, f64::max))
            .collect();
        if paper.is_some() {
            // At most so high that all rows fit on a page.
            high = (if is_of_scenes { 0.75 } else { 0.55 } * wide)
                .min((PAGE - top - bands.iter().sum::<f64>()) / rows.len() as f64);
        } else {
            canvas.text(&self.title, (14.0, 24.0), TITLE, Anchor::Left);
        }
        legend.draw(&mut canvas);
        for (row, band) in rows.iter().zip(bands) {
            for (column, view) in row.iter().enumerate() {
                let frame = Rectangle { left: column as f64 * full, top, width: wide, height: high + band };
                view.draw(&mut canvas, frame, band, &names);
                if !is_shared {
                    let start = if is_of_scenes {
                        (frame.left + 18.0, top + 32.0)
                    } else {
                        (frame.right(), top + 34.0)
                    };
                    Legend::new(view.legend(), start, 0.0).draw(&mut canvas);
                }
            }
            top += high + band;
        }
        canvas.finish(width, top, paper.map(|(inches, _)| inches))
    }

    fn views(&self) -> impl Iterator<Item = &View> {
        self.rows.iter().flatten()
    }

    /// Returns whether the figure has one legend for all views. This is the case if one of the views has all entries.
    fn shares_legend(&self, all: &[Series]) -> bool {
        self.views().any(|view| all.iter().all(|entry| view.legend().iter().any(|its| is_same(its, entry))))
    }

    /// Returns the entries of the shared legend. `all` are the entries of all views. Returns an empty list if the views share no legend.
    ///
    /// If curves are named at their ends, a screen needs no legend. On paper, letters mark the ends, and the legend explains the
    /// letters.
    fn shown_in_legend(&self, all: Vec<Series>, is_shared: bool, is_on_paper: bool) -> Vec<Series> {
        let has_names = self.views().any(View::has_names_at_ends);
        match (is_shared, has_names, is_on_paper) {
            (false, ..) | (_, true, false) => Vec::new(),
            (true, false, _) => all,
            (true, true, true) => {
                let lettered = |(index, series): (usize, Series)| {
                    let name = format!("{} {}", Names::letter(index), series.name);
                    Series { name, ..series }
                };
                all.into_iter().enumerate().map(lettered).collect()
            }
        }
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

/// Returns the legend that all views share, and the top of the first row of views \[px\]. `right` is the right end of the rows.
fn placed_legend(shown: Vec<Series>, is_on_paper: bool, is_of_scenes: bool, right: f64) -> (Legend, f64) {
    if !is_on_paper && !is_of_scenes {
        return (Legend::new(shown, (right + 12.0, 74.0), 0.0), 40.0);
    }
    let legend = Legend::new(shown, if is_on_paper { (10.0, 14.0) } else { (18.0, 54.0) }, right);
    let bottom = legend.bottom;
    (legend, bottom)
}

/// Writes every figure into `folder`. Creates the folder if necessary.
///
/// # Errors
/// [`DrawError`] if a file cannot be drawn or written.
pub fn save(figures: &[Figure], folder: &Path, width: Width) -> Result<(), DrawError> {
    make_folder(folder)?;
    figures.iter().try_for_each(|figure| figure.save(folder, width))
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
