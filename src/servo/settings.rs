//! What may change while the servo runs.

use super::{Interface, Limits, Posture};
use std::time::Duration;

/// How near counts as arrived.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tolerance {
    /// Distance of the tool from the goal \[m\].
    pub linear: f64,
    /// Angle between tool and goal \[rad\].
    pub angular: f64,
}

/// The servo's live settings.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings<C> {
    /// The law and its gains.
    pub controller: C,
    /// δ of the double-cover rule.
    pub sign_hysteresis: f64,
    /// Speed, acceleration and position limits.
    pub limits: Limits,
    /// What an arm of more joints than the tool needs does with the rest.
    pub posture: Posture,
    /// How near counts as arrived.
    pub goal_tolerance: Tolerance,
    /// Age by receipt at which a joint state is stale.
    pub state_timeout: Duration,
    /// A robot that was away for longer needs a new goal.
    pub rearm_timeout: Duration,
    /// From a command to the joint state that shows it; none: estimated.
    pub latency: Option<Duration>,
    /// Age by receipt at which a goal is stale; none: goals are latched.
    pub goal_timeout: Option<Duration>,
    /// Age by receipt at which a twist is stale.
    pub twist_timeout: Duration,
    /// Time without progress after which a motion is given up; none: never.
    pub progress_timeout: Option<Duration>,
    /// What kind of commands the robot takes; it stays as it is while the servo runs.
    pub interface: Interface,
    /// How far an arm that takes positions may be from where it was sent and should be \[rad\].
    pub following_error: f64,
}
