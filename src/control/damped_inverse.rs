//! The damped least-squares inverse of the Jacobian of one arm.

use super::gram::Gram;
use crate::arm::ArmState;
use nalgebra::Vector6;

/// `J⁺ = Jᵀ(JJᵀ + λ²I)⁻¹`, with λ growing smoothly only near a singularity.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Damping {
    /// λ at the singularity.
    pub max: f64,
    /// The smallest singular value σ₀ below which damping begins.
    pub threshold: f64,
}

/// Relative floor of λ² for the case that damping is switched off and the solve fails: finite before exact.
const FALLBACK: f64 = 1e-9;

impl Damping {
    /// `λ² = λ_max² (1 − (σ/σ₀)²)` below σ₀, 0 above.
    pub fn lambda_squared(&self, smallest_singular_value: f64) -> f64 {
        if smallest_singular_value >= self.threshold {
            return 0.0;
        }
        self.max.powi(2) * (1.0 - (smallest_singular_value / self.threshold).powi(2))
    }

    /// Joint velocities [rad/s] for the twist `(ω, v)` of the tool along the base's axes, written to `theta_dot`, finite for every
    /// finite input.
    ///
    /// Fast because away from singularities, which is where arms mostly are, the trace of the inverse that the solution takes anyway
    /// bounds the singular values from below, `1/σ_min² ≤ tr (JJᵀ)⁻¹`, and no eigenvalue is computed.
    pub(super) fn joint_velocity(&self, arm: &ArmState, twist: &Vector6<f64>, theta_dot: &mut [f64]) {
        let solution = self.solution(arm, twist);
        for (speed, column) in theta_dot.iter_mut().zip(arm.tool_columns()) {
            *speed = column.dot(&solution);
        }
    }

    /// Takes out of joint velocities what this inverse would need for the twist that they give the tool: `(I − J⁺ J) θ̇`. What is left
    /// moves an arm of more than six joints and not its tool, where the inverse is not damped; where it is, the tool moves by
    /// `λ²/(σ² + λ²)` of what it would have.
    pub fn leave_tool(&self, arm: &ArmState, theta_dot: &mut [f64]) {
        let (omega, v) = arm.tool_twist(theta_dot);
        let solution = self.solution(arm, &Vector6::new(omega.x, omega.y, omega.z, v.x, v.y, v.z));
        for (speed, column) in theta_dot.iter_mut().zip(arm.tool_columns()) {
            *speed -= column.dot(&solution);
        }
    }

    /// `(J Jᵀ + λ² I)⁻¹` times the twist, finite for every finite input.
    fn solution(&self, arm: &ArmState, twist: &Vector6<f64>) -> Vector6<f64> {
        let gram = Gram::of(arm);
        self.solve(&gram, twist)
            .or_else(|| gram.inverse(FALLBACK * (1.0 + gram.trace()))?.times(twist))
            .unwrap_or_else(Vector6::zeros)
    }

    /// `(J Jᵀ + λ² I)⁻¹` times the twist.
    fn solve(&self, gram: &Gram, twist: &Vector6<f64>) -> Option<Vector6<f64>> {
        let undamped = gram.inverse(0.0);
        let square = self.threshold.powi(2);
        // What rounding makes of a singular matrix has a large trace of either sign.
        match undamped.as_ref().filter(|inverse| (inverse.trace() * square).abs() <= 1.0) {
            Some(inverse) => inverse.times(twist),
            None => {
                let smallest = gram.smallest_eigenvalue(undamped.as_ref()).max(0.0).sqrt();
                gram.inverse(self.lambda_squared(smallest))?.times(twist)
            }
        }
    }
}

impl ArmState {
    /// The smallest singular value of the 6×n Jacobian (rad and m taken alike); 0 for fewer than six joints.
    pub fn smallest_singular_value(&self) -> f64 {
        let gram = Gram::of(self);
        gram.smallest_eigenvalue(gram.inverse(0.0).as_ref()).max(0.0).sqrt()
    }
}
