//! The memory of a law: what it keeps from cycle to cycle during one motion.

use super::PoseError;
use super::angular_linear::rotated;
use super::control_law::{LawInput, MEMORY, Map, ToolMotion};
use super::controller::Controller;
use crate::arm::ArmState;
use dq_algebra::UnitDualQuaternion;
use nalgebra::Quaternion;
use serde::{Deserialize, Serialize};

/// The memory of the present law. A law without a memory leaves it empty.
///
/// A law computes its twist from its input and this memory alone. So a motion can be recorded and replayed, several motions can use
/// one law at the same time, and the servo can evaluate the law one cycle ahead on a copy.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct LawMemory {
    numbers: [f64; MEMORY],
    /// The [number](super::Law::number) of the law that has written the numbers; `None` before a law has written any in this
    /// motion.
    law: Option<usize>,
}

impl LawMemory {
    /// Forgets everything, so that the next cycle begins a motion.
    pub fn reset(&mut self) {
        self.law = None;
    }

    /// Sets `theta_dot` to the joint velocities [rad/s, prismatic: m/s] of the present law of `controller`. For a law without a
    /// memory, these are the velocities of [`Controller::joint_velocity`]. Call this function once per cycle. `command` are the
    /// joint velocities of the last command [rad/s, prismatic: m/s], and `period` is the time since that command \[s\]. A law that
    /// was not used in the previous cycle begins with a new memory. Does not allocate.
    pub fn joint_velocity(
        &mut self,
        controller: &Controller,
        arm: &ArmState,
        base_from_goal: &UnitDualQuaternion,
        (command, period): (&[f64], f64),
        theta_dot: &mut [f64],
    ) {
        let law = controller.law;
        let memory = &mut self.numbers[..law.memory_size()];
        if memory.is_empty() {
            self.law = None;
            return controller.joint_velocity(arm, base_from_goal, theta_dot);
        }
        let input = controller.input(arm, base_from_goal);
        let motion = tool_motion(&input, command, period);
        if self.law != Some(law.number()) {
            self.law = Some(law.number());
            law.begin(&motion, memory);
        }
        let twist = rotated(&arm.base_from_tool().rotation(), &law.twist_with_memory(&motion, memory));
        match law.map() {
            Map::Transpose => input.transpose(&twist, theta_dot),
            Map::DampedInverse => input.damped_inverse(|| twist, theta_dot),
        }
    }
}

/// Returns the input of a law with a memory, rotated from the base's axes to the tool's axes.
fn tool_motion(input: &LawInput, command: &[f64], period: f64) -> ToolMotion {
    let tool_from_base = input.arm.base_from_tool().rotation().inverse();
    let PoseError { rotation, translation } = input.error();
    let error = PoseError {
        rotation: Quaternion::from_parts(rotation.w, tool_from_base * rotation.imag()),
        translation: tool_from_base * translation,
    };
    let twist = rotated(&tool_from_base, &input.arm.tool_twist(command));
    ToolMotion { gains: input.gains, error, twist, period }
}
