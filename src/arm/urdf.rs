//! A chain as a URDF document, so that RViz and other tools can show it.

use super::Chain;
use crate::dq::UnitDualQuaternion;
use nalgebra::{UnitQuaternion, Vector3};
use std::fmt::Write;

/// Frames that are nearer to each other than this \[m\] coincide.
const SHORTEST_LINK: f64 = 1e-6;

/// Radius of the first limb by the arm's reach, and what is left of it at the tool: arms are stout at their foot.
const STOUTNESS: f64 = 0.04;
const TAPER: f64 = 0.45;

/// The URDF of `chain`: links `base`, then `links` (one a joint), then `tool`. Each link is drawn as the housing of its joint, a drum
/// about the joint's axis, and a limb to the next joint. The joints are continuous, since the chain states no bounds.
pub fn urdf(
    chain: &Chain,
    name: &str,
    joints: &[String],
    base: &str,
    links: &[String],
    tool: &str,
) -> String {
    let (name, base, tool) = (&escaped(name), escaped(base), &escaped(tool));
    let escape = |names: &[String]| names.iter().map(|name| escaped(name)).collect::<Vec<_>>();
    let (joints, links, base) = (escape(joints), &escape(links), base.as_str());
    let (before_joint, last_link_from_tool) = (&chain.parent_from_joint(), &chain.last_link_from_tool());
    let parents = std::iter::once(base).chain(links.iter().map(String::as_str));
    let ends = before_joint.iter().chain([last_link_from_tool]);
    let mut text = format!("<?xml version=\"1.0\"?>\n<robot name=\"{name}\">\n{MATERIALS}");
    let radius = |i: usize| {
        let part = i as f64 / links.len().max(1) as f64;
        STOUTNESS * chain.reach() * (1.0 - (1.0 - TAPER) * part)
    };
    for (i, (link, end)) in parents.clone().zip(ends).enumerate() {
        push_link(&mut text, link, end, radius(i));
    }
    let flange =
        visual(&UnitDualQuaternion::identity(), radius(links.len()), 0.4 * radius(links.len()), "joint");
    let _ = writeln!(text, "  <link name=\"{tool}\">\n{flange}  </link>");
    for (((joint, parent), child), origin) in joints.iter().zip(parents).zip(links).zip(before_joint) {
        let _ = writeln!(
            text,
            "  <joint name=\"{joint}\" type=\"continuous\">\n    <parent link=\"{parent}\"/>\n    <child link=\"{child}\"/>\n    \
             {}\n    <axis xyz=\"0 0 1\"/>\n  </joint>",
            origin_element(origin)
        );
    }
    let last = links.last().map_or(base, String::as_str);
    let _ = writeln!(
        text,
        "  <joint name=\"{tool}_fixed\" type=\"fixed\">\n    <parent link=\"{last}\"/>\n    <child link=\"{tool}\"/>\n    {}\n  </joint>\n</robot>",
        origin_element(last_link_from_tool)
    );
    text
}

/// `<origin xyz rpy>`: URDF's roll-pitch-yaw is Rz(yaw) Ry(pitch) Rx(roll), as nalgebra's Euler angles are.
fn origin_element(transform: &UnitDualQuaternion) -> String {
    let (t, (roll, pitch, yaw)) = (transform.translation(), transform.rotation().euler_angles());
    format!("<origin xyz=\"{} {} {}\" rpy=\"{roll} {pitch} {yaw}\"/>", t.x, t.y, t.z)
}

/// The colours of limbs and joints.
const MATERIALS: &str = "  <material name=\"limb\"><color rgba=\"0.86 0.87 0.89 1\"/></material>\n  \
                         <material name=\"joint\"><color rgba=\"0.25 0.33 0.42 1\"/></material>\n";

/// A link with the housing of its joint, and a limb of that radius \[m\] from its frame to `end` where the two do not coincide.
fn push_link(text: &mut String, link: &str, end: &UnitDualQuaternion, radius: f64) {
    let housing = visual(&UnitDualQuaternion::identity(), 1.3 * radius, 2.8 * radius, "joint");
    let limb = limb(&end.translation(), radius).unwrap_or_default();
    let _ = writeln!(text, "  <link name=\"{link}\">\n{housing}{limb}  </link>");
}

