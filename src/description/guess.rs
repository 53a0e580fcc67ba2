//! Guesses the frames of the arm in a robot description if the user does not name them.

use super::arm::DescriptionError;
use super::urdf_tree::{Tree, child_of, is_moving, linked, name_of, with_document};
use dq_common::text::cut;
use roxmltree::Node;
use std::collections::{HashMap, HashSet};
use std::f64::consts::PI;

/// Names of frames at which tools are mounted, in the order of preference.
const TOOL_FRAMES: [&str; 2] = ["tool0", "flange"];

/// The two frames of an arm.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Guess {
    /// The name of the base frame.
    pub base: String,
    /// The name of the tool frame.
    pub tool: String,
    /// Other links that could be the tool frame, if the tool frame was guessed.
    pub alternatives: Vec<String>,
}

/// Returns the frames of the arm in the URDF document `text`. Keeps a given frame, and guesses a missing one:
///
/// - The tool frame is `tool0` or, if there is none, `flange`, with or without a prefix. If there is neither, the tool frame is the
///   end of the chain with the most joints. The chain includes fixed joints at its end, but no gripper.
/// - A joint at the end of a chain is the jaw of a gripper if it opens to one side only, and at least four joints precede it. A
///   gripper also begins at a link that carries several moving parts, if none of these parts has more joints than the arm has up to
///   that link.
/// - The base frame is `base_link` if that link is on the path to the tool; otherwise the root.
///
/// # Errors
/// [`DescriptionError::SeveralArms`] if several chains could equally well be the arm; other errors if the document is invalid.
pub fn guess_frames(text: &str, [base, tool]: [Option<&str>; 2]) -> Result<Guess, DescriptionError> {
    if let (Some(base), Some(tool)) = (base, tool) {
        let [base, tool] = [base, tool].map(str::to_owned);
        return Ok(Guess { base, tool, alternatives: Vec::new() });
    }
    with_document(text, |document| {
        let tree = Tree::new(document.root_element())?;
        let root = tree.root().unwrap_or_default();
        let from = base.unwrap_or(root);
        let branches = Branches::new(&tree, from);
        let (tool, alternatives) = match tool {
            Some(tool) => (tool, Vec::new()),
            None => branches.tool(from)?,
        };
        let passes_base_link = || {
            tree.between(root, tool)
                .is_ok_and(|way| way.iter().any(|joint| linked(*joint, "parent") == Ok("base_link")))
        };
        let base = base.unwrap_or_else(|| if passes_base_link() { "base_link" } else { root });
        let alternatives = alternatives.into_iter().map(|link| cut(link).into_owned()).collect();
        Ok(Guess { base: base.to_owned(), tool: tool.to_owned(), alternatives })
    })
}

/// A joint, and the link that it carries.
#[derive(Clone, Copy)]
struct Branch<'a> {
    joint: Node<'a, 'a>,
    child: &'a str,
    /// Whether the joint is a mimic joint whose driver comes earlier on the chain, so that it cannot move independently.
    follows: bool,
}

impl Branch<'_> {
    /// Returns whether the joint can be one of the arm's own joints: it moves, and does not mimic.
    fn is_driven(&self) -> bool {
        is_moving(self.joint) && child_of(self.joint, "mimic").is_none()
    }

    /// Returns whether the joint does not move independently.
    fn is_rigid(&self) -> bool {
        self.follows || self.joint.attribute("type") == Some("fixed")
    }

    /// Returns whether the joint opens to one side only, by at most half a turn. A jaw does; a wrist does not.
    fn is_one_sided(&self) -> bool {
        /// How far a jaw may also turn or slide in the direction opposite to its opening, as a fraction of how far it opens.
        const OTHER_SIDE: f64 = 0.25;
        let limit = |name| child_of(self.joint, "limit")?.attribute(name)?.trim().parse::<f64>().ok();
        let (lower, upper) = (limit("lower").unwrap_or(0.0), limit("upper").unwrap_or(0.0));
        let (one, other) = (upper.max(-lower), upper.min(-lower));
        lower < upper && upper - lower <= PI && other <= OTHER_SIDE * one
    }
}

