//! `J Jᵀ`, its inverse and its smallest eigenvalue.

use super::symmetric::Symmetric;
use crate::arm::{ArmState, pair};
use nalgebra::{Matrix6, Vector3};
use wide::f64x2;

/// `J Jᵀ` of a 6×n Jacobian in four blocks `[A C; Cᵀ D]` of 3×3, angular first.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Gram {
    angular: Symmetric,
    /// C by its columns.
    mixed: [Vector3<f64>; 3],
    linear: Symmetric,
    /// How many columns J has, and rows that are not used.
    joint_count: usize,
}

/// A vector of six numbers in two halves, angular and linear.
pub(super) type Halves<T = f64> = (Vector3<T>, Vector3<T>);

/// `J Jᵀ` on its way: of every other column, and of those between.
struct GramPair {
    angular: Symmetric<f64x2>,
    mixed: [Vector3<f64x2>; 3],
    linear: Symmetric<f64x2>,
}

impl GramPair {
    #[inline(always)]
    fn add(&mut self, (angular, linear): &Halves<f64x2>) {
        self.angular.add_square(angular);
        let [x, y, z] = &mut self.mixed;
        *x += angular * linear.x;
        *y += angular * linear.y;
        *z += angular * linear.z;
        self.linear.add_square(linear);
    }
}

impl Gram {
    /// Of the Jacobian at the tool along the base's axes; its singular values are those along any axes.
    #[inline(always)]
    pub fn of(arm: &ArmState) -> Self {
        Self::of_columns(arm.joint_count(), arm.tool_motion_pairs())
    }

    /// Of the Jacobian with so many columns, two at a time.
    #[inline(always)]
    pub fn of_columns(joint_count: usize, pairs: impl Iterator<Item = Halves<f64x2>>) -> Self {
        let mut sums = GramPair {
            angular: Symmetric::zeros(),
            mixed: [Vector3::from_element(f64x2::ZERO); 3],
            linear: Symmetric::zeros(),
        };
        for columns in pairs {
            sums.add(&columns);
        }
        Self {
            angular: sums.angular.sum(),
            mixed: sums.mixed.map(|column| pair::sum(&column)),
            linear: sums.linear.sum(),
            joint_count,
        }
    }

    /// Of columns whose first `rows` numbers alone are used: along the others it is as stiff as along all of these together.
    pub fn stiffened(mut self, rows: usize) -> Self {
        let trace = self.trace();
        let [angular, linear] = [&mut self.angular, &mut self.linear].map(|block| block.diagonal.iter_mut());
        for stiffness in angular.chain(linear).skip(rows) {
            *stiffness = trace;
            self.joint_count += 1;
        }
        self
    }

    /// The sum of the eigenvalues.
    pub fn trace(&self) -> f64 {
        self.angular.trace() + self.linear.trace()
    }

    /// Whether there are too few joints for an inverse.
    pub fn is_singular(&self) -> bool {
        self.joint_count < 6
    }

    /// The inverse of `J Jᵀ + shift I`; not finite, or of no use, where there is none.
    ///
    /// Fast because two closed inverses of 3×3, with a division each, are the whole of it; a Cholesky decomposition of 6×6 waits for six
    /// roots and six divisions, one after the other.
    #[inline(always)]
    pub fn inverse(&self, shift: f64) -> Inverse {
        let angular = self.angular.shifted(shift).inverse();
        let carried = self.mixed.map(|column| angular.times(&column));
        let taken = |i: usize, j: usize| self.mixed[i].dot(&carried[j]);
        let rest = Symmetric {
            diagonal: self.linear.diagonal.add_scalar(shift)
                - Vector3::new(taken(0, 0), taken(1, 1), taken(2, 2)),
            others: self.linear.others - Vector3::new(taken(1, 2), taken(2, 0), taken(0, 1)),
        };
        Inverse { angular, carried, rest: rest.inverse() }
    }

    /// The smallest eigenvalue, to rounding; `inverse` is that without a shift.
    ///
    /// Fast because that inverse is what the damped solution begins with, and mostly one more is all that it takes.
    pub fn smallest_eigenvalue(&self, inverse: &Inverse) -> f64 {
        if self.is_singular() {
            return 0.0;
        }
        self.lonely_eigenvalue(inverse).unwrap_or_else(|| {
            let bound = inverse.smallest_eigenvalue_bound();
            // Where rounding has the last word of it, the steps begin below 0.
            let begin = if bound > NEGLIGIBLE * self.trace() { bound } else { -1e-3 * self.trace() };
            self.eigenvalue_above(begin)
        })
    }

    /// The smallest singular value of J.
    pub fn smallest_singular_value(&self) -> f64 {
        self.smallest_eigenvalue(&self.inverse(0.0)).max(0.0).sqrt()
    }

    /// The smallest eigenvalue where it is so much smaller than the others that its inverse is more than theirs together.
    ///
    /// Rayleigh quotients on the way of the inverse iteration: each step multiplies what they lack by `((μ₁ − s)/(μ₂ − s))²`, with the shift
    /// s. That is 0 first, as that inverse is there already, and then, where it takes long, the last quotient. The trace of the
    /// inverse says how far the next eigenvalue is at least, and that none smaller was missed.
    fn lonely_eigenvalue(&self, unshifted: &Inverse) -> Option<f64> {
        let trace = unshifted.trace();
        let mut direction = unshifted.strong_column();
        let (mut inverse, mut shift, mut smallest) = (*unshifted, 0.0, f64::INFINITY);
        for _ in 0..STEPS {
            let next = inverse.times(&direction);
            let before = smallest;
            smallest = shift + dot(&direction, &next) / dot(&next, &next);
            direction = next;
            // The inverses of the other eigenvalues together, by that of the smallest.
            let others = smallest * trace - 1.0;
            if !(-1e-3..1.0).contains(&others) {
                return None;
            }
            // The rate as a quotient that nothing has to wait for.
            let (near, far) = ((smallest - shift) * others, smallest - shift * others);
            let (near, far) = (near * near, far * far);
            if (before - smallest).abs() * near <= 1e-14 * smallest * far {
                return Some(smallest);
            }
            if near > SLOW * far {
                (shift, inverse) = (smallest, self.inverse(-smallest));
            }
        }
        None
    }

