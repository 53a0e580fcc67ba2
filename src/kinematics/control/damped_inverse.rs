//! The damped least-squares inverse of the Jacobian.

use super::Aim;
use super::angular_linear::{AngularLinear, first, is_finite, twice};
use super::gram::Gram;
use crate::arm::ArmState;
use crate::arm::pair::{Motions, dot, put, two};
use wide::f64x2;

/// The damping λ of the damped inverse `J⁺ = Jᵀ(JJᵀ + λ²I)⁻¹`. λ is 0 away from singularities, and grows smoothly toward them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Damping {
    /// λ at the singularity.
    pub max: f64,
    /// The singular value σ₀ below which damping begins.
    pub threshold: f64,
}

/// The λ² that is used if the solution with the usual λ is not finite, as a fraction of `1 + tr J Jᵀ`.
const FALLBACK: f64 = 1e-9;

/// The smallest λ² that exceeds the rounding errors of `J Jᵀ`, as a fraction of `1 + tr J Jᵀ`.
const ROUNDING: f64 = 1e-15;

impl Damping {
    /// Returns `λ² = λ_max² (1 − (σ/σ₀)²)` for a singular value σ below σ₀; otherwise 0.
    pub fn lambda_squared(&self, smallest_singular_value: f64) -> f64 {
        self.lambda_squared_at(smallest_singular_value.powi(2))
    }

    /// Returns λ² for the smallest eigenvalue of `J Jᵀ`, the square of the smallest singular value.
    ///
    /// This is fast because it needs no square root, and its only division does not depend on the singular value.
    #[inline(always)]
    fn lambda_squared_at(&self, smallest_eigenvalue: f64) -> f64 {
        let (begin, slope) = (self.threshold.powi(2), (self.max / self.threshold).powi(2));
        if smallest_eigenvalue >= begin { 0.0 } else { slope * (begin - smallest_eigenvalue) }
    }

    /// Sets `theta_dot` to the joint velocities [rad/s, prismatic: m/s] that move the tool of `arm` with `twist`, along the base's
    /// axes. Components of `twist` that `aim` leaves free are ignored. The result is finite for every finite input.
    ///
    /// `twist` is a function so that the processor can compute the twist during the inversion of `J Jᵀ`, the slowest part.
    #[inline(always)]
    pub fn joint_velocity(
        &self,
        arm: &ArmState,
        aim: Aim,
        twist: impl FnOnce() -> AngularLinear,
        theta_dot: &mut [f64],
    ) {
        let rows = aim.rows(arm);
        let gram = rows.gram(arm);
        let solution = self.solve(&gram, &rows.of(&twist()));
        arm.apply_transpose(&rows.twist(&solution), theta_dot);
    }

    /// Returns the product of `(J Jᵀ + λ² I)⁻¹` and the six numbers of `error`. Both halves of each register contain the same
    /// result. The result is finite for every finite input.
    ///
    /// This is fast because `J Jᵀ − σ₀² I` is inverted in parallel with `J Jᵀ`, at no cost. Away from singularities, where arms
    /// mostly are, `J Jᵀ − σ₀² I` is positive definite. Then no singular value is below σ₀, and the inverse of `J Jᵀ` is the
    /// result. Otherwise, the two inverses yield the smallest singular value.
    ///
    /// An alternative was rejected: to compute σ² from the determinants of `J Jᵀ` and `J Jᵀ + λ_max² I`, without a second solution
    /// near singularities. A step of logc then takes 15 % less time, on random postures of the PUMA 560. But this σ² is only a lower
    /// bound, so the damping is too strong where several singular values are small. Then logc fails in 8 more of 100 tasks of the
    /// xArm 6.
    #[inline(always)]
    pub(super) fn solve(&self, gram: &Gram, error: &AngularLinear) -> Motions {
        let bound = self.threshold.powi(2);
        let inverse = gram.inverse(f64x2::new([0.0, -bound]));
        let solution = if inverse.second_is_positive() {
            twice(&first(&inverse.times(error)))
        } else {
            gram.solve(self.lambda_squared_at(gram.eigenvalue_below(bound, &inverse)), error)
        };
        if gram.is_singular() || !is_finite(&solution) {
            return self.solve_after_eigenvalue(gram, error);
        }
        solution
    }

    /// Computes the result of [`solve`](Self::solve) for a matrix for which the fast method fails. If this solution is not finite
    /// either, because of rounding, adds damping. If that is not enough, returns 0.
    #[cold]
    #[inline(never)]
    fn solve_after_eigenvalue(&self, gram: &Gram, error: &AngularLinear) -> Motions {
        let lambda_squared = self.lambda_squared_at(gram.smallest_eigenvalue());
        [lambda_squared, FALLBACK * (1.0 + gram.trace())]
            .into_iter()
            .map(|shift| gram.solve(shift, error))
            .find(is_finite)
            // A NaN error stays NaN, so that the servo's final check detects and counts it.
            .unwrap_or_else(|| {
                let error = twice(error);
                if is_finite(&error) { twice(&AngularLinear::default()) } else { error }
            })
    }
}

impl Aim {
    /// Removes, from the joint velocities `theta_dot`, the part that moves the tool in the components of the aim: `(I − J⁺ J) θ̇`.
    /// The norm of the joint velocities never increases.
    ///
    /// The inverse is not damped. With a damped inverse, the remaining velocities would move these components near a singularity,
    /// where the damped law is too weak to compensate.
    pub fn leave_tool(self, arm: &ArmState, theta_dot: &mut [f64]) {
        let rows = self.rows(arm);
        let gram = rows.gram(arm);
        let shift = ROUNDING * (1.0 + gram.trace());
        let (moment, force) = rows.twist(&gram.solve(shift, &rows.of(&arm.tool_twist(theta_dot))));
        for (speeds, (angular, linear)) in theta_dot.chunks_mut(2).zip(arm.tool_motion_pairs()) {
            put(two(speeds) - dot(angular, &moment) - dot(linear, &force), speeds);
        }
    }
}

impl ArmState {
    /// Returns the smallest singular value of the 6×n Jacobian, in which 1 rad counts as much as 1 m. It is 0 for fewer than six
    /// joints.
    pub fn smallest_singular_value(&self) -> f64 {
        Gram::of(self).smallest_singular_value()
    }
}
