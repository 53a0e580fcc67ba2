//! From the text of a URDF document to the arm between two of its links.
//!
//! Read by roxmltree and not by urdf-rs (0.10): that reads every element of the robot where we need those of one chain, ends the process
//! by a stack overflow on deeply nested text, does not name the element in which a number is wrong, and reads a missing limit as zeros.

use super::bounds::JOINT_ANGLE;
use super::description::{DescribedArm, DescribedJoint, DescriptionError, JointLimits, Motion};
use crate::text::{self, cut};
use roxmltree::{Document, Node, ParsingOptions};
use std::collections::{HashMap, HashSet};

/// The longest description that is read \[bytes\]: a humanoid's has 0.2 MB.
pub const LONGEST_DESCRIPTION: usize = 4 << 20;

/// The most joints that a chain may have.
const MOST_JOINTS: usize = 64;

/// The most XML nodes that a description may have.
const MOST_NODES: u32 = 200_000;

/// What a description says, as far as somebody asked.
#[derive(Clone, Debug, PartialEq)]
pub struct Description {
    /// The arm between the two links.
    pub arm: DescribedArm,
    /// The robot's other joints that can be read: fingers, sensors, other arms.
    pub beside: Vec<DescribedJoint>,
}

impl Description {
    /// What the URDF document `text` has from the link `base` to the link `tool`, and beside that.
    ///
    /// The chain must be whole and right in each number that moves the tool. Of all else only the names of links and joints must be.
    ///
    /// # Errors
    /// [`DescriptionError`].
    pub fn read(text: &str, base: &str, tool: &str) -> Result<Self, DescriptionError> {
        if text.len() > LONGEST_DESCRIPTION {
            return Err(DescriptionError::TooLong { size: text.len(), most: LONGEST_DESCRIPTION });
        }
        let options = ParsingOptions { nodes_limit: MOST_NODES, ..ParsingOptions::default() };
        let document = Document::parse_with_options(text, options).map_err(|why| not_xml(&why))?;
        let robot = document.root_element();
        if robot.tag_name().name() != "robot" {
            return Err(DescriptionError::NotUrdf(cut(robot.tag_name().name()).into_owned()));
        }
        check_expanded(&document)?;
        let tree = Tree::new(robot)?;
        tree.check_link("base_frame", base)?;
        tree.check_link("tool_frame", tool)?;
        let chain = tree.between(base, tool)?;
        let joints = chain.iter().map(|joint| read_joint(*joint)).collect::<Result<Vec<_>, _>>()?;
        if joints.iter().all(|joint| joint.motion == Motion::Fixed) {
            let [base, tool] = [base, tool].map(|name| cut(name).into_owned());
            return Err(DescriptionError::NoJoint { base, tool });
        }
        let others = tree.joints.iter().filter(|joint| !chain.contains(joint));
        let beside = others.filter_map(|joint| read_beside(*joint)).collect();
        let robot = robot.attribute("name").map(|name| cut(name).into_owned()).unwrap_or_default();
        Ok(Self { arm: DescribedArm { robot, joints }, beside })
    }
}

/// Why a text is no XML: macros whose prefix nobody has declared are xacro all the same.
fn not_xml(why: &roxmltree::Error) -> DescriptionError {
    match why {
        roxmltree::Error::UnknownNamespace(prefix, at) if prefix == "xacro" => {
            DescriptionError::Xacro { element: format!("{prefix}:..."), line: at.row }
        }
        why => DescriptionError::NotXml(cut(&why.to_string()).into_owned()),
    }
}

/// Whether no macro of xacro is left.
fn check_expanded(document: &Document) -> Result<(), DescriptionError> {
    let is_macro = |node: &Node| node.tag_name().namespace().is_some_and(|uri| uri.contains("xacro"));
    match document.descendants().find(is_macro) {
        None => Ok(()),
        Some(node) => Err(DescriptionError::Xacro {
            element: format!("xacro:{}", cut(node.tag_name().name())),
            line: document.text_pos_at(node.range().start).row,
        }),
    }
}

/// The names in a description, and what hangs from what.
struct Tree<'a> {
    links: Vec<&'a str>,
    joints: Vec<Node<'a, 'a>>,
    /// By the link that it carries: the link that carries it, and the joint.
    by_child: HashMap<&'a str, (&'a str, Node<'a, 'a>)>,
}

