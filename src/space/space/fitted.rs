//! Capsules fitted around shapes. The fit tries a few lines as the axis, and takes the smallest capsule.

use super::Segment;
use nalgebra::{Isometry3, Vector3};
use std::f64::consts::PI;

/// A capsule around a shape.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fitted {
    /// The segment of the capsule \[m\].
    pub core: Segment,
    /// The radius of the capsule \[m\].
    pub radius: f64,
}

/// A circle around the axis of a capsule, or a torus if `thick` is not 0. The capsule is fitted so that it contains the ring.
#[derive(Clone, Copy)]
struct Ring {
    /// The position of the circle along the axis \[m\].
    along: f64,
    /// The radius of the circle \[m\].
    across: f64,
    /// The radius of the tube of the torus \[m\].
    thick: f64,
}

/// Number of times that the search for the best radius reduces its interval.
const STEPS: u32 = 30;

/// The fraction of the interval that remains after each reduction (golden section, Kiefer 1953).
const GOLDEN: f64 = 0.618_033_988_749_894_9;

impl Fitted {
    /// Creates a capsule that is a ball.
    pub fn ball(center: &Vector3<f64>, radius: f64) -> Self {
        Self { core: Segment { ends: [*center; 2] }, radius }
    }

    /// Creates a capsule along z whose middle is at the origin. `length` excludes the round ends.
    pub fn capsule(radius: f64, length: f64) -> Self {
        let end = Vector3::new(0.0, 0.0, 0.5 * length);
        Self { core: Segment { ends: [-end, end] }, radius }
    }

    /// Creates the smallest capsule around a cylinder along z whose middle is at the origin.
    pub fn cylinder(radius: f64, length: f64) -> Self {
        let rim = |along: f64| Ring { along, across: radius, thick: 0.0 };
        along(&Vector3::zeros(), &Vector3::z(), &[rim(-0.5 * length), rim(0.5 * length)])
    }

    /// Creates the smallest capsule around `points` whose axis is parallel to x, y or z and passes through the middle of the
    /// points' bounding box. Returns `None` if there are no points.
    pub fn points(points: &[Vector3<f64>]) -> Option<Self> {
        let first = points.first()?;
        let bound = |of: fn(&Vector3<f64>, &Vector3<f64>) -> Vector3<f64>| {
            points.iter().fold(*first, |bound, point| of(&bound, point))
        };
        let middle = 0.5 * (bound(Vector3::inf) + bound(Vector3::sup));
        let balls = points.iter().map(|point| (*point, 0.0));
        let axes = [Vector3::x(), Vector3::y(), Vector3::z()].map(|axis| (middle, axis));
        smallest(&axes, balls)
    }

    /// Returns a capsule around this capsule and `other`.
    #[must_use]
    pub fn with(&self, other: &Self) -> Self {
        let ends = [self, other].map(|one| one.core.ends);
        let middles = [self, other].map(|one| one.core.at(0.5));
        let between = ends[0].iter().flat_map(|one| ends[1].iter().map(move |two| (*one, two - one)));
        let longest = between.max_by(|(_, one), (_, two)| one.norm().total_cmp(&two.norm()));
        let axes = [
            (middles[0], self.core.vector()),
            (middles[1], other.core.vector()),
            (middles[0], middles[1] - middles[0]),
        ];
        // Balls with the same center have no direction between them: any direction will do.
        let axes: Vec<_> = axes.into_iter().chain(longest).chain([(middles[0], Vector3::z())]).collect();
        let balls = [self, other].into_iter().flat_map(|one| one.core.ends.map(|end| (end, one.radius)));
        smallest(&axes, balls).unwrap_or(*self)
    }

    /// Returns the capsule moved by the transform `to`.
    #[must_use]
    pub fn moved(&self, to: &Isometry3<f64>) -> Self {
        Self {
            core: Segment { ends: self.core.ends.map(|end| (to * nalgebra::Point3::from(end)).coords) },
            ..*self
        }
    }

