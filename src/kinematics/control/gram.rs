//! `J Jᵀ`, its inverse and its smallest eigenvalue.

use super::angular_linear::{AngularLinear, apart, inner};
use super::symmetric::{Symmetric, SymmetricInverse};
use crate::arm::ArmState;
use crate::arm::pair::{Pair, ZEROS, dot, sum_twice};
use nalgebra::{Matrix6, Vector3};
use wide::f64x2;

/// `J Jᵀ` of a 6×n Jacobian in four blocks `[A C; Cᵀ D]` of 3×3, angular first; every number twice.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Gram {
    angular: Symmetric,
    /// C by its columns.
    mixed: [Pair; 3],
    linear: Symmetric,
    /// How many columns J has, and rows that are not used.
    joint_count: usize,
}

impl Gram {
    /// Of the Jacobian at the tool along the base's axes; its singular values are those along any axes.
    ///
    /// Fast because six columns are summed at once: there are more sums than registers, and each turn of a loop writes them all to memory.
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

    /// Of the Jacobian with so many columns, two at a time.
    pub fn of_columns(joint_count: usize, pairs: impl Iterator<Item = AngularLinear<f64x2>>) -> Self {
        pairs.fold(Sums::NONE, |sums, pair| sums.plus(&Sums::of(&[pair]))).gram(joint_count)
    }

    /// Of columns whose first `rows` numbers alone are used: along the others it is as stiff as along all of these together.
    pub fn stiffened(mut self, rows: usize) -> Self {
        let trace = f64x2::splat(self.trace());
        let [angular, linear] = [&mut self.angular, &mut self.linear].map(|block| block.diagonal.iter_mut());
        for stiffness in angular.chain(linear).skip(rows) {
            *stiffness = trace;
            self.joint_count += 1;
        }
        self
    }

    /// The sum of the eigenvalues.
    pub fn trace(&self) -> f64 {
        first(self.angular.trace() + self.linear.trace())
    }

    /// Whether there are too few joints for an inverse.
    pub fn is_singular(&self) -> bool {
        self.joint_count < 6
    }

    /// The inverses of `J Jᵀ + shift I` with two shifts; not finite, or of no use, where there is none.
    ///
    /// Fast because two closed inverses of 3×3 are the whole of it, the second one of `det(A) S`, so that neither waits for the other's
    /// division, and two shifts take no more operations than one; a Cholesky decomposition of 6×6 waits for six roots and six divisions,
    /// one after the other.
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

    /// The smallest eigenvalue, to rounding.
    pub fn smallest_eigenvalue(&self) -> f64 {
        if self.is_singular() {
            return 0.0;
        }
        let bound = self.above(0.0).smallest_eigenvalue_bound();
        if bound > NEGLIGIBLE * self.trace() {
            // Where several eigenvalues are 0 rounding has the last word of the bound, which is then that of any matrix: the steps begin
            // below 0.
            let above = self.above(bound);
            if above.second_is_positive() {
                return self.eigenvalue_above(bound, above);
            }
        }
        let below = -1e-3 * self.trace();
        self.eigenvalue_above(below, self.above(below))
    }

    /// The inverse of `J Jᵀ − below I`.
    fn above(&self, below: f64) -> Inverse {
        self.inverse(f64x2::splat(-below))
    }

    /// The smallest singular value of J.
    pub fn smallest_singular_value(&self) -> f64 {
        self.smallest_eigenvalue().max(0.0).sqrt()
    }

    /// The same where it is below `bound`.
    ///
    /// Fast because one inverse says where it is not, which is most often.
    pub fn singular_value_below(&self, bound: f64) -> Option<f64> {
        let lies_above = !self.is_singular() && self.above(bound * bound).second_is_positive();
        (!lies_above).then(|| self.smallest_singular_value()).filter(|sigma| *sigma < bound)
    }

