//! From the velocity that is wanted to the command, in three steps: what is asked for, what keeps out of things, what the envelope admits.
//!
//! What is wanted is the law's velocity towards a goal, a twist's, or that on the way to another configuration.
//!
//! | step | what it does to the velocity |
//! |---|---|
//! | gain by delay | slows the directions in which the law is faster than the robot's delay allows |
//! | escape speed | leads out of a singularity at which the law stands still |
//! | feed-forward | adds the velocity of a goal that moves |
//! | null space | adds the motion towards the posture that leaves the tool where it is |
//! | speed | scales it to the speed limits of joints and tool |
//! | demanded acceleration | scales it so that the path asks for no more acceleration than there is |
//! | approach | goes from the last command towards it at the rate of a law of second order |
//! | probing speed | scales it to a gentle speed where an arm was not seen to follow yet |
//! | constraints | turns it away from what the arm must keep out of |
//! | envelope | goes towards it as far as every joint may ([`Envelope`]) |
//! | stoppable | slows down where a stop would lead into what the arm must keep out of |
//! | gate | stops instead of what is not finite or not in the envelope |
//!
//! The first five are what the law asks for; the demanded acceleration applies them where the next cycle finds the arm too. An arm that
//! is not to be driven stops, which is in its envelope whatever that is.

mod constraints;
mod demand;
mod demanded_acceleration;
mod envelope;
mod stop;
mod stoppable;

use super::escape::EscapeDirection;
use super::jerk::Pace;
use super::limits::Braking;
use super::link::Link;
use super::stream::MovingGoal;
use super::{Arms, ClosePair, Limits, Settings, ToolSpeed, Violation};
pub use constraints::CLEARANCE;
use constraints::Constraints;
use demand::LawDemand;
use demanded_acceleration::DemandedAcceleration;
use dq_algebra::UnitDualQuaternion;
use dq_kinematics::control::{AllowedRate, Approach};
use dq_space::space::Scene;
pub(super) use envelope::LatchedLimits;
use envelope::{Envelope, Span};
use stop::Stop;
use stoppable::Stoppable;

/// Changes a velocity on its way to the command.
trait Filter {
    /// Changes `velocity`, one number a joint [rad/s, prismatic: m/s].
    fn apply(&mut self, given: &Given, velocity: &mut [f64]);
}

/// What filters go by in one cycle.
pub(super) struct Given<'a> {
    pub settings: &'a Settings,
    /// The kinematics at these joint positions \[rad, prismatic: m\], where the arm is when the command reaches it.
    pub arms: &'a Arms,
    pub positions: &'a [f64],
    /// Where the law is to take the arm; none where no law does.
    pub goal: Option<Towards<'a>>,
    /// Whether what is wanted is a motion of the tool, and the joints' follows from that.
    pub by_tool: bool,
    pub link: &'a Link,
    /// The command before [rad/s, prismatic: m/s].
    pub before: &'a [f64],
    /// What each joint has for braking.
    pub braking: Braking<'a>,
    /// The cycle \[s\].
    pub period: f64,
}

impl Given<'_> {
    /// How the last command has left the joint number `joint`.
    fn pace(&self, joint: usize) -> Pace {
        Pace { speed: self.before[joint], step: self.braking.steps[joint] }
    }

    /// What the joint number `joint` may do in this cycle.
    pub fn span(&self, joint: usize) -> Span {
        Span::of(&self.settings.limits, joint, self.positions[joint], self.pace(joint), &self.braking)
    }
}

/// Where the arm is to go, and how.
#[derive(Clone)]
pub(super) struct Towards<'a> {
    /// The goal with the sign that was chosen.
    pub pose: UnitDualQuaternion,
    /// The same where it moves and that is fed forward.
    pub moving: Option<MovingGoal>,
    /// How fast the delays allow the law to be.
    pub allowed: AllowedRate,
    /// The direction out of a singularity, as long as the law stands still there.
    pub escape: Option<&'a EscapeDirection>,
}

/// Commands that were replaced by those of a stop.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Replaced {
    /// How many.
    pub count: u64,
    /// What was wrong with the last of them.
    pub last: Option<Violation>,
}

/// The steps with what they keep from cycle to cycle.
pub(super) struct Filters {
    demand: LawDemand,
    demanded_acceleration: DemandedAcceleration,
    approach: Approach,
    constraints: Constraints,
    envelope: Envelope,
    stoppable: Stoppable,
    replaced: Replaced,
}

impl Filters {
    /// For the joints of `arms`, in cycles of that `period` \[s\].
    pub fn new(arms: &Arms, period: f64) -> Self {
        Self {
            demand: LawDemand::new(arms.joint_count()),
            demanded_acceleration: DemandedAcceleration::new(arms.clone()),
            approach: Approach::new(arms.joint_count()),
            constraints: Constraints::new(arms.joint_count()),
            envelope: Envelope::new(arms.joint_count()),
            stoppable: Stoppable::new(arms.joint_count(), period),
            replaced: Replaced::default(),
        }
    }

