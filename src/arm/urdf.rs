//! A chain as a URDF document, so that RViz and other tools can show it.

use super::Chain;
use crate::dq::UnitDualQuaternion;
use nalgebra::{UnitQuaternion, Vector3};
use std::fmt::Write;

/// Frames that are nearer to each other than this \[m\] coincide.
const SHORTEST_LINK: f64 = 1e-6;

/// The URDF of `chain`: links `base`, then `links` (one a joint), then `tool`. Each link is drawn as a thin cylinder to
/// the next joint. The joints are continuous, since the chain states no bounds.
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
    let mut text = format!("<?xml version=\"1.0\"?>\n<robot name=\"{name}\">\n");
    for (link, end) in parents.clone().zip(ends) {
        push_link(&mut text, link, end);
    }
    let _ = writeln!(text, "  <link name=\"{tool}\"/>");
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

/// A link with a cylinder from its frame to `end`, or a bare one where the two coincide.
fn push_link(text: &mut String, link: &str, end: &UnitDualQuaternion) {
    let along = end.translation();
    if along.norm() < SHORTEST_LINK {
        let _ = writeln!(text, "  <link name=\"{link}\"/>");
        return;
    }
    // None for opposite vectors: any half turn about a horizontal axis takes z to -z.
    let turn = UnitQuaternion::rotation_between(&Vector3::z(), &along)
        .unwrap_or_else(|| UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI));
    let visual = origin_element(&UnitDualQuaternion::from_parts(turn, 0.5 * along));
    let _ = writeln!(
        text,
        "  <link name=\"{link}\">\n    <visual>\n      {visual}\n      <geometry><cylinder radius=\"0.03\" length=\"{}\"/></geometry>\n    </visual>\n  </link>",
        along.norm()
    );
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

    /// The cylinders of the document: length, and where their two ends are in the link's frame.
    fn cylinders(document: &str) -> Vec<(f64, [Vector3<f64>; 2])> {
        let numbers = |text: &str, key: &str| -> Vec<f64> {
            let (_, rest) = text.split_once(&format!("{key}=\"")).unwrap();
            rest.split('"').next().unwrap().split(' ').map(|number| number.parse().unwrap()).collect()
        };
        let each = document.split("<visual>").skip(1).map(|visual| {
            let (xyz, rpy) = (Vector3::from_vec(numbers(visual, "xyz")), numbers(visual, "rpy"));
            let length = numbers(visual, "length")[0];
            let half = Rotation3::from_euler_angles(rpy[0], rpy[1], rpy[2]) * Vector3::z() * (length / 2.0);
            (length, [xyz - half, xyz + half])
        });
        each.collect()
    }

    #[test]
    fn a_link_reaches_from_its_frame_to_the_next_and_is_bare_where_they_coincide() {
        let row = |a, d| DhRow { a, alpha: 0.0, d, theta_offset: 0.0 };
        let chain = Chain::new(
            Convention::ModifiedDh,
            &[row(0.0, 0.0), row(0.0, -0.5), row(0.0, 0.25), row(0.3, 0.0)],
        );
        let names: Vec<_> = (1..=4).map(|i| format!("n{i}")).collect();
        let document = urdf(&chain.unwrap(), "robot", &names, "base", &names, "tool");
        let cylinders = cylinders(&document);
        let expected = [
            (0.5, Vector3::new(0.0, 0.0, -0.5)),
            (0.25, Vector3::new(0.0, 0.0, 0.25)),
            (0.3, Vector3::new(0.3, 0.0, 0.0)),
        ];
        assert_eq!(cylinders.len(), expected.len(), "{document}");
        for ((length, [from, to]), (expected_length, end)) in cylinders.iter().zip(expected) {
            assert!((length - expected_length).abs() < 1e-12);
            assert!(from.norm() < 1e-12 && (to - end).norm() < 1e-12, "{from} {to} {end}");
        }
    }

    #[test]
    fn names_are_escaped() {
        assert_eq!(escaped("a\"<&>\u{1}é'"), "a&quot;&lt;&amp;&gt;\u{fffd}é'");
    }
}