    /// The largest eigenvalue, to rounding: minus the smallest one of `−J Jᵀ`.
    pub fn largest_eigenvalue(&self) -> f64 {
        let negated = |numbers: &Pair| -numbers;
        let negative = Self {
            angular: self.angular.map(negated),
            mixed: self.mixed.map(|column| -column),
            linear: self.linear.map(negated),
            ..*self
        };
        let below = -1.001 * self.trace();
        -negative.eigenvalue_above(below, negative.above(below))
    }

    /// The smallest eigenvalue, which is above `below`, with the inverse [`above`](Self::above) that.
    ///
    /// Laguerre's iteration from below: for a symmetric matrix it never passes the smallest root and converges cubically, by three or
    /// four inverses, where it is a simple one; else, which is rare, the eigenvalue decomposition is taken.
    fn eigenvalue_above(&self, mut below: f64, mut above: Inverse) -> f64 {
        let rounding = f64::EPSILON * self.trace().abs();
        for _ in 0..STEPS {
            let step = above.smallest_eigenvalue_bound();
            // Where rounding has the last word the inverse is that of any matrix.
            if step.is_nan() || step <= rounding {
                return below;
            }
            below += step;
            // What is left is of the order of the cube.
            if step <= SMALL * below.abs() {
                return below;
            }
            above = self.above(below);
        }
        self.matrix().symmetric_eigenvalues().min()
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

/// Steps that are tried.
const STEPS: usize = 8;

/// A step of this part of the eigenvalue is the last one.
const SMALL: f64 = 1e-6;

/// An eigenvalue of this part of the trace may be an error of rounding.
const NEGLIGIBLE: f64 = 1e-12;

/// The inverses of a [`Gram`] with two shifts, by what they are made of: `[A⁻¹ + X S⁻¹ Xᵀ, −X S⁻¹; −S⁻¹ Xᵀ, S⁻¹]` with `X = A⁻¹ C`, `S =
/// D − Cᵀ X`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Inverse {
    /// `A⁻¹`.
    angular: SymmetricInverse,
    /// X by its columns, times the determinant of A.
    carried: [Pair; 3],
    /// `S⁻¹`.
    rest: SymmetricInverse,
}

impl Inverse {
    /// Whether the second matrix is positive definite.
    #[inline(always)]
    pub fn second_is_positive(&self) -> bool {
        let [_, least] = self.angular.least_minors().fast_min(self.rest.least_minors()).to_array();
        least > 0.0
    }

    /// How many eigenvalues of the second matrix are negative: as many as of A and S together.
    pub fn second_negatives(&self) -> usize {
        self.angular.second_negatives() + self.rest.second_negatives()
    }

    /// The products with `(ω, v)`.
    #[inline(always)]
    pub fn times(&self, (angular, linear): &AngularLinear<f64x2>) -> AngularLinear<f64x2> {
        let [x, y, z] = &self.carried;
        let carried = Vector3::new(dot(x, angular), dot(y, angular), dot(z, angular));
        let linear = self.rest.times(&(linear - carried * self.angular.scale));
        ((self.angular.adjugate.times(angular) - self.carry(&linear)) * self.angular.scale, linear)
    }

    /// X times a vector, times the determinant of A.
    #[inline(always)]
    fn carry(&self, v: &Pair) -> Pair {
        let [x, y, z] = &self.carried;
        x * v.x + y * v.y + z * v.z
    }

    /// `XᵀX`.
    fn carried_square(&self) -> Symmetric {
        let [x, y, z] = self.carried.map(|column| column * self.angular.scale);
        Symmetric {
            diagonal: Vector3::new(dot(&x, &x), dot(&y, &y), dot(&z, &z)),
            others: Vector3::new(dot(&y, &z), dot(&z, &x), dot(&x, &y)),
        }
    }

    /// The sum of the first one's eigenvalues: with the trace of a product turned round, `tr A⁻¹ + tr S⁻¹ + tr S⁻¹ XᵀX`.
    pub fn trace(&self) -> f64 {
        let rest = self.rest.adjugate.dot(&self.carried_square()) * self.rest.scale;
        first(self.angular.trace() + self.rest.trace() + rest)
    }