    /// Returns the volume of the capsule \[m³\].
    pub fn volume(&self) -> f64 {
        volume(self.core.vector().norm(), self.radius)
    }
}

fn volume(length: f64, radius: f64) -> f64 {
    PI * radius * radius * (length + 4.0 / 3.0 * radius)
}

/// Returns the smallest capsule that contains `balls` and has one of `lines` as its axis. Each line is a point and a direction;
/// each ball is a center and a radius.
fn smallest(
    lines: &[(Vector3<f64>, Vector3<f64>)],
    balls: impl Iterator<Item = (Vector3<f64>, f64)> + Clone,
) -> Option<Fitted> {
    let on = |(origin, axis): &(Vector3<f64>, Vector3<f64>)| {
        let direction = axis.try_normalize(1e-9)?;
        let ring = |(center, thick): (Vector3<f64>, f64)| {
            let offset = center - origin;
            let along = offset.dot(&direction);
            Ring { along, across: (offset - along * direction).norm(), thick }
        };
        Some(along(origin, &direction, &balls.clone().map(ring).collect::<Vec<_>>()))
    };
    lines.iter().filter_map(on).min_by(|one, two| one.volume().total_cmp(&two.volume()))
}

/// Returns the smallest capsule around `rings` whose axis is the line through `origin` along `direction`. Searches for the best
/// radius, because a thicker capsule may be shorter.
fn along(origin: &Vector3<f64>, direction: &Vector3<f64>, rings: &[Ring]) -> Fitted {
    let [bottom, top] = span(rings, f64::INFINITY);
    let middle = 0.5 * (bottom + top);
    let thinnest = rings.iter().map(|ring| ring.across + ring.thick).fold(0.0, f64::max);
    let ball =
        rings.iter().map(|ring| ring.across.hypot(ring.along - middle) + ring.thick).fold(0.0, f64::max);
    let size = |radius: f64| {
        let [bottom, top] = span(rings, radius);
        volume(top - bottom, radius)
    };
    let (mut from, mut to) = (thinnest, ball);
    for _ in 0..STEPS {
        let step = GOLDEN * (to - from);
        if size(to - step) < size(from + step) { to = from + step } else { from = to - step }
    }
    let radius =
        [thinnest, 0.5 * (from + to), ball].into_iter().min_by(|one, two| size(*one).total_cmp(&size(*two)));
    let radius = radius.unwrap_or(ball);
    let ends = span(rings, radius).map(|along| origin + along * direction);
    Fitted { core: Segment { ends }, radius }
}

/// Returns the ends of the shortest segment whose capsule with this radius contains the rings. The ends are positions along the
/// axis. For an infinite radius, returns the range of the rings' positions.
fn span(rings: &[Ring], radius: f64) -> [f64; 2] {
    let (mut bottom, mut top) = (f64::INFINITY, f64::NEG_INFINITY);
    for ring in rings {
        let reach = if radius.is_finite() {
            let room = radius - ring.thick;
            (room * room - ring.across * ring.across).max(0.0).sqrt()
        } else {
            -ring.thick
        };
        (bottom, top) = (bottom.min(ring.along + reach), top.max(ring.along - reach));
    }
    // If `bottom` is above `top`, a ball is enough. Its center may be anywhere between the two positions.
    if bottom > top { [0.5 * (bottom + top); 2] } else { [bottom, top] }
}

/// Largest number of capsules per joint for which [`merged`] compares all pairs. If a joint has more capsules, successive capsules
/// are merged first.
const MOST_OF_ONE: usize = 64;

