//! What every figure has in common: colours, sizes, the font.

use crate::control::Law;
use plotters::style::RGBColor;

/// Text and axes.
pub const INK: RGBColor = RGBColor(34, 34, 34);
/// Grid lines and the far edges of boxes.
pub const FAINT: RGBColor = RGBColor(218, 218, 218);

/// Lines at limits and thresholds.
pub const LIMIT: RGBColor = RGBColor(150, 150, 150);

/// One colour for each law everywhere: what is fed back has a hue (Okabe & Ito, for colour-blind readers too), and the
/// laws with one that the reference does not have are paler.
pub fn law_color(law: Law) -> RGBColor {
    match law {
        Law::Diffc => RGBColor(0, 114, 178),
        Law::DiffcInverse => RGBColor(110, 175, 220),
        Law::Lq => RGBColor(20, 60, 110),
        Law::Logc => RGBColor(213, 94, 0),
        Law::LogcTranspose => RGBColor(245, 170, 120),
        Law::PredefinedTime => RGBColor(130, 50, 10),
        Law::DoubleGeodesic => RGBColor(0, 158, 115),
        Law::DoubleGeodesicTranspose => RGBColor(120, 205, 175),
        Law::UnitQuaternion => RGBColor(117, 80, 170),
        Law::UnitQuaternionTranspose => RGBColor(190, 165, 220),
        Law::HInfinity => RGBColor(70, 40, 110),
    }
}

/// Colours of components, none of them a law's.
pub const COMPONENTS: [RGBColor; 4] =
    [RGBColor(34, 34, 34), RGBColor(170, 51, 119), RGBColor(230, 159, 0), RGBColor(86, 180, 233)];

/// The axes x, y, z of a frame, as everywhere in robotics.
pub const AXES: [RGBColor; 3] = [RGBColor(214, 39, 40), RGBColor(44, 140, 44), RGBColor(40, 60, 200)];

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
