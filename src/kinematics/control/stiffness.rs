//! How fast a law with the transposed Jacobian makes errors decay, direction by direction.

use super::aim::Rows;
use super::angular_linear::AngularLinear;
use super::gram::Gram;
use super::pose_space::PoseSpace;
use crate::arm::ArmState;
use crate::arm::pair::{ZEROS, dot, put, sum, two};
use wide::f64x2;

/// `√K J`, the Jacobian J of what is fed back with the gains K: near the goal the closed loop is `δθ̇ = −Jᵀ K J δθ`, whose rates [1/s] are the
/// eigenvalues of `Jᵀ K J`.
pub struct Stiffness(Rooted);

enum Rooted {
    /// A twist's rows, with the roots of the angular and of the linear gain.
    Twist(Rows, [f64x2; 2]),
    /// A pose in R⁸, with the root of its gain.
    Pose(PoseSpace, f64x2),
}

impl Stiffness {
    pub(super) fn of_twist(rows: Rows, gains: [f64; 2]) -> Self {
        Self(Rooted::Twist(rows, gains.map(|gain| f64x2::splat(gain.sqrt()))))
    }

    pub(super) fn of_pose(arm: &ArmState, gain: f64) -> Self {
        Self(Rooted::Pose(PoseSpace::of(arm), f64x2::splat(gain.sqrt())))
    }

    /// The columns, two at a time.
    fn column_pairs<'a>(&'a self, arm: &'a ArmState) -> impl Iterator<Item = AngularLinear<f64x2>> + 'a {
        arm.tool_motion_pairs().iter().map(|motions| match &self.0 {
            Rooted::Twist(rows, [angular, linear]) => {
                rows.of_both(&(motions.0 * *angular, motions.1 * *linear))
            }
            Rooted::Pose(space, root) => {
                let (first, second) = space.column_pair(motions);
                (first * *root, second * *root)
            }
        })
    }

    fn gram(&self, arm: &ArmState) -> Gram {
        Gram::of_columns(arm.joint_count(), self.column_pairs(arm))
    }

    /// The fastest rate [1/s].
    pub(super) fn fastest_rate(&self, arm: &ArmState) -> f64 {
        self.gram(arm).largest_eigenvalue()
    }

    /// `(I + s Jᵀ K J)⁻¹ θ̇` with the time s \[s\]: each rate r becomes `r/(1 + s r)`, so that none is above 1/s and slow ones stay as they are.
    ///
    /// It is `θ̇ − (√K J)ᵀ (√K J Jᵀ√K + I/s)⁻¹ √K J θ̇`, one inverse of 6×6.
    pub(super) fn soften(&self, arm: &ArmState, time: f64, theta_dot: &mut [f64]) {
        let pairs = self.column_pairs(arm).zip(theta_dot.chunks(2));
        let (first, second) = pairs.fold((ZEROS, ZEROS), |(first, second), ((a, b), speeds)| {
            let speeds = two(speeds);
            (first + a * speeds, second + b * speeds)
        });
        let [first, second] = [first, second].map(|both| sum(&both).map(f64x2::splat));
        let (a, b) = self.gram(arm).inverse(f64x2::splat(time.recip())).times(&(first, second));
        for (room, columns) in theta_dot.chunks_mut(2).zip(self.column_pairs(arm)) {
            put(two(room) - dot(&columns.0, &a) - dot(&columns.1, &b), room);
        }
    }
}
