//! Evaluates equations 13 and 31 to 36 of the paper. Shows which expressions equal the logarithm of a pose or of a product, and
//! which do not.

use dq_algebra::UnitDualQuaternion;
use nalgebra::{UnitQuaternion, Vector3, Vector6};
use serde::Serialize;

/// Both sides of equations 33 to 36 for `q = q₁ q₂`, as half-log pairs \[rad, m\] (eq. 32).
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LogarithmEquations {
    /// The left side of equations 33 and 34, `log q`.
    pub log_q: [f64; 6],
    /// The right side of eq. 33, `log(q₁ q₂)`. It equals the left side.
    pub log_q1_q2: [f64; 6],
    /// The right side of eq. 34, `log q₁ + log q₂`. It does not equal the left side.
    pub log_q1_plus_log_q2: [f64; 6],
    /// One side of equations 35 and 36, `log q₂`.
    pub log_q2: [f64; 6],
    /// The other side of eq. 35, `log q − log q₁`. It does not equal `log q₂`.
    pub log_q_minus_log_q1: [f64; 6],
    /// The other side of eq. 36, `log(q₁* q)`. It equals `log q₂`.
    pub log_conjugate_q1_q: [f64; 6],
}

impl LogarithmEquations {
    /// Evaluates the equations for a pose `q` and its factor `q₁`. `q₂` is computed from the half-log pair of `q₁* q`, so that
    /// equality is not trivial.
    pub fn new(q: &UnitDualQuaternion, q1: &UnitDualQuaternion) -> Self {
        let relative = q1.inverse() * *q;
        let q2 = UnitDualQuaternion::half_exp(&relative.half_log());
        let sides = [
            q.half_log(),
            (*q1 * q2).half_log(),
            q1.half_log() + q2.half_log(),
            q2.half_log(),
            q.half_log() - q1.half_log(),
            relative.half_log(),
        ];
        let [log_q, log_q1_q2, log_q1_plus_log_q2, log_q2, log_q_minus_log_q1, log_conjugate_q1_q] =
            sides.map(<[f64; 6]>::from);
        Self { log_q, log_q1_q2, log_q1_plus_log_q2, log_q2, log_q_minus_log_q1, log_conjugate_q1_q }
    }

    /// Returns the largest difference between the components of the two sides, for equations 33, 34, 35 and 36.
    pub fn differences(&self) -> [f64; 4] {
        [
            (self.log_q, self.log_q1_q2),
            (self.log_q, self.log_q1_plus_log_q2),
            (self.log_q_minus_log_q1, self.log_q2),
            (self.log_conjugate_q1_q, self.log_q2),
        ]
        .map(|(left, right)| (Vector6::from(left) - Vector6::from(right)).amax())
    }
}

/// The differences between the pose of eq. 13, whose rotation is r and whose translation is t, and the poses that equations 31 and
/// 32 give for the same r and t.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct PoseEquations {
    /// The distance between t and the translation of `r exp(ε ½ t)` (eq. 31) \[m\]. This translation is `R t`, because
    /// `r exp(ε ½ t) = r + ε ½ r t`. In contrast, eq. 13 has `r + ε ½ t r`, whose translation is t.
    pub product_off_m: f64,
    /// The distance between t and the translation of the exponential of `½ θ k + ε ½ t` (eq. 32) \[m\].
    pub logarithm_off_m: f64,
}

impl PoseEquations {
    /// Evaluates the equations for a pose `q`.
    pub fn new(q: &UnitDualQuaternion) -> Self {
        let translation = q.translation();
        let rotation = UnitDualQuaternion::from_parts(q.rotation(), Vector3::zeros());
        let shift = UnitDualQuaternion::from_parts(UnitQuaternion::identity(), translation);
        let off = |pose: UnitDualQuaternion| (pose.translation() - translation).norm();
        // Twice the half-log pair is a twist, as in `screw_exp`.
        let exponential = UnitDualQuaternion::screw_exp(&(2.0 * q.half_log()));
        Self { product_off_m: off(rotation * shift), logarithm_off_m: off(exponential) }
    }
}
