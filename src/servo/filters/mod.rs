//! From the velocity that is wanted to the command: filters, each of which bounds it for a reason of its own, in one order.
//!
//! What is wanted is the law's velocity towards a goal, a twist's, or that on the way to another configuration.
//!
//! | filter | what it does to the velocity |
//! |---|---|
//! | gain by delay | takes the part of the law's gain that the robot's delay allows |
//! | escape speed | leads out of a singularity at which the law stands still |
//! | feed-forward | adds the velocity of a goal that moves |
//! | null space | adds the motion towards the posture that leaves the tool where it is |
//! | speed | scales it to the speed limits of joints and tool |
//! | demanded acceleration | scales it so that the path asks for no more acceleration than there is |
//! | probing speed | scales it to a gentle speed where an arm was not seen to follow yet |
//! | constraints | turns it away from what the arm must keep out of |
//! | position range | slows each joint towards its position limits |
//! | speed | once more: the joint that was slowed may have been what kept the tool slow |
//! | acceleration | moves the command towards it by what the acceleration limits allow |
//! | joint braking | brakes each joint that is too fast for its limits all the same |
//! | tool braking | the same for the tool |
//! | jerk | keeps each acceleration near the one before, and within what lets the joint stop before its limits |
//! | stoppable | slows down where a stop would lead into what the arm must keep out of |
//! | gate | replaces what is not finite, or breaks a limit, by braking |
//!
//! The first five are what the law asks for; the demanded acceleration applies them where the next cycle finds the arm too. An arm that
//! is not to be driven has two filters: it stops, and there is the gate.

mod acceleration;
mod braking;
mod constraints;
mod demand;
mod demanded_acceleration;
mod feed_forward;
mod gate;
mod jerk;
mod null_space;
mod position_range;
mod speed;
mod stop;
mod stoppable;
#[cfg(test)]
mod tests;

use super::escape::EscapeDirection;
use super::jerk::Pace;
use super::limits::Braking;
use super::link::Link;
use super::stream::MovingGoal;
use super::{Arms, ClosePair, Settings};
use crate::dq::UnitDualQuaternion;
use crate::space::Scene;
use acceleration::{Acceleration, ProbingSpeed};
use braking::{JointBraking, ToolBraking};
pub use constraints::CLEARANCE;
use constraints::Constraints;
use demand::LawDemand;
use demanded_acceleration::DemandedAcceleration;
use gate::Gate;
pub use gate::Replaced;
use jerk::Jerk;
use position_range::PositionRange;
use speed::Speed;
pub(super) use stop::HeldLimits;
use stop::Stop;
use stoppable::Stoppable;

/// Changes a velocity on its way to the command.
trait Filter {
    /// Changes `velocity`, one number a joint [rad/s, prismatic: m/s].
    fn apply(&mut self, given: &Given, velocity: &mut [f64]);
}

#[cfg(test)]
impl<F: Filter> Filter for &mut F {
    fn apply(&mut self, given: &Given, velocity: &mut [f64]) {
        (**self).apply(given, velocity);
    }
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
}

/// Where the arm is to go, and how.
#[derive(Clone)]
pub(super) struct Towards<'a> {
    /// The goal with the sign that was chosen.
    pub pose: UnitDualQuaternion,
    /// The same where it moves and that is fed forward.
    pub moving: Option<MovingGoal>,
    /// The part of the law's gains that the delays allow.
    pub gain_factor: f64,
    /// The direction out of a singularity, as long as the law stands still there.
    pub escape: Option<&'a EscapeDirection>,
}

/// The filters with what they keep from cycle to cycle.
pub(super) struct Filters {
    demand: LawDemand,
    demanded_acceleration: DemandedAcceleration,
    constraints: Constraints,
    position_range: PositionRange,
    tool_braking: ToolBraking,
    stoppable: Stoppable,
    gate: Gate,
}

impl Filters {
    /// For the joints of `arms`, in cycles of that `period` \[s\].
    pub fn new(arms: &Arms, period: f64) -> Self {
        Self {
            demand: LawDemand::new(arms.joint_count()),
            demanded_acceleration: DemandedAcceleration::new(arms.clone()),
            constraints: Constraints::new(arms.joint_count()),
            position_range: PositionRange::default(),
            tool_braking: ToolBraking::new(arms.joint_count()),
            stoppable: Stoppable::new(arms.joint_count(), period),
            gate: Gate::default(),
        }
    }

    /// Makes of the `velocity` that is wanted the next command [rad/s, prismatic: m/s].
    pub fn drive(&mut self, given: &Given, velocity: &mut [f64]) {
        let in_order: [&mut dyn Filter; 12] = [
            &mut self.demand,
            &mut self.demanded_acceleration,
            &mut ProbingSpeed,
            &mut self.constraints,
            &mut self.position_range,
            &mut Speed,
            &mut Acceleration,
            &mut JointBraking,
            &mut self.tool_braking,
            &mut Jerk,
            &mut self.stoppable,
            &mut self.gate,
        ];
        in_order.into_iter().for_each(|filter| filter.apply(given, velocity));
    }

    /// Makes of the `velocity`, whatever it is, the next command of an arm that is not to be driven [rad/s, prismatic: m/s].
    pub fn stop(&mut self, given: &Given, velocity: &mut [f64]) {
        let in_order: [&mut dyn Filter; 2] = [&mut Stop, &mut self.gate];
        in_order.into_iter().for_each(|filter| filter.apply(given, velocity));
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
        self.position_range.held_back.or(self.constraints.held_back)
    }

    /// Commands that the gate has replaced by braking.
    pub fn replaced(&self) -> &Replaced {
        &self.gate.replaced
    }
}

/// Brings `values` down to a part of themselves.
fn scale(values: &mut [f64], factor: f64) {
    if factor < 1.0 {
        values.iter_mut().for_each(|value| *value *= factor);
    }
}

/// `limit / value`, at most 1.
fn ratio(limit: f64, value: f64) -> f64 {
    if value > limit { limit / value } else { 1.0 }
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
