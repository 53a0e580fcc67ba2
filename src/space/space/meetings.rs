//! The pairs of parts in a scene that can collide. A pair is left out if no joint moves one part relative to the other, if the
//! parts are neighbors at a joint, or if they are parts of the body that always touch.

use super::placed::Placed;
use super::scene::{Against, Meeting};
use super::{Body, Capsule, KeepOut, MOST_CAPSULES, MOST_KEEP_OUTS, Scene, SceneError, Why};
use dq_kinematics::arm::{Chain, Coupling, JointKind};
use std::f64::consts::PI;

/// Number of configurations that are sampled to find the pairs that always touch.
const SAMPLES: u32 = 200;

/// A pair counts as always touching if its parts are apart in at most this many samples: 5 %, as in MoveIt's setup assistant.
const SELDOM: u32 = SAMPLES / 20;

/// The assumed range of a prismatic joint without limits, on each side of 0 \[m\].
const SLIDE: f64 = 3.0;

impl Scene {
    /// Creates the scene of the arms `chains`, whose joints move within `ranges` \[rad, prismatic: m\], arm after arm. Leaves out
    /// pairs of parts that cannot collide or that always touch: see [`left_out`](Self::left_out()).
    ///
    /// # Errors
    /// [`SceneError`] if there are more than [`MOST_CAPSULES`] capsules or [`MOST_KEEP_OUTS`] keep-outs.
    pub fn new(
        body: Body,
        keep_outs: Vec<KeepOut>,
        chains: &[Chain],
        ranges: &[(f64, f64)],
    ) -> Result<Self, SceneError> {
        if body.capsules.len() > MOST_CAPSULES {
            return Err(SceneError::Capsules(body.capsules.len()));
        }
        let links = links(chains);
        let mut scene = Self {
            levers: levers(&body.capsules, chains, &links, ranges),
            body,
            keep_outs: Vec::new(),
            tools: Vec::new(),
            keep_ins: Vec::new(),
            meetings: Vec::new(),
            left_out: Vec::new(),
            links,
            joint_count: chains.iter().map(Chain::joint_count).sum(),
        };
        scene.meet_itself();
        scene.leave_out(chains, ranges);
        // Until here, the levers are per motion of each link, not of each joint.
        scene.levers = scene.levers.iter().map(|levers| scene.of_joints(levers)).collect();
        scene.keep_out_of(keep_outs)?;
        Ok(scene)
    }

    /// Returns the scene with additional keep-outs.
    ///
    /// # Errors
    /// [`SceneError`] if there are more than [`MOST_KEEP_OUTS`] keep-outs and keep-ins.
    pub fn besides(&self, more: Vec<KeepOut>) -> Result<Self, SceneError> {
        let mut scene = self.clone();
        scene.keep_out_of(more)?;
        Ok(scene)
    }

    /// Returns the scene with keep-ins: the tool of each arm must stay in all of `keep_ins`. The caller must pass the `chains` and
    /// `ranges` from which the scene was created.
    ///
    /// # Errors
    /// [`SceneError`] if there are more than [`MOST_KEEP_OUTS`] keep-ins and keep-outs together.
    pub fn staying_in(
        mut self,
        keep_ins: Vec<KeepOut>,
        chains: &[Chain],
        ranges: &[(f64, f64)],
    ) -> Result<Self, SceneError> {
        self.check_room(&keep_ins)?;
        self.tools = Capsule::tools(chains);
        let first = self.levers.len();
        let levers = levers(&self.tools, chains, &self.links, ranges);
        self.levers.extend(levers.iter().map(|levers| self.of_joints(levers)).collect::<Vec<_>>());
        for tool in 0..self.tools.len() {
            let capsule = self.body.capsules.len() + tool;
            let against = (0..keep_ins.len()).map(Against::KeepIn);
            let inside =
                against.map(|against| Meeting { capsule, against, levers: first + tool, radius: 0.0 });
            self.meetings.extend(inside);
        }
        self.keep_ins = keep_ins;
        Ok(self)
    }

    /// Converts the levers of one part (see [`Scene::levers`]) from one number per link to one number per joint. A joint may move
    /// several links.
    fn of_joints(&self, levers: &[f64]) -> Vec<f64> {
        let mut of_joints = vec![0.0; self.joint_count];
        for (lever, (coupling, _)) in levers.iter().zip(&self.links) {
            of_joints[coupling.driver] += coupling.ratio.abs() * lever;
        }
        of_joints
    }

    /// Returns how many more keep-outs can be added.
    pub fn room(&self) -> usize {
        MOST_KEEP_OUTS.saturating_sub(self.keep_outs.len() + self.keep_ins.len())
    }

    fn check_room(&self, more: &[KeepOut]) -> Result<(), SceneError> {
        match more.get(self.room()..) {
            Some(beyond @ [_, ..]) => {
                Err(SceneError::KeepOuts(beyond.iter().map(|keep_out| keep_out.name).collect()))
            }
            _ => Ok(()),
        }
    }

