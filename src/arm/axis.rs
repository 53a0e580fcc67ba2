//! The axes of joints, one by one and two side by side.

use super::JointKind;
use super::pair::dot;
use nalgebra::Vector3;
use wide::f64x2;

/// The line about which a joint turns, or along which it slides, in the base frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JointAxis {
    /// What it does.
    pub kind: JointKind,
    /// Along the line, of length 1.
    pub direction: Vector3<f64>,
    /// On the line \[m\].
    pub point: Vector3<f64>,
}

impl JointAxis {
    /// That of no joint, which has no direction and so adds nothing to any sum.
    pub(super) const NONE: Self = Self {
        kind: JointKind::Revolute,
        direction: Vector3::new(0.0, 0.0, 0.0),
        point: Vector3::new(0.0, 0.0, 0.0),
    };

    /// How the joint turns what it carries, for each unit of its own speed.
    pub fn angular(&self) -> Vector3<f64> {
        match self.kind {
            JointKind::Revolute => self.direction,
            JointKind::Prismatic => Vector3::zeros(),
        }
    }

    /// The velocity that the joint gives a point that it carries, for each unit of its own speed: `l × (t − p)` \[m/rad\], or `l`.
    pub fn linear(&self, point: &Vector3<f64>) -> Vector3<f64> {
        match self.kind {
            JointKind::Revolute => self.direction.cross(&(point - self.point)),
            JointKind::Prismatic => self.direction,
        }
    }
}

/// The axes of two joints, or of one and of [none](JointAxis::NONE).
///
/// Fast because what is computed of one joint is computed of two at once.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct AxisPair {
    pub direction: Vector3<f64x2>,
    pub point: Vector3<f64x2>,
    /// 1 for a joint that turns, 0 for one that slides; none where both turn.
    pub turns: Option<f64x2>,
}

impl AxisPair {
    /// Of no joints.
    pub fn none() -> Self {
        let zeros = Vector3::from_element(f64x2::ZERO);
        Self { direction: zeros, point: zeros, turns: None }
    }

    /// The first axis, or the second one.
    pub fn axis(&self, index: usize) -> JointAxis {
        JointAxis {
            kind: self.kind(index),
            direction: self.direction.map(|numbers| numbers.to_array()[index]),
            point: self.point.map(|numbers| numbers.to_array()[index]),
        }
    }

    fn kind(&self, index: usize) -> JointKind {
        let turns = self.turns.is_none_or(|turns| turns.to_array()[index] == 1.0);
        if turns { JointKind::Revolute } else { JointKind::Prismatic }
    }

    /// Makes the first axis, or the second one, what it is now.
    pub fn set_axis(&mut self, index: usize, axis: &JointAxis) {
        for (slot, number) in self.direction.iter_mut().zip(&axis.direction) {
            slot.as_mut_array()[index] = *number;
        }
        for (slot, number) in self.point.iter_mut().zip(&axis.point) {
            slot.as_mut_array()[index] = *number;
        }
        if axis.kind != self.kind(index) {
            let mut kinds = [0, 1].map(|i| self.kind(i));
            kinds[index] = axis.kind;
            self.turns = turns(kinds);
        }
    }

    /// How each joint turns what it carries, for each unit of its own speed: l, or 0.
    #[inline(always)]
    pub fn angular(&self) -> Vector3<f64x2> {
        self.turns.map_or(self.direction, |turns| self.direction * turns)
    }

    /// The velocity that each joint gives a point that it carries, for each unit of its own speed: `l × (t − p)` \[m/rad\], or `l`.
    #[inline(always)]
    pub fn linear(&self, point: &Vector3<f64x2>) -> Vector3<f64x2> {
        let turned = self.direction.cross(&(point - self.point));
        self.turns.map_or(turned, |turns| turned * turns + self.direction * (1.0 - turns))
    }

    /// The moment about each axis, or the force along it, of a moment about the base's origin and a force there.
    #[inline(always)]
    pub fn give_way(&self, moment: &Vector3<f64x2>, force: &Vector3<f64x2>) -> f64x2 {
        let turned = dot(&self.direction, &(moment + force.cross(&self.point)));
        self.turns.map_or(turned, |turns| turned * turns + dot(&self.direction, force) * (1.0 - turns))
    }
}

/// 1 for a joint that turns, 0 for one that slides; none where both turn.
pub(super) fn turns(kinds: [JointKind; 2]) -> Option<f64x2> {
    kinds.contains(&JointKind::Prismatic).then(|| {
        f64x2::new(kinds.map(|kind| match kind {
            JointKind::Revolute => 1.0,
            JointKind::Prismatic => 0.0,
        }))
    })
}
