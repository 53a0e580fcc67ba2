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
mod stoppable;

use super::escape::EscapeDirection;
use super::stream::MovingGoal;
use super::{Arms, ClosePair, Settings, Violation};
pub use constraints::CLEARANCE;
use constraints::Constraints;
use demand::LawDemand;
use demanded_acceleration::DemandedAcceleration;
use dq_algebra::UnitDualQuaternion;
use dq_kinematics::control::{AllowedRate, Approach};
use dq_limits::{Envelope, Joints, scale};
use dq_link::Link;
use dq_space::space::Scene;
use stoppable::Stoppable;

/// What filters go by in one cycle.
pub(super) struct Given<'a> {
    pub settings: &'a Settings,
    /// The arm's joints, and its kinematics where they are when the command reaches them.
    pub joints: Joints<'a>,
    pub arms: &'a Arms,
    /// Where the law is to take the arm; none where no law does.
    pub goal: Option<Towards<'a>>,
    /// Whether what is wanted is a motion of the tool, and the joints' follows from that.
    pub by_tool: bool,
    pub link: &'a Link,
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
        self.envelope.enclose(&given.joints);
        self.demand.apply(given, velocity);
        self.demanded_acceleration.apply(given, velocity);
        self.approach(given, velocity);
        keep_probing_speed(given, velocity);
        self.constraints.apply(given, velocity);
        self.envelope.admit(&given.joints, given.arms, velocity);
        self.stoppable.apply(given, velocity);
        // The gate: no command leaves that is not in the envelope, however it was made.
        if let Some(violation) = self.envelope.violation(velocity) {
            self.replaced = Replaced { count: self.replaced.count + 1, last: Some(violation) };
            given.joints.stop(velocity);
        }
        self.approach.keep(given.arms.state(), velocity);
    }

    /// Goes from the last command towards the `velocity` that a law asks for, where that is one of second order.
    fn approach(&mut self, given: &Given, velocity: &mut [f64]) {
        let (controller, arm) = (&given.settings.controller, given.arms.state());
        if given.goal.is_some() && self.approach.apply(controller, arm, given.joints.braking.period, velocity)
        {
            given.joints.keep_speeds(given.arms, velocity);
        }
    }

    /// Makes of the `velocity`, whatever it is, the next command of an arm that is not to be driven [rad/s, prismatic: m/s].
    pub fn stop(&mut self, given: &Given, velocity: &mut [f64]) {
        // In the envelope by its construction.
        given.joints.stop(velocity);
        self.approach.keep(given.arms.state(), velocity);
    }

    /// Returns what the filters keep from cycle to cycle.
    pub fn approach_memory(&self) -> &Approach {
        &self.approach
    }

    /// Restores what the filters kept from the cycle before.
    pub fn go_on_from(&mut self, approach: Approach) {
        self.approach = approach;
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
