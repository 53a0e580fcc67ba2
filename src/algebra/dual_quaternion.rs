//! Dual quaternions of any norm.

use super::Vector8;
use nalgebra::{Quaternion, Vector6};
use std::fmt::{self, Display, Formatter};
use std::ops::{Mul, MulAssign};

/// A dual quaternion `real + ε dual` with `ε² = 0`. Its eight numbers are arbitrary.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DualQuaternion {
    /// The real part.
    pub real: Quaternion<f64>,
    /// The dual part.
    pub dual: Quaternion<f64>,
}

impl DualQuaternion {
    /// Creates a dual quaternion from `[real w x y z, dual w x y z]` (the paper's `R82dual`).
    #[doc(alias = "R82dual")]
    pub fn from_vector8(vector: &Vector8) -> Self {
        let quaternion = |i: usize| Quaternion::new(vector[i], vector[i + 1], vector[i + 2], vector[i + 3]);
        Self { real: quaternion(0), dual: quaternion(4) }
    }

    /// Creates the pure dual quaternion `(0, a) + ε (0, b)` from the vector `(a, b)` of six numbers, such as a logarithm or a twist
    /// (the paper's `R62dual`).
    #[doc(alias = "R62dual")]
    pub fn from_vector6(vector: &Vector6<f64>) -> Self {
        let pure = |i: usize| Quaternion::new(0.0, vector[i], vector[i + 1], vector[i + 2]);
        Self { real: pure(0), dual: pure(3) }
    }

    /// Returns `[real w x y z, dual w x y z]`.
    pub fn to_vector8(self) -> Vector8 {
        let (r, d) = (self.real, self.dual);
        Vector8::from([r.w, r.i, r.j, r.k, d.w, d.i, d.j, d.k])
    }

    /// Returns the dual quaternion with both parts conjugated (eq. 6, the paper's `cdualq`).
    #[doc(alias = "cdualq")]
    pub fn conjugate(self) -> Self {
        Self { real: self.real.conjugate(), dual: self.dual.conjugate() }
    }
}

/// The Hamilton product `(a + εb)(c + εd) = ac + ε(ad + bc)` (the paper's `dqmult`).
impl Mul for DualQuaternion {
    type Output = Self;
    fn mul(self, right: Self) -> Self {
        Self { real: self.real * right.real, dual: self.real * right.dual + self.dual * right.real }
    }
}

impl MulAssign for DualQuaternion {
    fn mul_assign(&mut self, right: Self) {
        *self = *self * right;
    }
}

/// Writes `w + xi + yj + zk + ε(w + xi + yj + zk)`. A precision such as `{:.3}` applies to each number.
impl Display for DualQuaternion {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let quaternion = |f: &mut Formatter<'_>, q: &Quaternion<f64>| {
            Display::fmt(&q.w, f)?;
            [(q.i, 'i'), (q.j, 'j'), (q.k, 'k')].into_iter().try_for_each(|(number, unit)| {
                f.write_str(if number.is_sign_negative() { " - " } else { " + " })?;
                Display::fmt(&number.abs(), f)?;
                write!(f, "{unit}")
            })
        };
        quaternion(f, &self.real)?;
        f.write_str(" + ε(")?;
        quaternion(f, &self.dual)?;
        f.write_str(")")
    }
}
