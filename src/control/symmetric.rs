//! Symmetric 3×3 matrices by their six numbers.

use crate::arm::pair;
use nalgebra::{Scalar, Vector3};
use wide::f64x2;

/// A symmetric 3×3 matrix.
///
/// Fast because three of nine numbers are not computed, and the inverse is closed: six cofactors and one division.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Symmetric<T: Scalar = f64> {
    /// xx, yy, zz.
    pub diagonal: Vector3<T>,
    /// yz, zx, xy.
    pub others: Vector3<T>,
}

impl Symmetric<f64x2> {
    pub fn zeros() -> Self {
        Self { diagonal: Vector3::from_element(f64x2::ZERO), others: Vector3::from_element(f64x2::ZERO) }
    }

    /// Adds `v vᵀ`.
    #[inline(always)]
    pub fn add_square(&mut self, v: &Vector3<f64x2>) {
        self.diagonal += v.component_mul(v);
        self.others += Vector3::new(v.y * v.z, v.z * v.x, v.x * v.y);
    }

    /// The sum of both.
    #[inline(always)]
    pub fn sum(&self) -> Symmetric {
        Symmetric { diagonal: pair::sum(&self.diagonal), others: pair::sum(&self.others) }
    }
}

impl Symmetric {
    /// With `shift` added to the diagonal.
    #[inline(always)]
    pub fn shifted(&self, shift: f64) -> Self {
        Self { diagonal: self.diagonal.add_scalar(shift), others: self.others }
    }

    /// The inverse; not finite where there is none.
    #[inline(always)]
    pub fn inverse(&self) -> Self {
        let (d, o) = (&self.diagonal, &self.others);
        let cofactors = Vector3::new(d.y * d.z - o.x * o.x, d.z * d.x - o.y * o.y, d.x * d.y - o.z * o.z);
        let mixed = Vector3::new(o.y * o.z - d.x * o.x, o.z * o.x - d.y * o.y, o.x * o.y - d.z * o.z);
        let determinant = d.x * cofactors.x + o.z * mixed.z + o.y * mixed.y;
        let scale = 1.0 / determinant;
        Self { diagonal: cofactors * scale, others: mixed * scale }
    }

    #[inline(always)]
    pub fn times(&self, v: &Vector3<f64>) -> Vector3<f64> {
        let (d, o) = (&self.diagonal, &self.others);
        Vector3::new(
            d.x * v.x + o.z * v.y + o.y * v.z,
            o.z * v.x + d.y * v.y + o.x * v.z,
            o.y * v.x + o.x * v.y + d.z * v.z,
        )
    }

    #[inline(always)]
    pub fn column(&self, index: usize) -> Vector3<f64> {
        let (d, o) = (&self.diagonal, &self.others);
        match index {
            0 => Vector3::new(d.x, o.z, o.y),
            1 => Vector3::new(o.z, d.y, o.x),
            _ => Vector3::new(o.y, o.x, d.z),
        }
    }

    /// The sum of the eigenvalues.
    #[inline(always)]
    pub fn trace(&self) -> f64 {
        self.diagonal.sum()
    }

    /// The sum of the products of all nine numbers with those of `other`.
    #[inline(always)]
    pub fn dot(&self, other: &Self) -> f64 {
        self.diagonal.dot(&other.diagonal) + 2.0 * self.others.dot(&other.others)
    }
}
