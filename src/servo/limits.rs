//! Speed, acceleration and position limits: what the command of a driven arm keeps.

use super::position_limits::Brakes;
use super::stopping::slowed;
use super::{PositionLimits, ToolSpeed};

/// From its largest speed a joint comes to rest within this time \[s\], whatever the limits on its acceleration are.
pub const STOP_TIME: f64 = 1.0;

/// What the commands never exceed.
#[derive(Clone, Debug, PartialEq)]
pub struct Limits {
    /// Joint speeds [rad/s, prismatic: m/s], one a joint.
    pub joint_velocity: Vec<f64>,
    /// Joint accelerations [rad/s², prismatic: m/s²] of an arm that is driven, one a joint.
    pub joint_acceleration: Vec<f64>,
    /// Joint decelerations [rad/s², prismatic: m/s²] in a stop and before a position limit, one a joint; less than
    /// [`deceleration`](Self::deceleration) is not taken.
    pub joint_deceleration: Vec<f64>,
    /// Speed of the tool point [m/s] of an arm that is driven.
    pub linear_speed: f64,
    /// Angular speed of the tool [rad/s] of an arm that is driven.
    pub angular_speed: f64,
    /// Joint positions.
    pub position: PositionLimits,
}

/// What braking before a position limit depends on.
#[derive(Clone, Copy, Debug)]
pub(super) struct Braking<'a> {
    /// What each joint has [rad/s²].
    pub decelerations: &'a [f64],
    /// The cycle \[s\]: what a command may change belongs to that.
    pub period: f64,
    /// How long a cycle took at worst in the last seconds, on average over a stop \[s\].
    pub cycle: f64,
    /// From a command to the joint state that shows it and to the next one, with what came late in the last seconds \[s\].
    pub delay: f64,
}

impl Limits {
    /// The deceleration [rad/s²] at which joint number `joint` stops: at least what brings it from its velocity limit to rest in
    /// [`STOP_TIME`], so that no setting takes the stop away.
    pub fn deceleration(&self, joint: usize) -> f64 {
        self.joint_deceleration[joint].max(self.joint_velocity[joint] / STOP_TIME)
    }

    /// Scales joint velocities by one factor so that no speed limit is exceeded: the direction stays.
    /// `tool` is the speed that these velocities give the fastest tool.
    pub fn limit_speed(&self, tool: &ToolSpeed, theta_dot: &mut [f64]) {
        let joints =
            theta_dot.iter().zip(&self.joint_velocity).map(|(speed, limit)| ratio(*limit, speed.abs()));
        scale(theta_dot, joints.fold(self.share_of(tool), f64::min));
    }

    /// The factor, at most 1, that brings the fastest tool under its speed limits.
    pub(super) fn share_of(&self, tool: &ToolSpeed) -> f64 {
        ratio(self.angular_speed, tool.angular).min(ratio(self.linear_speed, tool.linear))
    }

    /// Scales joint velocities so that following the law needs no more acceleration than there is.
    ///
    /// `change` is how much the law's own velocities change in `period` \[s\] along the motion, an acceleration `A`. A path driven
    /// at `s` times the law's speed needs `s² A`, so `s = √(limit / |A|)`. Without this a law with a high gain would overshoot its
    /// goal, because the acceleration limit would not let it brake in time.
    ///
    /// The path is nearly the law's own, not quite: where s changes, the speed along the path changes too, which takes
    /// acceleration that is not counted here, and the command lags behind by as much. That bends logc's path in the paper's motion
    /// by 0.01 mm under 50 rad/s², by 1.3 mm under 5 rad/s² and by 7 mm under 2 rad/s²; other motions by up to four times as much.
    pub fn limit_demanded_acceleration(&self, theta_dot: &mut [f64], change: &[f64], period: f64) {
        let factors = change
            .iter()
            .zip(&self.joint_acceleration)
            .map(|(c, limit)| ratio(limit * period, c.abs()).sqrt());
        scale(theta_dot, factors.fold(1.0, f64::min));
    }

