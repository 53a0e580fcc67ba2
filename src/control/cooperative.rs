//! Two arms as one: feedback on the pose of one tool relative to the other (paper §4; Adorno et al. 2010).

use super::damped_inverse::Damping;
use super::names::named;
use crate::arm::ArmState;
use crate::dq::{Matrix8, UnitDualQuaternion, Vector8};
use nalgebra::{Quaternion, Vector3};

named! {
    /// What of the relative pose is controlled; the rest is free.
    "primitive" Primitive {
        /// The translation `t_r` \[m\] of the right tool in the left tool's frame (eq. 25): the paper's experiment.
        RelativePosition = "relative_position",
        /// The rotation `r_r`.
        RelativeOrientation = "relative_orientation",
        /// The whole pose `q_r`.
        RelativePose = "relative_pose",
        /// The distance of the tools, as `|t_r|²` \[m²\], which is smooth everywhere.
        RelativeDistance = "relative_distance",
    }
}

named! {
    /// How the error becomes joint velocities.
    "controller" Feedback {
        /// `θ̇ = Jᵀ K e`, as the paper.
        Transpose = "transpose",
        /// `θ̇ = J⁺ K e`: the error decays as `exp(−K t)` away from singularities.
        DampedInverse = "damped_inverse",
    }
}

/// The two-arm law with its gains.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cooperative {
    /// What is controlled.
    pub primitive: Primitive,
    /// The form of the law.
    pub feedback: Feedback,
    /// `K` of the transposed form.
    pub transpose_gain: f64,
    /// `K` of the inverse form [1/s].
    pub inverse_gain: f64,
    /// The damped inverse.
    pub damping: Damping,
}

impl Cooperative {
    /// Joint velocities [rad/s] that move the relative pose towards `left_from_goal`, whose sign is chosen already. `arms` is
    /// the two arms as one ([`ArmState::relative`]); written to `theta_dot`, left arm first, without allocating.
    pub fn joint_velocity(
        &self,
        arms: &ArmState,
        left_from_goal: &UnitDualQuaternion,
        theta_dot: &mut [f64],
    ) {
        let error = self.primitive.error(&arms.base_from_tool(), left_from_goal);
        let (gain, feedback) = match self.feedback {
            Feedback::Transpose => (self.transpose_gain, error),
            Feedback::DampedInverse => (self.inverse_gain, self.invert(&self.gram(arms), &error)),
        };
        self.transpose(arms, &(gain * feedback), theta_dot);
    }

    /// `Jᵀ e`, written to `descent`: the direction in which the joints reduce `½|e|²` fastest. Returns `|e|`.
    pub fn steepest_descent(
        &self,
        arms: &ArmState,
        left_from_goal: &UnitDualQuaternion,
        descent: &mut [f64],
    ) -> f64 {
        let error = self.primitive.error(&arms.base_from_tool(), left_from_goal);
        self.transpose(arms, &error, descent);
        error.norm()
    }

    /// `Jᵀ y`, written to `product`.
    fn transpose(&self, arms: &ArmState, y: &Vector8, product: &mut [f64]) {
        let mut slots = product.iter_mut();
        self.primitive.for_each_column(arms, |column| {
            if let Some(slot) = slots.next() {
                *slot = column.dot(y);
            }
        });
    }

    /// The fastest rate [1/s] at which a small error decays with `arms` where they are.
    pub fn fastest_rate(&self, arms: &ArmState) -> f64 {
        match self.feedback {
            Feedback::Transpose => self.transpose_gain * self.gram(arms).symmetric_eigenvalues().max(),
            Feedback::DampedInverse => self.inverse_gain,
        }
    }

    /// The smallest singular value of the primitive's Jacobian.
    pub fn smallest_singular_value(&self, arms: &ArmState) -> f64 {
        self.modes(&self.gram(arms)).map(|(square, _)| square).fold(f64::INFINITY, f64::min).max(0.0).sqrt()
    }

    /// `J Jᵀ`, zero beyond the primitive's rows.
    fn gram(&self, arms: &ArmState) -> Matrix8 {
        let mut gram = Matrix8::zeros();
        self.primitive.for_each_column(arms, |column| gram += column * column.transpose());
        gram
    }

