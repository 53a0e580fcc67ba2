//! Two arms as one: feedback on the pose of one tool relative to the other (paper §4; Adorno et al. 2010).

use super::damped_inverse::Damping;
use super::gram::Gram;
use super::halves::Halves;
use super::names::named;
use super::pose_space::PoseSpace;
use crate::arm::ArmState;
use crate::arm::pair::{ZEROS, dot, put, twice};
use crate::dq::{UnitDualQuaternion, Vector8};
use nalgebra::{Quaternion, Vector3};
use wide::f64x2;

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
        /// `θ̇ = J⁺ K e`: away from singularities the error of position and distance decays as `exp(−K t)`, and that of orientation and pose to
        /// first order, as a part of it is no motion.
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
        match self.feedback {
            Feedback::Transpose => self.transpose(arms, &(self.transpose_gain * error), theta_dot),
            Feedback::DampedInverse => self.invert(arms, &(self.inverse_gain * error), theta_dot),
        }
    }

    /// `Jᵀ (J Jᵀ + λ² I)⁻¹ e` on the range of J, written to `product`; what of e no motion can change is left out.
    ///
    /// Fast because in the six directions in which a pose can move this is the damped inverse of one arm.
    fn invert(&self, arms: &ArmState, error: &Vector8, product: &mut [f64]) {
        let space = PoseSpace::of(arms);
        let error = self.primitive.part_of(&space, error, arms);
        let (angular, linear) = self.damping.solve(&self.stiffened_gram(space, arms), &error);
        for (slots, (l, v)) in product.chunks_mut(2).zip(self.primitive.motions(space, arms)) {
            put(dot(&l, &angular) + dot(&v, &linear), slots);
        }
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
            Feedback::Transpose => {
                self.transpose_gain * self.gram(PoseSpace::of(arms), arms).largest_eigenvalue()
            }
            Feedback::DampedInverse => self.inverse_gain,
        }
    }

    /// The smallest singular value of the primitive's Jacobian.
    pub fn smallest_singular_value(&self, arms: &ArmState) -> f64 {
        self.stiffened_gram(PoseSpace::of(arms), arms).smallest_singular_value()
    }

    /// `J Jᵀ` in as many of six directions as the primitive has degrees of freedom, zero along the others.
    fn gram(&self, space: PoseSpace, arms: &ArmState) -> Gram {
        Gram::of_columns(arms.joint_count(), self.primitive.motions(space, arms))
    }

    /// The same with the others made stiff, so that none of them is the weakest.
    fn stiffened_gram(&self, space: PoseSpace, arms: &ArmState) -> Gram {
        self.gram(space, arms).stiffened(self.primitive.degrees_of_freedom())
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

    /// The primitive's Jacobian in as many rows as it has degrees of freedom, the first ones of six, zeros beyond: two columns at a time.
    fn motions(self, space: PoseSpace, arms: &ArmState) -> impl Iterator<Item = Halves<f64x2>> + '_ {
        let way = twice(&(2.0 * arms.tool_point()));
        arms.tool_motion_pairs().iter().map(move |(angular, linear)| match self {
            Self::RelativePosition => (*linear, ZEROS),
            // Seen from the tool's rotation `½ l r` is ½ l.
            Self::RelativeOrientation => (angular * f64x2::HALF, ZEROS),
            Self::RelativePose => space.column_pair(&(*angular, *linear)),
            Self::RelativeDistance => (Vector3::new(dot(&way, linear), f64x2::ZERO, f64x2::ZERO), ZEROS),
        })
    }

    /// What of an error can be changed by a motion, in the rows of [`motions`](Self::motions).
    fn part_of(self, space: &PoseSpace, error: &Vector8, arms: &ArmState) -> Halves {
        match self {
            Self::RelativePosition | Self::RelativeDistance => {
                (error.fixed_rows::<3>(0).into(), Vector3::zeros())
            }
            Self::RelativeOrientation => {
                let real = Quaternion::new(error[0], error[1], error[2], error[3]);
                ((real * arms.base_from_tool().real().conjugate()).imag(), Vector3::zeros())
            }
            Self::RelativePose => space.part_of(error, &arms.base_from_tool()),
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
                arms.tool_motions().for_each(|(angular, _)| each(column(angular)));
            }
            Self::RelativePose => arms.for_each_pose_column(each),
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
