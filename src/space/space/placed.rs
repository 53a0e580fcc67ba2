//! A body at given joint positions: the gap of each pair of parts that can meet, and the derivatives of these gaps.

use super::scene::{Against, Meeting, travel};
use super::{Gap, MOST_CAPSULES, MOST_PAIRS, Scene, Segment};
use dq_kinematics::arm::{Chain, JointKind};
use nalgebra::{Isometry3, Vector3};

/// A body at given joint positions.
#[derive(Clone, Debug, PartialEq)]
pub struct Placed {
    /// The segment of each capsule in the base frame.
    cores: Vec<Segment>,
    /// The center of each capsule's segment, and half the length of the segment \[m\].
    balls: Vec<(Vector3<f64>, f64)>,
    /// The axis about or along which each link moves: its direction, and a point on it.
    axes: Vec<(Vector3<f64>, Vector3<f64>)>,
    /// The frame of each link.
    links: Vec<Isometry3<f64>>,
    /// For each pair, the last measured gap; `None` if the gap has not been measured. The gap is measured from the segments of the
    /// capsules, so the radii are not subtracted. For a pair with a keep-out, which does not move, this gap later gives a lower bound
    /// of the gap at other joint positions.
    measured: Vec<Option<Gap>>,
    /// For each list of [`Scene::levers`], the gap below which a pair with these levers counts as near \[m\].
    travels: Vec<f64>,
}

#[cfg(debug_assertions)]
thread_local! {
    /// Number of gaps to keep-outs that this thread has measured. Tests use it as a measure of the work in a cycle.
    pub static MEASURED: std::cell::Cell<usize> = const { std::cell::Cell::new(0) };
}

/// Largest number of parts: the capsules, and the tools of two arms.
const MOST_PARTS: usize = MOST_CAPSULES + 2;

/// Two parts that are near each other.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Near {
    /// The index of the pair of parts.
    pub pair: usize,
    /// The gap between the two parts.
    pub gap: Gap,
}

impl Placed {
    /// Creates the body of `scene`. The body has no position yet.
    pub fn of(scene: &Scene) -> Self {
        let mut placed = Self {
            cores: Vec::new(),
            balls: Vec::new(),
            axes: Vec::new(),
            links: Vec::new(),
            measured: Vec::new(),
            travels: Vec::new(),
        };
        placed.take(scene);
        placed
    }

