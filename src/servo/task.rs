//! What the cycle controls: the tool of one arm, or the tools of two arms relative to each other.

use super::{PositionLimits, Reach, Tolerance};
use crate::arm::{ArmError, ArmState, Chain, JointKind};
use crate::control::{Aim, Controller, Cooperative, Primitive, pose_error};
use crate::dq::UnitDualQuaternion;
use nalgebra::{UnitQuaternion, Vector3};
use std::fmt::Debug;

/// How far from the goal, in what the task controls; 0 for what it leaves free.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct GoalError {
    /// Distance \[m\].
    pub position: f64,
    /// Angle \[rad\].
    pub rotation: f64,
}

impl GoalError {
    /// Whether both parts are.
    pub fn is_within(&self, tolerance: &Tolerance) -> bool {
        self.position <= tolerance.linear && self.rotation <= tolerance.angular
    }
}

/// How fast the fastest tool moves.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ToolSpeed {
    /// Speed of the tool point [m/s].
    pub linear: f64,
    /// Angular speed [rad/s].
    pub angular: f64,
}

/// An arm has arrived when at its speed it would take longer than this \[s\] to cross the tolerance.
const LINGERING: f64 = 0.1;

/// What the cycle controls and by which law; every safety rule is the cycle's own, and so the same for each task.
pub trait Task: Clone + Send + 'static {
    /// The law with its gains.
    type Controller: Clone + Debug + PartialEq + Send + 'static;

    /// The joints of all arms.
    fn joint_count(&self) -> usize;

    /// What they do, arm after arm.
    fn joint_kinds(&self) -> Vec<JointKind>;

    /// Puts each arm's tool at `tool_offset` in its tool frame, from the next [`evaluate`](Self::evaluate) on.
    fn set_tool_offset(&mut self, tool_offset: &UnitDualQuaternion);

    /// The axes of the frame in which twists of the tool come, along which [`pose`](Self::pose) is given.
    fn tool_axes(&self) -> UnitQuaternion<f64> {
        self.pose().rotation()
    }

    /// Moves the kinematics to the joint angles `theta` \[rad\].
    ///
    /// # Errors
    /// [`ArmError::JointCount`].
    fn evaluate(&mut self, theta: &[f64]) -> Result<(), ArmError>;

    /// The controlled pose: the tool in the base frame, or the right tool in the left tool's frame.
    fn pose(&self) -> UnitDualQuaternion;

    /// The law's joint velocities [rad/s] towards `goal`, whose sign is chosen already.
    fn joint_velocity(&self, controller: &Self::Controller, goal: &UnitDualQuaternion, theta_dot: &mut [f64]);

    /// Whether the law controls the whole pose, so that the twist of a goal that moves can be added to what it asks for.
    fn feeds_forward(_: &Self::Controller) -> bool {
        true
    }

    /// Takes out of the joint velocities `theta_dot` what would move what is controlled; by default that is all.
    fn leave_tool(&self, _: &Self::Controller, theta_dot: &mut [f64]) {
        theta_dot.fill(0.0);
    }

    /// Joint velocities [rad/s] at which the controlled pose moves at `angular` [rad/s] and `linear` [m/s] along the base's axes, by the
    /// law's damped inverse.
    fn joint_velocity_of(
        &self,
        controller: &Self::Controller,
        angular: &Vector3<f64>,
        linear: &Vector3<f64>,
        theta_dot: &mut [f64],
    );

    /// `Jᵀ e`, with the law's error e and the Jacobian of the same numbers, written to `descent`: the direction in which the joints
    /// reduce `½|e|²` fastest. Returns `|e|`.
    fn steepest_descent(
        &self,
        controller: &Self::Controller,
        goal: &UnitDualQuaternion,
        descent: &mut [f64],
    ) -> f64;

    /// The pose nearest to the present one that meets `goal`: `goal` itself where all of it is controlled, which is the default.
    fn nearest_goal(&self, _: &Self::Controller, goal: &UnitDualQuaternion) -> UnitDualQuaternion {
        *goal
    }

    /// How far the pose is from `goal`.
    fn goal_error(&self, controller: &Self::Controller, goal: &UnitDualQuaternion) -> GoalError;

    /// The fastest rates [1/s] at which the law makes small errors of position and rotation decay, on the way to `goal`.
    fn fastest_rates(&self, controller: &Self::Controller, goal: &UnitDualQuaternion) -> [f64; 2];

    /// The fastest tool at joint velocities `theta_dot` [rad/s].
    fn tool_speed(&self, theta_dot: &[f64]) -> ToolSpeed;

    /// The same of what is controlled of the pose; by default that is all.
    fn controlled_speed(&self, _: &Self::Controller, theta_dot: &[f64]) -> ToolSpeed {
        self.tool_speed(theta_dot)
    }

    /// Whether an arm that is within `tolerance` stays there for a moment at joint velocities `theta_dot` [rad/s].
    fn lingers(&self, controller: &Self::Controller, tolerance: &Tolerance, theta_dot: &[f64]) -> bool {
        let speed = self.controlled_speed(controller, theta_dot);
        speed.linear * LINGERING <= tolerance.linear && speed.angular * LINGERING <= tolerance.angular
    }

    /// The smallest singular value of the Jacobian of what is controlled.
    fn smallest_singular_value(&self, controller: &Self::Controller) -> f64;

    /// How far the goal's position \[m\] is, and how far the links reach with joints within `limits`.
    fn reach(&self, goal_point: &Vector3<f64>, limits: &PositionLimits) -> Reach;

    /// Whether the two controllers aim at the same: else a change from one to the other revokes the consent to move.
    fn same_aim(one: &Self::Controller, other: &Self::Controller) -> bool;
}

