//! Which pairs of a scene can meet: all but those that never come apart.

use super::placed::Placed;
use super::scene::{Against, Meeting};
use super::{Body, Capsule, KeepOut, MOST_CAPSULES, MOST_KEEP_OUTS, Scene, Why};
use crate::arm::{Chain, JointKind};
use std::f64::consts::PI;

/// So many configurations are looked at to find pairs that always touch.
const SAMPLES: u32 = 200;

/// Of the body itself, what is apart in so many of them at most, 5 %, has nothing to do with how the arm moves (as MoveIt's setup assistant
/// takes it).
const SELDOM: u32 = SAMPLES / 20;

/// A joint that slides and has no limits is taken to stay within this \[m\].
const SLIDE: f64 = 3.0;

impl Scene {
    /// For these arms, whose joints move within these ranges \[rad, prismatic: m\], arm after arm. Pairs that always touch are left out.
    /// More than [`MOST_CAPSULES`] and [`MOST_KEEP_OUTS`] are not taken.
    pub fn new(body: Body, keep_outs: Vec<KeepOut>, chains: &[Chain], ranges: &[(f64, f64)]) -> Self {
        let joint_count = chains.iter().map(Chain::joint_count).sum();
        let levers = levers(&body.capsules, chains, ranges);
        let meetings = meetings(&body, &keep_outs, &levers);
        let mut scene = Self {
            body,
            keep_outs,
            tools: Vec::new(),
            keep_ins: Vec::new(),
            meetings,
            left_out: Vec::new(),
            joint_count,
        };
        scene.body.capsules.truncate(MOST_CAPSULES);
        scene.keep_outs.truncate(MOST_KEEP_OUTS);
        scene.leave_out(chains, ranges);
        scene
    }

    /// The same, with the tool of each of these arms, of which a scene is made, to stay in all of `keep_ins`, of which more than
    /// [`MOST_KEEP_OUTS`] are not taken.
    #[must_use]
    pub fn staying_in(mut self, mut keep_ins: Vec<KeepOut>, chains: &[Chain], ranges: &[(f64, f64)]) -> Self {
        keep_ins.truncate(MOST_KEEP_OUTS);
        self.tools = Capsule::tools(chains);
        let levers = levers(&self.tools, chains, ranges);
        for (tool, levers) in levers.into_iter().enumerate() {
            let capsule = self.body.capsules.len() + tool;
            let inside = (0..keep_ins.len()).map(|other| Meeting {
                capsule,
                against: Against::KeepIn(other),
                levers: levers.clone(),
                radius: 0.0,
            });
            self.meetings.extend(inside);
        }
        self.keep_ins = keep_ins;
        self
    }

    /// Leaves out what cannot be kept apart.
    fn leave_out(&mut self, chains: &[Chain], ranges: &[(f64, f64)]) {
        let mut apart = vec![0_u32; self.meetings.len()];
        let mut placed = Placed::of(self);
        for number in 0..SAMPLES {
            placed.place(self, chains, &sample(number, ranges));
            for (count, meeting) in apart.iter_mut().zip(&self.meetings) {
                if *count <= meeting.spare() {
                    *count += u32::from(placed.gap(self, meeting).distance > 0.0);
                }
            }
        }
        let why = |meeting: &Meeting, apart: u32| {
            let moving = meeting.levers.iter().filter(|lever| **lever > 0.0).count();
            match meeting.against {
                Against::Capsule(_) if moving == 0 => Some(Why::Fixed),
                Against::Capsule(_) if moving == 1 => Some(Why::Neighbours),
                Against::KeepOut(_) if moving == 0 => Some(Why::Fixed),
                _ if apart <= meeting.spare() => Some(Why::Touch),
                _ => None,
            }
        };
        let (mut kept, mut left_out) = (Vec::new(), Vec::new());
        for (meeting, apart) in std::mem::take(&mut self.meetings).into_iter().zip(apart) {
            match why(&meeting, apart) {
                None => kept.push(meeting),
                Some(why) => left_out.push((self.named(&meeting), why)),
            }
        }
        (self.meetings, self.left_out) = (kept, left_out);
    }
}

impl Meeting {
    /// In so many configurations at most the two of a pair are apart that always touch.
    fn spare(&self) -> u32 {
        match self.against {
            Against::Capsule(_) => SELDOM,
            Against::KeepOut(_) | Against::KeepIn(_) => 0,
        }
    }
}

/// The joint positions of that number, spread evenly over these ranges (Roberts 2018).
fn sample(number: u32, ranges: &[(f64, f64)]) -> Vec<f64> {
    let root = (0..64).fold(1.5_f64, |g, _| (1.0 + g).powf(1.0 / (ranges.len() as f64 + 1.0)));
    let mut step = 1.0;
    let place = |(lower, upper): &(f64, f64)| {
        step /= root;
        let (lower, upper) = (lower.max(-PI), upper.min(PI));
        lower + (0.5 + f64::from(number) * step).fract() * (upper - lower)
    };
    ranges.iter().map(place).collect()
}

/// For each capsule how far a point of its core is at most from each joint's axis \[m\]; 1 for a joint that slides, 0 for one that does
/// not move it.
fn levers(capsules: &[Capsule], chains: &[Chain], ranges: &[(f64, f64)]) -> Vec<Vec<f64>> {
    let origins: Vec<_> = chains.iter().flat_map(Chain::joint_origins).map(|origin| origin.norm()).collect();
    let kinds: Vec<_> = chains.iter().flat_map(|chain| chain.kinds().iter().copied()).collect();
    let slide = |joint: usize| match (kinds[joint], ranges.get(joint)) {
        (JointKind::Prismatic, Some((lower, upper))) if lower.is_finite() && upper.is_finite() => {
            lower.abs().max(upper.abs())
        }
        (JointKind::Prismatic, _) => SLIDE,
        (JointKind::Revolute, _) => 0.0,
    };
    let of = |capsule: &Capsule| {
        let mut levers = vec![0.0; kinds.len()];
        let mut reach = capsule.core.ends.iter().fold(0.0_f64, |most, end| most.max(end.norm()));
        for joint in capsule.moved_by.clone().rev() {
            levers[joint] = if kinds[joint] == JointKind::Prismatic { 1.0 } else { reach };
            reach += slide(joint) + origins[joint];
        }
        levers
    };
    capsules.iter().map(of).collect()
}

/// All pairs.
fn meetings(body: &Body, keep_outs: &[KeepOut], levers: &[Vec<f64>]) -> Vec<Meeting> {
    let capsules = &body.capsules[..body.capsules.len().min(MOST_CAPSULES)];
    let keep_outs = &keep_outs[..keep_outs.len().min(MOST_KEEP_OUTS)];
    let mut meetings = Vec::new();
    for (capsule, of) in capsules.iter().enumerate() {
        let others = (0..keep_outs.len()).map(|other| Meeting {
            capsule,
            against: Against::KeepOut(other),
            levers: levers[capsule].clone(),
            radius: of.radius,
        });
        meetings.extend(others);
        for (other, with) in capsules.iter().enumerate().take(capsule) {
            // Joints that move both do not move one against the other.
            let of_one = levers[capsule].iter().zip(&levers[other]).enumerate();
            let levers = of_one.map(|(joint, (one, two))| {
                let both = of.moved_by.contains(&joint) && with.moved_by.contains(&joint);
                if both { 0.0 } else { one + two }
            });
            meetings.push(Meeting {
                capsule,
                against: Against::Capsule(other),
                levers: levers.collect(),
                radius: of.radius + with.radius,
            });
        }
    }
    meetings
}
