//! The difference feedback of the reference work (Sathuluri 2018).

use crate::control::control_law::{
    ControlLaw, LEAST, LawGains, LawInput, Map, descent_by_twist, stiffness_of_twist,
};
use crate::control::transpose::difference;
use crate::control::{Aim, AngularLinear, PoseError, Stiffness};

/// The law `θ̇ = Jᵀ K (q_d − q)` in R⁸ (eq. 16–20).
///
/// If the aim is not the whole pose, the joint velocity is `Jᵀ ¼ K ξ`. Here ξ is the error of the law diffc_inverse, which is a twist,
/// and J is the Jacobian of the tool's twist instead of the pose. For small errors of a tool at the base frame's origin, both formulas
/// give the same joint velocity. The quarter is ½ · ½: the difference `q_d − q` contains half of ξ, and the pose Jacobian half of J.
pub struct Diffc;

/// The factor by which K is reduced if the law feeds back a twist.
const QUARTER: f64 = 0.25;

impl ControlLaw for Diffc {
    fn name(&self) -> &'static str {
        "diffc"
    }

    fn error(&self, error: &PoseError) -> AngularLinear {
        error.difference()
    }

    fn map(&self) -> Map {
        Map::Transpose
    }

    fn gains(&self) -> LawGains {
        LawGains {
            names: &["gain"],
            defaults: [185.0, 0.0],
            range: LEAST..=1e4,
            unit: "1/s",
            about: "K of the difference in R^8",
        }
    }

    fn twist_gains(&self, [gain, _]: [f64; 2], _error: &AngularLinear) -> [f64; 2] {
        [QUARTER * gain; 2]
    }

    fn joint_velocity(&self, input: &LawInput, theta_dot: &mut [f64]) {
        let [gain, _] = input.gains;
        let twist = match input.aim {
            Aim::Pose => difference(gain, input.arm, input.base_from_goal),
            _ => self.twist(input.gains, &input.error()),
        };
        input.transpose(&twist, theta_dot);
    }

    fn stiffness(&self, input: &LawInput) -> Stiffness {
        let [gain, _] = input.gains;
        match input.aim {
            Aim::Pose => Stiffness::of_pose(input.arm, gain),
            _ => stiffness_of_twist(self, input),
        }
    }

    /// Sets `descent` to `Jᵀ e`, as the default implementation does. If the aim is a pose, the error e is the difference `q_d − q` in R⁸
    /// instead of a twist, and J is the pose Jacobian.
    fn steepest_descent(&self, input: &LawInput, descent: &mut [f64]) -> f64 {
        let LawInput { arm, base_from_goal, .. } = *input;
        match input.aim {
            Aim::Pose => {
                input.transpose(&difference(1.0, arm, base_from_goal), descent);
                (base_from_goal.to_vector8() - arm.base_from_tool().to_vector8()).norm()
            }
            _ => descent_by_twist(self, input, descent),
        }
    }
}
