//! The arm's body: capsules on its links.

use super::Segment;
use dq_algebra::UnitDualQuaternion;
use dq_kinematics::arm::Chain;
use nalgebra::{Point3, Vector3};
use std::ops::Range;
use thiserror::Error;

/// A capsule on a link: all points within a radius of a segment. It moves with the link.
#[derive(Clone, Debug, PartialEq)]
pub struct Capsule {
    /// The number of the link that carries the capsule, counted from 1, arm after arm; 0 for a part fixed to the base. If each
    /// joint moves one link, this is also the number of the joint that moves the link.
    pub link: usize,
    /// The indices of the links whose motion moves the capsule, counted from 0, arm after arm: the capsule's own link and the links
    /// before it.
    pub(super) carried_by: Range<usize>,
    /// The segment \[m\] in the frame of the link, whose z axis is the joint's axis. If the part is fixed to the base, the segment
    /// is in the base frame.
    pub core: Segment,
    /// The radius \[m\].
    pub radius: f64,
}

/// The error for a text that is not a capsule.
#[derive(Clone, Debug, Error, PartialEq)]
#[error("{text:?} is not a capsule: expected {}", Self::EXPECTED)]
pub struct CapsuleError {
    /// The text, shortened.
    pub text: String,
}

impl CapsuleError {
    /// The expected form.
    pub const EXPECTED: &str = "the name of a joint, or base, then x y z and x y z in the frame that moves with it, and a radius, all in m";
}

/// The capsules of one or two arms.
#[derive(Clone, Debug, PartialEq)]
pub struct Body {
    /// The capsules, arm after arm.
    pub capsules: Vec<Capsule>,
}

/// A link shorter than this has no capsule of its own \[m\].
const SHORTEST: f64 = 1e-6;

/// Largest radius of a capsule, and largest distance of its ends from the joint \[m\].
const LARGEST: f64 = 100.0;

impl Body {
    /// Creates a body with a capsule along each link, from the link's joint to the next joint or the tool. Another capsule leads
    /// from the base to the first joint. All have the radius `radius` \[m\].
    pub fn along(chains: &[Chain], radius: f64) -> Self {
        let (mut capsules, mut before) = (Vec::new(), 0);
        for chain in chains {
            let origins: Vec<_> = chain.joint_origins().collect();
            let tool = chain.last_link_from_tool().translation();
            let ends = origins.iter().skip(1).copied().chain([tool]).enumerate();
            let links = ends.map(|(i, end)| (i + 1, Segment { ends: [Vector3::zeros(), end] }));
            let foot = origins.first().map(|first| (0, Segment { ends: [chain.base_point(), *first] }));
            for (link, core) in foot.into_iter().chain(links) {
                if core.vector().norm() > SHORTEST {
                    capsules.push(Capsule::new(before, link, core, radius));
                }
            }
            before += chain.link_count();
        }
        Self { capsules }
    }

    /// Parses the capsules of one arm. `joints` are the names of the joints that move the links.
    ///
    /// # Errors
    /// [`CapsuleError`] for the first invalid text.
    pub fn parse(texts: &[String], joints: &[String]) -> Result<Self, CapsuleError> {
        let capsules = texts.iter().map(|text| {
            let wrong = || CapsuleError { text: dq_common::text::cut(text).into_owned() };
            let (link, core, radius) = parse(text, joints).ok_or_else(wrong)?;
            Ok(Capsule::new(0, link, core, radius))
        });
        Ok(Self { capsules: capsules.collect::<Result<_, _>>()? })
    }

    /// Returns the body of the same arm with its base at `world_from_base`. Parts that are fixed to the base are then given in the
    /// world frame.
    #[must_use]
    pub fn standing_at(mut self, world_from_base: &UnitDualQuaternion) -> Self {
        let world_from_base = world_from_base.frame();
        for capsule in self.capsules.iter_mut().filter(|capsule| capsule.link == 0) {
            capsule.core.ends = capsule.core.ends.map(|end| (world_from_base * Point3::from(end)).coords);
        }
        self
    }

    /// Creates the body of all arms from the body of each arm. If several arms have the same part fixed to the base, the result has
    /// it once.
    pub fn of_arms(bodies: impl IntoIterator<Item = Self>, chains: &[Chain]) -> Self {
        let (mut capsules, mut before) = (Vec::new(), 0);
        for (body, chain) in bodies.into_iter().zip(chains) {
            for Capsule { link, core, radius, .. } in body.capsules {
                let capsule = Capsule::new(before, link, core, radius);
                if link > 0 || !capsules.contains(&capsule) {
                    capsules.push(capsule);
                }
            }
            before += chain.link_count();
        }
        Self { capsules }
    }
}

