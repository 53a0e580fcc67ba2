//! `J Jᵀ`, its inverse and its smallest eigenvalue.

use super::angular_linear::AngularLinear;
use super::symmetric::{Symmetric, SymmetricInverse};
use crate::arm::ArmState;
use crate::arm::pair::{Motions, Pair, ZEROS, beside, dot, first, sum_twice, twice};
use nalgebra::{Matrix6, Vector3};
use wide::f64x2;

/// The matrix `J Jᵀ` of a 6×n Jacobian in four 3×3 blocks `[A C; Cᵀ D]`, angular first. Each register (`f64x2`) contains one element
/// of the matrix, in both halves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Gram {
    angular: Symmetric,
    /// The columns of C.
    mixed: [Pair; 3],
    linear: Symmetric,
    /// The number of columns of J, plus the number of unused rows that [`stiffened`](Self::stiffened) has filled, because each
    /// filled row raises the rank by 1.
    joint_count: usize,
}

impl Gram {
    /// Computes the matrix from the Jacobian of the tool point, along the base's axes. Any other axes would give the same singular
    /// values.
    ///
    /// This is fast because each step adds up six columns. There are more sums than registers, so each step writes all sums to
    /// memory, and larger steps need fewer writes.
    #[inline(always)]
    pub fn of(arm: &ArmState) -> Self {
        let (threes, rest) = arm.tool_motion_pairs().as_chunks::<3>();
        let (mut sums, threes) = match threes {
            [first, others @ ..] => (Sums::of(first), others),
            [] => (Sums::NONE, threes),
        };
        for pairs in threes {
            sums = sums.plus(&Sums::of(pairs));
        }
        for pair in rest {
            sums = sums.plus(&Sums::of(std::array::from_ref(pair)));
        }
        sums.gram(arm.joint_count())
    }

    /// Computes the matrix from a Jacobian with the columns `columns`. `joint_count` is the number of columns.
    pub fn of_columns(joint_count: usize, mut columns: impl Iterator<Item = AngularLinear>) -> Self {
        let mut sums = Sums::NONE;
        while let Some((l, v)) = columns.next() {
            let (next_l, next_v) = columns.next().unwrap_or_default();
            sums = sums.plus(&Sums::of(&[(beside(&l, &next_l), beside(&v, &next_v))]));
        }
        sums.gram(joint_count)
    }

    /// Sets the diagonal elements of the unused rows, those after the first `rows` rows, to the trace of the matrix. So the smallest
    /// eigenvalue is that of the first rows.
    pub fn stiffened(mut self, rows: usize) -> Self {
        let trace = f64x2::splat(self.trace());
        let [angular, linear] = [&mut self.angular, &mut self.linear].map(|block| block.diagonal.iter_mut());
        for stiffness in angular.chain(linear).skip(rows) {
            *stiffness = trace;
            self.joint_count += 1;
        }
        self
    }

    /// Returns the sum of the eigenvalues.
    pub fn trace(&self) -> f64 {
        first(self.angular.trace() + self.linear.trace())
    }

    /// Returns whether there are too few joints for an inverse.
    pub fn is_singular(&self) -> bool {
        self.joint_count < 6
    }

    /// Returns the inverses of `J Jᵀ + shift I` for two shifts. If a matrix is singular, its inverse is not finite or not accurate.
    ///
    /// This is fast because it computes only two 3×3 inverses, by formula: those of the blocks A and `det(A) S` that [`Inverse`]
    /// explains. The factor `det(A)` lets both divisions run at the same time. Two shifts take no more operations than one. A 6×6
    /// Cholesky decomposition would need six roots and six divisions, one after the other.
    #[inline(always)]
    pub fn inverse(&self, shifts: f64x2) -> Inverse {
        let angular = self.angular.shifted(shifts).inverse();
        let [x, y, z] = &self.mixed;
        let carried = [angular.adjugate.times(x), angular.adjugate.times(y), angular.adjugate.times(z)];
        let taken = |i: usize, j: usize| dot(&self.mixed[i], &carried[j]);
        let linear = self.linear.shifted(shifts);
        let determinant = angular.determinant();
        let rest = Symmetric {
            diagonal: linear.diagonal * determinant - Vector3::new(taken(0, 0), taken(1, 1), taken(2, 2)),
            others: linear.others * determinant - Vector3::new(taken(1, 2), taken(2, 0), taken(0, 1)),
        };
        let rest = rest.inverse().of_quotients(determinant, angular.scale);
        Inverse { angular, carried, rest }
    }

