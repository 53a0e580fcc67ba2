//! The choice between q and −q, which represent the same pose.

use dq_algebra::UnitDualQuaternion;
use serde::{Deserialize, Serialize};

/// Returns the goal `q_d` with the sign that brings it nearer to the quaternion of the tool's pose. `q_d` and `−q_d` represent the
/// same pose. Use this function for a new goal.
pub fn nearer_goal(
    base_from_goal: &UnitDualQuaternion,
    base_from_tool: &UnitDualQuaternion,
) -> UnitDualQuaternion {
    SignMemory::nearest(base_from_goal, base_from_tool).signed(base_from_goal)
}

/// The sign of the goal's quaternion, +1 or −1, that the laws use. The quaternions `q_d` and `−q_d` are the same pose, but a law
/// turns the tool toward them along different rotations. A remembered sign keeps the law from taking the longer rotation, and from
/// alternating between the two rotations.
///
/// A new goal gets the sign that brings it nearer to the tool. After that, the sign changes only if `⟨±r_d, r⟩ < −δ`. Here r_d and r
/// are the real parts of the goal and of the tool's pose, and δ is the hysteresis. If the tool is about a half turn from the goal,
/// noise thus does not switch the direction back and forth. Kussaba, Figueredo, Ishihara & Adorno (2017, arXiv 1701.08031) avoid
/// both unwinding and chattering in this manner.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SignMemory {
    sign: f64,
}

impl SignMemory {
    /// Chooses the sign that brings a new goal nearer to the tool, as a quaternion.
    pub fn nearest(base_from_goal: &UnitDualQuaternion, base_from_tool: &UnitDualQuaternion) -> Self {
        let near = base_from_goal.real().dot(&base_from_tool.real()) >= 0.0;
        Self { sign: if near { 1.0 } else { -1.0 } }
    }

    /// Returns the memory for the goal `next`, which replaces the goal `before`. The new sign is chosen so that the two goals, each
    /// multiplied by its sign, are near each other as quaternions.
    ///
    /// So the tool keeps its direction of rotation under a stream of goals, even if the goals are about a half turn from the tool.
    /// [`apply`](Self::apply) changes the sign if the tool must then turn farther than the hysteresis allows.
    pub fn carried(&self, before: &UnitDualQuaternion, next: &UnitDualQuaternion) -> Self {
        let same_side = before.real().dot(&next.real()) >= 0.0;
        Self { sign: if same_side { self.sign } else { -self.sign } }
    }

    /// Returns the sign of the goal's quaternion that the laws use, +1 or −1.
    pub fn sign(&self) -> f64 {
        self.sign
    }

    /// Returns the goal multiplied by the sign. Before that, changes the sign if `⟨±r_d, r⟩ < −hysteresis`. Here r_d and r are the
    /// real parts of the goal and of the tool's pose, and ± is the sign.
    pub fn apply(
        &mut self,
        base_from_goal: &UnitDualQuaternion,
        base_from_tool: &UnitDualQuaternion,
        hysteresis: f64,
    ) -> UnitDualQuaternion {
        if self.sign * base_from_goal.real().dot(&base_from_tool.real()) < -hysteresis {
            self.sign = -self.sign;
        }
        self.signed(base_from_goal)
    }

    fn signed(&self, base_from_goal: &UnitDualQuaternion) -> UnitDualQuaternion {
        if self.sign > 0.0 { *base_from_goal } else { -*base_from_goal }
    }
}
