//! The limits of speed, acceleration and position that the commands of a driven arm keep.

use crate::{PositionLimits, ratio};
use dq_kinematics::arm::ToolSpeed;
use dq_params::Parameters;
use std::ops::RangeInclusive;

/// Longest time that a joint needs to come to rest from its largest speed \[s\]. A deceleration limit that is too low for this is
/// raised.
pub const STOP_TIME: f64 = 1.0;

/// Longest time that a joint with limited jerk needs to reach its largest acceleration or deceleration \[s\]. A jerk limit that is
/// too low for this is raised. So the jerk limit makes a stop longer by at most twice this time.
pub const RAMP_TIME: f64 = 0.2;

/// The least time constant of the approach to a position limit, as a number of cycles. It applies even if the margin is narrow.
/// Joint states are some cycles old, and the joint must not pass the limit before the servo sees its motion.
const APPROACH_CYCLES: f64 = 20.0;

/// The least time constant of the approach to a position limit, as a multiple of [`Braking::delay`]. An arm with a lag coasts
/// farther than an arm with a pure delay, and the estimated latency may be only half of the lag.
const APPROACH_DELAYS: f64 = 5.0;

/// The fraction of its deceleration with which a joint brakes before a position limit. The rest of the deceleration is a reserve,
/// because the servo knows the joint's position only from joint states that are some cycles old.
const BRAKING_SHARE: f64 = 0.5;

/// The least value that a parameter for a gain, a limit or a tolerance can have, in the unit of that parameter.
pub const POSITIVE: f64 = 1e-6;

/// The range of joint speed and acceleration limits [rad/s, rad/s², prismatic: m/s, m/s²].
pub const JOINT_SPEEDS: RangeInclusive<f64> = POSITIVE..=1e4;

/// The range of joint jerk limits [rad/s³, prismatic: m/s³].
pub const JOINT_JERKS: RangeInclusive<f64> = POSITIVE..=1e6;

/// The limits that commands never exceed.
///
/// In a servo, each list has one number per joint, arm after arm. Lists that come straight from the parameters may be shorter: some
/// may be empty, the jerk limits may be one number for all joints, and one list may serve two arms that have equally many joints.
#[derive(Clone, Debug, PartialEq, Parameters)]
#[parameters(prefix = "limits.")]
pub struct Limits {
    /// largest joint speeds, one per joint [rad/s, m/s]
    #[parameter(range = JOINT_SPEEDS, required)]
    pub joint_velocity: Vec<f64>,
    /// largest joint accelerations, one per joint [rad/s^2, m/s^2]
    // These limits apply to an arm that is driven. A stop uses the decelerations.
    #[parameter(range = JOINT_SPEEDS, required)]
    pub joint_acceleration: Vec<f64>,
    /// joint decelerations in a stop and before a position limit, one per joint; empty: the accelerations, but at least enough to
    /// stop a joint within 1 s [rad/s^2, m/s^2]
    // `Limits::deceleration` raises a value that is too small to stop the joint in time.
    #[parameter(range = JOINT_SPEEDS)]
    pub joint_deceleration: Vec<f64>,
    /// largest joint jerks, also in a stop: one number for all joints or one per joint; empty: no limit [rad/s^3, m/s^3]
    // Infinite for no limit. `Limits::jerk` raises a value that is too small.
    #[parameter(name = "limits.jerk", range = JOINT_JERKS)]
    pub joint_jerk: Vec<f64>,
    /// largest speed of a tool point [m/s]
    #[parameter(default = 2.0, range = POSITIVE..=100.0)]
    pub linear_speed: f64,
    /// largest angular speed of a tool [rad/s]
    #[parameter(default = 6.0, range = POSITIVE..=100.0)]
    pub angular_speed: f64,
    /// Joint positions.
    #[parameter(group)]
    pub position: PositionLimits,
}