/// Merges capsules that the same joint moves. Each entry of `all` is the number of a joint and a capsule that this joint moves.
///
/// Two capsules are replaced by one capsule around both if its volume is at most the sum of their volumes. If there are still more
/// than `most` capsules in total, the function continues with the two capsules whose union adds the least volume.
pub fn merged(mut all: Vec<(usize, Fitted)>, most: usize) -> Vec<(usize, Fitted)> {
    all.sort_by_key(|(joint, _)| *joint);
    let mut groups: Vec<_> = all.chunk_by(|one, two| one.0 == two.0).map(Group::new).collect();
    loop {
        let count: usize = groups.iter().map(|group| group.all.len()).sum();
        let added = |group: &Group| group.best().map_or(f64::INFINITY, |best| best.added);
        let best = groups.iter_mut().min_by(|one, two| added(one).total_cmp(&added(two)));
        match best {
            Some(group) if added(group) <= if count > most { f64::MAX } else { 0.0 } => group.merge(),
            _ => {
                return groups
                    .iter()
                    .flat_map(|group| group.all.iter().map(|(_, one)| (group.joint, *one)))
                    .collect();
            }
        }
    }
}

/// The capsules that one joint moves.
struct Group {
    joint: usize,
    /// The capsules, each with a number that is unique in the group. Unions refer to the capsules by these numbers.
    all: Vec<(usize, Fitted)>,
    /// The union of each pair of these capsules.
    unions: Vec<Union>,
}

struct Union {
    of: [usize; 2],
    whole: Fitted,
    /// The volume of the union less the volumes of its two capsules \[m³\]; may be negative.
    added: f64,
}

impl Group {
    fn new(of: &[(usize, Fitted)]) -> Self {
        let mut all: Vec<_> = of.iter().map(|(_, one)| *one).collect();
        while all.len() > MOST_OF_ONE {
            let pairs =
                all.chunks(2).map(|pair| pair.iter().skip(1).fold(pair[0], |one, other| one.with(other)));
            all = pairs.collect();
        }
        let mut group = Self { joint: of[0].0, all: Vec::new(), unions: Vec::new() };
        all.into_iter().for_each(|one| group.add(one));
        group
    }

    fn add(&mut self, new: Fitted) {
        let number = self.all.last().map_or(0, |(last, _)| last + 1);
        let union = |(other, old): &(usize, Fitted)| {
            let whole = old.with(&new);
            Union { of: [*other, number], whole, added: whole.volume() - old.volume() - new.volume() }
        };
        self.unions.extend(self.all.iter().map(union));
        self.all.push((number, new));
    }

    fn best(&self) -> Option<&Union> {
        self.unions.iter().min_by(|one, two| one.added.total_cmp(&two.added))
    }

