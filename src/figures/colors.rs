//! The colors of laws, components and axes in figures, in RViz and in the browser.

use super::line::Line;
use dq_kinematics::control::Law;

/// A color as red, green and blue, from 0 to 255.
pub type Color = [u8; 3];

/// The colors and line styles of the built-in laws, in the order of the laws. The hue depends on the error that the law feeds back
/// (Okabe & Ito; color-blind readers can distinguish the hues). Laws with the transpose have dashed lines. Laws with derived gains
/// are darker, and have dotted or dash-dotted lines.
const LAWS: [(Color, Line); Law::ALL.len()] = [
    ([0, 114, 178], Line::Dashed),
    ([110, 175, 220], Line::Solid),
    ([213, 94, 0], Line::Solid),
    ([245, 170, 120], Line::Dashed),
    ([0, 158, 115], Line::Solid),
    ([120, 205, 175], Line::Dashed),
    ([117, 80, 170], Line::Solid),
    ([190, 165, 220], Line::Dashed),
    ([20, 60, 110], Line::Dotted),
    ([70, 40, 110], Line::DashDotted),
    ([130, 50, 10], Line::Dotted),
    ([170, 20, 60], Line::DashDotted),
];

/// The colors of laws that a program has registered, in the order of registration.
const OTHERS: [Color; 5] = [[204, 60, 140], [150, 150, 0], [0, 150, 170], [90, 60, 40], [230, 159, 0]];

/// Returns the color of a law.
pub fn law_color(law: Law) -> Color {
    style(law).0
}

/// Returns the line style of a law. Built-in laws of the same hue have different line styles, so that readers of a print without color
/// can distinguish them.
pub fn law_line(law: Law) -> Line {
    style(law).1
}

fn style(law: Law) -> (Color, Line) {
    let number = law.number();
    LAWS.get(number).copied().unwrap_or_else(|| (OTHERS[(number - LAWS.len()) % OTHERS.len()], Line::Solid))
}

/// The colors of curves that do not stand for a law, such as those of the components of an error. They differ from the colors of
/// the built-in laws.
pub const COMPONENTS: [Color; 4] = [[34, 34, 34], [170, 51, 119], [230, 159, 0], [86, 180, 233]];

/// The colors of a frame's axes x, y and z, as usual in robotics.
pub const AXES: [Color; 3] = [[214, 39, 40], [44, 140, 44], [40, 60, 200]];
