//! What every figure has in common: colours, sizes, the font.

use super::colors::Color;

/// Text and axes.
pub const INK: Color = [34, 34, 34];
/// Grid lines and the far edges of boxes.
pub const FAINT: Color = [218, 218, 218];
/// Lines at limits and thresholds.
pub const LIMIT: Color = [150, 150, 150];

/// Ubuntu Light, for PNG; in an SVG the text is sans-serif of the reader's program.
pub const FONT_FILE: &[u8] = epaint_default_fonts::UBUNTU_LIGHT;
/// Its family.
pub const FONT_FAMILY: &str = "Ubuntu";

/// Sizes of text, in the figure's pixels.
pub const TITLE: f64 = 13.7;
/// Of axis labels and legends.
pub const LABEL: f64 = 10.5;
/// Of the numbers at the ticks.
pub const TICK: f64 = 9.3;

/// About how wide a text of `size` pixels is \[px\].
pub fn text_width(text: &str, size: f64) -> f64 {
    0.6 * size * text.chars().count() as f64
}
