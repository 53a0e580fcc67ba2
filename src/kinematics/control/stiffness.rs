//! How fast errors decay in each direction under a law with the transposed Jacobian.

use super::aim::Rows;
use super::angular_linear::{AngularLinear, first, scaled};
use super::gram::Gram;
use super::pose_space::PoseSpace;
use crate::arm::ArmState;

/// The matrix `√K J`, with the gains K and the Jacobian J of the error that the law feeds back. Near the goal the closed loop is
/// `δθ̇ = −Jᵀ K J δθ`; its rates [1/s] are the eigenvalues of `Jᵀ K J`.
pub struct Stiffness(Rooted);

enum Rooted {
    /// For a law that feeds back a twist: the Jacobian's rows for the aim, and the square roots of the angular and the linear gain.
    Twist(Rows, [f64; 2]),
    /// For a law that feeds back a pose in R⁸: the basis of its six directions, and the square root of its gain.
    Pose(PoseSpace, f64),
}

impl Stiffness {
    pub(super) fn of_twist(rows: Rows, gains: [f64; 2]) -> Self {
        Self(Rooted::Twist(rows, gains.map(f64::sqrt)))
    }

    pub(super) fn of_pose(arm: &ArmState, gain: f64) -> Self {
        Self(Rooted::Pose(PoseSpace::of(arm), gain.sqrt()))
    }

    fn columns<'a>(&'a self, arm: &'a ArmState) -> impl Iterator<Item = AngularLinear> + 'a {
        arm.tool_motions().map(|motion| match &self.0 {
            Rooted::Twist(rows, roots) => rows.of(&scaled(*roots, &motion)),
            Rooted::Pose(space, root) => scaled([*root; 2], &space.column(&motion)),
        })
    }

    fn gram(&self, arm: &ArmState) -> Gram {
        Gram::of_columns(arm.joint_count(), self.columns(arm))
    }

    /// Returns the largest eigenvalue of `Jᵀ K J`: the rate at which the fastest errors decay [1/s].
    pub(super) fn fastest_rate(&self, arm: &ArmState) -> f64 {
        self.gram(arm).largest_eigenvalue()
    }

    /// Replaces the joint velocities θ̇ in `theta_dot` by `(I + s Jᵀ K J)⁻¹ θ̇`, where s is `time` \[s\]. An error that the law
    /// reduces at the rate r [1/s] then decays at the rate `r/(1 + s r)`. So no rate exceeds `1/s`, and slow rates hardly change.
    ///
    /// The result is computed as `θ̇ − (√K J)ᵀ (√K J Jᵀ√K + I/s)⁻¹ √K J θ̇`, because this needs only one 6×6 inverse.
    pub(super) fn soften(&self, arm: &ArmState, time: f64, theta_dot: &mut [f64]) {
        let columns = self.columns(arm).zip(theta_dot.iter());
        let fed_back = columns.fold(AngularLinear::default(), |(angular, linear), ((a, b), speed)| {
            (angular + a * *speed, linear + b * *speed)
        });
        let (a, b) = first(&self.gram(arm).solve(time.recip(), &fed_back));
        for (speed, (angular, linear)) in theta_dot.iter_mut().zip(self.columns(arm)) {
            *speed -= angular.dot(&a) + linear.dot(&b);
        }
    }
}
