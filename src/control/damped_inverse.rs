//! The damped least-squares inverse of the body Jacobian.

use crate::arm::ArmState;
use nalgebra::{Cholesky, Matrix6, Vector6};

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

    /// Joint velocities [rad/s] for the body twist `(ω, v)`, written to `theta_dot`, finite for every finite input.
    pub(super) fn joint_velocity(&self, arm: &ArmState, twist: &Vector6<f64>, theta_dot: &mut [f64]) {
        let gram = gram(arm);
        let lambda_squared = self.lambda_squared(smallest_singular_value(&gram));
        let solution = solve(&gram, lambda_squared, twist)
            .or_else(|| solve(&gram, FALLBACK * (1.0 + gram.trace()), twist))
            .unwrap_or_else(Vector6::zeros);
        for (speed, column) in theta_dot.iter_mut().zip(arm.body_columns()) {
            *speed = column.dot(&solution);
        }
    }
}

impl ArmState {
    /// The smallest singular value of the 6×n body Jacobian (rad and m taken alike); 0 for fewer than six joints.
    pub fn smallest_singular_value(&self) -> f64 {
        smallest_singular_value(&gram(self))
    }
}

/// `J Jᵀ`, 6×6.
fn gram(arm: &ArmState) -> Matrix6<f64> {
    arm.body_columns().fold(Matrix6::zeros(), |sum, column| sum + column * column.transpose())
}

fn smallest_singular_value(gram: &Matrix6<f64>) -> f64 {
    gram.symmetric_eigenvalues().min().max(0.0).sqrt()
}

fn solve(gram: &Matrix6<f64>, lambda_squared: f64, twist: &Vector6<f64>) -> Option<Vector6<f64>> {
    let solution = Cholesky::new(gram + Matrix6::identity() * lambda_squared)?.solve(twist);
    solution.iter().all(|x| x.is_finite()).then_some(solution)
}