    fn merge(&mut self) {
        let Some(Union { of, whole, .. }) = self.best() else { return };
        let (of, whole) = (*of, *whole);
        self.all.retain(|(number, _)| !of.contains(number));
        self.unions.retain(|union| !union.of.iter().any(|number| of.contains(number)));
        self.add(whole);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn vector() -> impl Strategy<Value = Vector3<f64>> {
        prop::array::uniform3(-1.0..1.0f64).prop_map(Vector3::from)
    }

    /// Returns how far a point lies outside the capsule; negative inside.
    fn beyond(fitted: &Fitted, point: &Vector3<f64>) -> f64 {
        fitted.core.gap_of(point).distance - fitted.radius
    }

    fn capsule() -> impl Strategy<Value = Fitted> {
        (vector(), vector(), 0.01..0.5f64, 0..3usize).prop_map(|(one, two, radius, kind)| {
            let ends = if kind == 0 { [one, one] } else { [one, two] };
            Fitted { core: Segment { ends }, radius }
        })
    }

    proptest! {
        #[test]
        fn points_and_cylinders_are_inside(points in prop::collection::vec(vector(), 1..20), sizes in prop::array::uniform2(0.01..1.0f64)) {
            let fitted = Fitted::points(&points).unwrap();
            prop_assert!(points.iter().all(|point| beyond(&fitted, point) < 1e-9));
            let [radius, length] = sizes;
            let fitted = Fitted::cylinder(radius, length);
            for point in &points {
                let on_rim = Vector3::new(point.x, point.y, 0.0).normalize() * radius + 0.5 * point.z.signum() * length * Vector3::z();
                prop_assert!(beyond(&fitted, &on_rim) < 1e-9);
            }
        }

        #[test]
        fn the_capsule_around_two_contains_both(one in capsule(), two in capsule(), toward in vector(), part in 0.0..1.0f64) {
            let whole = one.with(&two);
            for of in [one, two] {
                let outermost = of.core.at(part) + of.radius * toward.normalize();
                prop_assert!(beyond(&whole, &outermost) < 1e-9, "{}", beyond(&whole, &outermost));
            }
        }

        #[test]
        fn merged_capsules_contain_all_of_their_joint(all in prop::collection::vec((0..3usize, capsule()), 1..12), most in 3..6usize) {
            let fewer = merged(all.clone(), most);
            prop_assert!(fewer.len() <= most);
            for (joint, one) in all {
                for end in one.core.ends {
                    let inside = fewer.iter().filter(|(of, _)| *of == joint);
                    prop_assert!(inside.map(|(_, whole)| beyond(whole, &end) + one.radius).any(|beyond| beyond < 1e-9));
                }
            }
        }
    }

    #[test]
    fn capsules_are_as_small_as_the_best_axis_allows() {
        let corners = |x: f64, y: f64, z: f64| -> Vec<_> {
            (0..8)
                .map(|i| {
                    Vector3::new(x, y, z).zip_map(&Vector3::new(i & 1, i & 2, i & 4), |size, side| {
                        if side > 0 { size } else { -size }
                    })
                })
                .collect()
        };
        let long = Fitted::points(&corners(0.02, 0.3, 0.03)).unwrap();
        let along = long.core.vector();
        assert!(along.y.abs() > 0.5 && along.x == 0.0 && along.z == 0.0, "{along}");
        // If the round ends extend over the corners, the capsule is thicker and shorter.
        let plain = volume(0.6, 0.02_f64.hypot(0.03));
        assert!(long.volume() < plain && long.volume() > 0.9 * plain, "{} {plain}", long.volume());
        // If the segment ends at the distance d from the rims, the derivative is zero: (R² + d²) = 2 (h − d) d + 2 d √(R² + d²).
        let (radius, half) = (0.1_f64, 0.3);
        let rod = Fitted::cylinder(radius, 2.0 * half);
        let d = half - 0.5 * rod.core.vector().norm();
        let r = radius.hypot(d);
        assert!(
            (r - rod.radius).abs() < 1e-6 && (r * r - 2.0 * (half - d) * d - 2.0 * d * r).abs() < 1e-5,
            "{rod:?}"
        );
        let disc = Fitted::cylinder(0.3, 0.02);
        assert!(
            disc.core.vector().norm() < 1e-6 && (disc.radius - 0.3_f64.hypot(0.01)).abs() < 1e-6,
            "{disc:?}"
        );
    }

    #[test]
    fn a_cylinder_with_a_ball_at_each_end_is_one_capsule() {
        let ball = |z: f64| (2, Fitted::ball(&Vector3::new(0.0, 0.0, z), 0.06));
        let all =
            vec![(2, Fitted::cylinder(0.06, 0.3)), ball(-0.15), ball(0.15), (1, Fitted::cylinder(0.1, 0.1))];
        let fewer = merged(all, 16);
        let [(1, _), (2, arm)] = fewer[..] else { panic!("{fewer:?}") };
        assert!(arm.volume() < 1.1 * volume(0.3, 0.06), "{arm:?}");
        // Two balls that are far apart are not merged.
        let apart = vec![ball(-1.0), ball(1.0)];
        assert_eq!((merged(apart.clone(), 2).len(), merged(apart, 1).len()), (2, 1));
    }

    #[test]
    fn many_capsules_are_merged() {
        let ball = |i: usize| (0, Fitted::ball(&Vector3::new(i as f64, 0.0, 0.0), 0.1));
        assert_eq!(merged((0..1000).map(ball).collect(), 4).len(), 4);
    }
}
