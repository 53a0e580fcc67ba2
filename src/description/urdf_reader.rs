//! Reads the arm between two links from the text of a URDF document.

use super::arm::{DescribedArm, DescribedJoint, DescriptionError, JointLimits, Mimic, Motion, angles};
use super::urdf_tree::{MOST_JOINTS, Tree, child_of, is_moving, linked, name_of, with_document, wrong};
use dq_common::text::cut;
use dq_kinematics::arm::bounds::JOINT_ANGLE;
use nalgebra::{Quaternion, UnitQuaternion};
use roxmltree::{Document, Node};
use std::ops::RangeInclusive;

/// The arm and the other joints of a robot description.
#[derive(Clone, Debug, PartialEq)]
pub struct Description {
    /// The arm between the two links.
    pub arm: DescribedArm,
    /// The robot's other joints that can be read, such as those of fingers, sensors and other arms.
    pub beside: Vec<DescribedJoint>,
}

impl Description {
    /// Reads the arm from the link `base` to the link `tool` in the URDF document `text`, and the other joints.
    ///
    /// Each number that affects the motion of the tool must be present and valid. In the rest of the document, only the names of
    /// links and joints must be valid.
    ///
    /// # Errors
    /// [`DescriptionError`] if the document has no such arm.
    pub fn read(text: &str, base: &str, tool: &str) -> Result<Self, DescriptionError> {
        with_document(text, |document| Self::of(document, base, tool))
    }

    fn of(document: &Document, base: &str, tool: &str) -> Result<Self, DescriptionError> {
        let robot = document.root_element();
        let tree = Tree::new(robot)?;
        tree.check_link("base_frame", base)?;
        tree.check_link("tool_frame", tool)?;
        let chain = tree.between(base, tool)?;
        let joints = chain.iter().map(|joint| read_joint(&tree, *joint)).collect::<Result<Vec<_>, _>>()?;
        if joints.iter().all(|joint| joint.motion == Motion::Fixed) {
            let [base, tool] = [base, tool].map(|name| cut(name).into_owned());
            return Err(DescriptionError::NoJoint { base, tool });
        }
        let others = tree.joints.iter().filter(|joint| !chain.contains(joint));
        let beside = others.filter_map(|joint| read_beside(&tree, *joint)).collect();
        let robot = robot.attribute("name").map(|name| cut(name).into_owned()).unwrap_or_default();
        let drivers = drivers_elsewhere(&tree, base, &joints)?;
        Ok(Self { arm: with_bound_drivers(DescribedArm { robot, joints, drivers }), beside })
    }
}

/// Reads the joints outside the chain that drive mimic joints among the chain's `joints`.
fn drivers_elsewhere(
    tree: &Tree,
    base: &str,
    joints: &[DescribedJoint],
) -> Result<Vec<DescribedJoint>, DescriptionError> {
    let mut drivers: Vec<DescribedJoint> = Vec::new();
    for Mimic { driver, .. } in joints.iter().filter_map(|joint| joint.mimic.as_ref()) {
        let mut known = joints.iter().chain(&drivers);
        if known.all(|joint| joint.name != *driver)
            && let Some(joint) = tree.joint(driver)
        {
            drivers.push(DescribedJoint { parent: base.to_owned(), ..read_joint(tree, joint)? });
        }
    }
    Ok(drivers)
}

/// Narrows the limits of each driver so that its mimic joints stay within their own limits.
fn with_bound_drivers(mut arm: DescribedArm) -> DescribedArm {
    let links: Vec<_> = arm.links().cloned().collect();
    for link in &links {
        let Some(mimic) = &link.mimic else { continue };
        let mut drivers = arm.joints.iter_mut().chain(&mut arm.drivers);
        if let Some(driver) = drivers.find(|joint| joint.name == mimic.driver) {
            driver.bind(link, mimic);
        }
    }
    arm
}

