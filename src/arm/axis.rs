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

/// The axes of two joints, or of one and of none, which has no direction and so adds nothing to any sum.
///
/// Fast because what is computed of one joint is computed of two at once.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct AxisPair {
    pub direction: Vector3<f64x2>,
    pub point: Vector3<f64x2>,
    /// 1 for a joint that turns, 0 for one that slides; none where both turn.
    turns: Option<f64x2>,
}

impl AxisPair {
    /// The axes of joints of these kinds, one or two, with nothing known of where they are.
    pub fn new(kinds: &[JointKind]) -> Self {
        let turns = [0, 1].map(|i| if kinds.get(i) == Some(&JointKind::Prismatic) { 0.0 } else { 1.0 });
        Self {
            direction: Vector3::from_element(f64x2::ZERO),
            point: Vector3::from_element(f64x2::ZERO),
            turns: Some(f64x2::new(turns)).filter(|_| turns.contains(&0.0)),
        }
    }

    /// The first axis, or the second one.
    pub fn axis(&self, index: usize) -> JointAxis {
        let turns = self.turns.is_none_or(|turns| turns.to_array()[index] == 1.0);
        JointAxis {
            kind: if turns { JointKind::Revolute } else { JointKind::Prismatic },
            direction: self.direction.map(|numbers| numbers.to_array()[index]),
            point: self.point.map(|numbers| numbers.to_array()[index]),
        }
    }

    /// Puts the first axis, or the second one, where it is now.
    pub fn set_axis(&mut self, index: usize, direction: &Vector3<f64>, point: &Vector3<f64>) {
        for (slot, number) in self.direction.iter_mut().zip(direction) {
            slot.as_mut_array()[index] = *number;
        }
        for (slot, number) in self.point.iter_mut().zip(point) {
            slot.as_mut_array()[index] = *number;
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
