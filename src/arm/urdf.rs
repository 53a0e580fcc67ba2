//! A chain as a URDF document, so that RViz and other tools can show it.

use super::Chain;
use crate::dq::UnitDualQuaternion;
use std::fmt::Write;

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
    let (before_joint, last_link_from_tool) = (chain.parent_from_joint(), &chain.last_link_from_tool());
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
    let Some(turn) = nalgebra::UnitQuaternion::rotation_between(&nalgebra::Vector3::z(), &along) else {
        let _ = writeln!(text, "  <link name=\"{link}\"/>");
        return;
    };
    let visual = origin_element(&UnitDualQuaternion::from_parts(turn, 0.5 * along));
    let _ = writeln!(
        text,
        "  <link name=\"{link}\">\n    <visual>\n      {visual}\n      <geometry><cylinder radius=\"0.03\" length=\"{}\"/></geometry>\n    </visual>\n  </link>",
        along.norm()
    );
}
