//! The choice between q and −q, which are the same pose.

use dq_algebra::UnitDualQuaternion;
use serde::{Deserialize, Serialize};

/// The nearer of `q_d` and `−q_d` to the tool's pose: the sign that a new goal gets.
pub fn nearer_goal(
    base_from_goal: &UnitDualQuaternion,
    base_from_tool: &UnitDualQuaternion,
) -> UnitDualQuaternion {
    SignMemory::nearest(base_from_goal, base_from_tool).signed(base_from_goal)
}

/// Keeps a sign for the goal: +1 or −1, so that no law takes the long way round nor hesitates between the two.
///
/// A new goal gets the sign of the nearer of the two. After that the sign flips only when `⟨±r_d, r⟩ < −δ`: the memory
/// keeps noise near a half turn from switching the direction back and forth. This is the hysteresis by which Kussaba,
/// Figueredo, Ishihara & Adorno (2017, arXiv 1701.08031) avoid both unwinding and chattering.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SignMemory {
    sign: f64,
}

impl SignMemory {
    /// The nearer sign for a new goal.
    pub fn nearest(base_from_goal: &UnitDualQuaternion, base_from_tool: &UnitDualQuaternion) -> Self {
        let near = base_from_goal.real().dot(&base_from_tool.real()) >= 0.0;
        Self { sign: if near { 1.0 } else { -1.0 } }
    }

    /// The memory for `next`, which replaces the goal `before`: the sign that stays on its side, so that a stream of goals near a
    /// half turn does not choose anew with each. Where that is the far side by more than the hysteresis, `apply` flips it.
    pub fn carried(&self, before: &UnitDualQuaternion, next: &UnitDualQuaternion) -> Self {
        let same_side = before.real().dot(&next.real()) >= 0.0;
        Self { sign: if same_side { self.sign } else { -self.sign } }
    }

    /// +1 or −1.
    pub fn sign(&self) -> f64 {
        self.sign
    }

    /// The goal with the sign in force, after a flip where `⟨±r_d, r⟩ < −hysteresis`.
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
