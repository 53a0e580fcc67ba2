//! The links and joints of a URDF document, and their tree.
//!
//! This module uses roxmltree instead of urdf-rs (0.10). urdf-rs reads every element of the robot instead of one chain, overflows
//! the stack on deeply nested text, does not name the element with an invalid number, and reads a missing limit as zeros. A text
//! that is not XML is first converted by [`as_xml`].

use super::arm::DescriptionError;
use super::urdf_lenient::{as_xml, line};
use dq_common::text::{self, cut};
use roxmltree::{Document, Node, ParsingOptions};
use std::collections::{HashMap, HashSet};

/// The size of the longest description that is read \[bytes\]. The description of a humanoid has 0.2 MB.
pub const LONGEST_DESCRIPTION: usize = 4 << 20;

/// Largest number of joints in a chain.
pub(crate) const MOST_JOINTS: usize = 64;

/// Largest number of XML nodes in a description.
const MOST_NODES: u32 = 200_000;

/// Calls `read` with the document of the robot. A text that is not XML is converted first, if ROS 2's own parser accepts it.
pub(crate) fn with_document<T>(
    text: &str,
    read: impl FnOnce(&Document) -> Result<T, DescriptionError>,
) -> Result<T, DescriptionError> {
    match strict(text) {
        Ok(document) => read(&document),
        Err(NotStrict::Refused(why)) => Err(why),
        Err(NotStrict::Odd { .. }) => {
            let xml = as_xml(text)?;
            let document = strict(&xml).map_err(NotStrict::why)?;
            read(&document)
        }
    }
}

/// Returns a warning if the text is not XML but can be read.
pub fn oddity(text: &str) -> Option<String> {
    match strict(text) {
        Err(NotStrict::Odd { why, line }) => {
            Some(format!("{why}: line {line} and similar lines are read as ROS 2's own reader reads them"))
        }
        _ => None,
    }
}

/// The reason why the strict parser rejects a text.
enum NotStrict {
    /// The error is final: the lenient parser does not try the text.
    Refused(DescriptionError),
    /// The lenient parser may be able to read the text.
    Odd { why: DescriptionError, line: u32 },
}

impl NotStrict {
    fn why(self) -> DescriptionError {
        match self {
            Self::Refused(why) | Self::Odd { why, .. } => why,
        }
    }
}

fn strict(text: &str) -> Result<Document<'_>, NotStrict> {
    let refused = |why| Err(NotStrict::Refused(why));
    if text.len() > LONGEST_DESCRIPTION {
        return refused(DescriptionError::TooLong { size: text.len(), most: LONGEST_DESCRIPTION });
    }
    let options = ParsingOptions { nodes_limit: MOST_NODES, ..ParsingOptions::default() };
    let document = match Document::parse_with_options(text, options) {
        Ok(document) => document,
        Err(roxmltree::Error::NodesLimitReached) => {
            let why = format!("it has more than {MOST_NODES} elements and attributes");
            return refused(DescriptionError::NotXml(why));
        }
        Err(why) => {
            let doctype = text.find("<!DOCTYPE").filter(|_| matches!(why, roxmltree::Error::DtdDetected));
            let line = doctype.map_or(why.pos().row, |at| line(text, at));
            let why = DescriptionError::NotXml(cut(&why.to_string()).into_owned());
            return Err(NotStrict::Odd { why, line });
        }
    };
    let robot = document.root_element();
    if robot.tag_name().name() != "robot" {
        return refused(DescriptionError::NotUrdf(cut(robot.tag_name().name()).into_owned()));
    }
    match of_xacro(&document) {
        None => Ok(document),
        Some((element, line)) if element.contains(':') => refused(DescriptionError::Xacro { element, line }),
        // An element without a namespace prefix is not a macro.
        Some((element, line)) => {
            let why = DescriptionError::NotXml(format!("<{element}> is in xacro's namespace"));
            Err(NotStrict::Odd { why, line })
        }
    }
}

/// Returns the name and the line of the first element in xacro's namespace; `None` if there is no such element. Elements whose names
/// have a namespace prefix take precedence. The name is as written in the document, with its prefix.
fn of_xacro(document: &Document) -> Option<(String, u32)> {
    let is_macro = |node: &Node| node.tag_name().namespace().is_some_and(|uri| uri.contains("xacro"));
    let mut of_xacro = document.descendants().filter(is_macro);
    let written = |node: &Node| {
        let text = document.input_text()[node.range()].trim_start_matches('<');
        text.split([' ', '\t', '\r', '\n', '/', '>']).next().unwrap_or_default().to_owned()
    };
    let first = of_xacro.next()?;
    let shown = of_xacro.find(|node| written(node).contains(':')).filter(|_| !written(&first).contains(':'));
    let shown = shown.unwrap_or(first);
    Some((cut(&written(&shown)).into_owned(), document.text_pos_at(shown.range().start).row))
}

