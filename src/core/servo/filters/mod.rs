//! The filters that turn the desired velocity into the command, in this order:
//!
//! 1. If a law drives the arm: add the escape, the feed-forward and the posture, and limit the acceleration of the sum.
//! 2. Keep the arm slow until each joint has followed a command.
//! 3. Keep the arm clear of its scene.
//! 4. Keep the command within the envelope.
//! 5. Check that the arm can be stopped without closing a gap.
//!
//! The desired velocity comes from a law, from a twist, or from a straight line in joint space.

mod constraints;
mod demand;
mod demanded_acceleration;
mod stoppable;

use super::stream::MovingGoal;
use super::{Arms, ClosePair, Settings, Violation};
pub use constraints::CLEARANCE;
use constraints::Constraints;
use demand::LawDemand;
use demanded_acceleration::DemandedAcceleration;
use dq_algebra::UnitDualQuaternion;
use dq_kinematics::control::{AllowedRate, LawMemory};
use dq_limits::{Envelope, Joints, scale};
use dq_link::Link;
use dq_search::EscapeDirection;
use dq_space::space::Scene;
use stoppable::Stoppable;

/// The inputs of the filters in one cycle.
pub(super) struct FilterInput<'a> {
    pub settings: &'a Settings,
    /// The joints and the kinematics at the positions predicted for the time at which the command takes effect.
    pub joints: Joints<'a>,
    pub arms: &'a Arms,
    /// The goal of the law, or `None` if no law drives the arm.
    pub goal: Option<LawGoal<'a>>,
    /// Whether the desired motion is given as a motion of the tool, by a law or a twist, and not as a motion of the joints.
    pub by_tool: bool,
    pub link: &'a Link,
}

/// The goal of the law, and how to move to it.
#[derive(Clone)]
pub(super) struct LawGoal<'a> {
    /// The goal pose. The quaternions q and −q are the same pose; this is the one with the sign that the servo has chosen.
    pub pose: UnitDualQuaternion,
    /// The memory of the law after this cycle.
    pub memory: LawMemory,
    /// The goal's motion, if it moves and its velocity is fed forward.
    pub moving: Option<MovingGoal>,
    /// The largest rate at which the law may reduce the error. The robot's delay determines this rate.
    pub allowed: AllowedRate,
    /// The direction out of a singularity, if the law stands still at one.
    pub escape: Option<&'a EscapeDirection>,
    /// The posture: the joint positions to which the arm moves as far as it can without disturbing the motion of the tool \[rad,
    /// prismatic: m\].
    pub posture: &'a [f64],
}

/// The count of commands that the final check has replaced by a stop.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Replaced {
    /// The number of replaced commands.
    pub count: u64,
    /// The violation by the last replaced command; `None` if no command was replaced.
    pub last: Option<Violation>,
}

/// The filters with their memory.
pub(super) struct Filters {
    demand: LawDemand,
    demanded_acceleration: DemandedAcceleration,
    constraints: Constraints,
    envelope: Envelope,
    stoppable: Stoppable,
    replaced: Replaced,
}

impl Filters {
    /// Creates the filters for the joints of `arms` and the control period `period` \[s\].
    pub fn new(arms: &Arms, period: f64) -> Self {
        Self {
            demand: LawDemand::new(arms.joint_count()),
            demanded_acceleration: DemandedAcceleration::new(arms.clone()),
            constraints: Constraints::new(arms),
            envelope: Envelope::new(arms.joint_count()),
            stoppable: Stoppable::new(arms, period),
            replaced: Replaced::default(),
        }
    }

    /// Turns the desired `velocity` into the next command [rad/s, prismatic: m/s].
    pub fn drive(&mut self, input: &FilterInput, velocity: &mut [f64]) {
        self.envelope.enclose(&input.joints);
        self.demand.apply(input, velocity);
        self.demanded_acceleration.apply(input, velocity);
        keep_probing_speed(input, velocity);
        self.constraints.apply(input, velocity);
        self.envelope.admit(&input.joints, input.arms, velocity);
        self.stoppable.apply(input, velocity);
        // The final check: no command outside of the envelope is sent, whatever step made it.
        if let Some(violation) = self.envelope.violation(velocity) {
            self.replaced = Replaced { count: self.replaced.count + 1, last: Some(violation) };
            input.joints.stop(velocity);
        }
    }

    /// Sets `velocity` to the next command of an arm that must stop [rad/s, prismatic: m/s].
    pub fn stop(&mut self, input: &FilterInput, velocity: &mut [f64]) {
        // A stop is in the envelope by construction.
        input.joints.stop(velocity);
    }

    /// Sets the tool offset.
    pub fn set_tool_offset(&mut self, tool_offset: &UnitDualQuaternion) {
        self.demanded_acceleration.set_tool_offset(tool_offset);
    }

    /// Sets the scene that the arm must keep clear of from now on. Allocates nothing.
    pub fn set_scene(&mut self, scene: Option<&Scene>) {
        self.constraints.set_scene(scene);
        self.stoppable.set_scene(scene);
    }

    /// Returns the closest pair that was checked in the last cycle in which the arm was driven; `None` if no pair was near.
    pub fn closest(&self) -> Option<ClosePair> {
        self.constraints.closest
    }

    /// Returns the pair that kept the arm from its desired motion in the last cycle in which the arm was driven, if any.
    pub fn held_by(&self) -> Option<ClosePair> {
        self.constraints.held_by.or(self.stoppable.held_by)
    }

    /// Returns the joint (counted from 0) that could not move on because of its position limit, if any. This is the result of the last
    /// cycle in which the arm was driven.
    pub fn held_back(&self) -> Option<usize> {
        self.envelope.held_back.or(self.constraints.held_back)
    }

    /// Returns the count of commands that the final check has replaced, and the last violation.
    pub fn replaced(&self) -> &Replaced {
        &self.replaced
    }
}

/// Scales `velocity` down to a low speed until each joint has followed a command.
fn keep_probing_speed(input: &FilterInput, velocity: &mut [f64]) {
    scale(velocity, input.link.probing_factor(velocity, &input.settings.limits.joint_acceleration));
}
