//! Symmetric 3×3 matrices of six numbers, two matrices in parallel.

use crate::arm::pair::{Pair, ZEROS, dot};
use nalgebra::Vector3;
use wide::f64x2;

/// Two symmetric 3×3 matrices in parallel.
///
/// This is fast because only six of the nine numbers of a matrix are computed, and the inverse is a closed formula (six cofactors
/// and one division). Two matrices take no more operations than one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Symmetric {
    /// The elements xx, yy and zz.
    pub diagonal: Pair,
    /// The elements yz, zx and xy.
    pub others: Pair,
}

impl Symmetric {
    /// Two zero matrices.
    pub const ZEROS: Self = Self { diagonal: ZEROS, others: ZEROS };

    /// Returns the sums of these two matrices and the two matrices of `other`.
    #[inline(always)]
    pub fn plus(&self, other: &Self) -> Self {
        Self { diagonal: self.diagonal + other.diagonal, others: self.others + other.others }
    }

    /// Applies a function to all numbers of both matrices.
    #[inline(always)]
    pub fn map(&self, each: impl Fn(&Pair) -> Pair) -> Self {
        Self { diagonal: each(&self.diagonal), others: each(&self.others) }
    }

    /// Adds `shifts` to the diagonals.
    #[inline(always)]
    pub fn shifted(&self, shifts: f64x2) -> Self {
        Self { diagonal: self.diagonal.map(|number| number + shifts), others: self.others }
    }

    /// Returns the inverses of both matrices. The inverse of a singular matrix is not finite.
    #[inline(always)]
    pub fn inverse(&self) -> SymmetricInverse {
        let (d, o) = (&self.diagonal, &self.others);
        let diagonal = Vector3::new(d.y * d.z - o.x * o.x, d.z * d.x - o.y * o.y, d.x * d.y - o.z * o.z);
        let others = Vector3::new(o.y * o.z - d.x * o.x, o.z * o.x - d.y * o.y, o.x * o.y - d.z * o.z);
        let determinant = d.x * diagonal.x + o.z * others.z + o.y * others.y;
        SymmetricInverse {
            adjugate: Self { diagonal, others },
            scale: f64x2::ONE / determinant,
            minors: Vector3::new(d.x, diagonal.z, determinant),
        }
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

    /// Returns the trace (the sum of the eigenvalues) of each matrix.
    #[inline(always)]
    pub fn trace(&self) -> f64x2 {
        self.diagonal.x + self.diagonal.y + self.diagonal.z
    }

    /// Returns the sum of the products of corresponding elements, over all nine elements: one number for the first matrices of
    /// `self` and `other`, and one for the second matrices.
    #[inline(always)]
    pub fn dot(&self, other: &Self) -> f64x2 {
        dot(&self.diagonal, &other.diagonal) + dot(&self.others, &other.others) * 2.0
    }
}

/// The inverses of two symmetric 3×3 matrices in parallel.
///
/// This is fast because a product uses the adjugate, and multiplies by `scale` last. So the product need not wait for the division.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct SymmetricInverse {
    pub adjugate: Symmetric,
    /// The factor of the adjugate: 1 divided by the determinant.
    pub scale: f64x2,
    /// The leading minors of each matrix, up to positive factors.
    minors: Pair,
}

impl SymmetricInverse {
    /// Returns the determinant of each matrix. After [`of_quotients`](Self::of_quotients), returns the determinant times a positive
    /// factor.
    #[inline(always)]
    pub fn determinant(&self) -> f64x2 {
        self.minors.z
    }

    /// Turns the inverses of two matrices A into the inverses of `A / divisor`, each with its own divisor. `reciprocals` are the
    /// reciprocals of the `divisors`.
    #[inline(always)]
    pub fn of_quotients(self, divisors: f64x2, reciprocals: f64x2) -> Self {
        let minors = Vector3::new(self.minors.x * reciprocals, self.minors.y, self.minors.z * reciprocals);
        Self { scale: self.scale * divisors, minors, ..self }
    }

    /// Returns the smallest leading minor of each matrix. It is positive if the matrix is positive definite.
    #[inline(always)]
    pub fn least_minors(&self) -> f64x2 {
        // If one operand is NaN, `fast_min` returns the second operand. If any minor is NaN, so is the determinant, which is the
        // last operand.
        self.minors.x.fast_min(self.minors.y).fast_min(self.minors.z)
    }

    #[inline(always)]
    pub fn times(&self, v: &Pair) -> Pair {
        self.adjugate.times(v) * self.scale
    }
}