/// A cylinder from the frame to `end`.
fn limb(end: &Vector3<f64>, radius: f64) -> Option<String> {
    let length = end.norm();
    if length < SHORTEST_LINK {
        return None;
    }
    // None for opposite vectors: any half turn about a horizontal axis takes z to -z.
    let turn = UnitQuaternion::rotation_between(&Vector3::z(), end)
        .unwrap_or_else(|| UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI));
    Some(visual(&UnitDualQuaternion::from_parts(turn, 0.5 * end), radius, length, "limb"))
}

/// A cylinder about z, with its middle at `origin`.
fn visual(origin: &UnitDualQuaternion, radius: f64, length: f64, material: &str) -> String {
    format!(
        "    <visual>\n      {}\n      <geometry><cylinder radius=\"{radius}\" length=\"{length}\"/></geometry>\n      \
         <material name=\"{material}\"/>\n    </visual>\n",
        origin_element(origin)
    )
}

/// Text as it stands between quotes in XML.
fn escaped(text: &str) -> String {
    text.chars().fold(String::new(), |mut out, character| {
        match character {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            // XML has no way to write most of these.
            control if control.is_control() => out.push(char::REPLACEMENT_CHARACTER),
            other => out.push(other),
        }
        out
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::arm::{Convention, DhRow};
    use nalgebra::Rotation3;

    /// The limbs of the document: length, and where their two ends are in the link's frame.
    fn limbs(document: &str) -> Vec<(f64, [Vector3<f64>; 2])> {
        let numbers = |text: &str, key: &str| -> Vec<f64> {
            let (_, rest) = text.split_once(&format!("{key}=\"")).unwrap();
            rest.split('"').next().unwrap().split(' ').map(|number| number.parse().unwrap()).collect()
        };
        let limbs =
            document.split("<visual>").skip(1).filter(|visual| visual.contains("material name=\"limb\""));
        let each = limbs.map(|visual| {
            let (xyz, rpy) = (Vector3::from_vec(numbers(visual, "xyz")), numbers(visual, "rpy"));
            let length = numbers(visual, "length")[0];
            let half = Rotation3::from_euler_angles(rpy[0], rpy[1], rpy[2]) * Vector3::z() * (length / 2.0);
            (length, [xyz - half, xyz + half])
        });
        each.collect()
    }

    #[test]
    fn a_limb_reaches_from_its_frame_to_the_next_and_is_not_there_where_they_coincide() {
        let row = |a, d| DhRow { a, alpha: 0.0, d, theta_offset: 0.0 };
        let chain = Chain::new(
            Convention::ModifiedDh,
            &[row(0.0, 0.0), row(0.0, -0.5), row(0.0, 0.25), row(0.3, 0.0)],
        );
        let names: Vec<_> = (1..=4).map(|i| format!("n{i}")).collect();
        let document = urdf(&chain.unwrap(), "robot", &names, "base", &names, "tool");
        let limbs = limbs(&document);
        let expected = [
            (0.5, Vector3::new(0.0, 0.0, -0.5)),
            (0.25, Vector3::new(0.0, 0.0, 0.25)),
            (0.3, Vector3::new(0.3, 0.0, 0.0)),
        ];
        assert_eq!(limbs.len(), expected.len(), "{document}");
        for ((length, [from, to]), (expected_length, end)) in limbs.iter().zip(expected) {
            assert!((length - expected_length).abs() < 1e-12);
            assert!(from.norm() < 1e-12 && (to - end).norm() < 1e-12, "{from} {to} {end}");
        }
        // One for each link, the base among them, and the flange.
        assert_eq!(document.matches("<material name=\"joint\"/>").count(), 6, "{document}");
    }

    #[test]
    fn names_are_escaped() {
        assert_eq!(escaped("a\"<&>\u{1}é'"), "a&quot;&lt;&amp;&gt;\u{fffd}é'");
    }
}