/// The joints and links of a robot, by parent link.
struct Branches<'a> {
    by_parent: HashMap<&'a str, Vec<Branch<'a>>>,
    /// For each link, a summary of all links beyond it.
    beyond: HashMap<&'a str, Beyond>,
    /// All links, each after its parent.
    order: Vec<&'a str>,
}

/// A summary of the chains beyond a link: how many joints they have, and whether anything moves there.
#[derive(Clone, Copy, Default)]
struct Beyond {
    /// The largest number of driven joints on one chain beyond the link.
    joints: usize,
    /// Whether any joint beyond the link moves. A mimic joint does not count if its driver comes earlier on the chain.
    moves: bool,
}

impl<'a> Branches<'a> {
    fn new(tree: &Tree<'a>, from: &'a str) -> Self {
        let mut by_parent: HashMap<&str, Vec<Branch>> = HashMap::new();
        for &joint in &tree.joints {
            if let (Ok(parent), Ok(child)) = (linked(joint, "parent"), linked(joint, "child")) {
                by_parent.entry(parent).or_default().push(Branch { joint, child, follows: false });
            }
        }
        let mut all = Self { by_parent, beyond: HashMap::new(), order: Vec::new() };
        // A depth-first search, with the joints that lead to each link. The search visits a link again after all links beyond that
        // link.
        let (mut stack, mut before) = (vec![(from, None, false)], HashSet::new());
        while let Some((link, joint, is_done)) = stack.pop() {
            if is_done {
                let each = all.of(link).iter().map(|branch| all.carried(branch));
                let sum = each.fold(Beyond::default(), |sum, one| Beyond {
                    joints: sum.joints.max(one.joints),
                    moves: sum.moves || one.moves,
                });
                all.beyond.insert(link, sum);
                joint.map(|joint| before.remove(name_of(joint)));
                continue;
            }
            all.order.push(link);
            joint.map(|joint| before.insert(name_of(joint)));
            stack.push((link, joint, true));
            for branch in all.by_parent.get_mut(link).into_iter().flatten().rev() {
                let driver = child_of(branch.joint, "mimic").and_then(|mimic| mimic.attribute("joint"));
                branch.follows = driver.is_some_and(|driver| before.contains(driver));
                stack.push((branch.child, Some(branch.joint), false));
            }
        }
        all
    }

    fn of(&self, link: &str) -> &[Branch<'a>] {
        self.by_parent.get(link).map(Vec::as_slice).unwrap_or_default()
    }

    /// Returns the summary of all links that a branch carries, including the branch's own joint.
    fn carried(&self, branch: &Branch) -> Beyond {
        let Beyond { joints, moves } = self.beyond.get(branch.child).copied().unwrap_or_default();
        Beyond { joints: joints + usize::from(branch.is_driven()), moves: moves || !branch.is_rigid() }
    }

    /// Returns the tool frame of the arm that begins at `from`, and other possible tool frames.
    fn tool(&self, from: &'a str) -> Result<(&'a str, Vec<&'a str>), DescriptionError> {
        for name in TOOL_FRAMES {
            if let Some(tool) = self.named(from, name)? {
                return Ok((tool, self.fixed_to(from, tool)));
            }
        }
        let tool = self.over_fixed(self.end(from, 0)?);
        Ok((tool, self.fixed_to(from, tool)))
    }

