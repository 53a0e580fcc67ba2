//! A chain as a URDF document, so that RViz and other tools can show it, and a described arm as a short one.

use super::Chain;
use super::description::{DescribedArm, DescribedJoint, JointLimits, Motion};
use crate::dq::UnitDualQuaternion;
use nalgebra::{UnitQuaternion, Vector3};
use std::fmt::Write;

/// Frames that are nearer to each other than this \[m\] coincide.
const SHORTEST_LINK: f64 = 1e-6;

impl DescribedArm {
    /// A chain as a description would have it: links `base`, then `links` (one a joint), then `tool`. The joints are continuous, since
    /// the chain states no bounds.
    pub fn of_chain(
        chain: &Chain,
        robot: &str,
        joints: &[String],
        [base, tool]: [&str; 2],
        links: &[String],
    ) -> Self {
        let parents = std::iter::once(base).chain(links.iter().map(String::as_str));
        let parents = parents.map(str::to_owned).collect::<Vec<_>>();
        let joint = |((name, origin), (parent, child)): ((&String, _), (&String, &String))| {
            described(name, Motion::Continuous, [parent, child], origin)
        };
        let moving = joints.iter().zip(chain.parent_from_joint()).zip(parents.iter().zip(links));
        let last = parents.last().map_or(base, String::as_str);
        let end = described(&format!("{tool}_fixed"), Motion::Fixed, [last, tool], chain.last_link_from_tool());
        Self { robot: robot.to_owned(), joints: moving.map(joint).chain([end]).collect() }
    }

    /// The URDF document of these joints and the links between them, and nothing else: it reads back as the same arm, to the last bit.
    pub fn urdf(&self) -> String {
        let mut text = format!("<robot name=\"{}\">\n", escaped(&self.robot));
        self.joints.iter().take(1).for_each(|joint| push_link(&mut text, &joint.parent, None));
        self.joints.iter().for_each(|joint| push_link(&mut text, &joint.child, None));
        self.joints.iter().for_each(|joint| push_joint(&mut text, joint));
        text + "</robot>\n"
    }

    /// The same to look at: each link is drawn as a thin cylinder to the next joint.
    pub fn drawn_urdf(&self) -> String {
        let mut text = format!("<?xml version=\"1.0\"?>\n<robot name=\"{}\">\n", escaped(&self.robot));
        for joint in &self.joints {
            push_link(&mut text, &joint.parent, Some(joint));
        }
        self.joints.iter().rev().take(1).for_each(|joint| push_link(&mut text, &joint.child, None));
        self.joints.iter().for_each(|joint| push_joint(&mut text, joint));
        text + "</robot>\n"
    }
}

fn described(name: &str, motion: Motion, [parent, child]: [&str; 2], origin: UnitDualQuaternion) -> DescribedJoint {
    let (roll, pitch, yaw) = origin.rotation().euler_angles();
    DescribedJoint {
        name: name.to_owned(),
        motion,
        parent: parent.to_owned(),
        child: child.to_owned(),
        xyz: origin.translation().into(),
        rpy: [roll, pitch, yaw],
        // URDF's default, for one that has none.
        axis: if motion == Motion::Fixed { [1.0, 0.0, 0.0] } else { [0.0, 0.0, 1.0] },
        limits: JointLimits::default(),
    }
}

fn push_joint(text: &mut String, joint: &DescribedJoint) {
    let DescribedJoint { xyz, rpy, axis, limits, .. } = joint;
    let kind = match joint.motion {
        Motion::Fixed => "fixed",
        Motion::Revolute => "revolute",
        Motion::Continuous => "continuous",
        Motion::Prismatic => "prismatic",
    };
    let [name, parent, child] = [&joint.name, &joint.parent, &joint.child].map(|name| escaped(name));
    let numbers = |[x, y, z]: &[f64; 3]| format!("{x} {y} {z}");
    let (xyz, rpy, axis) = (numbers(xyz), numbers(rpy), numbers(axis));
    let _ = write!(
        text,
        "  <joint name=\"{name}\" type=\"{kind}\">\n    <parent link=\"{parent}\"/>\n    <child link=\"{child}\"/>\n    \
         <origin xyz=\"{xyz}\" rpy=\"{rpy}\"/>\n"
    );
    if joint.motion != Motion::Fixed {
        let _ = writeln!(text, "    <axis xyz=\"{axis}\"/>");
    }
    if *limits != JointLimits::default() {
        let named = [
            ("lower", limits.lower),
            ("upper", limits.upper),
            ("velocity", limits.velocity),
            ("acceleration", limits.acceleration),
        ];
        let given = named.into_iter().filter_map(|(name, limit)| Some(format!(" {name}=\"{}\"", limit?)));
        // URDF wants an effort; nobody here does.
        let _ = writeln!(text, "    <limit effort=\"0\"{}/>", given.collect::<String>());
    }
    text.push_str("  </joint>\n");
}

/// `<origin xyz rpy>`: URDF's roll-pitch-yaw is Rz(yaw) Ry(pitch) Rx(roll), as nalgebra's Euler angles are.
fn origin_element(transform: &UnitDualQuaternion) -> String {
    let (t, (roll, pitch, yaw)) = (transform.translation(), transform.rotation().euler_angles());
    format!("<origin xyz=\"{} {} {}\" rpy=\"{roll} {pitch} {yaw}\"/>", t.x, t.y, t.z)
}

/// A link with a cylinder from its frame to where `next` begins, or a bare one where the two coincide or nothing follows.
fn push_link(text: &mut String, link: &str, next: Option<&DescribedJoint>) {
    let (link, along) = (escaped(link), next.map_or_else(Vector3::zeros, |next| Vector3::from(next.xyz)));
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
        let arm = DescribedArm::of_chain(&chain.unwrap(), "robot", &names, ["base", "tool"], &names);
        let document = arm.drawn_urdf();
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