    /// Moves `command` towards `target` [rad/s] by what the acceleration limits allow in `period` \[s\]; the change is
    /// scaled as a whole, so that a switch neither steps the command nor turns it.
    ///
    /// Where the change as a whole would take longer than a stop, because one joint may hardly accelerate, the joints that are to
    /// slow down do so by their own `decelerations` [rad/s²]: a weak joint holds up no other one's braking.
    pub(super) fn approach(&self, command: &mut [f64], target: &[f64], decelerations: &[f64], period: f64) {
        let deltas = command.iter().zip(target).map(|(from, to)| (to - from).abs());
        let factors = deltas.zip(&self.joint_acceleration).map(|(delta, limit)| ratio(limit * period, delta));
        let factor = factors.fold(1.0, f64::min);
        if factor >= 1.0 {
            return command.copy_from_slice(target);
        }
        let too_long = factor * STOP_TIME < period;
        for ((speed, wanted), deceleration) in command.iter_mut().zip(target).zip(decelerations) {
            let braked =
                slowed(*speed, between(*wanted, speed.min(0.0), speed.max(0.0)), deceleration * period);
            let with_the_others = *speed + factor * (wanted - *speed);
            *speed = if too_long && braked != *speed { braked } else { with_the_others };
        }
    }

    /// Cuts what of `target` [rad/s] goes too fast towards a position limit, with the joints at `positions` \[rad\]. The first
    /// joint that was cut near its limit: it is held back by it.
    pub(super) fn keep_positions(
        &self,
        target: &mut [f64],
        positions: &[f64],
        braking: &Braking,
    ) -> Option<usize> {
        let mut held_back = None;
        for (joint, speed) in target.iter_mut().enumerate() {
            let brakes = self.brakes(joint, braking);
            let (lowest, highest) = self.position.velocities(joint, positions[joint], &brakes);
            let kept = between(*speed, lowest, highest);
            if kept != *speed && self.position.is_near(joint, positions[joint]) {
                held_back.get_or_insert(joint);
            }
            *speed = kept;
        }
        held_back
    }

    /// Brakes each joint whose `command` [rad/s] is above its velocity limit, which may have been lowered, or too fast for the
    /// position limit ahead, as hard as its own deceleration allows after `before`, the command of the cycle before: what
    /// [`approach`](Self::approach) scales as a whole may come too late for one joint.
    pub(super) fn brake(&self, command: &mut [f64], before: &[f64], positions: &[f64], braking: &Braking) {
        for (joint, speed) in command.iter_mut().enumerate() {
            let brakes = self.brakes(joint, braking);
            let (lowest, highest) = self.position.velocities(joint, positions[joint], &brakes);
            let allowed = between(*speed, lowest.max(-brakes.speed), highest.min(brakes.speed));
            if allowed != *speed {
                let most = brakes.deceleration * brakes.period;
                let (down, up) = (before[joint] - most, before[joint] + most);
                *speed = between(allowed, down.min(*speed), up.max(*speed));
            }
        }
    }

    /// Slows `command` [rad/s], which moves the fastest tool at `tool`, to the tool's speed limits, each joint as far as its
    /// deceleration allows after `before`: what was changed for one joint alone may have made the tool faster.
    pub(super) fn brake_tool(
        &self,
        tool: &ToolSpeed,
        command: &mut [f64],
        before: &[f64],
        decelerations: &[f64],
        period: f64,
    ) {
        let factor = self.share_of(tool);
        for ((speed, before), deceleration) in command.iter_mut().zip(before).zip(decelerations) {
            let slowest =
                if *speed * before > 0.0 { slowed(*before, 0.0, deceleration * period) } else { 0.0 };
            let wanted = factor * *speed;
            if wanted.abs() < speed.abs() {
                let kept = if slowest.abs() > wanted.abs() { slowest } else { wanted };
                *speed = between(kept, speed.min(0.0), speed.max(0.0));
            }
        }
    }

    fn brakes(&self, joint: usize, braking: &Braking) -> Brakes {
        let Braking { decelerations, period, cycle, delay } = *braking;
        // Where cycles come late, what a command may change is spread over more time.
        let deceleration = decelerations[joint] * (period / cycle);
        Brakes { speed: self.joint_velocity[joint], deceleration, period: cycle, delay }
    }
}

/// `value`, but not below `lowest` nor above `highest`. Unlike `f64::clamp` it takes any numbers: a bound that is not one is none,
/// and what is not a number stays so, for the gate to see.
fn between(value: f64, lowest: f64, highest: f64) -> f64 {
    if value < lowest {
        lowest
    } else if value > highest {
        highest
    } else {
        value
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