/// Reads a joint of the chain.
fn read_joint(tree: &Tree, joint: Node) -> Result<DescribedJoint, DescriptionError> {
    let motion = match joint.attribute("type").unwrap_or_default() {
        "fixed" => Motion::Fixed,
        "revolute" => Motion::Revolute,
        "continuous" => Motion::Continuous,
        "prismatic" => Motion::Prismatic,
        other => {
            let why =
                "expected revolute, continuous, prismatic or fixed joints between base_frame and tool_frame";
            return Err(wrong(joint, format!("its type is {:?}: {why}", cut(other))));
        }
    };
    Ok(DescribedJoint { mimic: mimic(tree, joint)?, ..read_as(joint, motion)? })
}

/// Follows the mimic joints from `joint` to the joint that drives it, and returns how it is driven. Returns `None` if `joint` does
/// not mimic. A fixed joint does not mimic, whatever the document says.
fn mimic(tree: &Tree, joint: Node) -> Result<Option<Mimic>, DescriptionError> {
    /// The allowed ratios of the joint's speed to its driver's speed.
    const RATIOS: RangeInclusive<f64> = 1.0 / JOINT_ANGLE..=JOINT_ANGLE;
    let (mut driver, mut multiplier, mut offset) = (joint, 1.0_f64, 0.0_f64);
    for _ in 0..MOST_JOINTS {
        let Some(mimic) = child_of(driver, "mimic").filter(|_| is_moving(driver)) else {
            let name = name_of(driver);
            if !RATIOS.contains(&multiplier.abs()) || offset.abs() > JOINT_ANGLE {
                let (name, least) = (cut(name), RATIOS.start());
                let why = format!("it moves {multiplier} times as much as {name:?}, from {offset} on");
                return Err(wrong(
                    joint,
                    format!("{why}: expected {least:e} to {JOINT_ANGLE:e} times as much"),
                ));
            }
            let mimic = || Mimic { driver: name.to_owned(), multiplier, offset };
            return Ok((driver != joint).then(mimic));
        };
        let number = |name, default| match mimic.attribute(name) {
            None => Ok(default),
            Some(text) => number(text).ok_or_else(|| {
                wrong(driver, format!("{name} of its mimic is {:?}: expected a number", cut(text)))
            }),
        };
        offset += multiplier * number("offset", 0.0)?;
        multiplier *= number("multiplier", 1.0)?;
        let name = mimic.attribute("joint").unwrap_or_default();
        driver = tree.joint(name).filter(|driver| is_moving(*driver)).ok_or_else(|| {
            wrong(joint, format!("it mimics {:?}, which is no joint that moves on an axis", cut(name)))
        })?;
    }
    Err(wrong(joint, "it mimics itself, or by too many others: expected a joint that moves on its own"))
}

/// Reads a joint that is not on the chain; `None` if it cannot be read. The joint stays at its start position, which follows from
/// its limits if these can be read.
fn read_beside(tree: &Tree, joint: Node) -> Option<DescribedJoint> {
    let motion = match joint.attribute("type")? {
        "fixed" => Motion::Fixed,
        "revolute" => Motion::Revolute,
        "continuous" => Motion::Continuous,
        "prismatic" => Motion::Prismatic,
        _ => return None,
    };
    let read = read_as(joint, motion).or_else(|_| read_as(joint, Motion::Fixed)).ok()?;
    Some(DescribedJoint { mimic: mimic(tree, joint).ok().flatten(), ..read })
}

fn read_as(joint: Node, motion: Motion) -> Result<DescribedJoint, DescriptionError> {
    let origin = child_of(joint, "origin");
    let wrong_origin = |why| wrong(joint, format!("the quat_xyzw of its origin {why}"));
    let axis = child_of(joint, "axis").filter(|_| motion != Motion::Fixed);
    let described = DescribedJoint {
        name: name_of(joint).to_owned(),
        motion,
        parent: linked(joint, "parent")?.to_owned(),
        child: linked(joint, "child")?.to_owned(),
        xyz: three(joint, origin, "xyz", [0.0; 3])?,
        rpy: match origin.and_then(quaternion).transpose().map_err(wrong_origin)? {
            Some(rotation) => angles(&rotation),
            None => three(joint, origin, "rpy", [0.0; 3])?,
        },
        axis: three(joint, axis, "xyz", [1.0, 0.0, 0.0])?,
        limits: limits(joint, motion)?,
        mimic: None,
    };
    match motion == Motion::Fixed || described.axis.iter().any(|number| number.abs() > SHORTEST_AXIS) {
        true => Ok(described),
        false => Err(wrong(joint, format!("its axis is {:?}: expected a direction", described.axis))),
    }
}

