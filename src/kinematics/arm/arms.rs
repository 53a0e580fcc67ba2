//! What is controlled: the tool of one arm, or the tool of one arm as seen from that of another.

use super::{ArmState, Chain, JointKind};
use dq_algebra::UnitDualQuaternion;
use nalgebra::{UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};

/// How fast the fastest tool moves.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ToolSpeed {
    /// Speed of the tool point [m/s].
    pub linear: f64,
    /// Angular speed [rad/s].
    pub angular: f64,
}

/// How far the goal is from where the arm stands, or can slide to, and how far the arm reaches from there \[m\].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Reach {
    /// Distance of the goal.
    pub goal: f64,
    /// The length of the links together, which no pose of the tool is beyond.
    pub longest: f64,
}

impl Reach {
    /// Whether the links are too short to come within `tolerance` \[m\] of the goal.
    pub fn is_beyond(&self, tolerance: f64) -> bool {
        self.goal > self.longest + tolerance
    }
}

/// One arm, or two whose right tool is controlled as seen from the left one (paper §4), at some joint positions.
///
/// Two arms are one to every law and every safety rule: [`ArmState::relative`], with the joints of both.
#[derive(Clone, Debug, PartialEq)]
pub struct Arms {
    left: Arm,
    right: Option<Right>,
}

#[derive(Clone, Debug, PartialEq)]
struct Arm {
    chain: Chain,
    state: ArmState,
}

/// The other arm of two.
#[derive(Clone, Debug, PartialEq)]
struct Right {
    arm: Arm,
    /// Both as one.
    relative: ArmState,
}

impl Arm {
    fn new(chain: Chain) -> Self {
        Self { state: ArmState::new(&chain), chain }
    }

    fn evaluate(&mut self, theta: &[f64]) {
        // A list of another length says nothing of this arm.
        let _ = self.chain.evaluate(theta, &mut self.state);
    }

    fn tool_speed(&self, theta_dot: &[f64]) -> ToolSpeed {
        let (angular, linear) = self.state.tool_twist(theta_dot);
        ToolSpeed { linear: linear.norm(), angular: angular.norm() }
    }
}

impl Arms {
    /// One arm.
    pub fn one(chain: Chain) -> Self {
        Self { left: Arm::new(chain), right: None }
    }

    /// Two arms, both in one base frame.
    pub fn two(left: Chain, right: Chain) -> Self {
        let (left, arm) = (Arm::new(left), Arm::new(right));
        let relative = ArmState::relative(&left.state, &arm.state);
        Self { left, right: Some(Right { arm, relative }) }
    }

    /// The arm, or the left one of two.
    pub fn chain(&self) -> &Chain {
        &self.left.chain
    }

    /// All arms, the left one first.
    pub fn chains(&self) -> impl Iterator<Item = &Chain> {
        let right = self.right.as_ref().map(|right| &right.arm.chain);
        std::iter::once(&self.left.chain).chain(right)
    }

    /// The joints of all arms.
    pub fn joint_count(&self) -> usize {
        self.state().joint_count()
    }

    /// What they do, arm after arm.
    pub fn joint_kinds(&self) -> Vec<JointKind> {
        self.chains().flat_map(|chain| chain.kinds().iter().copied()).collect()
    }

    /// Puts each arm's tool at `tool_offset` in its tool frame, from the next [`evaluate`](Self::evaluate) on.
    pub fn set_tool_offset(&mut self, tool_offset: &UnitDualQuaternion) {
        self.left.chain.set_tool_offset(tool_offset);
        self.right.iter_mut().for_each(|right| right.arm.chain.set_tool_offset(tool_offset));
    }

    /// Moves the joints to `theta` \[rad, prismatic: m\], one number a joint, arm after arm. An arm for whose joints there are not as many
    /// numbers stays where it was.
    pub fn evaluate(&mut self, theta: &[f64]) {
        let (of_left, of_right) = self.split(theta);
        self.left.evaluate(of_left);
        if let Some(Right { arm, relative }) = &mut self.right {
            arm.evaluate(of_right);
            relative.set_relative(&self.left.state, &arm.state);
        }
    }

    /// The numbers of the left arm's joints, and those of the right one's.
    fn split<'a>(&self, numbers: &'a [f64]) -> (&'a [f64], &'a [f64]) {
        match self.right {
            Some(_) => numbers.split_at(self.left.chain.joint_count().min(numbers.len())),
            None => (numbers, &[]),
        }
    }

    /// The arm, or two arms as one, as laws take it.
    pub fn state(&self) -> &ArmState {
        self.right.as_ref().map_or(&self.left.state, |right| &right.relative)
    }

    /// The controlled pose: the tool in the base frame, or the right tool in the left tool's frame.
    pub fn pose(&self) -> UnitDualQuaternion {
        self.state().base_from_tool()
    }

    /// The axes of the frame in which twists of the tool come, along which [`pose`](Self::pose) is given: of one arm those of its tool
    /// frame, which the offset may turn away from.
    pub fn tool_axes(&self) -> UnitQuaternion<f64> {
        let (tool, offset) = (self.pose().rotation(), self.left.chain.tool_offset().rotation());
        let is_tool_frame = self.right.is_some() || offset == UnitQuaternion::identity();
        if is_tool_frame { tool } else { tool * offset.inverse() }
    }

    /// The fastest tool at joint velocities `theta_dot` [rad/s, prismatic: m/s].
    pub fn tool_speed(&self, theta_dot: &[f64]) -> ToolSpeed {
        let (of_left, of_right) = self.split(theta_dot);
        let left = self.left.tool_speed(of_left);
        let Some(right) = self.right.as_ref().map(|right| right.arm.tool_speed(of_right)) else {
            return left;
        };
        ToolSpeed { linear: left.linear.max(right.linear), angular: left.angular.max(right.angular) }
    }

    /// How far the goal's position \[m\] is, and how far the links reach with joints within these `ranges` \[rad, prismatic: m\], arm after arm.
    pub fn reach(
        &self,
        goal_point: &Vector3<f64>,
        mut ranges: impl Iterator<Item = (f64, f64)> + Clone,
    ) -> Reach {
        let left = &self.left.chain;
        let Some(right) = self.right.as_ref().map(|right| &right.arm.chain) else {
            let (goal, longest) = left.gap(goal_point, ranges);
            return Reach { goal, longest };
        };
        let between_bases = (left.base_point() - right.base_point()).norm();
        let arms = left.reach(ranges.by_ref()) + right.reach(ranges);
        Reach { goal: goal_point.norm(), longest: arms + between_bases }
    }
}
