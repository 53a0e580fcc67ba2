//! The colours of laws, components and axes, the same in figures, in RViz and in the browser.

use dq_kinematics::control::Law;

/// Red, green, blue, of 255.
pub type Color = [u8; 3];

/// The colours of the laws that are built in, in their order: what is fed back has a hue (Okabe & Ito, for colour-blind readers too), and
/// the laws with one that the reference does not have are paler.
const LAWS: [Color; Law::ALL.len()] = [
    [0, 114, 178],
    [110, 175, 220],
    [213, 94, 0],
    [245, 170, 120],
    [0, 158, 115],
    [120, 205, 175],
    [117, 80, 170],
    [190, 165, 220],
    [20, 60, 110],
    [70, 40, 110],
    [130, 50, 10],
    [170, 20, 60],
];

/// Those of laws that a program has registered, one after the other.
const OTHERS: [Color; 5] = [[204, 60, 140], [150, 150, 0], [0, 150, 170], [90, 60, 40], [230, 159, 0]];

/// One colour for each law everywhere.
pub fn law_color(law: Law) -> Color {
    let number = law.number();
    LAWS.get(number).copied().unwrap_or_else(|| OTHERS[(number - LAWS.len()) % OTHERS.len()])
}

/// Colours of components, none of them a law's.
pub const COMPONENTS: [Color; 4] = [[34, 34, 34], [170, 51, 119], [230, 159, 0], [86, 180, 233]];

/// The axes x, y, z of a frame, as everywhere in robotics.
pub const AXES: [Color; 3] = [[214, 39, 40], [44, 140, 44], [40, 60, 200]];