impl Capsule {
    /// Returns one capsule per arm for the arm's tool. Each of these capsules is a point without extent, the tool point.
    pub(super) fn tools(chains: &[Chain]) -> Vec<Self> {
        let mut before = 0;
        let each = chains.iter().map(|chain| {
            let core = Segment { ends: [chain.last_link_from_tool().translation(); 2] };
            let tool = Self::new(before, chain.link_count(), core, 0.0);
            before += chain.link_count();
            tool
        });
        each.collect()
    }

    /// Creates a capsule on the link `link` of an arm, counted from 1; 0 is the arm's base. `before` is the total number of links
    /// of all earlier arms.
    fn new(before: usize, link: usize, core: Segment, radius: f64) -> Self {
        let carried_by = before..before + link;
        Self { link: if link == 0 { 0 } else { carried_by.end }, carried_by, core, radius }
    }
}

/// Parses the link, the segment and the radius of a capsule. The text is the name of a joint, a blank, and seven numbers. The name
/// may contain any characters, blanks included. It may also be `base`, or be missing.
fn parse(text: &str, joints: &[String]) -> Option<(usize, Segment, f64)> {
    let named = |text: &str, name: &str| {
        text.strip_prefix(name).filter(|rest| rest.starts_with(char::is_whitespace)).and_then(numbers)
    };
    // If several names match, the longest one counts. Blanks at the beginning may be part of the name or not.
    let of = |text: &str| {
        let found = joints
            .iter()
            .enumerate()
            .filter_map(|(number, name)| Some((name.len(), (number + 1, named(text, name)?))));
        found.max_by_key(|(length, _)| *length).map(|(_, found)| found)
    };
    let trimmed = text.trim_start();
    let base = || named(trimmed, "base").or_else(|| numbers(text)).map(|numbers| (0, numbers));
    let (link, [a, b, c, d, e, f, radius]) = of(text).or_else(|| of(trimmed)).or_else(base)?;
    let core = Segment { ends: [Vector3::new(a, b, c), Vector3::new(d, e, f)] };
    let is_near = core.ends.iter().all(|end| end.norm() <= LARGEST);
    (is_near && radius > 0.0 && radius <= LARGEST).then_some((link, core, radius))
}

fn numbers(text: &str) -> Option<[f64; 7]> {
    let numbers: Vec<f64> = text.split_whitespace().map(str::parse).collect::<Result<_, _>>().ok()?;
    numbers.try_into().ok()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const NUMBERS: &str = "0 0 0 0 0 0.5 0.1";

    fn joint(text: &str, joints: &[&str]) -> Option<usize> {
        let joints: Vec<_> = joints.iter().map(|name| (*name).to_owned()).collect();
        let body = Body::parse(&[text.to_owned()], &joints).ok()?;
        Some(body.capsules[0].link)
    }

    #[test]
    fn names_are_matched_exactly() {
        let names = ["a", "a 1", "a ", " a", "1", "base", "a\u{a0}1", "\"a\", 'b'/c"];
        for (number, name) in (1..).zip(names) {
            assert_eq!(joint(&format!("{name} {NUMBERS}"), &names), Some(number), "{name:?}");
        }
        assert_eq!(joint(NUMBERS, &names), Some(0));
        assert_eq!(joint(&format!("base {NUMBERS}"), &["a"]), Some(0));
        assert_eq!(joint(&format!("  a \t {NUMBERS} "), &["a"]), Some(1), "by hand, with blanks");
        for wrong in ["b 0 0 0 0 0 0.5 0.1", "a 0 0 0 0 0 0.5", "a1 0 0 0 0 0 0.5 0.1", "a0 0 0 0 0 0.5 0.1"]
        {
            assert_eq!(joint(wrong, &["a"]), None, "{wrong:?}");
        }
    }

    proptest! {
        #[test]
        fn names_with_any_characters_are_distinguished(one in "[ a1.\u{a0}\"']{1,4}", other in "[ a1.\u{a0}\"']{1,4}") {
            prop_assume!(one != other);
            prop_assert_eq!(joint(&format!("{one} {NUMBERS}"), &[&one, &other]), Some(1));
        }
    }
}
