//! The damped least-squares inverse of the Jacobian of one arm.

use super::Aim;
use super::angular_linear::{AngularLinear, first, is_finite, twice};
use super::gram::Gram;
use crate::arm::ArmState;
use crate::arm::pair::{Motions, dot, put, two};
use wide::f64x2;

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
        self.lambda_squared_at(smallest_singular_value.powi(2))
    }

    /// The same of the singular value's square.
    ///
    /// Fast because no root and no quotient wait for it.
    #[inline(always)]
    fn lambda_squared_at(&self, smallest_eigenvalue: f64) -> f64 {
        let (begin, slope) = (self.threshold.powi(2), (self.max / self.threshold).powi(2));
        if smallest_eigenvalue >= begin { 0.0 } else { slope * (begin - smallest_eigenvalue) }
    }

    /// Joint velocities [rad/s] for what `aim` asks for of the `twist` of the tool along the base's axes, written to `theta_dot`, finite for
    /// every finite input.
    ///
    /// Fast because the twist is computed while `J Jᵀ` is inverted, which takes longest.
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

    /// Takes out of joint velocities what this inverse would need for what `aim` asks for of the twist that they give the tool:
    /// `(I − J⁺ J) θ̇`. What is left moves an arm of more joints than the aim has rows and nothing that is asked for, where the inverse
    /// is not damped; where it is, that moves by `λ²/(σ² + λ²)` of what it would have.
    pub fn leave_tool(&self, arm: &ArmState, aim: Aim, theta_dot: &mut [f64]) {
        let rows = aim.rows(arm);
        let solution = self.solve(&rows.gram(arm), &rows.of(&arm.tool_twist(theta_dot)));
        let (moment, force) = rows.twist(&solution);
        for (speeds, (angular, linear)) in theta_dot.chunks_mut(2).zip(arm.tool_motion_pairs()) {
            put(two(speeds) - dot(angular, &moment) - dot(linear, &force), speeds);
        }
    }

    /// `(J Jᵀ + λ² I)⁻¹` times six numbers, finite for every finite input; each number twice.
    ///
    /// Fast because `J Jᵀ − σ₀² I` is inverted beside `J Jᵀ`, at no cost: away from singularities, which is where arms mostly are, it is
    /// positive definite, so that no singular value is below σ₀; where it is not, both say which one is.
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

    /// The same for every matrix. Where the solution fails, by damping too small for rounding, there is more of it; where that fails, 0.
    #[cold]
    #[inline(never)]
    fn solve_after_eigenvalue(&self, gram: &Gram, error: &AngularLinear) -> Motions {
        let lambda_squared = self.lambda_squared_at(gram.smallest_eigenvalue());
        [lambda_squared, FALLBACK * (1.0 + gram.trace())]
            .into_iter()
            .map(|shift| gram.solve(shift, error))
            .find(is_finite)
            // An error that is no number stays so, for the servo's gate to see and to count.
            .unwrap_or_else(|| {
                let error = twice(error);
                if is_finite(&error) { twice(&AngularLinear::default()) } else { error }
            })
    }
}

impl ArmState {
    /// The smallest singular value of the 6×n Jacobian (rad and m taken alike); 0 for fewer than six joints.
    pub fn smallest_singular_value(&self) -> f64 {
        Gram::of(self).smallest_singular_value()
    }
}
