//! Two parts of the space that are near each other.

use dq_space::space::{Near, Pair, Scene};
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

/// Two that are near each other, and how far they are from each other.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ClosePair {
    /// Which.
    pub pair: Pair,
    /// The gap between them \[m\].
    pub distance: f64,
    /// Where the gap is: a point of the core of the first, and one of the other or of its core, or of the edge that the tool is in, in the base frame \[m\].
    pub points: [Vector3<f64>; 2],
}

impl ClosePair {
    /// Two of `scene` that are near each other.
    pub(super) fn of(scene: &Scene, near: &Near) -> Self {
        let gap = &near.gap;
        Self { pair: scene.pair(near.pair), distance: gap.distance, points: [gap.point, gap.other] }
    }

    /// The pair and the gap in words; `joint` names a joint by its number.
    pub fn explain(&self, joint: impl Fn(usize) -> String) -> String {
        self.pair.explain_gap(self.distance, joint)
    }

    /// The same, and what it forbids.
    pub(super) fn explain_hold(&self, joint: impl Fn(usize) -> String) -> String {
        let is_outside = self.distance < 0.0 && matches!(self.pair, Pair::KeepIn(..));
        let bound = if is_outside { "go no farther" } else { "come no nearer" };
        format!("{}, and may {bound}", self.explain(joint))
    }
}