impl<'a> Tree<'a> {
    fn new(robot: Node<'a, 'a>) -> Result<Self, DescriptionError> {
        let elements = |kind: &'static str| robot.children().filter(move |node| node.has_tag_name(kind));
        let links = named("link", elements("link"))?;
        let joints: Vec<_> = elements("joint").collect();
        named("joint", joints.iter().copied())?;
        let by_name: HashMap<&str, ()> = links.iter().map(|name| (*name, ())).collect();
        let mut by_child = HashMap::new();
        for joint in &joints {
            let (parent, child) = (linked(*joint, "parent")?, linked(*joint, "child")?);
            for (role, name) in [("parent", parent), ("child", child)] {
                if !by_name.contains_key(name) {
                    return Err(wrong(*joint, format!("its {role} {:?} is no link", cut(name))));
                }
            }
            if let Some((_, other)) = by_child.insert(child, (parent, *joint)) {
                let (child, other) = (cut(child), name_of(other));
                return Err(wrong(
                    *joint,
                    format!("its child {child:?} is the child of joint {other:?} too"),
                ));
            }
        }
        let tree = Self { links, joints, by_child };
        tree.check_rings()?;
        let mut roots = tree.links.iter().filter(|link| !tree.by_child.contains_key(*link));
        if let (Some(first), Some(second)) = (roots.next(), roots.next()) {
            return Err(DescriptionError::TwoRoots(cut(first).into_owned(), cut(second).into_owned()));
        }
        Ok(tree)
    }

    /// That the way up from each link ends.
    fn check_rings(&self) -> Result<(), DescriptionError> {
        let mut ends: HashSet<&str> = HashSet::new();
        for link in &self.links {
            let (mut link, mut way) = (*link, Vec::new());
            while let Some((parent, joint)) = self.by_child.get(link).filter(|_| !ends.contains(link)) {
                // As many steps as there are joints lead onto the ring, if there is one.
                if way.len() == self.joints.len() {
                    let why = format!("its child {:?} carries its parent {:?} too", cut(link), cut(parent));
                    return Err(wrong(*joint, format!("{why}: expected links that form a tree, no ring")));
                }
                way.push(link);
                link = parent;
            }
            ends.extend(way);
        }
        Ok(())
    }

    fn check_link(&self, frame: &'static str, name: &str) -> Result<(), DescriptionError> {
        /// So many links are listed.
        const LISTED: usize = 8;
        if self.links.contains(&name) {
            return Ok(());
        }
        let listed: Vec<_> = self.links.iter().take(LISTED).map(|link| cut(link)).collect();
        let more = match self.links.len().saturating_sub(LISTED) {
            0 => String::new(),
            more => format!(" and {more} more"),
        };
        let known = format!("{}{more}", listed.join(", "));
        Err(DescriptionError::NoSuchLink { frame, name: cut(name).into_owned(), known })
    }

    /// The joints from one link to another, found from the tool back to the base.
    fn between(&self, base: &str, tool: &str) -> Result<Vec<Node<'a, 'a>>, DescriptionError> {
        let (mut link, mut found) = (tool, Vec::new());
        while link != base {
            match self.by_child.get(link) {
                Some((parent, joint)) => {
                    found.push(*joint);
                    link = parent;
                }
                None => {
                    let [base, tool, root] = [base, tool, link].map(|name| cut(name).into_owned());
                    return Err(DescriptionError::NotConnected { base, tool, root });
                }
            }
        }
        if let Some(beyond) = found.len().checked_sub(MOST_JOINTS).filter(|beyond| *beyond > 0) {
            let joint = found[beyond - 1];
            return Err(wrong(
                joint,
                format!("{} joints lead to the tool: expected {MOST_JOINTS} at most", found.len()),
            ));
        }
        found.reverse();
        Ok(found)
    }
}

