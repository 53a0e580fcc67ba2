//! Joint position limits.

use dq_kinematics::arm::{JointKind, bounds};
use dq_params::Parameters;

/// The position range of each joint, and the margin in which a joint slows down.
///
/// Only a joint that is near its limit slows down, and only if it moves outward. The other joints continue to move, and the law
/// continues from the resulting positions in each cycle. Scaling the whole velocity, as for the speed limits, would stop the whole
/// arm as soon as one joint is at its limit.
///
/// In a servo, the lists have one number per joint, which is infinite for a joint without a limit.
#[derive(Clone, Debug, PartialEq, Parameters)]
#[parameters(prefix = "limits.joint_position_")]
pub struct PositionLimits {
    /// smallest joint positions, one per joint; empty: no limits \[rad, m\]
    #[parameter(range = -bounds::JOINT_ANGLE..=bounds::JOINT_ANGLE)]
    pub lower: Vec<f64>,
    /// largest joint positions, one per joint; empty: no limits \[rad, m\]
    #[parameter(range = -bounds::JOINT_ANGLE..=bounds::JOINT_ANGLE)]
    pub upper: Vec<f64>,
    /// distance from a position limit within which a joint slows down \[rad, m\]
    #[parameter(name = "limits.position_margin", default = 0.1, range = 0.0..=3.0)]
    pub margin: f64,
}

/// For each kind of joint, the displacement in [`PositionLimits::beside`] \[rad, prismatic: m\].
const ASIDE: [(JointKind, f64); 2] = [(JointKind::Revolute, 0.3), (JointKind::Prismatic, 0.1)];

impl PositionLimits {
    /// Returns joint positions near `positions`. The tool pose at the returned positions is a goal that the arm can reach.
    ///
    /// Each joint is displaced upward by 0.3 rad (prismatic: 0.1 m) and stays at least the margin away from its limits. If there is
    /// not enough space for this displacement, the joint is displaced downward instead. If there is not enough space downward
    /// either, the joint is displaced in the direction with more space, by half of that space.
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

    /// Returns the smallest and the largest position of each joint \[rad, prismatic: m\].
    pub fn ranges(&self) -> impl Iterator<Item = (f64, f64)> + Clone {
        self.lower.iter().copied().zip(self.upper.iter().copied())
    }

    /// Returns whether `positions` has one position per joint, within the limits.
    pub fn contain(&self, positions: &[f64]) -> bool {
        let mut joints = positions.iter().zip(self.ranges());
        let is_within = |(position, (lower, upper)): (&f64, _)| {
            position.is_finite() && (lower..=upper).contains(position)
        };
        positions.len() == self.lower.len() && joints.all(is_within)
    }

    /// Creates infinite limits for `joint_count` joints.
    pub fn none(joint_count: usize) -> Self {
        Self {
            lower: vec![f64::NEG_INFINITY; joint_count],
            upper: vec![f64::INFINITY; joint_count],
            margin: 0.0,
        }
    }

    /// Returns whether `position` is beyond a limit of joint number `joint`, or at most the margin away from one.
    pub fn is_near(&self, joint: usize, position: f64) -> bool {
        (position - self.lower[joint]).min(self.upper[joint] - position) <= self.margin
    }

    /// Returns whether `position` is beyond the limit of joint number `joint` in the given direction, or at most the margin away
    /// from that limit. The limit is the upper one if `direction` is positive, otherwise the lower one.
    pub fn is_near_towards(&self, joint: usize, position: f64, direction: f64) -> bool {
        let room = if direction > 0.0 { self.upper[joint] - position } else { position - self.lower[joint] };
        room <= self.margin
    }
}