/// The tool pose of one arm, or what an [`Aim`] takes of it.
#[derive(Clone, Debug, PartialEq)]
pub struct OneArm {
    chain: Chain,
    state: ArmState,
}

impl OneArm {
    /// The task for this arm.
    pub fn new(chain: Chain) -> Self {
        Self { state: ArmState::new(&chain), chain }
    }

    /// The arm.
    pub fn chain(&self) -> &Chain {
        &self.chain
    }
}

impl Task for OneArm {
    type Controller = Controller;

    fn joint_count(&self) -> usize {
        self.chain.joint_count()
    }

    fn joint_kinds(&self) -> Vec<JointKind> {
        self.chain.kinds().to_vec()
    }

    fn set_tool_offset(&mut self, tool_offset: &UnitDualQuaternion) {
        self.chain.set_tool_offset(tool_offset);
    }

    /// Those of the tool frame, which the offset may turn away from.
    fn tool_axes(&self) -> UnitQuaternion<f64> {
        let (tool, offset) = (self.pose().rotation(), self.chain.tool_offset().rotation());
        if offset == UnitQuaternion::identity() { tool } else { tool * offset.inverse() }
    }

    fn evaluate(&mut self, theta: &[f64]) -> Result<(), ArmError> {
        self.chain.evaluate(theta, &mut self.state)
    }

    fn pose(&self) -> UnitDualQuaternion {
        self.state.base_from_tool()
    }

    fn joint_velocity(&self, controller: &Controller, goal: &UnitDualQuaternion, theta_dot: &mut [f64]) {
        controller.joint_velocity(&self.state, goal, theta_dot);
    }

    fn leave_tool(&self, controller: &Controller, theta_dot: &mut [f64]) {
        controller.damping.leave_tool(&self.state, controller.aim, theta_dot);
    }

    fn joint_velocity_of(
        &self,
        controller: &Controller,
        angular: &Vector3<f64>,
        linear: &Vector3<f64>,
        theta_dot: &mut [f64],
    ) {
        let twist = (*angular, *linear);
        controller.damping.joint_velocity(&self.state, controller.aim, &twist, theta_dot);
    }

    fn steepest_descent(
        &self,
        controller: &Controller,
        goal: &UnitDualQuaternion,
        descent: &mut [f64],
    ) -> f64 {
        controller.steepest_descent(&self.state, goal, descent)
    }

    fn nearest_goal(&self, controller: &Controller, goal: &UnitDualQuaternion) -> UnitDualQuaternion {
        controller.aim.nearest(goal, &self.state.base_from_tool())
    }

    fn goal_error(&self, controller: &Controller, goal: &UnitDualQuaternion) -> GoalError {
        let goal_from_tool = pose_error(&self.state, goal);
        let rotation = match controller.aim {
            Aim::Pose => angle(&goal_from_tool),
            aim => aim.angle(goal, &self.state.base_from_tool()),
        };
        GoalError { position: goal_from_tool.translation().norm(), rotation }
    }

    fn fastest_rates(&self, controller: &Controller, goal: &UnitDualQuaternion) -> [f64; 2] {
        controller.fastest_rates(&self.state, goal)
    }

    fn tool_speed(&self, theta_dot: &[f64]) -> ToolSpeed {
        let (angular, linear) = self.state.tool_twist(theta_dot);
        ToolSpeed { linear: linear.norm(), angular: angular.norm() }
    }

    fn controlled_speed(&self, controller: &Controller, theta_dot: &[f64]) -> ToolSpeed {
        let (angular, linear) = self.state.tool_twist(theta_dot);
        let angular = controller.aim.part_of(&angular, &self.state.base_from_tool());
        ToolSpeed { linear: linear.norm(), angular: angular.norm() }
    }

    fn smallest_singular_value(&self, controller: &Controller) -> f64 {
        controller.smallest_singular_value(&self.state)
    }

    fn reach(&self, goal_point: &Vector3<f64>, limits: &PositionLimits) -> Reach {
        let (goal, longest) = self.chain.gap(goal_point, limits.ranges());
        Reach { goal, longest }
    }