    /// Returns the product of `(J Jᵀ + shift I)⁻¹` and `numbers`. Both halves of each register contain the same result. If the
    /// matrix is singular, the result is not finite or not accurate.
    #[inline(always)]
    pub fn solve(&self, shift: f64, numbers: &AngularLinear) -> Motions {
        self.inverse(f64x2::splat(shift)).times(numbers)
    }

    /// Returns the smallest eigenvalue, which must be below `bound`. `inverse` has the inverses of `J Jᵀ` and `J Jᵀ − bound I`.
    /// Uses [`root`](Self::root) if that is accurate, otherwise computes all eigenvalues.
    #[inline(always)]
    pub fn eigenvalue_below(&self, bound: f64, inverse: &Inverse) -> f64 {
        self.root(bound, inverse).unwrap_or_else(|| self.smallest_eigenvalue())
    }

    /// Returns the smallest eigenvalue from the inverses of `J Jᵀ` and `J Jᵀ − bound I`; `None` if rounding may have made it
    /// inaccurate.
    ///
    /// The eigenvalue is the smallest root of `p(s) = det(J Jᵀ − s I) = s⁶ − a s⁵ + b s⁴ − …`, with `a = tr J Jᵀ` and `b = ½ (a² −
    /// |J Jᵀ|²)`. The inverses give the values of p and of `p' = −p tr (J Jᵀ − s I)⁻¹` at 0 and at the bound β. Let h be the cubic
    /// with these four values. Then `p = h + s² (s − β)² (s² + k s + l)` with `k = 2β − a` and `l = b + 2β k − β²`.
    ///
    /// Halley's method then finds the root. It starts from the quotient of two coefficients of the power series of 1/p (Bernoulli's
    /// method). This start does not exceed the smallest root, and saves several steps compared with a start from 0. Halley's steps do
    /// not pass the root either. Each step triples the number of correct digits, so usually one step is enough.
    ///
    /// The method is fast because it needs only the two inverses.
    #[inline(always)]
    fn root(&self, bound: f64, inverse: &Inverse) -> Option<f64> {
        let values = inverse.determinants();
        let ([p, p_bound], [slope, slope_bound]) = (values.to_array(), (-inverse.slopes(values)).to_array());
        let by_bound = bound.recip();
        let secant = (p_bound - p) * by_bound;
        let square = by_bound * (3.0 * secant - 2.0 * slope - slope_bound);
        let cube = by_bound * by_bound * (slope + slope_bound - 2.0 * secant);
        let a = self.trace();
        // If two eigenvalues are 0, the slope is 0, too. If the block A has no inverse, S is unknown.
        let [block, block_bound] = inverse.angular.determinant().to_array();
        let a3 = a * a * a;
        if slope.abs() <= ROUNDING * (a3 * a * a) || block.abs().min(block_bound.abs()) <= SINGULAR * a3 {
            return None;
        }
        let k = 2.0 * bound - a;
        let l = 0.5 * (a * a - self.square()) + bound * (2.0 * k - bound);
        // The coefficients of s², s³, s⁴ and s⁵.
        let (c, d) = (square + bound * bound * l, cube + bound * (bound * k - 2.0 * l));
        let (e, f) = (l + bound * (bound - 2.0 * k), -a);
        // The coefficients of s³ and s⁴ in 1/p, times p⁴ and p⁵.
        let (slope2, pc, p2) = (slope * slope, p * c, p * p);
        let third = slope * (2.0 * pc - slope2) - d * p2;
        let fourth = slope2 * (slope2 - 3.0 * pc) + p2 * (2.0 * slope * d + c * c - e * p);
        let mut s = p * third / fourth;
        for _ in 0..STEPS {
            let s2 = s * s;
            let value = (p + slope * s) + s2 * ((c + d * s) + s2 * ((e + f * s) + s2));
            let first = (slope + 2.0 * c * s) + s2 * ((3.0 * d + 4.0 * e * s) + s2 * (5.0 * f + 6.0 * s));
            let half_second = (c + 3.0 * d * s) + s2 * ((6.0 * e + 10.0 * f * s) + 15.0 * s2);
            let (square, bend) = (first * first, value * half_second);
            let step = value * first / (square - bend);
            s -= step;
            if bend.abs() <= SMALL * square || step.abs() <= f64::EPSILON * a {
                return Some(s);
            }
        }
        None
    }

