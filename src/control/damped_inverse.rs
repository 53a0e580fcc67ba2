//! The damped least-squares inverse of the Jacobian of one arm.

use super::Aim;
use super::gram::{Gram, Halves};
use super::transpose::Pull;
use crate::arm::ArmState;
use crate::arm::pair::{dot, put, twice, two};
use nalgebra::Vector3;

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

    /// Joint velocities [rad/s] for what `aim` asks for of the twist `(ω, v)` of the tool along the base's axes, written to `theta_dot`,
    /// finite for every finite input.
    pub fn joint_velocity(
        &self,
        arm: &ArmState,
        aim: Aim,
        twist: &(Vector3<f64>, Vector3<f64>),
        theta_dot: &mut [f64],
    ) {
        let rows = aim.rows(arm);
        let solution = self.solve(&rows.gram(arm), &rows.of(twist));
        Pull::twist(arm, &rows.twist(&solution)).joint_velocity(arm, theta_dot);
    }

    /// Takes out of joint velocities what this inverse would need for what `aim` asks for of the twist that they give the tool:
    /// `(I − J⁺ J) θ̇`. What is left moves an arm of more joints than the aim has rows and nothing that is asked for, where the inverse
    /// is not damped; where it is, that moves by `λ²/(σ² + λ²)` of what it would have.
    pub fn leave_tool(&self, arm: &ArmState, aim: Aim, theta_dot: &mut [f64]) {
        let rows = aim.rows(arm);
        let solution = self.solve(&rows.gram(arm), &rows.of(&arm.tool_twist(theta_dot)));
        let (moment, force) = rows.twist(&solution);
        let (moment, force) = (twice(&moment), twice(&force));
        for (speeds, (angular, linear)) in theta_dot.chunks_mut(2).zip(arm.tool_motion_pairs()) {
            put(two(speeds) - dot(&angular, &moment) - dot(&linear, &force), speeds);
        }
    }

    /// `(J Jᵀ + λ² I)⁻¹` times six numbers, finite for every finite input.
    ///
    /// Fast because away from singularities, which is where arms mostly are, the trace of the inverse that the solution takes anyway
    /// bounds the singular values from below, `1/σ_min² ≤ tr (JJᵀ)⁻¹`, and no eigenvalue is computed.
    #[inline]
    pub(super) fn solve(&self, gram: &Gram, error: &Halves) -> Halves {
        let undamped = gram.inverse(0.0);
        // What rounding makes of a singular matrix has a large trace of either sign.
        let is_far = (undamped.trace() * self.threshold.powi(2)).abs() <= 1.0 && !gram.is_singular();
        let solution = match is_far {
            true => undamped.times(error),
            false => {
                let smallest = gram.smallest_eigenvalue(&undamped).max(0.0).sqrt();
                gram.inverse(self.lambda_squared(smallest)).times(error)
            }
        };
        let is_finite = |(angular, linear): &Halves| angular.sum().is_finite() && linear.sum().is_finite();
        let fallback = || gram.inverse(FALLBACK * (1.0 + gram.trace())).times(error);
        [solution]
            .into_iter()
            .find(is_finite)
            .or_else(|| Some(fallback()).filter(is_finite))
            .unwrap_or_default()
    }
}

impl ArmState {
    /// The smallest singular value of the 6×n Jacobian (rad and m taken alike); 0 for fewer than six joints.
    pub fn smallest_singular_value(&self) -> f64 {
        Gram::of(self).smallest_singular_value()
    }
}
