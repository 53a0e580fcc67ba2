//! The state that a second-order law keeps from cycle to cycle.

use super::angular_linear::AngularLinear;
use super::controller::Controller;
use crate::arm::ArmState;
use nalgebra::UnitQuaternion;
use serde::{Deserialize, Serialize};

/// The state of a second-order law: the last velocity, which approaches the law's velocity.
///
/// A law with the twist `ξ` and the [rate](super::ControlLaw::approach_rate) R moves the tool by `V̇ = R (ξ − V)` in the tool's
/// axes. With `ξ = −(K_p/K_d) log(e)` and `R = K_d` that is `V̇ = −K_p log(e) − K_d V`, the PD law on SE(3) (paper §10.2; Bullo &
/// Murray 1995, theorem 5). V is the commanded velocity after all limits. So neither a limit nor a switch from another law leaves
/// an error in V.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Approach {
    /// The tool's twist by the last command, along the tool's axes [rad/s, m/s].
    twist: AngularLinear,
    command: Vec<f64>,
    correction: Vec<f64>,
}

impl Approach {
    /// Creates the state of an arm at rest with this many joints.
    pub fn new(joints: usize) -> Self {
        Self { twist: AngularLinear::default(), command: vec![0.0; joints], correction: vec![0.0; joints] }
    }

    /// Replaces the law's velocities in `theta_dot` with the next command [rad/s, prismatic: m/s]. On entry, `theta_dot` is the
    /// velocity of the law of `controller` at the present positions. The next command lies between the last command, sent `period`
    /// \[s\] ago, and the law's velocities. Returns false, and changes nothing, if the law is of first order.
    pub fn apply(
        &mut self,
        controller: &Controller,
        arm: &ArmState,
        period: f64,
        theta_dot: &mut [f64],
    ) -> bool {
        let rate = controller.approach_rate();
        if rate.is_infinite() {
            return false;
        }
        // At the new joint positions, the last command would give the tool another twist, but V must not change.
        let (angular, linear) = rotated(&arm.base_from_tool().rotation(), &self.twist);
        let (angular_here, linear_here) = arm.tool_twist(&self.command);
        let turned = (angular - angular_here, linear - linear_here);
        controller.joint_velocity_of(arm, &turned, &mut self.correction);
        let left = (-rate * period).exp();
        for ((speed, before), more) in theta_dot.iter_mut().zip(&self.command).zip(&self.correction) {
            *speed = (1.0 - left) * *speed + left * (before + more);
        }
        true
    }

    /// Keeps the joint velocities `command` [rad/s, prismatic: m/s], which the arm gets at the present positions.
    pub fn keep(&mut self, arm: &ArmState, command: &[f64]) {
        self.twist = rotated(&arm.base_from_tool().rotation().inverse(), &arm.tool_twist(command));
        self.command.copy_from_slice(command);
    }
}

fn rotated(rotation: &UnitQuaternion<f64>, (angular, linear): &AngularLinear) -> AngularLinear {
    (rotation * angular, rotation * linear)
}
