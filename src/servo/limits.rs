//! Speed, acceleration and position limits.

use super::position_limits::Brakes;
use super::{PositionLimits, ToolSpeed};

/// What the commands never exceed.
#[derive(Clone, Debug, PartialEq)]
pub struct Limits {
    /// Joint speeds [rad/s], one a joint.
    pub joint_velocity: Vec<f64>,
    /// Joint accelerations [rad/s²], one a joint.
    pub joint_acceleration: Vec<f64>,
    /// Speed of the tool point [m/s].
    pub linear_speed: f64,
    /// Angular speed of the tool [rad/s].
    pub angular_speed: f64,
    /// Joint positions.
    pub position: PositionLimits,
}

impl Limits {
    /// Scales joint velocities by one factor so that no speed limit is exceeded: the direction stays.
    /// `tool` is the speed that these velocities give the fastest tool.
    pub fn limit_speed(&self, tool: &ToolSpeed, theta_dot: &mut [f64]) {
        let angular = ratio(self.angular_speed, tool.angular);
        let linear = ratio(self.linear_speed, tool.linear);
        let joints =
            theta_dot.iter().zip(&self.joint_velocity).map(|(speed, limit)| ratio(*limit, speed.abs()));
        scale(theta_dot, joints.fold(angular.min(linear), f64::min));
    }

    /// Scales joint velocities so that following the law needs no more acceleration than there is.
    ///
    /// `change` is how much the law's own velocities change in `period` \[s\] along the motion, an acceleration `A`. Driven
    /// at `s` times its speed the same path needs `s² A`, so `s = √(limit / |A|)`: the path stays the law's own, only
    /// slower where it bends or ends sharply. Without this a law with a high gain would overshoot its goal, because the
    /// acceleration limit would not let it brake in time.
    pub fn limit_demanded_acceleration(&self, theta_dot: &mut [f64], change: &[f64], period: f64) {
        let factors = change
            .iter()
            .zip(&self.joint_acceleration)
            .map(|(c, limit)| ratio(limit * period, c.abs()).sqrt());
        scale(theta_dot, factors.fold(1.0, f64::min));
    }

    /// Moves `command` towards `target` [rad/s] by what the acceleration limits allow in `period` \[s\]; the change is
    /// scaled as a whole, so that a switch never steps the command. True where the target was reached.
    pub fn approach(&self, command: &mut [f64], target: &[f64], period: f64) -> bool {
        let deltas = command.iter().zip(target).map(|(from, to)| (to - from).abs());
        let factors = deltas.zip(&self.joint_acceleration).map(|(delta, limit)| ratio(limit * period, delta));
        let factor = factors.fold(1.0, f64::min);
        for (speed, wanted) in command.iter_mut().zip(target) {
            *speed = if factor < 1.0 { *speed + factor * (wanted - *speed) } else { *wanted };
        }
        factor >= 1.0
    }

    /// Cuts what of `target` [rad/s] goes too fast towards a position limit, with the joints at `positions` \[rad\]. The first
    /// joint that was cut near its limit: it is held back by it.
    pub(super) fn keep_positions(&self, target: &mut [f64], positions: &[f64], period: f64) -> Option<usize> {
        let mut held_back = None;
        for (joint, (speed, position)) in target.iter_mut().zip(positions).enumerate() {
            let (lowest, highest) = self.position.velocities(joint, *position, &self.brakes(joint, period));
            let kept = speed.clamp(lowest, highest);
            if kept != *speed && self.position.is_near(joint, *position) {
                held_back.get_or_insert(joint);
            }
            *speed = kept;
        }
        held_back
    }

    /// Brakes each joint whose `command` [rad/s] is too fast for the position limit ahead, as hard as its own acceleration limit
    /// allows after `before`, the command of the cycle before: what [`approach`](Self::approach) scales as a whole may come too
    /// late for one joint.
    pub(super) fn brake(&self, command: &mut [f64], before: &[f64], positions: &[f64], period: f64) {
        for (joint, (speed, position)) in command.iter_mut().zip(positions).enumerate() {
            let brakes = self.brakes(joint, period);
            let (lowest, highest) = self.position.velocities(joint, *position, &brakes);
            if *speed < lowest || *speed > highest {
                let most = brakes.acceleration * period;
                *speed = before[joint] + (speed.clamp(lowest, highest) - before[joint]).clamp(-most, most);
            }
        }
    }

    fn brakes(&self, joint: usize, period: f64) -> Brakes {
        Brakes { speed: self.joint_velocity[joint], acceleration: self.joint_acceleration[joint], period }
    }
}

/// `limit / value`, at most 1.
fn ratio(limit: f64, value: f64) -> f64 {
    if value > limit { limit / value } else { 1.0 }
}

fn scale(values: &mut [f64], factor: f64) {
    if factor < 1.0 {
        values.iter_mut().for_each(|value| *value *= factor);
    }
}
