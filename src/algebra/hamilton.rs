//! Hamilton operators: products as matrices, `ab = H⁺(a) b = H⁻(b) a` (eq. 9–11).

use super::{DualQuaternion, Matrix8};
use nalgebra::{Matrix4, Quaternion};

/// Returns the 4×4 matrix `H⁺(a)`. For every quaternion b, written as a vector `(w, x, y, z)`, `H⁺(a) b` is the product `ab` (eq.
/// 9, the paper's `Hp`).
#[doc(alias = "Hp")]
#[rustfmt::skip]
pub fn hamilton_plus(a: &Quaternion<f64>) -> Matrix4<f64> {
    Matrix4::new(
        a.w, -a.i, -a.j, -a.k,
        a.i,  a.w, -a.k,  a.j,
        a.j,  a.k,  a.w, -a.i,
        a.k, -a.j,  a.i,  a.w,
    )
}

/// Returns the 4×4 matrix `H⁻(b)`. For every quaternion a, written as a vector `(w, x, y, z)`, `H⁻(b) a` is the product `ab` (eq.
/// 10, the paper's `Hn`).
#[doc(alias = "Hn")]
#[rustfmt::skip]
pub fn hamilton_minus(b: &Quaternion<f64>) -> Matrix4<f64> {
    Matrix4::new(
        b.w, -b.i, -b.j, -b.k,
        b.i,  b.w,  b.k, -b.j,
        b.j, -b.k,  b.w,  b.i,
        b.k,  b.j, -b.i,  b.w,
    )
}

/// Returns the 8×8 matrix `H⁺(a)`. For every dual quaternion b, written as a [`super::Vector8`], `H⁺(a) b` is the product `ab` (the
/// paper's `dHp`).
#[doc(alias = "dHp")]
pub fn dual_hamilton_plus(a: &DualQuaternion) -> Matrix8 {
    blocks(hamilton_plus(&a.real), hamilton_plus(&a.dual))
}

/// Returns the 8×8 matrix `H⁻(b)`. For every dual quaternion a, written as a [`super::Vector8`], `H⁻(b) a` is the product `ab` (the
/// paper's `dHn`).
#[doc(alias = "dHn")]
pub fn dual_hamilton_minus(b: &DualQuaternion) -> Matrix8 {
    blocks(hamilton_minus(&b.real), hamilton_minus(&b.dual))
}

/// Returns the 8×8 matrix `[real 0; dual real]`. The upper right block is 0 because `ε² = 0`.
fn blocks(real: Matrix4<f64>, dual: Matrix4<f64>) -> Matrix8 {
    let mut matrix = Matrix8::zeros();
    matrix.fixed_view_mut::<4, 4>(0, 0).copy_from(&real);
    matrix.fixed_view_mut::<4, 4>(4, 4).copy_from(&real);
    matrix.fixed_view_mut::<4, 4>(4, 0).copy_from(&dual);
    matrix
}