    /// Makes of the `velocity` that is wanted the next command [rad/s, prismatic: m/s].
    pub fn drive(&mut self, given: &Given, velocity: &mut [f64]) {
        self.envelope.enclose(given);
        self.demand.apply(given, velocity);
        self.demanded_acceleration.apply(given, velocity);
        self.approach(given, velocity);
        keep_probing_speed(given, velocity);
        self.constraints.apply(given, velocity);
        self.envelope.admit(given, velocity);
        self.stoppable.apply(given, velocity);
        // The gate: no command leaves that is not in the envelope, however it was made.
        if let Some(violation) = self.envelope.violation(velocity) {
            self.replaced = Replaced { count: self.replaced.count + 1, last: Some(violation) };
            Stop.apply(given, velocity);
        }
        self.approach.keep(given.arms.state(), velocity);
    }

    /// Goes from the last command towards the `velocity` that a law asks for, where that is one of second order.
    fn approach(&mut self, given: &Given, velocity: &mut [f64]) {
        let (controller, arm) = (&given.settings.controller, given.arms.state());
        if given.goal.is_some() && self.approach.apply(controller, arm, given.period, velocity) {
            keep_speed_limits(given, velocity);
        }
    }

    /// Makes of the `velocity`, whatever it is, the next command of an arm that is not to be driven [rad/s, prismatic: m/s].
    pub fn stop(&mut self, given: &Given, velocity: &mut [f64]) {
        // In the envelope by its construction.
        Stop.apply(given, velocity);
        self.approach.keep(given.arms.state(), velocity);
    }

    /// Puts the tool of what filters look ahead with at `tool_offset`.
    pub fn set_tool_offset(&mut self, tool_offset: &UnitDualQuaternion) {
        self.demanded_acceleration.set_tool_offset(tool_offset);
    }

    /// Takes what the arm must keep out of from now on. Allocates nothing.
    pub fn set_scene(&mut self, scene: Option<&Scene>) {
        self.constraints.set_scene(scene);
        self.stoppable.set_scene(scene);
    }

    /// The pair that is nearest to each other, of those that are looked at, in the last cycle in which the arm was driven.
    pub fn closest(&self) -> Option<ClosePair> {
        self.constraints.closest
    }

    /// The pair that kept the arm from what was wanted in the last cycle in which it was driven.
    pub fn held_by(&self) -> Option<ClosePair> {
        self.constraints.held_by.or(self.stoppable.held_by)
    }

    /// The joint that its position limit held back in the last cycle in which the arm was driven, counted from 0.
    pub fn held_back(&self) -> Option<usize> {
        self.envelope.held_back.or(self.constraints.held_back)
    }

    /// Commands that the gate has replaced.
    pub fn replaced(&self) -> &Replaced {
        &self.replaced
    }
}

/// Scales velocities to a gentle speed where an arm was not seen to follow yet.
fn keep_probing_speed(given: &Given, velocity: &mut [f64]) {
    scale(velocity, given.link.probing_factor(velocity, &given.settings.limits.joint_acceleration));
}

/// Scales joint velocities by one factor so that no speed limit of joints and tool is exceeded: the direction stays.
pub(super) fn keep_speed_limits(given: &Given, velocity: &mut [f64]) {
    let limits = &given.settings.limits;
    let joints = velocity.iter().zip(&limits.joint_velocity);
    let joints = joints.map(|(speed, limit)| ratio(*limit, speed.abs()));
    scale(velocity, joints.fold(tool_share(limits, &given.arms.tool_speed(velocity)), f64::min));
}

/// The factor, at most 1, that brings the fastest tool under its speed limits.
pub(super) fn tool_share(limits: &Limits, tool: &ToolSpeed) -> f64 {
    ratio(limits.angular_speed, tool.angular).min(ratio(limits.linear_speed, tool.linear))
}

/// Brings `values` down to a part of themselves.
fn scale(values: &mut [f64], factor: f64) {
    if factor < 1.0 {
        values.iter_mut().for_each(|value| *value *= factor);
    }
}

/// `limit / value`, at most 1.
pub(super) fn ratio(limit: f64, value: f64) -> f64 {
    if value > limit { limit / value } else { 1.0 }
}

/// `value`, but not below `lowest` nor above `highest`. Unlike `f64::clamp` it takes any numbers: a bound that is not one is none,
/// and what is not a number stays so, for the gate to see.
pub(super) fn between(value: f64, lowest: f64, highest: f64) -> f64 {
    if value < lowest {
        lowest
    } else if value > highest {
        highest
    } else {
        value
    }
}
