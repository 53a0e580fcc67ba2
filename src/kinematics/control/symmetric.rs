//! Symmetric 3×3 matrices by their six numbers, two matrices side by side.

use crate::arm::pair::{Pair, ZEROS, dot};
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
    /// Two of zeros.
    pub const ZEROS: Self = Self { diagonal: ZEROS, others: ZEROS };

    /// The sums with two others.
    #[inline(always)]
    pub fn plus(&self, other: &Self) -> Self {
        Self { diagonal: self.diagonal + other.diagonal, others: self.others + other.others }
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

    /// The inverses, not finite where there is none.
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

/// The inverses of two symmetric 3×3 matrices side by side.
///
/// Fast because products are with the adjugate, and so do not wait for the division: the quotient comes last.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct SymmetricInverse {
    pub adjugate: Symmetric,
    /// What the adjugate is multiplied with: 1 by the determinant.
    pub scale: f64x2,
    /// The leading minors of the matrix but for factors above 0.
    minors: Pair,
}

impl SymmetricInverse {
    /// The determinants of the matrices; of [quotients](Self::of_quotients) but for factors above 0.
    #[inline(always)]
    pub fn determinant(&self) -> f64x2 {
        self.minors.z
    }

    /// Those of the matrices divided by these numbers, whose inverses are given too.
    #[inline(always)]
    pub fn of_quotients(self, divisors: f64x2, inverses: f64x2) -> Self {
        let minors = Vector3::new(self.minors.x * inverses, self.minors.y, self.minors.z * inverses);
        Self { scale: self.scale * divisors, minors, ..self }
    }

    /// The least leading minors, which are above 0 where the matrix is positive definite.
    #[inline(always)]
    pub fn least_minors(&self) -> f64x2 {
        // Of a number and none the least is the one that comes last, and what is none in a minor is none in the determinant.
        self.minors.x.fast_min(self.minors.y).fast_min(self.minors.z)
    }

    #[inline(always)]
    pub fn times(&self, v: &Pair) -> Pair {
        self.adjugate.times(v) * self.scale
    }
}