    /// The largest eigenvalue, to rounding: minus the smallest one of `−J Jᵀ`.
    pub fn largest_eigenvalue(&self) -> f64 {
        let negated = |block: &Symmetric| Symmetric { diagonal: -block.diagonal, others: -block.others };
        let negative = Self {
            angular: negated(&self.angular),
            mixed: self.mixed.map(|column| -column),
            linear: negated(&self.linear),
            ..*self
        };
        -negative.eigenvalue_above(-1.001 * self.trace())
    }

    /// The smallest eigenvalue, which is above `below`.
    ///
    /// Laguerre's iteration from below: for a symmetric matrix it never passes the smallest root and converges cubically, by three or
    /// four inverses, where it is a simple one; else, which is rare, the eigenvalue decomposition is taken.
    fn eigenvalue_above(&self, mut below: f64) -> f64 {
        let rounding = f64::EPSILON * self.trace().abs();
        for _ in 0..STEPS {
            let step = self.inverse(-below).smallest_eigenvalue_bound();
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
        Matrix6::from_fn(|i, j| match (i < 3, j < 3) {
            (true, true) => self.angular.column(j)[i],
            (true, false) => self.mixed[j - 3][i],
            (false, true) => self.mixed[i - 3][j],
            (false, false) => self.linear.column(j - 3)[i - 3],
        })
    }
}

/// Steps that are tried.
const STEPS: usize = 8;

/// Beyond this rate another shift takes less time than more steps.
const SLOW: f64 = 1e-3;

/// A step of this part of the eigenvalue is the last one.
const SMALL: f64 = 1e-6;

/// An eigenvalue of this part of the trace may be an error of rounding.
const NEGLIGIBLE: f64 = 1e-12;

/// The inverse of a [`Gram`], by what it is made of: `[A⁻¹ + X S⁻¹ Xᵀ, −X S⁻¹; −S⁻¹ Xᵀ, S⁻¹]` with `X = A⁻¹ C`, `S = D − Cᵀ X`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Inverse {
    /// `A⁻¹`.
    angular: Symmetric,
    /// X by its columns.
    carried: [Vector3<f64>; 3],
    /// `S⁻¹`.
    rest: Symmetric,
}

impl Inverse {
    /// The product with `(ω, v)`.
    #[inline(always)]
    pub fn times(&self, (angular, linear): &Halves) -> Halves {
        let [x, y, z] = &self.carried;
        let carried = Vector3::new(x.dot(angular), y.dot(angular), z.dot(angular));
        let linear = self.rest.times(&(linear - carried));
        (self.angular.times(angular) - self.carry(&linear), linear)
    }

    /// X times a vector.
    #[inline(always)]
    fn carry(&self, v: &Vector3<f64>) -> Vector3<f64> {
        let [x, y, z] = &self.carried;
        x * v.x + y * v.y + z * v.z
    }

    /// `XᵀX`.
    #[inline(always)]
    fn carried_square(&self) -> Symmetric {
        let [x, y, z] = &self.carried;
        Symmetric {
            diagonal: Vector3::new(x.dot(x), y.dot(y), z.dot(z)),
            others: Vector3::new(y.dot(z), z.dot(x), x.dot(y)),
        }
    }

    /// The sum of the eigenvalues: with the trace of a product turned round, `tr A⁻¹ + tr S⁻¹ + tr S⁻¹ XᵀX`.
    #[inline(always)]
    pub fn trace(&self) -> f64 {
        self.angular.trace() + self.rest.trace() + self.rest.dot(&self.carried_square())
    }

    /// The column of the largest of the last three numbers on the diagonal.
    #[inline(always)]
    fn strong_column(&self) -> Halves {
        let column = self.rest.column(self.rest.diagonal.iamax());
        (-self.carry(&column), column)
    }

    /// What the smallest eigenvalue of the matrix that was inverted exceeds, if that is positive definite: Laguerre's bound `n / (t +
    /// √((n−1)(n s − t²)))`, with t the trace of the inverse, s the sum of its squares, n = 6. It is at most √n too small.
    fn smallest_eigenvalue_bound(&self) -> f64 {
        let trace = self.trace();
        // The squares of [A⁻¹ + X S⁻¹ Xᵀ, −X S⁻¹; −S⁻¹ Xᵀ, S⁻¹], block by block.
        let columns = [0, 1, 2].map(|i| self.carry(&self.rest.column(i)));
        let mixed: f64 = columns.iter().map(Vector3::norm_squared).sum();
        let angular = (0..3).map(|i| {
            let row = Vector3::from_fn(|j, _| self.carried[j][i]);
            (self.angular.column(i) + columns[0] * row.x + columns[1] * row.y + columns[2] * row.z)
                .norm_squared()
        });
        let squares = angular.sum::<f64>() + 2.0 * mixed + self.rest.dot(&self.rest);
        6.0 / (trace + (5.0 * (6.0 * squares - trace * trace)).max(0.0).sqrt())
    }
}

fn dot(a: &Halves, b: &Halves) -> f64 {
    a.0.dot(&b.0) + a.1.dot(&b.1)
}