    /// A Rayleigh quotient of the matrix without its shifts, near its smallest eigenvalue, and the vector: after a step of inverse
    /// iteration with either shift the lesser quotient, which is the nearer one.
    #[inline(always)]
    pub fn weak_direction(&self, shifts: f64x2) -> (f64, AngularLinear) {
        let column = self.strong_column();
        let next = self.times(&column);
        let [one, other] = (inner(&column, &next) / inner(&next, &next) - shifts).to_array();
        let [first, second] = apart(&next);
        // Without an inverse the first quotient may be none.
        if one <= other { (one, first) } else { (other, second) }
    }

    /// The columns, but for their lengths, of the largest of the first matrix's last three numbers on the diagonal.
    #[inline(always)]
    fn strong_column(&self) -> AngularLinear<f64x2> {
        let rest = &self.rest.adjugate;
        let column = rest.column(rest.diagonal.map(first).iamax());
        (-self.carry(&column) * self.angular.scale, column)
    }

    /// What the smallest eigenvalue of the first matrix exceeds, if that is positive definite: Laguerre's bound `n / (t +
    /// √((n−1)(n s − t²)))`, with t the trace of the inverse, s the sum of its squares, n = 6. It is at most √n too small.
    fn smallest_eigenvalue_bound(&self) -> f64 {
        let trace = self.trace();
        // The squares of [A⁻¹ + X S⁻¹ Xᵀ, −X S⁻¹; −S⁻¹ Xᵀ, S⁻¹], block by block.
        let (angular, rest, scale) = (self.angular.matrix(), self.rest.matrix(), self.angular.scale);
        let columns = [0, 1, 2].map(|i| self.carry(&rest.column(i)) * scale);
        let square = |v: &Pair| first(dot(v, v));
        let mixed: f64 = columns.iter().map(square).sum();
        let corner = (0..3).map(|i| {
            let row = Vector3::from_fn(|j, _| self.carried[j][i] * scale);
            square(&(angular.column(i) + columns[0] * row.x + columns[1] * row.y + columns[2] * row.z))
        });
        let squares = corner.sum::<f64>() + 2.0 * mixed + first(rest.dot(&rest));
        6.0 / (trace + (5.0 * (6.0 * squares - trace * trace)).max(0.0).sqrt())
    }
}

/// `J Jᵀ` of every other column of a Jacobian, beside that of those between.
struct Sums {
    angular: Symmetric,
    mixed: [Pair; 3],
    linear: Symmetric,
}

impl Sums {
    /// Of no columns.
    const NONE: Self = Self { angular: Symmetric::ZEROS, mixed: [ZEROS; 3], linear: Symmetric::ZEROS };

    /// Of so many pairs of columns.
    #[inline(always)]
    fn of<const N: usize>(pairs: &[AngularLinear<f64x2>; N]) -> Self {
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

    /// Of the columns of both.
    #[inline(always)]
    fn plus(&self, other: &Self) -> Self {
        let ([x, y, z], [a, b, c]) = (&self.mixed, &other.mixed);
        Self {
            angular: self.angular.plus(&other.angular),
            mixed: [x + a, y + b, z + c],
            linear: self.linear.plus(&other.linear),
        }
    }

    /// Of all columns, which are so many.
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

/// The sum of what is made of each pair.
#[inline(always)]
fn sum<const N: usize>(
    pairs: &[AngularLinear<f64x2>; N],
    each: impl Fn(&AngularLinear<f64x2>) -> Pair,
) -> Pair {
    pairs.iter().map(each).reduce(|sum, more| sum + more).unwrap_or(ZEROS)
}

/// Of `v vᵀ` the numbers yz, zx and xy.
#[inline(always)]
fn others(v: &Pair) -> Pair {
    Vector3::new(v.y * v.z, v.z * v.x, v.x * v.y)
}

/// The first of two numbers.
#[inline(always)]
fn first(numbers: f64x2) -> f64 {
    let [first, _] = numbers.to_array();
    first
}
