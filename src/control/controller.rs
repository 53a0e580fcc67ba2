//! A law with its gains.

use super::gram::Gram;
use super::halves::{Halves, twice};
use super::law::{Law, Map, Metric};
use super::metric::Place;
use super::pose_space::PoseSpace;
use super::transpose::difference;
use super::{Aim, Attenuation, Damping, LqWeights, PredefinedTime, TwistGains};
use crate::arm::ArmState;
use crate::dq::UnitDualQuaternion;
use nalgebra::Vector6;
use wide::f64x2;

/// A law with its gains, and those of the others, which wait for their turn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Controller {
    /// The law in force.
    pub law: Law,
    /// What of the goal's pose it is asked for.
    pub aim: Aim,
    /// `K` of diffc [1/s].
    pub diffc_gain: f64,
    /// Gains of diffc_inverse.
    pub diffc_inverse: TwistGains,
    /// Gains of logc.
    pub logc: TwistGains,
    /// Gains of logc_transpose.
    pub logc_transpose: TwistGains,
    /// Gains of double_geodesic.
    pub double_geodesic: TwistGains,
    /// Gains of double_geodesic_transpose.
    pub double_geodesic_transpose: TwistGains,
    /// Gains of unit_quaternion.
    pub unit_quaternion: TwistGains,
    /// Gains of unit_quaternion_transpose.
    pub unit_quaternion_transpose: TwistGains,
    /// Weights of lq.
    pub lq: LqWeights,
    /// Bounds of h_infinity.
    pub h_infinity: Attenuation,
    /// Time and limit of predefined_time.
    pub predefined_time: PredefinedTime,
    /// The damped inverse of the laws that use it.
    pub damping: Damping,
}

impl Controller {
    /// Joint velocities [rad/s, prismatic: m/s] that move `arm` towards `base_from_goal`, whose sign is chosen already; written to
    /// `theta_dot`, one a joint, without allocating. `theta_dot` must have one number a joint, which is not checked: a shorter slice
    /// gets the first joints only, and the rest of a longer one is no joint of this arm's.
    pub fn joint_velocity(&self, arm: &ArmState, base_from_goal: &UnitDualQuaternion, theta_dot: &mut [f64]) {
        if self.pulls_in_pose_space() {
            return arm.apply_transpose(&twice(&difference(self.diffc_gain, arm, base_from_goal)), theta_dot);
        }
        if self.law.cell().1 == Map::Transpose {
            let twist = self.twist(&Place::of_goal(self.aim, arm, base_from_goal));
            return arm.apply_transpose(&twice(&twist), theta_dot);
        }
        // First of all what takes longest: while it is inverted, the error is computed beside it.
        let rows = self.aim.rows(arm);
        let gram = rows.gram(arm);
        let twist = self.twist(&Place::of_goal(self.aim, arm, base_from_goal));
        self.damping.apply_transpose(arm, &rows, &gram, &twist, theta_dot);
    }

    /// The fastest rates [1/s] at which small errors of position and rotation decay with `arm` where it is. With the damped inverse
    /// they are the gains of what is asked for; with the transpose the closed loop is `δθ̇ = −Jᵀ K J δθ`, and both rates are
    /// `σ_max²(√K J)`.
    pub fn fastest_rates(&self, arm: &ArmState, base_from_goal: &UnitDualQuaternion) -> [f64; 2] {
        let (metric, map) = self.law.cell();
        let gains = self.gains(|| metric.error(&Place::of_goal(self.aim, arm, base_from_goal)));
        match map {
            Map::DampedInverse if self.aim == Aim::Position => [gains.linear, 0.0],
            Map::DampedInverse => [gains.linear, gains.angular],
            Map::Transpose if self.pulls_in_pose_space() => {
                [self.diffc_gain * PoseSpace::of(arm).gram(arm).largest_eigenvalue(); 2]
            }
            Map::Transpose => {
                let (angular, linear) = (gains.angular.sqrt(), gains.linear.sqrt());
                let rows = self.aim.rows(arm);
                let (angular, linear) = (f64x2::splat(angular), f64x2::splat(linear));
                let weighted =
                    arm.tool_motion_pairs().iter().map(|(l, v)| rows.of_both(&(l * angular, v * linear)));
                [Gram::of_columns(arm.joint_count(), weighted).largest_eigenvalue(); 2]
            }
        }
    }

    /// `Jᵀ e`, with the law's error e and the Jacobian of the same numbers, written to `descent`: the direction in which the joints
    /// reduce `½|e|²` fastest. Returns `|e|`. With diffc to a pose e is `q_d − q`, else the twist that the law wants.
    pub fn steepest_descent(
        &self,
        arm: &ArmState,
        base_from_goal: &UnitDualQuaternion,
        descent: &mut [f64],
    ) -> f64 {
        if self.pulls_in_pose_space() {
            arm.apply_transpose(&twice(&difference(1.0, arm, base_from_goal)), descent);
            return (base_from_goal.to_vector8() - arm.base_from_tool().to_vector8()).norm();
        }
        let twist = self.twist(&Place::of_goal(self.aim, arm, base_from_goal));
        arm.apply_transpose(&twice(&twist), descent);
        norm(&twist)
    }

