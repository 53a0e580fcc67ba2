//! Limits the acceleration that the path of the law requires.

use super::demand::LawDemand;
use super::{FilterInput, LawGoal};
use crate::servo::Arms;
use dq_algebra::UnitDualQuaternion;
use dq_limits::{Joints, ratio, scale};

/// The fraction of the jerk limit that the path may require. The rest lets a command that lags behind catch up with the path.
const JERK_SHARE: f64 = 0.25;

/// Scales joint velocities so that the path of the law requires no more than the available acceleration and jerk.
///
/// Let `v` be the law's present velocity, and `A` the acceleration from `v` to the law's velocity at the end of the cycle. At `s`
/// times the law's speed, the path requires the acceleration `s² A`, so `s = √(limit / |A|)`. Without this scaling, a law with a
/// high gain would overshoot its goal, because the acceleration limit would prevent the arm from braking in time.
///
/// For the jerk, the filter assumes that the acceleration changes by the same fraction per second as the speed. The jerk is then
/// `|A|²/|v|`. At `s` times the speed, the path requires `s³` times this jerk.
///
/// The path of the filtered velocity is nearly the law's path. But while s changes, the speed along the path changes, too. The
/// filter does not count this acceleration, so the command lags a little, and the tool leaves the path a little. Example: in the
/// motion of the reference paper, under the law `logc`, the distance from the path is 0.01 mm with an acceleration limit of 50
/// rad/s², 1.3 mm with 5 rad/s², and 7 mm with 2 rad/s². In other motions, these distances are up to four times as large.
pub(super) struct DemandedAcceleration {
    /// A copy of the arms, in their state at the end of the next cycle.
    ahead: Arms,
    /// The joint positions at the end of the next cycle \[rad, prismatic: m\].
    positions: Vec<f64>,
    /// The law's velocity at the end of the next cycle [rad/s, prismatic: m/s].
    velocity: Vec<f64>,
    demand: LawDemand,
}

impl DemandedAcceleration {
    /// Creates the filter. The filter computes the state of `ahead`, a copy of the arms, at the end of the next cycle.
    pub fn new(ahead: Arms) -> Self {
        let joints = ahead.joint_count();
        let zeros = vec![0.0; joints];
        Self { ahead, positions: zeros.clone(), velocity: zeros, demand: LawDemand::new(joints) }
    }

    /// Sets the tool offset.
    pub fn set_tool_offset(&mut self, tool_offset: &UnitDualQuaternion) {
        self.ahead.set_tool_offset(tool_offset);
    }
}

impl DemandedAcceleration {
    /// Scales `velocity`, one number per joint [rad/s, prismatic: m/s].
    pub fn apply(&mut self, input: &FilterInput, velocity: &mut [f64]) {
        let Some(goal) = &input.goal else { return };
        for ((ahead, position), speed) in
            self.positions.iter_mut().zip(input.joints.positions).zip(&*velocity)
        {
            *ahead = position + input.joints.braking.period * speed;
        }
        self.ahead.evaluate(&self.positions);
        let moving = goal.moving.as_ref().map(|moving| moving.after(input.joints.braking.period));
        let pose = moving.as_ref().map_or(goal.pose, |moving| moving.pose);
        let mut memory = goal.memory;
        let (controller, last) = (&input.settings.controller, (&*velocity, input.joints.braking.period));
        memory.joint_velocity(controller, self.ahead.state(), &pose, last, &mut self.velocity);
        let goal = Some(LawGoal { pose, moving, memory, ..*goal });
        let joints = Joints { positions: &self.positions, ..input.joints };
        let there = FilterInput { arms: &self.ahead, joints, goal, ..*input };
        self.demand.apply(&there, &mut self.velocity);
        let changes = self.velocity.iter().zip(&*velocity).map(|(ahead, speed)| ahead - speed);
        let factors = changes
            .clone()
            .zip(&input.settings.limits.joint_acceleration)
            .map(|(change, limit)| ratio(limit * input.joints.braking.period, change.abs()).sqrt());
        let factor = factors.fold(1.0, f64::min);
        if !input.joints.braking.limits_jerk() {
            return scale(velocity, factor);
        }
        let size = |numbers: &mut dyn Iterator<Item = f64>| numbers.map(|x| x * x).sum::<f64>().sqrt();
        let part = size(&mut changes.clone()) / size(&mut velocity.iter().copied());
        let eased = changes.enumerate().map(|(joint, change)| {
            (JERK_SHARE * input.joints.braking.jerk_step(joint) / (part * change).abs()).cbrt()
        });
        scale(velocity, eased.fold(factor, f64::min));
    }
}