    /// Returns the sum of the squares of all numbers in the matrix.
    #[inline(always)]
    fn square(&self) -> f64 {
        let [x, y, z] = &self.mixed;
        let mixed = dot(x, x) + dot(y, y) + dot(z, z);
        first(self.angular.dot(&self.angular) + self.linear.dot(&self.linear) + 2.0 * mixed)
    }

    /// Returns the smallest eigenvalue, accurate to rounding.
    pub fn smallest_eigenvalue(&self) -> f64 {
        if self.is_singular() { 0.0 } else { self.matrix().symmetric_eigenvalues().min().max(0.0) }
    }

    /// Returns the smallest singular value of J.
    pub fn smallest_singular_value(&self) -> f64 {
        self.smallest_eigenvalue().sqrt()
    }

    /// Returns the smallest singular value of J if it is below `bound`; otherwise `None`.
    ///
    /// This is fast in the usual case: a single inverse shows that the singular value is not below `bound`.
    pub fn singular_value_below(&self, bound: f64) -> Option<f64> {
        let lies_above =
            !self.is_singular() && self.inverse(f64x2::splat(-bound * bound)).second_is_positive();
        (!lies_above).then(|| self.smallest_singular_value()).filter(|sigma| *sigma < bound)
    }

    /// Returns the largest eigenvalue, accurate to rounding.
    pub fn largest_eigenvalue(&self) -> f64 {
        self.matrix().symmetric_eigenvalues().max()
    }

    fn matrix(&self) -> Matrix6<f64> {
        Matrix6::from_fn(|i, j| {
            first(match (i < 3, j < 3) {
                (true, true) => self.angular.column(j)[i],
                (true, false) => self.mixed[j - 3][i],
                (false, true) => self.mixed[i - 3][j],
                (false, false) => self.linear.column(j - 3)[i - 3],
            })
        })
    }
}

/// Largest number of steps of the iteration to the smallest root of the determinant `p(s)`. If the roots are far apart, one or two
/// steps are enough.
const STEPS: usize = 8;

/// If the slope of the determinant `p(s)` is below this fraction of the fifth power of the eigenvalues' sum, it is only a rounding
/// error.
const ROUNDING: f64 = 1e-14;

/// If the determinant of the block A is below this fraction of the third power of the eigenvalues' sum, it is too inaccurate as a
/// divisor.
const SINGULAR: f64 = 1e-6;

/// The iteration to the smallest root ends after a step below this fraction of the distance to the other roots. The error is then
/// of the order of the cube of the step.
const SMALL: f64 = 1e-5;

/// The inverses of two matrices `J Jᵀ + shift I`, each with its own shift (see [`Gram::inverse`]). With the blocks `[A C; Cᵀ D]` of
/// a matrix, `X = A⁻¹ C` and `S = D − Cᵀ X`, the inverse is `[A⁻¹ + X S⁻¹ Xᵀ, −X S⁻¹; −S⁻¹ Xᵀ, S⁻¹]`. Only A⁻¹, X and S⁻¹ are stored.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Inverse {
    /// The inverse of the block A.
    angular: SymmetricInverse,
    /// The columns of `X = A⁻¹ C`, times the determinant of A.
    carried: [Pair; 3],
    /// The inverse of the Schur complement `S = D − Cᵀ X`.
    rest: SymmetricInverse,
}

impl Inverse {
    /// Returns whether the second of the two matrices is positive definite.
    #[inline(always)]
    pub fn second_is_positive(&self) -> bool {
        let [_, least] = self.angular.least_minors().fast_min(self.rest.least_minors()).to_array();
        least > 0.0
    }

    /// Returns the product of each inverse with the six numbers `(angular, linear)`.
    #[inline(always)]
    pub fn times(&self, (angular, linear): &AngularLinear) -> Motions {
        let (angular, linear) = (&twice(angular), twice(linear));
        let [x, y, z] = &self.carried;
        let carried = Vector3::new(dot(x, angular), dot(y, angular), dot(z, angular));
        let linear = self.rest.times(&(linear - carried * self.angular.scale));
        let [x, y, z] = &self.carried;
        let carried = x * linear.x + y * linear.y + z * linear.z;
        ((self.angular.adjugate.times(angular) - carried) * self.angular.scale, linear)
    }

    /// Returns the determinants of the two matrices, not of their inverses.
    #[inline(always)]
    fn determinants(&self) -> f64x2 {
        // The last minor of S is the determinant of S times the square of the determinant of A.
        self.rest.determinant() * self.angular.scale
    }

