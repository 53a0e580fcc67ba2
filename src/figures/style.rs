//! The common style of all figures: colors, sizes and the font.

use super::colors::Color;

/// The color of text and axes.
pub const INK: Color = [34, 34, 34];
/// The color of the sheet.
pub const WHITE: Color = [255, 255, 255];
/// The color of grid lines and the far edges of boxes.
pub const FAINT: Color = [218, 218, 218];
/// The color of lines at limits and thresholds.
pub const LIMIT: Color = [150, 150, 150];

/// The font Ubuntu Light, for PNG. In an SVG, text has the sans-serif font of the viewing program.
pub const FONT_FILE: &[u8] = epaint_default_fonts::UBUNTU_LIGHT;
/// The name of the font's family.
pub const FONT_FAMILY: &str = "Ubuntu";

/// The size of titles \[px\].
pub const TITLE: f64 = 13.7;
/// The size of axis labels and legends \[px\].
pub const LABEL: f64 = 10.5;
/// The size of tick labels \[px\].
pub const TICK: f64 = 9.3;

/// Returns the approximate width of a text of `size` pixels \[px\].
pub fn text_width(text: &str, size: f64) -> f64 {
    0.6 * size * text.chars().count() as f64
}