    /// Returns the first frame after `from` with this name, with or without a prefix; `None` if there is no such frame. Ignores a
    /// frame if more joints are beyond it than before it. If several branches have such a frame, the one without a prefix counts.
    ///
    /// # Errors
    /// [`DescriptionError::SeveralArms`] if several branches have such a frame, all with a prefix.
    fn named(&self, from: &'a str, name: &str) -> Result<Option<&'a str>, DescriptionError> {
        let (mut before, mut found) = (HashMap::from([(from, 0)]), Vec::new());
        for &link in &self.order {
            let Some(joints) = before.remove(link) else { continue };
            let is_named =
                link.strip_suffix(name).is_some_and(|prefix| prefix.is_empty() || prefix.ends_with('_'));
            if is_named && joints > 0 && joints >= self.beyond[link].joints {
                found.push(link);
                continue;
            }
            let next = |branch: &Branch<'a>| (branch.child, joints + usize::from(branch.is_driven()));
            before.extend(self.of(link).iter().map(next));
        }
        if found.contains(&name) {
            found.retain(|link| *link == name);
        }
        match found.as_slice() {
            [] => Ok(None),
            [tool] => Ok(Some(tool)),
            several => Err(several_arms(several)),
        }
    }

    /// Returns the link after `from` at which the arm ends and its gripper begins. The arm has `joints` joints before `from`.
    fn end(&self, from: &'a str, mut joints: usize) -> Result<&'a str, DescriptionError> {
        /// The least number of arm joints before the jaw of a gripper. After fewer joints, the last joint belongs to the arm, even if
        /// it opens to one side only, as a jaw does. An example is the vertical axis of a gantry.
        const FEWEST: usize = 4;
        let (mut link, mut last) = (from, None);
        loop {
            let longest = self.beyond[link].joints;
            let parts = self.of(link).iter().filter(|branch| self.carried(branch).moves).count();
            let chains = self.of(link).iter().filter(|branch| self.carried(branch).joints > 0).count();
            let is_hand = parts > 1 && (longest <= 1 || chains > 1 && longest <= joints);
            if longest == 0 || joints > 0 && is_hand {
                break;
            }
            let next: Vec<_> =
                self.of(link).iter().filter(|branch| self.carried(branch).joints == longest).collect();
            let [branch] = next.as_slice() else {
                let end = |branch: &&Branch<'a>| {
                    let joints = joints + usize::from(branch.is_driven());
                    self.over_fixed(self.end(branch.child, joints).unwrap_or(branch.child))
                };
                return Err(several_arms(&next.iter().map(end).collect::<Vec<_>>()));
            };
            if branch.is_driven() {
                (joints, last) = (joints + 1, Some((link, *branch)));
            }
            link = branch.child;
        }
        Ok(match last {
            Some((parent, jaw)) if joints > FEWEST && jaw.is_one_sided() => parent,
            _ => link,
        })
    }

    /// Follows fixed joints from `link` as long as each link carries only one other link. Returns the last link. A tool center
    /// point does not count, because it depends on the tool.
    fn over_fixed(&self, mut link: &'a str) -> &'a str {
        let is_next = |branch: &&Branch| branch.is_rigid() && !branch.child.ends_with("tcp");
        loop {
            let mut next = self.of(link).iter().filter(is_next);
            match (next.next(), next.next()) {
                (Some(branch), None) => link = branch.child,
                _ => return link,
            }
        }
    }

    /// Returns the alternatives to `tool`. These are the other links that move rigidly with `tool`, and the links that are connected
    /// to them by one moving joint.
    fn fixed_to(&self, from: &'a str, tool: &'a str) -> Vec<&'a str> {
        let parents = self
            .by_parent
            .iter()
            .flat_map(|(parent, all)| all.iter().map(|branch| (branch.child, (*parent, branch))));
        let parents: HashMap<_, _> = parents.collect();
        let mut first = tool;
        while let Some((parent, _)) =
            parents.get(first).filter(|(_, branch)| branch.is_rigid() && first != from)
        {
            first = parent;
        }
        let (mut links, mut next) = (vec![first], 0);
        while let Some(link) = links.get(next) {
            // Beyond the next moving joint, only the first link counts.
            let is_moved = next > 0 && parents.get(link).is_some_and(|(_, branch)| !branch.is_rigid());
            links.extend(self.of(link).iter().filter(|_| !is_moved).map(|branch| branch.child));
            next += 1;
        }
        links.retain(|link| *link != tool);
        links
    }
}

fn several_arms(tools: &[&str]) -> DescriptionError {
    /// Largest number of names in the message.
    const NAMED: usize = 6;
    DescriptionError::SeveralArms(tools.iter().take(NAMED).map(|tool| format!("{:?}", cut(tool))).collect())
}
