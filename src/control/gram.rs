//! `J Jᵀ`, its inverse and its smallest eigenvalue.

use crate::arm::ArmState;
use nalgebra::{Matrix3, Matrix6, Vector3, Vector6};

/// `J Jᵀ` of a 6×n Jacobian in four blocks `[A C; Cᵀ D]` of 3×3, angular first.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Gram {
    angular: Matrix3<f64>,
    mixed: Matrix3<f64>,
    linear: Matrix3<f64>,
}

impl Gram {
    /// Of the Jacobian at the tool along the base's axes; its singular values are those along any axes.
    pub fn of(arm: &ArmState) -> Self {
        Self::of_columns(arm.tool_motions())
    }

    /// Of the Jacobian with these columns, in two halves each.
    pub fn of_columns(columns: impl Iterator<Item = (Vector3<f64>, Vector3<f64>)>) -> Self {
        let zeros = Matrix3::zeros();
        let mut gram = Self { angular: zeros, mixed: zeros, linear: zeros };
        for (angular, linear) in columns {
            add_square(&mut gram.angular, &angular);
            gram.mixed += angular * linear.transpose();
            add_square(&mut gram.linear, &linear);
        }
        gram.angular.fill_lower_triangle_with_upper_triangle();
        gram.linear.fill_lower_triangle_with_upper_triangle();
        gram
    }

    /// The sum of the eigenvalues.
    pub fn trace(&self) -> f64 {
        self.angular.trace() + self.linear.trace()
    }

    /// The inverse of `J Jᵀ + shift I`; none where a block has none.
    ///
    /// Fast because two closed inverses of 3×3, with a division each, are the whole of it; a Cholesky decomposition of 6×6 waits for six
    /// roots and six divisions, one after the other.
    pub fn inverse(&self, shift: f64) -> Option<Inverse> {
        let shift = Matrix3::from_diagonal_element(shift);
        let angular = (self.angular + shift).try_inverse()?;
        let carried = angular * self.mixed;
        let rest = (self.linear + shift - self.mixed.tr_mul(&carried)).try_inverse()?;
        Some(Inverse { angular, carried, rest })
    }

    /// The smallest eigenvalue, to rounding; `inverse` is that without a shift.
    ///
    /// Fast because the inverse is what the damped solution begins with, and its bound is the first of the steps, mostly of two. Where
    /// rounding has the last word of it, the steps begin below 0.
    pub fn smallest_eigenvalue(&self, inverse: Option<&Inverse>) -> f64 {
        let bound = inverse.map_or(0.0, Inverse::smallest_eigenvalue_bound);
        let begin = if bound > NEGLIGIBLE * self.trace() { bound } else { -1e-3 * self.trace() };
        self.eigenvalue_above(begin)
    }

    /// The largest eigenvalue, to rounding: minus the smallest one of `−J Jᵀ`.
    pub fn largest_eigenvalue(&self) -> f64 {
        let negative = Self { angular: -self.angular, mixed: -self.mixed, linear: -self.linear };
        -negative.eigenvalue_above(-1.001 * self.trace())
    }

    /// The smallest eigenvalue, which is above `below`.
    ///
    /// Laguerre's iteration from below: for a symmetric matrix it never passes the smallest root and converges cubically, by three or
    /// four inverses, where it is a simple one; else, which is rare, the eigenvalue decomposition is taken.
    fn eigenvalue_above(&self, mut below: f64) -> f64 {
        let rounding = f64::EPSILON * self.trace().abs();
        for _ in 0..STEPS {
            let Some(step) = self.inverse(-below).map(|inverse| inverse.smallest_eigenvalue_bound()) else {
                return below;
            };
            // Where rounding has the last word the inverse is that of any matrix.
            if step.is_nan() || step <= rounding {
                return below;
            }
            below += step;
            // What is left is of the order of the cube.
            if step <= SMALL * below.abs() {
                return below;
            }
        }
        self.matrix().symmetric_eigenvalues().min()
    }

    fn matrix(&self) -> Matrix6<f64> {
        let mut matrix = Matrix6::zeros();
        matrix.fixed_view_mut::<3, 3>(0, 0).copy_from(&self.angular);
        matrix.fixed_view_mut::<3, 3>(0, 3).copy_from(&self.mixed);
        matrix.fixed_view_mut::<3, 3>(3, 0).copy_from(&self.mixed.transpose());
        matrix.fixed_view_mut::<3, 3>(3, 3).copy_from(&self.linear);
        matrix
    }
}

/// Adds `x xᵀ` to the upper triangle.
fn add_square(sum: &mut Matrix3<f64>, x: &Vector3<f64>) {
    sum.m11 += x.x * x.x;
    sum.m12 += x.x * x.y;
    sum.m13 += x.x * x.z;
    sum.m22 += x.y * x.y;
    sum.m23 += x.y * x.z;
    sum.m33 += x.z * x.z;
}

/// Laguerre steps that are tried.
const STEPS: usize = 8;

/// A step of this part of the eigenvalue is the last one.
const SMALL: f64 = 1e-6;

/// An eigenvalue of this part of the trace may be an error of rounding.
const NEGLIGIBLE: f64 = 1e-12;

/// The inverse of a [`Gram`], by what it is made of: `[A⁻¹ + X S⁻¹ Xᵀ, −X S⁻¹; −S⁻¹ Xᵀ, S⁻¹]` with `X = A⁻¹ C`, `S = D − Cᵀ X`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Inverse {
    /// `A⁻¹`.
    angular: Matrix3<f64>,
    /// X.
    carried: Matrix3<f64>,
    /// `S⁻¹`.
    rest: Matrix3<f64>,
}

impl Inverse {
    /// The product with `twist`, if it is finite.
    pub fn times(&self, twist: &Vector6<f64>) -> Option<Vector6<f64>> {
        let (omega, v) = (Vector3::from(twist.fixed_rows::<3>(0)), Vector3::from(twist.fixed_rows::<3>(3)));
        let linear = self.rest * (v - self.carried.tr_mul(&omega));
        let angular = self.angular * omega - self.carried * linear;
        let product = Vector6::new(angular.x, angular.y, angular.z, linear.x, linear.y, linear.z);
        product.iter().all(|x| x.is_finite()).then_some(product)
    }

    /// The sum of the eigenvalues.
    pub fn trace(&self) -> f64 {
        self.angular.trace() + (self.carried * self.rest).dot(&self.carried) + self.rest.trace()
    }

    /// What the smallest eigenvalue of the matrix that was inverted exceeds, if that is positive definite: Laguerre's bound `n / (t +
    /// √((n−1)(n s − t²)))`, with t the trace of the inverse, s the sum of its squares, n = 6. It is at most √n too small.
    pub fn smallest_eigenvalue_bound(&self) -> f64 {
        let mixed = self.carried * self.rest;
        let angular = self.angular + mixed * self.carried.transpose();
        let trace = angular.trace() + self.rest.trace();
        let squares = angular.norm_squared() + 2.0 * mixed.norm_squared() + self.rest.norm_squared();
        6.0 / (trace + (5.0 * (6.0 * squares - trace * trace)).max(0.0).sqrt())
    }
}