/// The data from which the braking before a position limit is computed.
#[derive(Clone, Copy, Debug)]
pub struct Braking<'a> {
    /// The deceleration of each joint [rad/s², prismatic: m/s²].
    pub decelerations: &'a [f64],
    /// The jerk limit of each joint [rad/s³, prismatic: m/s³].
    pub jerks: &'a [f64],
    /// The change of each joint's speed in the last cycle [rad/s, prismatic: m/s].
    pub steps: &'a [f64],
    /// The control period \[s\]. A joint's speed can change once per period.
    pub period: f64,
    /// The time between cycles that braking assumes \[s\]: the largest average in the last 2 to 4 s, and at least `period`. Each
    /// average covers about as many cycles as a stop takes.
    pub cycle: f64,
    /// The longest time until the servo sees the effect of a command \[s\]. It is the sum of three times: the time from a command to
    /// the joint state that shows its effect, the interval of joint states, and the worst recent lateness of a cycle or joint state.
    pub delay: f64,
}

impl Braking<'_> {
    /// Returns whether any joint has a jerk limit.
    pub fn limits_jerk(&self) -> bool {
        self.jerks.iter().any(|jerk| jerk.is_finite())
    }

    /// Returns the largest allowed difference between the changes of speed in two successive cycles, for joint number `joint` [rad/s,
    /// prismatic: m/s].
    pub fn jerk_step(&self, joint: usize) -> f64 {
        self.jerks[joint] * self.period * self.period
    }
}

impl Limits {
    /// Returns the deceleration at which joint number `joint` stops [rad/s², prismatic: m/s²]. The deceleration is large enough to
    /// stop the joint from its velocity limit within [`STOP_TIME`], so that no setting disables the stop.
    pub fn deceleration(&self, joint: usize) -> f64 {
        self.joint_deceleration[joint].max(self.joint_velocity[joint] / STOP_TIME)
    }

    /// Returns the jerk limit of joint number `joint` [rad/s³, prismatic: m/s³]. The limit is large enough that the joint reaches
    /// its largest acceleration or deceleration within [`RAMP_TIME`].
    pub fn jerk(&self, joint: usize) -> f64 {
        let largest = self.deceleration(joint).max(self.joint_acceleration[joint]);
        self.joint_jerk[joint].max(largest / RAMP_TIME)
    }

    /// Returns the factor, at most 1, by which the motion must be scaled so that the tools keep their speed limits. `tool` is the speed
    /// of the fastest tool.
    pub fn tool_share(&self, tool: &ToolSpeed) -> f64 {
        ratio(self.angular_speed, tool.angular).min(ratio(self.linear_speed, tool.linear))
    }

    /// Returns how joint number `joint` may approach a position that it must not pass.
    pub fn approach(&self, joint: usize, braking: &Braking) -> Approach {
        let slowest = (APPROACH_CYCLES * braking.cycle).max(APPROACH_DELAYS * braking.delay);
        // If cycles are late, a command changes the speed over a longer time.
        let part = braking.period / braking.cycle;
        let deceleration = braking.decelerations[joint] * part;
        // A joint with a low jerk limit slows down no faster than the jerk allows.
        let eased = braking.jerks[joint] * part * part / deceleration;
        let rate = (self.joint_velocity[joint] / self.position.margin).min(1.0 / slowest).min(eased);
        Approach { rate, deceleration }
    }
}

/// How a joint approaches a position that it must not pass.
#[derive(Clone, Copy, Debug)]
pub struct Approach {
    /// The joint's allowed speed divided by its distance to the position that it must not pass, if this distance is small [1/s].
    rate: f64,
    /// The deceleration that is available to the joint [rad/s², prismatic: m/s²].
    pub deceleration: f64,
}

impl Approach {
    /// Returns the joint's allowed speed [rad/s, prismatic: m/s] at the distance `distance` \[rad, prismatic: m\] from the position
    /// that the joint must not pass.
    ///
    /// Near that position, the allowed speed is proportional to the distance. Farther away, it follows the curve of constant
    /// deceleration. The two curves join smoothly, and neither needs more than the available deceleration.
    pub fn speed(&self, distance: f64) -> f64 {
        let deceleration = BRAKING_SHARE * self.deceleration;
        let proportional_below = deceleration / (self.rate * self.rate);
        match distance {
            d if d <= 0.0 => 0.0,
            d if d <= proportional_below => self.rate * d,
            d => (2.0 * deceleration * (d - 0.5 * proportional_below)).sqrt(),
        }
    }
}
