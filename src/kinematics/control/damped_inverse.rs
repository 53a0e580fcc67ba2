//! The damped least-squares inverse of the Jacobian of one arm.

use super::Aim;
use super::angular_linear::{AngularLinear, apart, beside, first_twice, inner, is_finite, twice};
use super::gram::{Gram, Inverse};
use crate::arm::ArmState;
use crate::arm::pair::{dot, put, two};
use std::ops::Range;
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
    /// positive definite, so that no singular value is below σ₀, and none is computed.
    #[inline(always)]
    pub(super) fn solve(&self, gram: &Gram, error: &AngularLinear) -> AngularLinear<f64x2> {
        let shifts = f64x2::new([0.0, -self.threshold.powi(2)]);
        let inverse = gram.inverse(shifts);
        let solution = match (gram.is_singular(), inverse.second_is_positive()) {
            (true, _) => None,
            (false, true) => Some(inverse.times(&twice(error))),
            (false, false) => self.solve_beside_eigenvalue(gram, &inverse, shifts, error),
        };
        let solution = match solution {
            Some(solution) if is_finite(&solution) => solution,
            _ => self.solve_after_eigenvalue(gram, error),
        };
        first_twice(&solution)
    }

    /// The same as the first vector of two where the smallest eigenvalue is below σ₀², from the inverses of `J Jᵀ` with these shifts;
    /// none where that eigenvalue is not the only one that small.
    ///
    /// Fast because Rayleigh quotients, each from the inverse with the last one for its shift, get right three times the digits at each
    /// step: the first one makes a λ² that is nearly right, the solution with this is computed beside the next quotient, and what is
    /// then left of it by one more product: `−δ (J Jᵀ + λ² I)⁻¹` times the solution, with `δ = δλ² (1 − δλ²/(σ² + λ²))`. That is to
    /// second order along the weak direction, and to first order along the others.
    #[inline(always)]
    fn solve_beside_eigenvalue(
        &self,
        gram: &Gram,
        inverse: &Inverse,
        shifts: f64x2,
        error: &AngularLinear,
    ) -> Option<AngularLinear<f64x2>> {
        let (mut smallest, mut direction) = inverse.weak_direction(shifts);
        for _ in 0..STEPS {
            let lambda_squared = self.lambda_squared_at(smallest);
            let damped = gram.inverse(f64x2::new([lambda_squared, -smallest]));
            let stiffness = (smallest + lambda_squared).recip();
            let right = beside(error, &direction);
            let next = damped.times(&right);
            let [_, step] = (inner(&right, &next) / inner(&next, &next)).to_array();
            smallest += step;
            let change = self.lambda_squared_at(smallest) - lambda_squared;
            let weakest = smallest + lambda_squared;
            let is_known = step.abs() <= CLOSE * smallest.abs() + SMALL * SMALL * weakest;
            if is_known && change.abs() <= SMALL * weakest {
                let is_smallest = smallest < self.threshold.powi(2)
                    && (inverse.second_negatives() == 1 || LONELY.contains(&(inverse.trace() * smallest)));
                let lacking = damped.times(&next);
                let part = f64x2::splat(change * (1.0 - change * stiffness));
                return is_smallest.then(|| (next.0 - lacking.0 * part, next.1 - lacking.1 * part));
            }
            direction = apart(&next)[1];
        }
        None
    }

    /// The same as the first vector of two for every matrix. Where the solution fails, by damping too small for rounding, there is more
    /// of it; where that fails, 0.
    #[cold]
    #[inline(never)]
    fn solve_after_eigenvalue(&self, gram: &Gram, error: &AngularLinear) -> AngularLinear<f64x2> {
        let lambda_squared = self.lambda_squared_at(gram.smallest_eigenvalue().max(0.0));
        let solve = |shift| gram.inverse(f64x2::splat(shift)).times(&twice(error));
        [lambda_squared, FALLBACK * (1.0 + gram.trace())]
            .into_iter()
            .map(solve)
            .find(is_finite)
            // An error that is no number stays so, for the servo's gate to see and to count.
            .unwrap_or_else(|| {
                if is_finite(&twice(error)) { twice(&AngularLinear::default()) } else { twice(error) }
            })
    }
}

/// Steps that are tried: where eigenvalues are apart the first one will do, and seldom are three not enough.
const STEPS: usize = 4;

/// A change of `σ² + λ²` by this part is made up for: along stiffer directions what is then left is less than its square, and so is what
/// the quotient still lacks.
const SMALL: f64 = 1e-6;

/// An eigenvalue whose last step was this part of it, or as good as nothing, is known: where λ² grows slowly with it, a small change of λ²
/// does not say that.
const CLOSE: f64 = 1e-3;

/// An eigenvalue times the trace of the inverse is from 1 to 2 if it is the smallest one by far, and above 2 if it is not the smallest one;
/// anything else is rounding.
const LONELY: Range<f64> = 0.99..1.99;

impl ArmState {
    /// The smallest singular value of the 6×n Jacobian (rad and m taken alike); 0 for fewer than six joints.
    pub fn smallest_singular_value(&self) -> f64 {
        Gram::of(self).smallest_singular_value()
    }
}
