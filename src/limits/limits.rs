//! Speed, acceleration and position limits: what the command of a driven arm keeps.

use crate::{PositionLimits, ratio};
use dq_kinematics::arm::ToolSpeed;
use dq_params::Parameters;
use std::ops::RangeInclusive;

/// From its largest speed a joint comes to rest within this time \[s\], whatever the limits on its acceleration are.
pub const STOP_TIME: f64 = 1.0;

/// A limit on jerk lets a joint come to its acceleration within this time \[s\], so that a stop takes no more than twice this longer.
pub const RAMP_TIME: f64 = 0.2;

/// An approach to a limit takes at least this many cycles to come e times nearer, however narrow the margin is: a joint state is
/// some cycles old, and the joint must not be past the limit by then.
const APPROACH_CYCLES: f64 = 20.0;

/// And this many times as long as it takes until a command shows in the joint states, and until the next one: an arm that follows with
/// a lag coasts farther than one that is only late, and for that the latency is taken, which comes out up to half as long as the lag.
const APPROACH_DELAYS: f64 = 5.0;

/// The part of the deceleration that braking before a limit counts on; the rest is for joint states that are some cycles old.
const BRAKING_SHARE: f64 = 0.5;

/// The least gain, limit and tolerance that a parameter can be, in its unit.
pub const POSITIVE: f64 = 1e-6;

/// The range of limits of joints' speeds and accelerations [rad/s, rad/s², prismatic: m/s, m/s²].
pub const JOINT_SPEEDS: RangeInclusive<f64> = POSITIVE..=1e4;

/// The range of limits of joints' jerks [rad/s³, prismatic: m/s³].
pub const JOINT_JERKS: RangeInclusive<f64> = POSITIVE..=1e6;

/// What the commands never exceed. A servo's lists have a number for each joint of all its arms; as parameters they are of one arm, and
/// may be shorter.
#[derive(Clone, Debug, PartialEq, Parameters)]
#[parameters(prefix = "limits.")]
pub struct Limits {
    /// largest joint speeds, one a joint [rad/s, m/s]
    #[parameter(range = JOINT_SPEEDS, required)]
    pub joint_velocity: Vec<f64>,
    /// largest joint accelerations, one a joint [rad/s^2, m/s^2]
    // Of an arm that is driven.
    #[parameter(range = JOINT_SPEEDS, required)]
    pub joint_acceleration: Vec<f64>,
    /// joint decelerations in a stop and before a position limit, one a joint; empty: the accelerations, or what stops in 1 s where that
    /// is more [rad/s^2, m/s^2]
    // Less than `deceleration` is not taken.
    #[parameter(range = JOINT_SPEEDS)]
    pub joint_deceleration: Vec<f64>,
    /// how fast joint accelerations may change, stops included: one number for all joints or one a joint; empty: at once
    /// [rad/s^3, m/s^3]
    // Infinite for no limit; less than `jerk` is not taken.
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

/// What braking before a position limit depends on.
#[derive(Clone, Copy, Debug)]
pub struct Braking<'a> {
    /// What each joint has [rad/s²].
    pub decelerations: &'a [f64],
    /// How fast the acceleration of each may change [rad/s³].
    pub jerks: &'a [f64],
    /// By what the last cycle has changed the speed of each [rad/s].
    pub steps: &'a [f64],
    /// The cycle \[s\]: what a command may change belongs to that.
    pub period: f64,
    /// How long a cycle took at worst in the last seconds, on average over a stop \[s\].
    pub cycle: f64,
    /// From a command to the joint state that shows it and to the next one, with what came late in the last seconds \[s\].
    pub delay: f64,
}

impl Braking<'_> {
    /// Whether there is a limit on the jerk of any joint.
    pub fn limits_jerk(&self) -> bool {
        self.jerks.iter().any(|jerk| jerk.is_finite())
    }

    /// By what a cycle may change the step of the joint number `joint` [rad/s].
    pub fn jerk_step(&self, joint: usize) -> f64 {
        self.jerks[joint] * self.period * self.period
    }
}

impl Limits {
    /// The deceleration [rad/s²] at which joint number `joint` stops: at least what brings it from its velocity limit to rest in
    /// [`STOP_TIME`], so that no setting takes the stop away.
    pub fn deceleration(&self, joint: usize) -> f64 {
        self.joint_deceleration[joint].max(self.joint_velocity[joint] / STOP_TIME)
    }

    /// How fast the acceleration of the joint number `joint` may change [rad/s³]: it comes to what the joint has in [`RAMP_TIME`].
    pub fn jerk(&self, joint: usize) -> f64 {
        let largest = self.deceleration(joint).max(self.joint_acceleration[joint]);
        self.joint_jerk[joint].max(largest / RAMP_TIME)
    }

    /// The factor, at most 1, that brings the fastest tool under its speed limits.
    pub fn tool_share(&self, tool: &ToolSpeed) -> f64 {
        ratio(self.angular_speed, tool.angular).min(ratio(self.linear_speed, tool.linear))
    }

    /// How the joint number `joint` may approach a place that it is not to pass.
    pub fn approach(&self, joint: usize, braking: &Braking) -> Approach {
        let slowest = (APPROACH_CYCLES * braking.cycle).max(APPROACH_DELAYS * braking.delay);
        // Where cycles come late, what a command may change is spread over more time.
        let part = braking.period / braking.cycle;
        let deceleration = braking.decelerations[joint] * part;
        // A joint whose acceleration cannot change as fast slows down no faster than that can.
        let eased = braking.jerks[joint] * part * part / deceleration;
        let rate = (self.joint_velocity[joint] / self.position.margin).min(1.0 / slowest).min(eased);
        Approach { rate, deceleration }
    }
}

/// How a joint approaches a place that it is not to pass.
#[derive(Clone, Copy, Debug)]
pub struct Approach {
    /// The part of the distance that it may come nearer in a second at most [1/s].
    rate: f64,
    /// What it surely has [rad/s², prismatic: m/s²].
    pub deceleration: f64,
}

impl Approach {
    /// The speed [rad/s] at which it may go where the place is `distance` \[rad\] away: proportional to the distance where that needs no more
    /// deceleration than there is, and on the curve of constant deceleration before, which joins it smoothly.
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