/// Returns the quaternion of an origin (URDF 1.1 and later), if the origin has one.
///
/// # Errors
/// The part of the error message that follows the name of the attribute.
pub(crate) fn quaternion(origin: Node) -> Option<Result<UnitQuaternion<f64>, String>> {
    let text = origin.attribute("quat_xyzw")?;
    let version = origin.document().root_element().attribute("version").unwrap_or("1.0");
    // In URDF 1.0, ROS 2's own parser ignores the quaternion. Using the quaternion would give another robot.
    if version.trim() == "1.0" {
        return Some(Err("needs <robot version=\"1.2\">".to_owned()));
    }
    if origin.has_attribute("rpy") {
        return Some(Err("is there beside rpy: expected one of them".to_owned()));
    }
    let numbers: Option<Vec<f64>> = text.split_whitespace().take(5).map(number).collect();
    let rotation = match numbers.as_deref() {
        Some(&[x, y, z, w]) => UnitQuaternion::try_new(Quaternion::new(w, x, y, z), SHORTEST_AXIS),
        _ => None,
    };
    Some(rotation.ok_or_else(|| format!("is {:?}: expected a quaternion x y z w", cut(text))))
}

/// An axis whose components are all below this size has no direction.
const SHORTEST_AXIS: f64 = 1e-6;

/// Reads the attribute `name` of the element `of` as three numbers. Returns `default` if the element or the attribute is missing.
/// Errors name the joint `joint`.
fn three(joint: Node, of: Option<Node>, name: &str, default: [f64; 3]) -> Result<[f64; 3], DescriptionError> {
    let Some((node, text)) = of.and_then(|node| Some((node, node.attribute(name)?))) else {
        return Ok(default);
    };
    let numbers: Option<Vec<f64>> = text.split_whitespace().take(4).map(number).collect();
    numbers.and_then(|numbers| numbers.try_into().ok()).ok_or_else(|| {
        let element = node.tag_name().name();
        wrong(joint, format!("{name} of its {element} is {:?}: expected three numbers", cut(text)))
    })
}

/// Parses a number; `None` if the text is not a number, or the number is too large for a robot.
fn number(text: &str) -> Option<f64> {
    text.trim().parse().ok().filter(|number: &f64| number.abs() <= JOINT_ANGLE)
}

/// Reads the limits of a joint. Accepts limits that do not form a range, because parameters may override them. If there is also a
/// soft limit (`safety_controller`), the tighter of the hard and the soft limit counts, because a controller should keep within
/// both.
fn limits(joint: Node, motion: Motion) -> Result<JointLimits, DescriptionError> {
    let read = |element: &'static str, name: &str| {
        let Some(text) = child_of(joint, element).and_then(|element| element.attribute(name)) else {
            return Ok(None);
        };
        match text.trim().parse().ok().filter(|number: &f64| !number.is_nan()) {
            Some(number) => Ok(Some(number)),
            None => {
                Err(wrong(joint, format!("{name} of its {element} is {:?}: expected a number", cut(text))))
            }
        }
    };
    let between = matches!(motion, Motion::Revolute | Motion::Prismatic);
    let bound = |name, soft, tighter: fn(f64, f64) -> f64| -> Result<_, DescriptionError> {
        if !between {
            return Ok(None);
        }
        // In URDF a missing limit is 0. A missing soft limit does not count.
        let (hard, soft) = (read("limit", name)?.unwrap_or(0.0), read("safety_controller", soft)?);
        Ok(Some(soft.map_or(hard, |soft: f64| tighter(hard, soft))))
    };
    Ok(match motion {
        Motion::Fixed => JointLimits::default(),
        _ => JointLimits {
            lower: bound("lower", "soft_lower_limit", f64::max)?,
            upper: bound("upper", "soft_upper_limit", f64::min)?,
            velocity: read("limit", "velocity")?,
            acceleration: read("limit", "acceleration")?,
            deceleration: read("limit", "deceleration")?,
            jerk: read("limit", "jerk")?,
        },
    })
}
