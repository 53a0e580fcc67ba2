//! The acceleration that following the law takes.

use super::demand::LawDemand;
use super::{Given, Towards};
use crate::servo::Arms;
use dq_algebra::UnitDualQuaternion;
use dq_limits::{Joints, ratio, scale};

/// The part of the jerk that following the law may need; the rest is for following it in time.
const JERK_SHARE: f64 = 0.25;

/// Scales joint velocities so that following the law needs no more acceleration than there is, and no more jerk.
///
/// The law's own velocities change in a cycle by what it asks for where that cycle leads, an acceleration `A`. A path driven
/// at `s` times the law's speed needs `s² A`, so `s = √(limit / |A|)`. Without this a law with a high gain would overshoot its
/// goal, because the acceleration limit would not let it brake in time.
///
/// Its own change of acceleration is taken for as fast as that of its speed, so a jerk of `|A|²/|v|`: at `s` times the speed the path needs
/// `s³` times that.
///
/// The path is nearly the law's own, not quite: where s changes, the speed along the path changes too, which takes
/// acceleration that is not counted here, and the command lags behind by as much. That bends logc's path in the paper's motion
/// by 0.01 mm under 50 rad/s², by 1.3 mm under 5 rad/s² and by 7 mm under 2 rad/s²; other motions by up to four times as much.
pub(super) struct DemandedAcceleration {
    /// The arm where the next cycle finds it, and what the law asks for there.
    ahead: Arms,
    positions: Vec<f64>,
    velocity: Vec<f64>,
    demand: LawDemand,
}

impl DemandedAcceleration {
    /// Looks ahead with `ahead`.
    pub fn new(ahead: Arms) -> Self {
        let joints = ahead.joint_count();
        let zeros = vec![0.0; joints];
        Self { ahead, positions: zeros.clone(), velocity: zeros, demand: LawDemand::new(joints) }
    }

    /// Puts the tool ahead at `tool_offset`.
    pub fn set_tool_offset(&mut self, tool_offset: &UnitDualQuaternion) {
        self.ahead.set_tool_offset(tool_offset);
    }
}

impl DemandedAcceleration {
    /// Changes `velocity`, one number a joint [rad/s, prismatic: m/s].
    pub fn apply(&mut self, given: &Given, velocity: &mut [f64]) {
        let Some(goal) = &given.goal else { return };
        for ((ahead, position), speed) in
            self.positions.iter_mut().zip(given.joints.positions).zip(&*velocity)
        {
            *ahead = position + given.joints.braking.period * speed;
        }
        self.ahead.evaluate(&self.positions);
        let moving = goal.moving.as_ref().map(|moving| moving.after(given.joints.braking.period));
        let pose = moving.as_ref().map_or(goal.pose, |moving| moving.pose);
        given.settings.controller.joint_velocity(self.ahead.state(), &pose, &mut self.velocity);
        let goal = Some(Towards { pose, moving, ..*goal });
        let joints = Joints { positions: &self.positions, ..given.joints };
        let there = Given { arms: &self.ahead, joints, goal, ..*given };
        self.demand.apply(&there, &mut self.velocity);
        let changes = self.velocity.iter().zip(&*velocity).map(|(ahead, speed)| ahead - speed);
        let factors = changes
            .clone()
            .zip(&given.settings.limits.joint_acceleration)
            .map(|(change, limit)| ratio(limit * given.joints.braking.period, change.abs()).sqrt());
        let factor = factors.fold(1.0, f64::min);
        if !given.joints.braking.limits_jerk() {
            return scale(velocity, factor);
        }
        let size = |numbers: &mut dyn Iterator<Item = f64>| numbers.map(|x| x * x).sum::<f64>().sqrt();
        let part = size(&mut changes.clone()) / size(&mut velocity.iter().copied());
        let eased = changes.enumerate().map(|(joint, change)| {
            (JERK_SHARE * given.joints.braking.jerk_step(joint) / (part * change).abs()).cbrt()
        });
        scale(velocity, eased.fold(factor, f64::min));
    }
}