    /// Adds the keep-outs `more`, and pairs each of them with each capsule that can move. Two capsules that always touch are left
    /// out. A capsule and a keep-out are checked even if they always touch, because the keep-out is not a part of the arm.
    fn keep_out_of(&mut self, more: Vec<KeepOut>) -> Result<(), SceneError> {
        self.check_room(&more)?;
        for keep_out in more {
            let against = Against::KeepOut(self.keep_outs.len());
            self.keep_outs.push(keep_out);
            for (capsule, Capsule { radius, carried_by, .. }) in self.body.capsules.iter().enumerate() {
                let meeting = Meeting { capsule, against, levers: capsule, radius: *radius };
                match carried_by.is_empty() {
                    true => self.left_out.push((self.named(&meeting), Why::Fixed)),
                    false => self.meetings.push(meeting),
                }
            }
        }
        Ok(())
    }

    /// Adds each pair of two capsules.
    fn meet_itself(&mut self) {
        let capsules = &self.body.capsules;
        for (capsule, of) in capsules.iter().enumerate() {
            for (other, with) in capsules.iter().enumerate().take(capsule) {
                // A link that carries both capsules does not move one relative to the other.
                let of_one = self.levers[capsule].iter().zip(&self.levers[other]).enumerate();
                let levers = of_one.map(|(link, (one, two))| {
                    let both = of.carried_by.contains(&link) && with.carried_by.contains(&link);
                    if both { 0.0 } else { one + two }
                });
                let levers = levers.collect();
                self.meetings.push(Meeting {
                    capsule,
                    against: Against::Capsule(other),
                    levers: self.levers.len(),
                    radius: of.radius + with.radius,
                });
                self.levers.push(levers);
            }
        }
    }

    /// Leaves out three kinds of pairs of capsules: pairs in which no joint moves one capsule relative to the other, neighbors at a
    /// single joint, and pairs that always touch.
    fn leave_out(&mut self, chains: &[Chain], ranges: &[(f64, f64)]) {
        let mut apart = vec![0_u32; self.meetings.len()];
        let mut placed = Placed::of(self);
        for number in 0..SAMPLES {
            placed.place(self, chains, &sample(number, ranges));
            for (pair, count) in apart.iter_mut().enumerate().filter(|(_, count)| **count <= SELDOM) {
                *count += u32::from(placed.gap_of(self, pair).distance > 0.0);
            }
        }
        for (meeting, apart) in std::mem::take(&mut self.meetings).into_iter().zip(apart) {
            let moving = self.levers[meeting.levers].iter().filter(|lever| **lever > 0.0).count();
            let why = match moving {
                0 => Some(Why::Fixed),
                1 => Some(Why::Neighbours),
                _ => (apart <= SELDOM).then_some(Why::Touch),
            };
            match why {
                None => self.meetings.push(meeting),
                Some(why) => self.left_out.push((self.named(&meeting), why)),
            }
        }
    }
}

/// Returns the joint positions of sample `number` \[rad, prismatic: m\]. The samples are spread evenly over the joint ranges (Roberts
/// 2018). A limit beyond ±π counts as ±π.
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

/// Returns the coupling and the joint kind of each link. `Coupling::driver` is an index into the joints of all arms.
fn links(chains: &[Chain]) -> Vec<(Coupling, JointKind)> {
    let (mut links, mut before) = (Vec::new(), 0);
    for chain in chains {
        let of_all = |(of, kind): (Coupling, _)| (Coupling { driver: before + of.driver, ..of }, kind);
        links.extend(chain.couplings().map(of_all));
        before += chain.joint_count();
    }
    links
}

/// Returns the levers of each capsule, one per link: an upper bound of the distance of the capsule's segment from the axis of the
/// link \[m\]. The lever is 1 for a link that slides, and 0 for a link that does not carry the capsule.
fn levers(
    capsules: &[Capsule],
    chains: &[Chain],
    links: &[(Coupling, JointKind)],
    ranges: &[(f64, f64)],
) -> Vec<Vec<f64>> {
    let origins: Vec<_> = chains.iter().flat_map(Chain::joint_origins).map(|origin| origin.norm()).collect();
    let slide = |(coupling, kind): &(Coupling, JointKind)| match (kind, ranges.get(coupling.driver)) {
        (JointKind::Prismatic, Some((lower, upper))) if lower.is_finite() && upper.is_finite() => {
            coupling.at(*lower).abs().max(coupling.at(*upper).abs())
        }
        (JointKind::Prismatic, _) => SLIDE,
        (JointKind::Revolute, _) => 0.0,
    };
    let of = |capsule: &Capsule| {
        let mut levers = vec![0.0; links.len()];
        let mut reach = capsule.core.ends.iter().fold(0.0_f64, |most, end| most.max(end.norm()));
        for link in capsule.carried_by.clone().rev() {
            levers[link] = if links[link].1 == JointKind::Prismatic { 1.0 } else { reach };
            reach += slide(&links[link]) + origins[link];
        }
        levers
    };
    capsules.iter().map(of).collect()
}
