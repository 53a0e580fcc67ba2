//! Writes an arm as a URDF document: with visuals for RViz and other tools, or without visuals.

use super::arm::{DescribedArm, DescribedJoint, JointLimits, Mimic, Motion, angles};
use dq_algebra::UnitDualQuaternion;
use dq_common::text::escaped;
use dq_kinematics::arm::{ArmError, Chain, JointKind};
use nalgebra::{UnitQuaternion, Vector3};
use std::fmt::Write;

/// Two frames within this distance coincide \[m\].
const SHORTEST_LINK: f64 = 1e-6;

/// The radius of the first limb as a fraction of the arm's reach. A limb is the cylinder that is drawn from one joint to the next.
const STOUTNESS: f64 = 0.04;
/// The radius at the tool as a fraction of the first limb's radius. From limb to limb, the radius decreases in equal steps.
const TAPER: f64 = 0.45;

impl DescribedArm {
    /// Converts a chain to a description with the links `base`, `links` (one per joint) and `tool`. A chain has no limits: its
    /// joints are continuous or prismatic until [`with_limits`](Self::with_limits) sets limits.
    ///
    /// # Errors
    /// [`ArmError::OnePerJoint`] if the number of joint names or link names differs from the number of joints.
    pub fn of_chain(
        chain: &Chain,
        robot: &str,
        joints: &[String],
        [base, tool]: [&str; 2],
        links: &[String],
    ) -> Result<Self, ArmError> {
        let expected = chain.joint_count();
        for (what, names) in [("joint names", joints), ("link names", links)] {
            if names.len() != expected {
                return Err(ArmError::OnePerJoint { what, expected, got: names.len() });
            }
        }
        let parents = std::iter::once(base).chain(links.iter().map(String::as_str));
        let parents = parents.map(str::to_owned).collect::<Vec<_>>();
        let joint =
            |((name, (kind, origin)), (parent, child)): ((&String, (&JointKind, _)), (&String, &String))| {
                let motion = match kind {
                    JointKind::Revolute => Motion::Continuous,
                    JointKind::Prismatic => Motion::Prismatic,
                };
                described(name, motion, [parent, child], origin)
            };
        let frames = chain.kinds().iter().zip(chain.parent_from_joint());
        let moving = joints.iter().zip(frames).zip(parents.iter().zip(links));
        let last = parents.last().map_or(base, String::as_str);
        let end =
            described(&format!("{tool}_fixed"), Motion::Fixed, [last, tool], chain.last_link_from_tool());
        let joints = moving.map(joint).chain([end]).collect();
        Ok(Self { robot: robot.to_owned(), joints, drivers: Vec::new() })
    }

    /// Returns the URDF document of the arm: its joints and the links between them. Reading the document gives exactly the same
    /// arm.
    pub fn urdf(&self) -> String {
        let mut text = format!("<robot name=\"{}\">\n", escaped(&self.robot));
        self.joints.iter().take(1).for_each(|joint| push_bare_link(&mut text, &joint.parent));
        let joints = self.joints.iter().chain(&self.drivers);
        joints.clone().for_each(|joint| push_bare_link(&mut text, &joint.child));
        joints.for_each(|joint| push_joint(&mut text, joint));
        text + "</robot>\n"
    }

    /// Returns the document of [`urdf`](Self::urdf) with visuals. Each link is drawn as the housing of its joint, a drum about the
    /// joint's axis, and a limb to the next joint.
    pub fn drawn_urdf(&self) -> String {
        let mut text =
            format!("<?xml version=\"1.0\"?>\n<robot name=\"{}\">\n{MATERIALS}", escaped(&self.robot));
        let ends: Vec<_> = self.joints.iter().map(|joint| Vector3::from(joint.xyz)).collect();
        let reach: f64 = ends.iter().map(Vector3::norm).sum();
        let count = ends.len().saturating_sub(1);
        let radius = |i: usize| STOUTNESS * reach * (1.0 - (1.0 - TAPER) * (i as f64 / count.max(1) as f64));
        for (i, (joint, end)) in self.joints.iter().zip(&ends).enumerate() {
            push_link(&mut text, &joint.parent, end, radius(i));
        }
        let (last, thin) = (self.joints.iter().rev().take(1), radius(count));
        for joint in last {
            let flange = visual(&UnitDualQuaternion::identity(), thin, 0.4 * thin, "joint");
            let _ = writeln!(text, "  <link name=\"{}\">\n{flange}  </link>", escaped(&joint.child));
        }
        self.joints.iter().for_each(|joint| push_joint(&mut text, joint));
        text + "</robot>\n"
    }
}

