//! Two parts that are close to each other.

use dq_space::space::{Near, Pair, Scene};
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

/// Two parts of a scene that are close to each other, and the gap between them. A part is a capsule of an arm's body, a keep-out,
/// or a keep-in.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ClosePair {
    /// The two parts.
    pub pair: Pair,
    /// The size of the gap \[m\]; negative if the parts overlap, or if the tool is outside of the keep-in.
    pub distance: f64,
    /// The two ends of the gap in the base frame \[m\]. The first end is on the axis of the first capsule. The second end is on the
    /// axis of the other capsule, or on the surface of the keep-out or keep-in.
    pub points: [Vector3<f64>; 2],
}

impl ClosePair {
    /// Creates the pair from `near`, whose parts belong to `scene`.
    pub(super) fn of(scene: &Scene, near: &Near) -> Self {
        let gap = &near.gap;
        Self { pair: scene.pair(near.pair), distance: gap.distance, points: [gap.point, gap.other] }
    }

    /// Describes the pair and the gap in words; `joint` names a joint by its number.
    pub fn explain(&self, joint: impl Fn(usize) -> String) -> String {
        self.pair.explain_gap(self.distance, joint)
    }

    /// Describes the pair, the gap, and the motion that the gap forbids.
    pub(super) fn explain_hold(&self, joint: impl Fn(usize) -> String) -> String {
        let is_outside = self.distance < 0.0 && matches!(self.pair, Pair::KeepIn(..));
        let bound = if is_outside { "go no farther" } else { "come no nearer" };
        format!("{}, and may {bound}", self.explain(joint))
    }
}