    fn same_aim(one: &Controller, other: &Controller) -> bool {
        one.aim == other.aim
    }
}

/// The pose of the right arm's tool relative to the left arm's, or what a [`Primitive`] takes of it (paper §4).
#[derive(Clone, Debug, PartialEq)]
pub struct TwoArms {
    left: OneArm,
    right: OneArm,
    relative: ArmState,
}

impl TwoArms {
    /// The task for these arms, both in one base frame.
    pub fn new(left: Chain, right: Chain) -> Self {
        let (left, right) = (OneArm::new(left), OneArm::new(right));
        Self { relative: ArmState::relative(&left.state, &right.state), left, right }
    }

    /// The arms, left and right.
    pub fn chains(&self) -> (&Chain, &Chain) {
        (&self.left.chain, &self.right.chain)
    }
}

impl Task for TwoArms {
    type Controller = Cooperative;

    fn joint_count(&self) -> usize {
        self.relative.joint_count()
    }

    fn joint_kinds(&self) -> Vec<JointKind> {
        [self.left.joint_kinds(), self.right.joint_kinds()].concat()
    }

    fn set_tool_offset(&mut self, tool_offset: &UnitDualQuaternion) {
        self.left.set_tool_offset(tool_offset);
        self.right.set_tool_offset(tool_offset);
    }

    fn evaluate(&mut self, theta: &[f64]) -> Result<(), ArmError> {
        let (of_left, of_right) = theta.split_at(self.left.joint_count().min(theta.len()));
        self.left.evaluate(of_left)?;
        self.right.evaluate(of_right)?;
        self.relative.set_relative(&self.left.state, &self.right.state);
        Ok(())
    }

    fn pose(&self) -> UnitDualQuaternion {
        self.relative.base_from_tool()
    }

    fn feeds_forward(controller: &Cooperative) -> bool {
        controller.primitive == Primitive::RelativePose
    }

    fn joint_velocity(&self, controller: &Cooperative, goal: &UnitDualQuaternion, theta_dot: &mut [f64]) {
        controller.joint_velocity(&self.relative, goal, theta_dot);
    }

    fn joint_velocity_of(
        &self,
        controller: &Cooperative,
        angular: &Vector3<f64>,
        linear: &Vector3<f64>,
        theta_dot: &mut [f64],
    ) {
        let twist = (*angular, *linear);
        controller.damping.joint_velocity(&self.relative, Aim::Pose, &twist, theta_dot);
    }

    fn steepest_descent(
        &self,
        controller: &Cooperative,
        goal: &UnitDualQuaternion,
        descent: &mut [f64],
    ) -> f64 {
        controller.steepest_descent(&self.relative, goal, descent)
    }

    fn goal_error(&self, controller: &Cooperative, goal: &UnitDualQuaternion) -> GoalError {
        let goal_from_right = pose_error(&self.relative, goal);
        let (now, wanted) = (self.relative.tool_point(), goal.translation());
        let (position, rotation) = (goal_from_right.translation().norm(), angle(&goal_from_right));
        match controller.primitive {
            Primitive::RelativePosition => GoalError { position, rotation: 0.0 },
            Primitive::RelativeOrientation => GoalError { position: 0.0, rotation },
            Primitive::RelativePose => GoalError { position, rotation },
            Primitive::RelativeDistance => {
                GoalError { position: (wanted.norm() - now.norm()).abs(), rotation: 0.0 }
            }
        }
    }

    fn fastest_rates(&self, controller: &Cooperative, _: &UnitDualQuaternion) -> [f64; 2] {
        [controller.fastest_rate(&self.relative); 2]
    }

    fn tool_speed(&self, theta_dot: &[f64]) -> ToolSpeed {
        let (of_left, of_right) = theta_dot.split_at(self.left.joint_count().min(theta_dot.len()));
        let (left, right) = (self.left.tool_speed(of_left), self.right.tool_speed(of_right));
        ToolSpeed { linear: left.linear.max(right.linear), angular: left.angular.max(right.angular) }
    }

    fn smallest_singular_value(&self, controller: &Cooperative) -> f64 {
        controller.smallest_singular_value(&self.relative)
    }

    fn reach(&self, goal_point: &Vector3<f64>, limits: &PositionLimits) -> Reach {
        let mut ranges = limits.ranges();
        let (left, right) = (self.left.chain(), self.right.chain());
        let between_bases = (left.base_point() - right.base_point()).norm();
        let arms = left.reach(ranges.by_ref()) + right.reach(ranges);
        Reach { goal: goal_point.norm(), longest: arms + between_bases }
    }

    fn same_aim(one: &Cooperative, other: &Cooperative) -> bool {
        one.primitive == other.primitive
    }
}

/// The angle of a pose error \[rad\], of its signed quaternion.
fn angle(error: &UnitDualQuaternion) -> f64 {
    2.0 * error.half_log().fixed_rows::<3>(0).norm()
}