    /// Allocates the buffers for the body of any scene of these arms.
    pub fn with_room<'a>(chains: impl Iterator<Item = &'a Chain>) -> Self {
        let links = chains.map(Chain::link_count).sum();
        Self {
            cores: Vec::with_capacity(MOST_PARTS),
            balls: Vec::with_capacity(MOST_PARTS),
            axes: Vec::with_capacity(links),
            links: Vec::with_capacity(links),
            measured: Vec::with_capacity(MOST_PAIRS),
            travels: Vec::with_capacity(MOST_PARTS + MOST_CAPSULES * MOST_CAPSULES / 2),
        }
    }

    /// Replaces the body by the body of `scene`. The new body has no position yet. Allocates nothing if there is enough capacity.
    pub fn take(&mut self, scene: &Scene) {
        fn put<T>(list: &mut Vec<T>, of: impl Iterator<Item = T>) {
            list.clear();
            list.extend(of);
        }
        let half = |core: &Segment| 0.5 * core.vector().norm();
        put(&mut self.cores, scene.parts().map(|part| part.core));
        put(&mut self.balls, scene.parts().map(|part| (part.core.at(0.5), half(&part.core))));
        put(&mut self.axes, scene.links.iter().map(|_| (Vector3::z(), Vector3::zeros())));
        put(&mut self.links, scene.links.iter().map(|_| Isometry3::identity()));
        put(&mut self.measured, std::iter::repeat_n(None, scene.pair_count()));
    }

    /// Places the body: sets the joints of `chains`, the arms of `scene`, to `theta` \[rad, prismatic: m\], arm after arm.
    /// Allocates nothing.
    pub fn place<'a>(&mut self, scene: &Scene, chains: impl IntoIterator<Item = &'a Chain>, theta: &[f64]) {
        let (mut slots, mut theta) = (self.links.iter_mut().zip(&mut self.axes), theta);
        for chain in chains {
            let (own, rest) = theta.split_at(chain.joint_count().min(theta.len()));
            chain.for_each_link(own, |link| {
                if let Some((frame, axis)) = slots.next() {
                    *axis = (link.rotation * Vector3::z(), link.translation.vector);
                    *frame = *link;
                }
            });
            theta = rest;
        }
        let base = Isometry3::identity();
        for ((capsule, core), ball) in scene.parts().zip(&mut self.cores).zip(&mut self.balls) {
            let link = capsule.link.checked_sub(1).map_or(&base, |link| &self.links[link]);
            core.ends = capsule.core.ends.map(|end| link.rotation * end + link.translation.vector);
            ball.0 = core.at(0.5);
        }
    }

    /// Sets `near` to the pairs that are near, in the order of `scene`, up to the capacity of `near`. Measures only the gaps that
    /// may be small enough.
    ///
    /// A pair is near if its gap is less than `within(travel)` \[m\]. Here `travel` \[m\] is an upper bound of the decrease of the
    /// gap if each joint moves by `moves` \[rad, prismatic: m\] (see [`Scene::travel`]).
    pub fn near(
        &mut self,
        scene: &Scene,
        moves: impl Iterator<Item = f64> + Clone,
        within: impl Fn(f64) -> f64,
        near: &mut Vec<Near>,
    ) {
        near.clear();
        self.travels.clear();
        self.travels.extend(scene.levers.iter().map(|levers| within(travel(levers, moves.clone()))));
        for (pair, meeting) in scene.meetings.iter().enumerate() {
            let within = self.travels[meeting.levers];
            if self.at_least(scene, pair) < within && near.len() < near.capacity() {
                let gap = self.core_gap(scene, meeting);
                self.measured[pair] = Some(gap);
                let gap = gap.less(meeting.radius);
                if gap.distance < within {
                    near.push(Near { pair, gap });
                }
            }
        }
    }

    /// Returns the gap of the pair with the index `pair`.
    pub fn gap_of(&self, scene: &Scene, pair: usize) -> Gap {
        let meeting = &scene.meetings[pair];
        self.core_gap(scene, meeting).less(meeting.radius)
    }

    /// Returns a lower bound of the gap of a pair with a keep-out; `None` for other pairs. `near` is the gap of this pair at other
    /// joint positions. This takes little computation.
    pub fn gap_at_least(&self, scene: &Scene, near: &Near) -> Option<Gap> {
        let Meeting { capsule, against, .. } = scene.meetings[near.pair];
        matches!(against, Against::KeepOut(_)).then(|| self.cores[capsule].gap_at_least(&near.gap))
    }

    /// Returns a lower bound of a pair's gap \[m\]. This takes little computation.
    fn at_least(&self, scene: &Scene, pair: usize) -> f64 {
        let meeting = &scene.meetings[pair];
        let (middle, half) = self.balls[meeting.capsule];
        let distance = match meeting.against {
            Against::KeepOut(other) => {
                let by_ball = scene.keep_outs[other].shape.at_least(&middle) - half;
                let core = &self.cores[meeting.capsule];
                self.measured[pair].map_or(by_ball, |gap| by_ball.max(core.gap_at_least(&gap).distance))
            }
            Against::KeepIn(_) => f64::NEG_INFINITY,
            Against::Capsule(other) => {
                let (other, other_half) = self.balls[other];
                (middle - other).norm() - half - other_half
            }
        };
        distance - meeting.radius
    }

    /// Returns the gap between the segment of a pair's capsule and the other part, which may be the segment of another capsule.
    fn core_gap(&self, scene: &Scene, meeting: &Meeting) -> Gap {
        #[cfg(debug_assertions)]
        MEASURED.set(MEASURED.get() + usize::from(matches!(meeting.against, Against::KeepOut(_))));
        let core = &self.cores[meeting.capsule];
        match meeting.against {
            Against::KeepOut(other) => scene.keep_outs[other].shape.gap_to(core),
            Against::KeepIn(other) => scene.keep_ins[other].shape.gap_inside(&core.ends[0]),
            Against::Capsule(other) => core.gap_to(&self.cores[other]),
        }
    }

    /// Calls `each` with the gaps at both ends of each segment of a pair. If two segments are parallel, the gap at a single point
    /// does not show how the segments may move.
    ///
    /// For a tool in a box, a cylinder or a hull, calls `each` with the gap to each face, because several faces may be equally
    /// near.
    pub fn ends(&self, scene: &Scene, pair: usize, mut each: impl FnMut(Gap)) {
        let meeting = &scene.meetings[pair];
        let core = &self.cores[meeting.capsule];
        match meeting.against {
            Against::KeepOut(other) => {
                let shape = &scene.keep_outs[other].shape;
                core.ends.iter().for_each(|end| each(shape.gap_at(end).less(meeting.radius)));
            }
            Against::KeepIn(other) => scene.keep_ins[other].shape.faces(&core.ends[0], each),
            Against::Capsule(other) => {
                let other = &self.cores[other];
                core.ends.iter().for_each(|end| each(other.gap_of(end).less(meeting.radius)));
                for end in &other.ends {
                    let gap = core.gap_of(end).less(meeting.radius);
                    each(Gap { normal: -gap.normal, point: gap.other, other: gap.point, ..gap });
                }
            }
        }
    }

    /// Sets `slope` to the derivatives of a pair's `gap` with respect to the joint positions [m/rad, prismatic: m/m] (Faverjon &
    /// Tournassoud 1987). They are the normal times the Jacobian of the capsule's point. For a pair of capsules, the normal times
    /// the Jacobian of the other capsule's point is subtracted.
    pub fn slope(&self, scene: &Scene, pair: usize, gap: &Gap, slope: &mut [f64]) {
        let meeting = &scene.meetings[pair];
        slope.fill(0.0);
        self.add_motion(scene, meeting.capsule, &gap.point, &gap.normal, slope);
        if let Against::Capsule(other) = meeting.against {
            self.add_motion(scene, other, &gap.other, &-gap.normal, slope);
        }
    }

    fn add_motion(
        &self,
        scene: &Scene,
        capsule: usize,
        point: &Vector3<f64>,
        normal: &Vector3<f64>,
        slope: &mut [f64],
    ) {
        for link in scene.part(capsule).carried_by.clone() {
            let ((direction, origin), (coupling, kind)) = (&self.axes[link], &scene.links[link]);
            slope[coupling.driver] += coupling.ratio
                * match kind {
                    JointKind::Revolute => direction.cross(&(point - origin)).dot(normal),
                    JointKind::Prismatic => direction.dot(normal),
                };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::space::{Body, KeepOut, Pair, SceneError, Why};
    use dq_algebra::UnitDualQuaternion;
    use dq_kinematics::arm::{Coupling, Joint, JointKind};
    use nalgebra::{Unit, UnitQuaternion};
    use proptest::prelude::*;

    const KEEP_OUTS: [&str; 6] = [
        "table half_space 0 0.1 1 -0.4",
        "ball sphere 0.9 0.3 0.2 0.1",
        "crate box 0.5 -0.6 0.3 0.2 0.3 0.4 0.5 0.5 0.5 0.5",
        "pipe cylinder -0.5 0.5 0.2 0.1 0.5 0.6 0 0 0.8",
        "beam capsule 0.2 0.2 0.9 0.05 0.6 0.6 0 0.8 0",
        "wedge hull 0.3 0.5 0.1 0.8 0.6 0 0.5 0.9 0.2 0.6 0.5 0.5",
    ];

    const KEEP_INS: [&str; 6] = [
        "low half_space 0 0.1 1 0.4",
        "near sphere 0.3 0.3 0.2 0.9",
        "cell box 0.4 0.1 0.3 1.2 1.3 1.4 0.5 0.5 0.5 0.5",
        "hall cylinder 0.4 0.2 0.2 0.8 1.6 0.6 0 0 0.8",
        "lane capsule 0.2 0.2 0.5 0.7 0.6 0.6 0 0.8 0",
        "tent hull -1 -0.8 -0.4 1 -0.9 -0.3 1 1 -0.4 -1 1 -0.3 -0.8 0.1 1 0.9 0 1.2",
    ];

    /// Returns two arms of three joints each. One joint of each arm is prismatic.
    fn chains() -> [Chain; 2] {
        let joint = |kind, xyz: [f64; 3], turn: [f64; 3]| Joint {
            kind,
            parent_from_joint: UnitDualQuaternion::from_parts(UnitQuaternion::new(turn.into()), xyz.into()),
            axis: Unit::new_normalize(Vector3::new(0.3, -0.2, 1.0)),
        };
        let joints = [
            joint(JointKind::Revolute, [0.0, 0.1, 0.2], [0.0; 3]),
            joint(JointKind::Prismatic, [0.3, 0.0, 0.1], [1.2, 0.3, 0.0]),
            joint(JointKind::Revolute, [0.0, 0.3, 0.1], [-0.8, 0.0, 0.4]),
        ];
        let tool = UnitDualQuaternion::from_parts(UnitQuaternion::identity(), Vector3::new(0.2, 0.0, 0.2));
        let one = Chain::from_joints(&joints, &tool).unwrap();
        let beside = UnitDualQuaternion::from_parts(UnitQuaternion::identity(), Vector3::new(0.8, 0.2, 0.0));
        [one.clone(), one.standing_at(&beside)]
    }

    /// Returns the arms of [`chains`] with two joints each. The first joint of an arm also drives its third link.
    fn driven() -> [Chain; 2] {
        let third = Coupling { driver: 0, ratio: -0.7, offset: 0.2 };
        let couplings = vec![Coupling::own(0), Coupling::own(1), third];
        let kinds = vec![JointKind::Revolute, JointKind::Prismatic];
        chains().map(|chain| chain.driven_by(kinds.clone(), couplings.clone()).unwrap())
    }

    fn scene(chains: &[Chain]) -> Scene {
        let keep_outs: Vec<KeepOut> = KEEP_OUTS.map(|text| text.parse().unwrap()).to_vec();
        let keep_ins: Vec<KeepOut> = KEEP_INS.map(|text| text.parse().unwrap()).to_vec();
        let ranges = [(-3.0, 3.0); 6];
        let scene = Scene::new(Body::along(chains, 0.03), keep_outs, chains, &ranges).unwrap();
        scene.staying_in(keep_ins, chains, &ranges).unwrap()
    }

    proptest! {
        #[test]
        fn slopes_are_the_derivatives_of_gaps(
            theta in prop::array::uniform6(-1.5..1.5f64), is_driven in any::<bool>()
        ) {
            const STEP: f64 = 1e-5;
            let chains = if is_driven { driven() } else { chains() };
            let scene = scene(&chains);
            let mut placed = Placed::of(&scene);
            let mut gaps_at = |theta: &[f64; 6]| {
                placed.place(&scene, &chains, theta);
                let gaps: Vec<_> = (0..scene.pair_count()).map(|pair| placed.gap_of(&scene, pair)).collect();
                let mut slopes = Vec::new();
                for (pair, gap) in gaps.iter().enumerate() {
                    let mut slope = [0.0; 6];
                    placed.slope(&scene, pair, gap, &mut slope);
                    slopes.push(slope);
                }
                (gaps, slopes)
            };
            let (_, slopes) = gaps_at(&theta);
            for joint in 0..scene.joint_count() {
                let mut beside = |side: f64| {
                    let mut theta = theta;
                    theta[joint] += side * STEP;
                    gaps_at(&theta).0
                };
                let (less, more) = (beside(-1.0), beside(1.0));
                for (pair, (less, more)) in less.iter().zip(&more).enumerate() {
                    let difference = (more.distance - less.distance) / (2.0 * STEP);
                    // If the nearest edge or point changes, there is a kink. Inside a box, a cylinder or a hull, two faces may be
                    // equally near.
                    let is_outside = less.distance + scene.radius(pair) > 1e-3;
                    let is_same =
                        (more.normal - less.normal).norm() < 1e-4 && (more.point - less.point).norm() < 1e-4;
                    let is_smooth = is_outside && is_same;
                    prop_assert!(
                        !is_smooth || (difference - slopes[pair][joint]).abs() < 2e-4,
                        "{:?} joint {joint}: {difference} {}", scene.pair(pair), slopes[pair][joint]
                    );
                }
            }
        }

        #[test]
        fn no_gap_closes_by_more_than_the_travel_of_its_joints(
            theta in prop::array::uniform6(-1.5..1.5f64), moves in prop::array::uniform6(-0.5..0.5f64),
            is_driven in any::<bool>()
        ) {
            let chains = if is_driven { driven() } else { chains() };
            let scene = scene(&chains);
            let mut placed = Placed::of(&scene);
            let mut gaps = |part: f64| {
                let theta: Vec<_> = theta.iter().zip(moves).map(|(theta, moves)| theta + part * moves).collect();
                placed.place(&scene, &chains, &theta);
                (0..scene.pair_count()).map(|pair| placed.gap_of(&scene, pair).distance).collect::<Vec<_>>()
            };
            let (before, after) = (gaps(0.0), gaps(1.0));
            for pair in 0..scene.pair_count() {
                let travel = scene.travel(pair, moves.into_iter());
                prop_assert!((after[pair] - before[pair]).abs() <= travel + 1e-9, "{:?}", scene.pair(pair));
            }
        }
    }

    /// Also checks that a gap measured at other joint positions gives a valid lower bound.
    #[test]
    fn a_pair_that_is_not_measured_is_not_near() {
        let chains = chains();
        let scene = scene(&chains);
        let (mut placed, mut near) = (Placed::of(&scene), Vec::with_capacity(MOST_PAIRS));
        let mut before: Vec<Near> = Vec::new();
        for step in 0..2000 {
            let theta: Vec<_> = (0..6).map(|joint| (0.001 * f64::from(step * (joint + 3))).sin()).collect();
            placed.place(&scene, &chains, &theta);
            for pair in &before {
                let at_least =
                    placed.gap_at_least(&scene, pair).map_or(f64::NEG_INFINITY, |gap| gap.distance);
                assert!(at_least <= placed.gap_of(&scene, pair.pair).distance + 1e-9, "{pair:?}");
            }
            placed.near(&scene, std::iter::empty(), |_| 0.1, &mut near);
            let gaps = (0..scene.pair_count()).map(|pair| placed.gap_of(&scene, pair));
            let expected = gaps.enumerate().map(|(pair, gap)| Near { pair, gap });
            assert_eq!(near, expected.filter(|near| near.gap.distance < 0.1).collect::<Vec<_>>());
            before = near.clone();
        }
    }

    #[test]
    fn body_parts_that_always_touch_are_left_out_and_keep_outs_are_not() {
        let chains = chains();
        let all = scene(&chains);
        let words: Vec<_> = all
            .left_out()
            .iter()
            .map(|(pair, why)| {
                format!("{}: {}", pair.explain(|joint| format!("joint{joint}")), why.explain())
            })
            .collect();
        assert!(
            words.contains(&"the link of joint2 and the link of joint1: neighbours".to_owned()),
            "{words:?}"
        );
        // The length is in the wrong unit, so the sphere contains the whole arm.
        let floor: KeepOut = "floor sphere 0 0 0 500".parse().unwrap();
        let body = Body::along(&chains[..1], 0.1);
        let moved = body.capsules.iter().filter(|capsule| capsule.link > 0).count();
        let standing = Scene::new(body, vec![floor], &chains[..1], &[(-3.0, 3.0); 3]).unwrap();
        let pairs = (0..standing.pair_count()).map(|pair| standing.pair(pair));
        assert_eq!(pairs.filter(|pair| matches!(pair, Pair::KeepOut(..))).count(), moved);
        let base = (Pair::KeepOut(0, standing.keep_outs()[0].name), Why::Fixed);
        assert!(standing.left_out().contains(&base), "{:?}", standing.left_out());
    }

    #[test]
    fn too_many_keep_outs_are_rejected_by_name() {
        let chains = chains();
        let things = |from: usize, to: usize| {
            (from..to)
                .map(|i| format!("thing{i} sphere 1 1 1 0.1").parse().unwrap())
                .collect::<Vec<KeepOut>>()
        };
        let new = |body: Body, things| Scene::new(body, things, &chains, &[(-3.0, 3.0); 6]);
        let body = Body::along(&chains, 0.03);
        let full = new(body.clone(), things(0, 62)).unwrap();
        let why = full.besides(things(62, 66)).unwrap_err().to_string();
        assert!(why.ends_with("no room for thing64, thing65"), "{why}");
        assert_eq!(full.besides(things(62, 64)).unwrap(), new(body.clone(), things(0, 64)).unwrap());
        let cell = full.staying_in(things(62, 65), &chains, &[(-3.0, 3.0); 6]).unwrap_err().to_string();
        assert!(cell.ends_with("no room for thing64"), "{cell}");
        let capsules = body.capsules.iter().cycle().take(MOST_CAPSULES + 1).cloned().collect();
        assert_eq!(new(Body { capsules }, Vec::new()), Err(SceneError::Capsules(MOST_CAPSULES + 1)));
    }
}
