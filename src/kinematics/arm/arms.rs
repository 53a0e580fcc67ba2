//! The controlled arms: one arm with its tool, or two arms with one tool relative to the other.

use super::{ArmState, Chain, JointKind};
use dq_algebra::UnitDualQuaternion;
use nalgebra::{UnitQuaternion, Vector3};
use serde::{Deserialize, Serialize};

/// The largest linear speed and the largest angular speed of the tools. The two may be of different tools.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ToolSpeed {
    /// Speed of the tool point [m/s].
    pub linear: f64,
    /// Angular speed [rad/s].
    pub angular: f64,
}

/// Two lengths \[m\]: the distance of a goal from the arm's foot, and an upper bound of the reach from the foot.
///
/// Usually the foot is the base of the arm. If the chain begins with prismatic joints whose axes are perpendicular to each other, the
/// foot is the frame of the last of these joints. A single prismatic joint is enough. Such a foot can move. The distance of the goal
/// is measured from the nearest position that the foot can have.
///
/// For two arms, the lengths are the distance between the tools at the goal, and an upper bound of the distance between the tools.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Reach {
    /// The distance of the goal.
    pub goal: f64,
    /// The total length of the links, which is an upper bound of the reach.
    pub longest: f64,
}

impl Reach {
    /// Returns whether the goal cannot be reached within `tolerance` \[m\] because the links are too short.
    pub fn is_beyond(&self, tolerance: f64) -> bool {
        self.goal > self.longest + tolerance
    }
}

/// One arm, or two arms (paper §4), at some joint positions. The controlled pose of two arms is the pose of the right tool
/// relative to the left tool.
///
/// The laws and safety rules treat two arms as one arm that has the joints of both: [`ArmState::relative`].
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

/// The right arm of two arms, and both arms as one.
#[derive(Clone, Debug, PartialEq)]
struct Right {
    arm: Arm,
    /// The state of both arms as one arm.
    relative: ArmState,
}

impl Arm {
    fn new(chain: Chain) -> Self {
        Self { state: ArmState::new(&chain), chain }
    }

    fn evaluate(&mut self, theta: &[f64]) {
        // A list with another number of positions changes nothing.
        let _ = self.chain.evaluate(theta, &mut self.state);
    }

    fn tool_speed(&self, theta_dot: &[f64]) -> ToolSpeed {
        let (angular, linear) = self.state.tool_twist(theta_dot);
        ToolSpeed { linear: linear.norm(), angular: angular.norm() }
    }
}

impl Arms {
    /// Creates a single arm.
    pub fn one(chain: Chain) -> Self {
        Self { left: Arm::new(chain), right: None }
    }

    /// Creates two arms that have the same base frame.
    pub fn two(left: Chain, right: Chain) -> Self {
        let (left, arm) = (Arm::new(left), Arm::new(right));
        let relative = ArmState::relative(&left.state, &arm.state);
        Self { left, right: Some(Right { arm, relative }) }
    }

    /// Returns the single arm, or the left arm of two.
    pub fn chain(&self) -> &Chain {
        &self.left.chain
    }

    /// Yields all arms, the left arm first.
    pub fn chains(&self) -> impl Iterator<Item = &Chain> {
        let right = self.right.as_ref().map(|right| &right.arm.chain);
        std::iter::once(&self.left.chain).chain(right)
    }

    /// Returns the number of joints of all arms.
    pub fn joint_count(&self) -> usize {
        self.state().joint_count()
    }

    /// Returns the kind of each joint, arm after arm.
    pub fn joint_kinds(&self) -> Vec<JointKind> {
        self.chains().flat_map(|chain| chain.kinds().iter().copied()).collect()
    }

    /// Sets the tool offset of each arm: the pose of the tool relative to the flange. The flange is the frame that the tool has
    /// without an offset. The offset applies from the next [`evaluate`](Self::evaluate) on.
    pub fn set_tool_offset(&mut self, tool_offset: &UnitDualQuaternion) {
        self.left.chain.set_tool_offset(tool_offset);
        self.right.iter_mut().for_each(|right| right.arm.chain.set_tool_offset(tool_offset));
    }

    /// Evaluates the arms at the joint positions `theta` \[rad, prismatic: m\], arm after arm. An arm that gets too few or too many
    /// positions keeps its previous state.
    pub fn evaluate(&mut self, theta: &[f64]) {
        let (of_left, of_right) = self.split(theta);
        self.left.evaluate(of_left);
        if let Some(Right { arm, relative }) = &mut self.right {
            arm.evaluate(of_right);
            relative.set_relative(&self.left.state, &arm.state);
        }
    }

    /// Splits `numbers`, one per joint, into the numbers of the left arm and the numbers of the right arm.
    fn split<'a>(&self, numbers: &'a [f64]) -> (&'a [f64], &'a [f64]) {
        match self.right {
            Some(_) => numbers.split_at(self.left.chain.joint_count().min(numbers.len())),
            None => (numbers, &[]),
        }
    }

    /// Returns the state of the single arm, or of two arms as one, for the laws.
    pub fn state(&self) -> &ArmState {
        self.right.as_ref().map_or(&self.left.state, |right| &right.relative)
    }

    /// Returns the controlled pose: the tool in the base frame, or the right tool in the left tool's frame.
    pub fn pose(&self) -> UnitDualQuaternion {
        self.state().base_from_tool()
    }

    /// Returns the orientation of the axes along which a twist in the tool frame is given. For a single arm, these are the axes of
    /// the flange (the tool frame without an offset), in the base frame. For two arms, they are the axes of the right tool, in the
    /// left tool's frame.
    pub fn tool_axes(&self) -> UnitQuaternion<f64> {
        let (tool, offset) = (self.pose().rotation(), self.left.chain.tool_offset().rotation());
        let is_tool_frame = self.right.is_some() || offset == UnitQuaternion::identity();
        if is_tool_frame { tool } else { tool * offset.inverse() }
    }

    /// Returns the linear and the angular speed of the tool. For two arms, returns the larger of the two linear speeds and the larger
    /// of the two angular speeds. `theta_dot` are the joint velocities [rad/s, prismatic: m/s].
    pub fn tool_speed(&self, theta_dot: &[f64]) -> ToolSpeed {
        let (of_left, of_right) = self.split(theta_dot);
        let left = self.left.tool_speed(of_left);
        let Some(right) = self.right.as_ref().map(|right| right.arm.tool_speed(of_right)) else {
            return left;
        };
        ToolSpeed { linear: left.linear.max(right.linear), angular: left.angular.max(right.angular) }
    }

    /// Returns the distance of the goal and the reach of the links, for a goal at `goal_point` \[m\]. The joints stay within
    /// `ranges` \[rad, prismatic: m\], arm after arm.
    pub fn reach(
        &self,
        goal_point: &Vector3<f64>,
        ranges: impl Iterator<Item = (f64, f64)> + Clone,
    ) -> Reach {
        let left = &self.left.chain;
        let Some(right) = self.right.as_ref().map(|right| &right.arm.chain) else {
            let (goal, longest) = left.gap(goal_point, ranges);
            return Reach { goal, longest };
        };
        let between_bases = (left.base_point() - right.base_point()).norm();
        let arms = left.reach(ranges.clone()) + right.reach(ranges.skip(left.joint_count()));
        Reach { goal: goal_point.norm(), longest: arms + between_bases }
    }
}
