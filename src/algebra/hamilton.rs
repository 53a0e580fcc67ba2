//! Hamilton operators: products as matrices, `ab = H⁺(a) b = H⁻(b) a` (eq. 9–11).

use super::{DualQuaternion, Matrix8};
use nalgebra::{Matrix4, Quaternion};

/// Returns `H⁺(a)`, 4×4: `ab = H⁺(a) b` on `(w, x, y, z)` (eq. 9, the paper's `Hp`).
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

/// Returns `H⁻(b)`, 4×4: `ab = H⁻(b) a` on `(w, x, y, z)` (eq. 10, the paper's `Hn`).
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

/// Returns `H⁺` of a dual quaternion, 8×8 on [`super::Vector8`] (the paper's `dHp`).
#[doc(alias = "dHp")]
pub fn dual_hamilton_plus(a: &DualQuaternion) -> Matrix8 {
    blocks(hamilton_plus(&a.real), hamilton_plus(&a.dual))
}

/// Returns `H⁻` of a dual quaternion, 8×8 on [`super::Vector8`] (the paper's `dHn`).
#[doc(alias = "dHn")]
pub fn dual_hamilton_minus(b: &DualQuaternion) -> Matrix8 {
    blocks(hamilton_minus(&b.real), hamilton_minus(&b.dual))
}

/// Returns `[real 0; dual real]`. This form follows from `ε² = 0`.
fn blocks(real: Matrix4<f64>, dual: Matrix4<f64>) -> Matrix8 {
    let mut matrix = Matrix8::zeros();
    matrix.fixed_view_mut::<4, 4>(0, 0).copy_from(&real);
    matrix.fixed_view_mut::<4, 4>(4, 4).copy_from(&real);
    matrix.fixed_view_mut::<4, 4>(4, 0).copy_from(&dual);
    matrix
}
