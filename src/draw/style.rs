//! What every figure has in common: colours, sizes, the font.

use crate::colors::{self, Color};
use crate::control::Law;
use plotters::style::RGBColor;

/// Text and axes.
pub const INK: RGBColor = RGBColor(34, 34, 34);
/// Grid lines and the far edges of boxes.
pub const FAINT: RGBColor = RGBColor(218, 218, 218);

/// Lines at limits and thresholds.
pub const LIMIT: RGBColor = RGBColor(150, 150, 150);

/// The colour of a law.
pub fn law_color(law: Law) -> RGBColor {
    rgb(colors::law_color(law))
}

/// Colours of components, none of them a law's.
pub const COMPONENTS: [RGBColor; 4] = {
    let [first, second, third, fourth] = colors::COMPONENTS;
    [rgb(first), rgb(second), rgb(third), rgb(fourth)]
};

/// The axes x, y, z of a frame.
pub const AXES: [RGBColor; 3] = [rgb(colors::AXES[0]), rgb(colors::AXES[1]), rgb(colors::AXES[2])];

const fn rgb([red, green, blue]: Color) -> RGBColor {
    RGBColor(red, green, blue)
}

/// The font: sans-serif, which a reader's program has, and [`FONT_FILE`] where there is none.
pub const FONT: &str = "sans-serif";
/// Ubuntu Light, for measuring text and for PNG.
pub const FONT_FILE: &[u8] = epaint_default_fonts::UBUNTU_LIGHT;
/// Its family.
pub const FONT_FAMILY: &str = "Ubuntu";

/// Sizes of text, in the figure's pixels.
pub const TITLE: f64 = 17.0;
/// Of axis labels and legends.
pub const LABEL: f64 = 13.0;
/// Of the numbers at the ticks.
pub const TICK: f64 = 11.5;

/// About how wide a text of `size` pixels is [px].
pub fn text_width(text: &str, size: f64) -> f64 {
    0.56 * size * text.chars().count() as f64
}