/// The names of these elements, each there once.
fn named<'a>(
    kind: &'static str,
    nodes: impl Iterator<Item = Node<'a, 'a>>,
) -> Result<Vec<&'a str>, DescriptionError> {
    let (mut seen, mut names) = (HashMap::new(), Vec::new());
    for node in nodes {
        let name = node.attribute("name").unwrap_or_default();
        let bad = |why: &str| {
            Err(DescriptionError::Element { kind, name: cut(name).into_owned(), why: why.to_owned() })
        };
        if name.is_empty() {
            let line = node.document().text_pos_at(node.range().start).row;
            return bad(&format!("it has no name, in line {line}"));
        }
        if name.len() > text::LONGEST || name.chars().any(char::is_control) {
            return bad("expected a name of printable characters, 250 bytes at most");
        }
        if seen.insert(name, ()).is_some() {
            return bad("the name is there twice");
        }
        names.push(name);
    }
    Ok(names)
}

fn name_of<'a>(joint: Node<'a, '_>) -> &'a str {
    joint.attribute("name").unwrap_or_default()
}

fn wrong(joint: Node, why: impl Into<String>) -> DescriptionError {
    DescriptionError::Element { kind: "joint", name: name_of(joint).to_owned(), why: why.into() }
}

fn child_of<'a>(node: Node<'a, 'a>, kind: &'static str) -> Option<Node<'a, 'a>> {
    node.children().find(|child| child.has_tag_name(kind))
}

/// The link that the joint names as its parent or child.
fn linked<'a>(joint: Node<'a, 'a>, role: &'static str) -> Result<&'a str, DescriptionError> {
    child_of(joint, role)
        .and_then(|node| node.attribute("link"))
        .ok_or_else(|| wrong(joint, format!("it has no <{role} link=...>")))
}

/// A joint of the chain.
fn read_joint(joint: Node) -> Result<DescribedJoint, DescriptionError> {
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
    // What does not move mimics nothing, whatever is written.
    if motion != Motion::Fixed
        && let Some(mimic) = child_of(joint, "mimic")
    {
        let of = cut(mimic.attribute("joint").unwrap_or_default());
        return Err(wrong(joint, format!("it mimics {of:?}: expected joints that move by themselves")));
    }
    read_as(joint, motion)
}

/// A joint beside the chain: one that moves stays where it is, so that its limits matter as far as they can be read.
fn read_beside(joint: Node) -> Option<DescribedJoint> {
    let motion = match joint.attribute("type")? {
        "fixed" => Motion::Fixed,
        "revolute" => Motion::Revolute,
        "continuous" => Motion::Continuous,
        "prismatic" => Motion::Prismatic,
        _ => return None,
    };
    read_as(joint, motion).or_else(|_| read_as(joint, Motion::Fixed)).ok()
}

fn read_as(joint: Node, motion: Motion) -> Result<DescribedJoint, DescriptionError> {
    let origin = child_of(joint, "origin");
    if origin.is_some_and(|origin| origin.has_attribute("quat_xyzw")) {
        return Err(wrong(joint, "its origin has quat_xyzw: expected rpy"));
    }
    let axis = child_of(joint, "axis").filter(|_| motion != Motion::Fixed);
    let described = DescribedJoint {
        name: name_of(joint).to_owned(),
        motion,
        parent: linked(joint, "parent")?.to_owned(),
        child: linked(joint, "child")?.to_owned(),
        xyz: three(joint, origin, "xyz", [0.0; 3])?,
        rpy: three(joint, origin, "rpy", [0.0; 3])?,
        axis: three(joint, axis, "xyz", [1.0, 0.0, 0.0])?,
        limits: limits(joint, motion)?,
    };
    match motion == Motion::Fixed || described.axis.iter().any(|number| number.abs() > SHORTEST_AXIS) {
        true => Ok(described),
        false => Err(wrong(joint, format!("its axis is {:?}: expected a direction", described.axis))),
    }
}

/// An axis whose numbers are all smaller is none.
const SHORTEST_AXIS: f64 = 1e-6;

/// Three numbers of an attribute.
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

/// A number within what a robot can have.
fn number(text: &str) -> Option<f64> {
    text.trim().parse().ok().filter(|number: &f64| number.abs() <= JOINT_ANGLE)
}

/// The limits of a joint as the description has them, whether any arm could move within them or not: parameters may give others. Of a
/// position limit and the soft one of the `safety_controller` it is the tighter one: a controller is to keep within both.
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
        // URDF: a limit that is not there is 0; of soft ones only those count that are there.
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
        },
    })
}
