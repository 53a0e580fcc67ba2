//! Symmetric 3×3 matrices by their six numbers, two matrices side by side.

use crate::arm::pair::{Pair, dot};
use nalgebra::Vector3;
use wide::f64x2;

/// Two symmetric 3×3 matrices side by side.
///
/// Fast because three of nine numbers are not computed, the inverse is closed, six cofactors and one division, and two matrices take
/// no more operations than one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Symmetric {
    /// xx, yy, zz.
    pub diagonal: Pair,
    /// yz, zx, xy.
    pub others: Pair,
}

impl Symmetric {
    pub fn zeros() -> Self {
        Self { diagonal: Vector3::from_element(f64x2::ZERO), others: Vector3::from_element(f64x2::ZERO) }
    }

    /// Adds `v vᵀ`.
    #[inline(always)]
    pub fn add_square(&mut self, v: &Pair) {
        self.diagonal += v.component_mul(v);
        self.others += Vector3::new(v.y * v.z, v.z * v.x, v.x * v.y);
    }

    /// The same done to all numbers of both.
    #[inline(always)]
    pub fn map(&self, each: impl Fn(&Pair) -> Pair) -> Self {
        Self { diagonal: each(&self.diagonal), others: each(&self.others) }
    }

    /// With `shifts` added to the diagonals.
    #[inline(always)]
    pub fn shifted(&self, shifts: f64x2) -> Self {
        Self { diagonal: self.diagonal.map(|number| number + shifts), others: self.others }
    }

    /// The inverses, not finite where there is none, and the least leading minors, which are above 0 where the matrix is positive definite.
    #[inline(always)]
    pub fn inverse(&self) -> (Self, f64x2) {
        let (d, o) = (&self.diagonal, &self.others);
        let cofactors = Vector3::new(d.y * d.z - o.x * o.x, d.z * d.x - o.y * o.y, d.x * d.y - o.z * o.z);
        let mixed = Vector3::new(o.y * o.z - d.x * o.x, o.z * o.x - d.y * o.y, o.x * o.y - d.z * o.z);
        let determinant = d.x * cofactors.x + o.z * mixed.z + o.y * mixed.y;
        let scale = f64x2::ONE / determinant;
        // Of a number and none the least is the one that comes last, and what is none in a minor is none in the determinant.
        let least = d.x.fast_min(cofactors.z).fast_min(determinant);
        (Self { diagonal: cofactors * scale, others: mixed * scale }, least)
    }

    /// How many eigenvalues of the second matrix are negative: as many as the signs of its minors change (Sylvester's law of inertia).
    pub fn second_negatives(&self) -> usize {
        let (d, o) = (&self.diagonal, &self.others);
        let cofactor = d.x * d.y - o.z * o.z;
        let determinant = d.z * cofactor + o.y * (o.z * o.x - d.y * o.y) - o.x * (d.x * o.x - o.z * o.y);
        let [a, b, c] = [d.x, cofactor, determinant].map(|minor| minor.to_array()[1] < 0.0);
        usize::from(a) + usize::from(a != b) + usize::from(b != c)
    }

    #[inline(always)]
    pub fn times(&self, v: &Pair) -> Pair {
        let (d, o) = (&self.diagonal, &self.others);
        Vector3::new(
            d.x * v.x + o.z * v.y + o.y * v.z,
            o.z * v.x + d.y * v.y + o.x * v.z,
            o.y * v.x + o.x * v.y + d.z * v.z,
        )
    }

    #[inline(always)]
    pub fn column(&self, index: usize) -> Pair {
        let (d, o) = (&self.diagonal, &self.others);
        match index {
            0 => Vector3::new(d.x, o.z, o.y),
            1 => Vector3::new(o.z, d.y, o.x),
            _ => Vector3::new(o.y, o.x, d.z),
        }
    }

    /// The sum of the eigenvalues.
    #[inline(always)]
    pub fn trace(&self) -> f64x2 {
        self.diagonal.x + self.diagonal.y + self.diagonal.z
    }

    /// The sum of the products of all nine numbers with those of `other`.
    #[inline(always)]
    pub fn dot(&self, other: &Self) -> f64x2 {
        dot(&self.diagonal, &other.diagonal) + dot(&self.others, &other.others) * 2.0
    }
}