    /// `(J Jᵀ + λ² I)⁻¹ e` on the range of J; what of e no motion can change is left out.
    fn invert(&self, gram: &Matrix8, error: &Vector8) -> Vector8 {
        // One decomposition gives both: how far to damp, and the inverse.
        let modes = self.modes(gram);
        let smallest = modes.clone().map(|(square, _)| square).fold(f64::INFINITY, f64::min).max(0.0);
        let lambda_squared = self.damping.lambda_squared(smallest.sqrt());
        let modes = modes.map(|(square, mode)| {
            let stiffness = square.max(0.0) + lambda_squared;
            if stiffness > f64::EPSILON { mode * (mode.dot(error) / stiffness) } else { Vector8::zeros() }
        });
        modes.sum()
    }

    /// The primitive's modes: as many as it has degrees of freedom, the strongest ones, each with its squared singular value.
    fn modes(&self, gram: &Matrix8) -> impl Iterator<Item = (f64, Vector8)> + Clone + use<> {
        let eigen = gram.symmetric_eigen();
        let mut order: [usize; 8] = std::array::from_fn(|i| i);
        order.sort_unstable_by(|a, b| eigen.eigenvalues[*b].total_cmp(&eigen.eigenvalues[*a]));
        let count = self.primitive.degrees_of_freedom();
        order
            .into_iter()
            .take(count)
            .map(move |i| (eigen.eigenvalues[i], eigen.eigenvectors.column(i).into_owned()))
    }
}

impl Primitive {
    /// Degrees of freedom that the primitive takes: the rank of its Jacobian.
    fn degrees_of_freedom(self) -> usize {
        match self {
            Self::RelativePosition | Self::RelativeOrientation => 3,
            Self::RelativePose => 6,
            Self::RelativeDistance => 1,
        }
    }

    /// The error `goal − now` in the primitive's own numbers (eq. 16): position 3 \[m\], orientation 4, pose 8, squared distance
    /// 1 \[m²\]; zeros beyond.
    pub fn error(self, left_from_right: &UnitDualQuaternion, left_from_goal: &UnitDualQuaternion) -> Vector8 {
        let (now, goal) = (left_from_right.translation(), left_from_goal.translation());
        match self {
            Self::RelativePosition => position(&(goal - now)),
            Self::RelativeOrientation => orientation(&(left_from_goal.real() - left_from_right.real())),
            Self::RelativePose => left_from_goal.to_vector8() - left_from_right.to_vector8(),
            Self::RelativeDistance => distance(goal.norm_squared() - now.norm_squared()),
        }
    }

    /// The primitive's Jacobian, column by column: left arm first, then right; zeros beyond the primitive's rows.
    ///
    /// With the arms as one, a joint's axis line (direction l, point p), tool pose `q = r + ε d` and tool point t: position
    /// `l × (t − p)`, which is eq. 27; orientation `½ l r`; pose `½ (l + ε p×l) q`; squared distance `2 t·(l × (t − p))`. Prismatic:
    /// `l`; 0; `½ ε l q`; `2 t·l`.
    pub fn for_each_column(self, arms: &ArmState, mut each: impl FnMut(Vector8)) {
        let (real, point) = (arms.base_from_tool().real(), arms.tool_point());
        match self {
            Self::RelativePosition => arms.point_columns().for_each(|column| each(position(&column))),
            Self::RelativeOrientation => {
                let column = |direction| orientation(&(Quaternion::from_imag(0.5 * direction) * real));
                arms.axes().for_each(|axis| each(column(axis.angular())));
            }
            Self::RelativePose => arms.pose_columns().for_each(each),
            Self::RelativeDistance => {
                arms.point_columns().for_each(|column| each(distance(2.0 * point.dot(&column))));
            }
        }
    }
}

fn position(t: &Vector3<f64>) -> Vector8 {
    Vector8::from([t.x, t.y, t.z, 0.0, 0.0, 0.0, 0.0, 0.0])
}

fn orientation(r: &Quaternion<f64>) -> Vector8 {
    Vector8::from([r.w, r.i, r.j, r.k, 0.0, 0.0, 0.0, 0.0])
}

fn distance(d: f64) -> Vector8 {
    Vector8::from([d, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0])
}