/// The names in a description, and the tree of its links.
pub(crate) struct Tree<'a> {
    links: Vec<&'a str>,
    pub joints: Vec<Node<'a, 'a>>,
    /// For each child link, its parent link and the joint between them.
    by_child: HashMap<&'a str, (&'a str, Node<'a, 'a>)>,
    by_name: HashMap<&'a str, Node<'a, 'a>>,
}

impl<'a> Tree<'a> {
    pub fn new(robot: Node<'a, 'a>) -> Result<Self, DescriptionError> {
        let elements = |kind: &'static str| robot.children().filter(move |node| node.has_tag_name(kind));
        let links = named("link", elements("link"))?;
        if links.is_empty() {
            return Err(DescriptionError::NoLink);
        }
        let joints: Vec<_> = elements("joint").collect();
        named("joint", joints.iter().copied())?;
        let known: HashSet<&str> = links.iter().copied().collect();
        let mut by_child = HashMap::new();
        for joint in &joints {
            let (parent, child) = (linked(*joint, "parent")?, linked(*joint, "child")?);
            for (role, name) in [("parent", parent), ("child", child)] {
                if !known.contains(name) {
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
        let by_name = joints.iter().map(|joint| (name_of(*joint), *joint)).collect();
        let tree = Self { links, joints, by_child, by_name };
        tree.check_rings()?;
        let mut roots = tree.links.iter().filter(|link| !tree.by_child.contains_key(*link));
        if let (Some(first), Some(second)) = (roots.next(), roots.next()) {
            return Err(DescriptionError::TwoRoots(cut(first).into_owned(), cut(second).into_owned()));
        }
        Ok(tree)
    }

    /// Checks that no link is its own ancestor.
    fn check_rings(&self) -> Result<(), DescriptionError> {
        let mut ends: HashSet<&str> = HashSet::new();
        for link in &self.links {
            let (mut link, mut way) = (*link, Vec::new());
            while let Some((parent, joint)) = self.by_child.get(link).filter(|_| !ends.contains(link)) {
                // If a path toward the root has as many steps as the robot has joints, some link is its own ancestor.
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

    pub fn check_link(&self, frame: &'static str, name: &str) -> Result<(), DescriptionError> {
        /// Largest number of links in the message.
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

    /// Returns the joints from the link `base` to the link `tool`. Follows the parents from the tool back to the base.
    pub fn between(&self, base: &str, tool: &str) -> Result<Vec<Node<'a, 'a>>, DescriptionError> {
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

    /// Returns the joint with this name, if there is one.
    pub fn joint(&self, name: &str) -> Option<Node<'a, 'a>> {
        self.by_name.get(name).copied()
    }

    /// Returns the link that is not the child of any joint.
    pub fn root(&self) -> Option<&'a str> {
        self.links.iter().copied().find(|link| !self.by_child.contains_key(link))
    }
}

/// Returns the names of these elements, after a check that each name is unique.
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

/// Returns whether the joint is revolute, continuous or prismatic: the types of moving joints that an arm may have.
pub(crate) fn is_moving(joint: Node) -> bool {
    matches!(joint.attribute("type"), Some("revolute" | "continuous" | "prismatic"))
}

pub(crate) fn name_of<'a>(joint: Node<'a, '_>) -> &'a str {
    joint.attribute("name").unwrap_or_default()
}

pub(crate) fn wrong(joint: Node, why: impl Into<String>) -> DescriptionError {
    DescriptionError::Element { kind: "joint", name: name_of(joint).to_owned(), why: why.into() }
}

pub(crate) fn child_of<'a>(node: Node<'a, 'a>, kind: &'static str) -> Option<Node<'a, 'a>> {
    node.children().find(|child| child.has_tag_name(kind))
}

/// Returns the name of the link that is the joint's parent or child.
pub(crate) fn linked<'a>(joint: Node<'a, 'a>, role: &'static str) -> Result<&'a str, DescriptionError> {
    child_of(joint, role)
        .and_then(|node| node.attribute("link"))
        .ok_or_else(|| wrong(joint, format!("it has no <{role} link=...>")))
}
