//! The colours of laws, components and axes, the same in figures, in RViz and in the browser.

use crate::control::Law;

/// Red, green, blue, of 255.
pub type Color = [u8; 3];

/// One colour for each law everywhere: what is fed back has a hue (Okabe & Ito, for colour-blind readers too), and the
/// laws with one that the reference does not have are paler.
pub const fn law_color(law: Law) -> Color {
    match law {
        Law::Diffc => [0, 114, 178],
        Law::DiffcInverse => [110, 175, 220],
        Law::Lq => [20, 60, 110],
        Law::Logc => [213, 94, 0],
        Law::LogcTranspose => [245, 170, 120],
        Law::PredefinedTime => [130, 50, 10],
        Law::DoubleGeodesic => [0, 158, 115],
        Law::DoubleGeodesicTranspose => [120, 205, 175],
        Law::UnitQuaternion => [117, 80, 170],
        Law::UnitQuaternionTranspose => [190, 165, 220],
        Law::HInfinity => [70, 40, 110],
    }
}

/// Colours of components, none of them a law's.
#[cfg(feature = "tools")]
pub const COMPONENTS: [Color; 4] = [[34, 34, 34], [170, 51, 119], [230, 159, 0], [86, 180, 233]];

/// The axes x, y, z of a frame, as everywhere in robotics.
pub const AXES: [Color; 3] = [[214, 39, 40], [44, 140, 44], [40, 60, 200]];