    /// Returns the derivative of each determinant with respect to its shift: the determinant times the trace of the inverse. With
    /// the blocks that [`Inverse`] explains, this trace is `tr A⁻¹ + tr S⁻¹ + tr S⁻¹ XᵀX`.
    ///
    /// This is fast because it needs no division by the determinant of S: the determinant of the matrix contains that factor.
    #[inline(always)]
    fn slopes(&self, determinants: f64x2) -> f64x2 {
        let [x, y, z] = &self.carried;
        let square = Symmetric {
            diagonal: Vector3::new(dot(x, x), dot(y, y), dot(z, z)),
            others: Vector3::new(dot(y, z), dot(z, x), dot(x, y)),
        };
        let scale = self.angular.scale;
        let rest = self.rest.adjugate.trace() + self.rest.adjugate.dot(&square) * (scale * scale);
        (self.angular.adjugate.trace() * determinants + rest) * scale
    }
}

/// The sums for `J Jᵀ` over the columns of a Jacobian. Each register has the sum over the even columns, and the sum over the odd
/// columns.
struct Sums {
    angular: Symmetric,
    mixed: [Pair; 3],
    linear: Symmetric,
}

impl Sums {
    /// The sums for a Jacobian without columns.
    const NONE: Self = Self { angular: Symmetric::ZEROS, mixed: [ZEROS; 3], linear: Symmetric::ZEROS };

    /// Computes the sums over `N` pairs of columns.
    #[inline(always)]
    fn of<const N: usize>(pairs: &[Motions; N]) -> Self {
        Self {
            angular: Symmetric {
                diagonal: sum(pairs, |(l, _)| l.component_mul(l)),
                others: sum(pairs, |(l, _)| others(l)),
            },
            mixed: [sum(pairs, |(l, v)| l * v.x), sum(pairs, |(l, v)| l * v.y), sum(pairs, |(l, v)| l * v.z)],
            linear: Symmetric {
                diagonal: sum(pairs, |(_, v)| v.component_mul(v)),
                others: sum(pairs, |(_, v)| others(v)),
            },
        }
    }

    /// Returns these sums plus `other`, the sums over other columns.
    #[inline(always)]
    fn plus(&self, other: &Self) -> Self {
        let ([x, y, z], [a, b, c]) = (&self.mixed, &other.mixed);
        Self {
            angular: self.angular.plus(&other.angular),
            mixed: [x + a, y + b, z + c],
            linear: self.linear.plus(&other.linear),
        }
    }

    /// Returns `J Jᵀ`: adds the sums over the even and the odd columns. `joint_count` is the number of columns.
    #[inline(always)]
    fn gram(&self, joint_count: usize) -> Gram {
        let [x, y, z] = &self.mixed;
        Gram {
            angular: self.angular.map(sum_twice),
            mixed: [sum_twice(x), sum_twice(y), sum_twice(z)],
            linear: self.linear.map(sum_twice),
            joint_count,
        }
    }
}

/// Returns the sum of `each` over the pairs.
#[inline(always)]
fn sum<const N: usize>(pairs: &[Motions; N], each: impl Fn(&Motions) -> Pair) -> Pair {
    pairs.iter().map(each).reduce(|sum, more| sum + more).unwrap_or(ZEROS)
}

/// Returns the elements yz, zx and xy of `v vᵀ`.
#[inline(always)]
fn others(v: &Pair) -> Pair {
    Vector3::new(v.y * v.z, v.z * v.x, v.x * v.y)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn the_root_of_the_determinant_is_the_smallest_eigenvalue(
            numbers in prop::collection::vec(-1.0..1.0f64, 36),
            bound in 1e-3..1.0f64,
        ) {
            let vector = |i: usize| Vector3::from_column_slice(&numbers[3 * i..3 * i + 3]);
            let gram = Gram::of_columns(6, (0..6).map(|i| (vector(2 * i), vector(2 * i + 1))));
            let smallest = gram.smallest_eigenvalue();
            let inverse = gram.inverse(f64x2::new([0.0, -bound]));
            prop_assert_eq!(inverse.second_is_positive(), smallest > bound);
            if smallest < bound {
                let found = gram.eigenvalue_below(bound, &inverse);
                // If two eigenvalues are equal, half of the digits are lost.
                prop_assert!((found - smallest).abs() < 3e-8, "{} instead of {}", found, smallest);
            }
        }
    }
}
