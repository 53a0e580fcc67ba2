//! Joint position limits: how fast a joint may go towards them.

use crate::arm::JointKind;

/// An approach to a limit takes at least this many cycles to come e times nearer, however narrow the margin is: a joint state is
/// some cycles old, and the joint must not be past the limit by then.
const APPROACH_CYCLES: f64 = 20.0;

/// And this many times as long as it takes until a command shows in the joint states, and until the next one: an arm that follows with
/// a lag coasts farther than one that is only late, and for that the latency is taken, which comes out up to half as long as the lag.
const APPROACH_DELAYS: f64 = 5.0;

/// The part of the deceleration that braking before a limit counts on; the rest is for joint states that are some cycles old.
const BRAKING_SHARE: f64 = 0.5;

/// Between which positions each joint may be, and where it slows down.
///
/// Only the joint that is near a limit is slowed, and only outward: to scale the whole velocity, as the speed limits do, would
/// hold the whole arm as soon as one joint is at its limit. The others go on, and the law sees each cycle where that has led.
#[derive(Clone, Debug, PartialEq)]
pub struct PositionLimits {
    /// Smallest joint positions \[rad, prismatic: m\], one a joint; −∞ for a joint without.
    pub lower: Vec<f64>,
    /// Largest joint positions \[rad, prismatic: m\], one a joint; ∞ for a joint without.
    pub upper: Vec<f64>,
    /// Distance from a limit \[rad, prismatic: m\] inside which the joint is slowed.
    pub margin: f64,
}

/// What a joint has for braking.
#[derive(Clone, Copy, Debug)]
pub(super) struct Brakes {
    /// Its largest speed [rad/s, prismatic: m/s].
    pub speed: f64,
    /// Its deceleration [rad/s², prismatic: m/s²].
    pub deceleration: f64,
    /// How fast its acceleration may change [rad/s³, prismatic: m/s³].
    pub jerk: f64,
    /// The cycle \[s\].
    pub period: f64,
    /// From a command to the joint state that shows it and to the next one, with what came late in the last seconds \[s\].
    pub delay: f64,
}

/// How far [`PositionLimits::beside`] goes \[rad, prismatic: m\].
const ASIDE: [(JointKind, f64); 2] = [(JointKind::Revolute, 0.3), (JointKind::Prismatic, 0.1)];

impl PositionLimits {
    /// Positions a little aside of `positions`, inside the limits: the pose of the tool there is one that the arm reaches. Joints of these
    /// kinds go up by 0.3 rad or 0.1 m, where their limits leave no room for it down, and where neither half of the way to the farther one.
    pub fn beside(&self, positions: &[f64], kinds: &[JointKind]) -> Vec<f64> {
        let bounds = self.lower.iter().zip(&self.upper);
        let aside = |((position, kind), (lower, upper)): ((&f64, &JointKind), (&f64, &f64))| {
            let step = ASIDE.iter().find(|(of, _)| of == kind).map_or(0.0, |(_, step)| *step);
            let (up, down) = (upper - self.margin - position, position - self.margin - lower);
            position
                + match (up >= step, down >= step) {
                    (true, _) => step,
                    (false, true) => -step,
                    (false, false) if up >= down => 0.5 * up.max(0.0),
                    (false, false) => -0.5 * down.max(0.0),
                }
        };
        positions.iter().zip(kinds).zip(bounds).map(aside).collect()
    }

    /// Smallest and largest position of each joint \[rad, prismatic: m\].
    pub fn ranges(&self) -> impl Iterator<Item = (f64, f64)> + Clone {
        self.lower.iter().copied().zip(self.upper.iter().copied())
    }

    /// Whether these are positions of all joints within their limits.
    pub(super) fn contain(&self, positions: &[f64]) -> bool {
        let mut joints = positions.iter().zip(self.ranges());
        let is_within = |(position, (lower, upper)): (&f64, _)| {
            position.is_finite() && (lower..=upper).contains(position)
        };
        positions.len() == self.lower.len() && joints.all(is_within)
    }

    /// No limits for `joint_count` joints.
    pub fn none(joint_count: usize) -> Self {
        Self {
            lower: vec![f64::NEG_INFINITY; joint_count],
            upper: vec![f64::INFINITY; joint_count],
            margin: 0.0,
        }
    }

    /// Whether the joint is nearer than the margin to a limit, or beyond it.
    pub(super) fn is_near(&self, joint: usize, position: f64) -> bool {
        (position - self.lower[joint]).min(self.upper[joint] - position) <= self.margin
    }

    /// Whether the joint is nearer than the margin to the limit that lies in the direction of `way`, or beyond it.
    pub(super) fn is_near_towards(&self, joint: usize, position: f64, way: f64) -> bool {
        let room = if way > 0.0 { self.upper[joint] - position } else { position - self.lower[joint] };
        room <= self.margin
    }

    /// The speed [rad/s] at which a joint may approach a limit `distance` \[rad\] away: proportional to the distance where that
    /// needs no more deceleration than there is, and on the curve of constant deceleration before, which joins it smoothly.
    pub(super) fn speed_towards(&self, distance: f64, brakes: &Brakes) -> f64 {
        let slowest = (APPROACH_CYCLES * brakes.period).max(APPROACH_DELAYS * brakes.delay);
        // A joint whose acceleration cannot change as fast slows down no faster than that can.
        let rate = (brakes.speed / self.margin).min(1.0 / slowest).min(brakes.jerk / brakes.deceleration);
        let deceleration = BRAKING_SHARE * brakes.deceleration;
        let proportional_below = deceleration / (rate * rate);
        match distance {
            d if d <= 0.0 => 0.0,
            d if d <= proportional_below => rate * d,
            d => (2.0 * deceleration * (d - 0.5 * proportional_below)).sqrt(),
        }
    }
}