    /// The smallest singular value of the rows of the tool's Jacobian that are asked for; 0 for fewer joints than rows.
    pub fn smallest_singular_value(&self, arm: &ArmState) -> f64 {
        self.aim.rows(arm).gram(arm).smallest_singular_value()
    }

    /// Whether the law is the paper's own diffc, whose error and Jacobian are those of R⁸.
    fn pulls_in_pose_space(&self) -> bool {
        self.law.cell() == (Metric::R8, Map::Transpose) && self.aim == Aim::Pose
    }

    /// Gain times error as a body twist `(ω, v)` [rad/s, m/s]: what a tool without an arm would do, and an arm does by the
    /// inverse of its Jacobian.
    pub fn body_twist(&self, goal_from_tool: &UnitDualQuaternion) -> Vector6<f64> {
        let twist = self.law.cell().0.twist(&goal_from_tool.conjugate());
        let gains = self.gains(|| (twist.fixed_rows::<3>(0).into(), twist.fixed_rows::<3>(3).into()));
        let (k, l) = (gains.angular, gains.linear);
        twist.component_mul(&Vector6::new(k, k, k, l, l, l))
    }

    /// Gain times error as a twist along the axes in which the goal is given.
    #[inline(always)]
    fn twist(&self, goal: &Place) -> Halves {
        let error = self.law.cell().0.error(goal);
        let gains = self.gains(|| error);
        (gains.angular * error.0, gains.linear * error.1)
    }

    /// This controller with `law` in force, and the one number `gain` [1/s] for what drives it: K, or equal gains; for a law with
    /// derived gains what they derive from, in the proportions that the defaults have.
    pub fn with_law(&self, law: Law, gain: f64) -> Self {
        let gains = TwistGains { angular: gain, linear: gain };
        let mut controller = Self { law, ..*self };
        match law {
            Law::Diffc => controller.diffc_gain = gain,
            Law::DiffcInverse => controller.diffc_inverse = gains,
            Law::Logc => controller.logc = gains,
            Law::LogcTranspose => controller.logc_transpose = gains,
            Law::DoubleGeodesic => controller.double_geodesic = gains,
            Law::DoubleGeodesicTranspose => controller.double_geodesic_transpose = gains,
            Law::UnitQuaternion => controller.unit_quaternion = gains,
            Law::UnitQuaternionTranspose => controller.unit_quaternion_transpose = gains,
            Law::Lq => controller.lq = LqWeights::with_gain(gain),
            Law::HInfinity => controller.h_infinity = Attenuation::with_gain(gain),
            Law::PredefinedTime => controller.predefined_time.settling_time = 1.0 / gain,
        }
        controller
    }

    /// The gains of the law in force, each with what it is.
    pub fn describe_gains(&self) -> String {
        match self.law {
            Law::Diffc => format!("gain {}", self.diffc_gain),
            Law::Lq => format!("weight_angular {}, weight_linear {}", self.lq.angular, self.lq.linear),
            Law::HInfinity => {
                format!(
                    "attenuation_angular {}, attenuation_linear {}",
                    self.h_infinity.angular, self.h_infinity.linear
                )
            }
            Law::PredefinedTime => {
                let PredefinedTime { settling_time, gain_limit } = self.predefined_time;
                format!("settling_time {settling_time}, gain_limit {gain_limit}")
            }
            _ => {
                let TwistGains { angular, linear } = self.gains(Halves::default);
                format!("k_omega {angular}, k_v {linear}")
            }
        }
    }

    /// The gains in force at this error, which only one law asks for.
    #[inline(always)]
    fn gains(&self, error: impl FnOnce() -> Halves) -> TwistGains {
        match self.law {
            Law::Diffc => {
                // Of a twist `½` comes in the pose's derivative, and `½` in its transpose.
                let gain = if self.aim == Aim::Pose { self.diffc_gain } else { 0.25 * self.diffc_gain };
                TwistGains { angular: gain, linear: gain }
            }
            Law::DiffcInverse => self.diffc_inverse,
            Law::Logc => self.logc,
            Law::LogcTranspose => self.logc_transpose,
            Law::DoubleGeodesic => self.double_geodesic,
            Law::DoubleGeodesicTranspose => self.double_geodesic_transpose,
            Law::UnitQuaternion => self.unit_quaternion,
            Law::UnitQuaternionTranspose => self.unit_quaternion_transpose,
            Law::Lq => self.lq.gains(),
            Law::HInfinity => self.h_infinity.gains(),
            Law::PredefinedTime => {
                let gain = self.predefined_time.gain(norm(&error()));
                TwistGains { angular: gain, linear: gain }
            }
        }
    }
}

/// The pose error `e = q_d* q` (eq. 28): `goal_from_tool`.
pub fn pose_error(arm: &ArmState, base_from_goal: &UnitDualQuaternion) -> UnitDualQuaternion {
    base_from_goal.conjugate() * arm.base_from_tool()
}

fn norm((angular, linear): &Halves) -> f64 {
    (angular.norm_squared() + linear.norm_squared()).sqrt()
}