fn described(
    name: &str,
    motion: Motion,
    [parent, child]: [&str; 2],
    origin: UnitDualQuaternion,
) -> DescribedJoint {
    DescribedJoint {
        name: name.to_owned(),
        motion,
        parent: parent.to_owned(),
        child: child.to_owned(),
        xyz: origin.translation().into(),
        rpy: angles(&origin.rotation()),
        // This is URDF's default axis, for a fixed joint.
        axis: if motion == Motion::Fixed { [1.0, 0.0, 0.0] } else { [0.0, 0.0, 1.0] },
        limits: JointLimits::default(),
        mimic: None,
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
            ("deceleration", limits.deceleration),
            ("jerk", limits.jerk),
        ];
        let given = named.into_iter().filter_map(|(name, limit)| Some(format!(" {name}=\"{}\"", limit?)));
        // URDF requires an effort limit, which this program does not use.
        let _ = writeln!(text, "    <limit effort=\"0\"{}/>", given.collect::<String>());
    }
    if let Some(Mimic { driver, multiplier, offset }) = &joint.mimic {
        let driver = escaped(driver);
        let _ =
            writeln!(text, "    <mimic joint=\"{driver}\" multiplier=\"{multiplier}\" offset=\"{offset}\"/>");
    }
    text.push_str("  </joint>\n");
}

/// Formats `<origin xyz rpy>`. URDF's roll-pitch-yaw is Rz(yaw) Ry(pitch) Rx(roll), like nalgebra's Euler angles.
fn origin_element(transform: &UnitDualQuaternion) -> String {
    let (t, [roll, pitch, yaw]) = (transform.translation(), angles(&transform.rotation()));
    format!("<origin xyz=\"{} {} {}\" rpy=\"{roll} {pitch} {yaw}\"/>", t.x, t.y, t.z)
}

/// The colors of limbs and joints.
const MATERIALS: &str = "  <material name=\"limb\"><color rgba=\"0.86 0.87 0.89 1\"/></material>\n  \
                         <material name=\"joint\"><color rgba=\"0.25 0.33 0.42 1\"/></material>\n";

/// Writes a link without visuals.
fn push_bare_link(text: &mut String, link: &str) {
    let _ = writeln!(text, "  <link name=\"{}\"/>", escaped(link));
}

/// Writes a link with the housing of its joint. Adds a limb with the radius `radius` \[m\] from the origin of the link's frame to
/// `end`, unless these two points coincide.
fn push_link(text: &mut String, link: &str, end: &Vector3<f64>, radius: f64) {
    let link = escaped(link);
    let housing = visual(&UnitDualQuaternion::identity(), 1.3 * radius, 2.8 * radius, "joint");
    let limb = limb(end, radius).unwrap_or_default();
    let _ = writeln!(text, "  <link name=\"{link}\">\n{housing}{limb}  </link>");
}

/// Returns the visual of a limb: a cylinder from the origin to `end`; `None` if it is too short.
fn limb(end: &Vector3<f64>, radius: f64) -> Option<String> {
    let length = end.norm();
    if length < SHORTEST_LINK {
        return None;
    }
    // The rotation is `None` for opposite vectors. Any half turn about a horizontal axis moves z to −z.
    let turn = UnitQuaternion::rotation_between(&Vector3::z(), end)
        .unwrap_or_else(|| UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI));
    Some(visual(&UnitDualQuaternion::from_parts(turn, 0.5 * end), radius, length, "limb"))
}

/// Returns the visual of a cylinder along z, whose middle is at `origin`.
fn visual(origin: &UnitDualQuaternion, radius: f64, length: f64, material: &str) -> String {
    format!(
        "    <visual>\n      {}\n      <geometry><cylinder radius=\"{radius}\" length=\"{length}\"/></geometry>\n      \
         <material name=\"{material}\"/>\n    </visual>\n",
        origin_element(origin)
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use dq_kinematics::arm::{Convention, DhRow};
    use nalgebra::Rotation3;

    /// Returns the limbs in the document: for each limb, its length, and both ends in the link's frame.
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
    fn a_limb_connects_its_frame_with_the_next_unless_they_coincide() {
        let row = |a, d| DhRow { a, alpha: 0.0, d, theta_offset: 0.0 };
        let chain = Chain::new(
            Convention::ModifiedDh,
            &[row(0.0, 0.0), row(0.0, -0.5), row(0.0, 0.25), row(0.3, 0.0)],
        );
        let names: Vec<_> = (1..=4).map(|i| format!("n{i}")).collect();
        let arm = DescribedArm::of_chain(&chain.unwrap(), "robot", &names, ["base", "tool"], &names).unwrap();
        let document = arm.drawn_urdf();
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
        // There is one housing for each link including the base, and one for the flange.
        assert_eq!(document.matches("<material name=\"joint\"/>").count(), 6, "{document}");
    }

    #[test]
    fn names_are_escaped() {
        assert_eq!(escaped("a\"<&>\u{1}é'"), "a&quot;&lt;&amp;&gt;\u{fffd}é'");
    }
}
