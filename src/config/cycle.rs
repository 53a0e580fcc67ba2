//! The parameters of the nodes that run the servo cycle, for one or two arms.

use super::common::{NO_POSE, PoseNumbers, TrajectoryParameters, pose};
use super::scene::{RightBody, SceneParameters};
use super::{ArmParameters, limits};
use dq_common::named;
use dq_core::servo::{Arms, JointOrder, POSITIVE, Settings, SettingsError};
use dq_kinematics::arm::Chain;
use dq_kinematics::control::Damping;
use dq_params::{ParameterError, Parameters};
use std::time::Duration;

named! {
    /// The QoS reliability with which the servo subscribes to joint states.
    "reliability" StatesReliability {
        /// The servo subscribes as reliable until a publisher appears that offers only best effort. It then subscribes as best effort,
        /// because such a subscription receives from publishers of both kinds.
        Auto = "auto",
        /// Publishers resend lost joint states. The servo does not receive from publishers that offer only best effort.
        Reliable = "reliable",
        /// Publishers do not resend lost joint states.
        BestEffort = "best_effort",
    }
}

/// The parameters of a servo node, typed and checked as a whole.
#[derive(Clone, Debug, PartialEq)]
pub struct ServoParameters {
    /// The single arm, or the two arms.
    pub arms: Arms,
    /// The joint names of each arm.
    pub joints: Vec<JointOrder>,
    /// The name of the frame of goals.
    pub goal_frame: String,
    /// The name of the tool's frame, in which twists may also be given.
    pub tool_frame: String,
    /// The settings that may change while the servo runs.
    pub settings: Settings,
    /// Number of keep-outs and keep-ins that have no effect, because constraints are off.
    pub idle_keep_outs: usize,
    /// The QoS reliability with which the servo subscribes to joint states.
    pub joint_states: StatesReliability,
    /// The control period of the node.
    pub period: Duration,
    /// The SCHED_FIFO priority of the cycle's thread; 0 for a normal thread.
    pub realtime_priority: u8,
    /// Whether stamps follow `/clock`.
    pub simulated_time: bool,
}

/// The parameters that all servos share, whatever their law is.
#[derive(Parameters)]
pub(super) struct CommonParameters {
    /// QoS reliability of the subscription to joint states; auto: reliable, until a publisher offers only best effort
    #[parameter(one_of = StatesReliability::NAMES, default = StatesReliability::Auto, fixed)]
    reliability: StatesReliability,
    #[parameter(group)]
    pub settings: Settings,
    /// pose of the tool that moves to the goal, in tool_frame: x y z \[m\], then qx qy qz qw. After a change the arm stops and waits
    /// for a new request
    #[parameter(default = NO_POSE)]
    tool_offset: PoseNumbers,
    #[parameter(group)]
    scene: SceneParameters,
    #[parameter(group)]
    trajectory: TrajectoryParameters,
}

/// The parameters of the damped inverse.
#[derive(Parameters)]
#[parameters(prefix = "damping.")]
pub(super) struct DampingParameters {
    /// lambda of the damped inverse at a singularity, for a Jacobian in which 1 rad counts as much as 1 m
    #[parameter(default = 0.05, range = 0.0..=1.0)]
    max: f64,
    /// damping begins when the smallest singular value falls below this
    #[parameter(default = 0.05, range = POSITIVE..=1.0)]
    threshold: f64,
}

impl From<DampingParameters> for Damping {
    fn from(DampingParameters { max, threshold }: DampingParameters) -> Self {
        Self { max, threshold }
    }
}

impl CommonParameters {
    /// Builds the parameters of the servo for the single arm `arm`. If `right` is given, builds them for two arms, with `arm` as the
    /// left arm.
    ///
    /// # Errors
    /// [`ParameterError`] if values contradict each other.
    pub fn build(
        self,
        arm: &ArmParameters,
        right: Option<RightArm>,
        frames: Frames,
    ) -> Result<ServoParameters, ParameterError> {
        let Self { mut settings, .. } = self;
        let left = arm.chain.clone();
        let mut joints = vec![JointOrder::new(arm.joints.clone())];
        let (mut arms, body) = match right {
            None => (Arms::one(left), None),
            Some(RightArm { chain, joints: names, body }) => {
                joints.push(JointOrder::new(names));
                (Arms::two(left, chain), body)
            }
        };
        limits::complete(&mut settings.limits, &arms.chains().map(Chain::kinds).collect::<Vec<_>>())?;
        settings.tool_offset = pose("tool_offset", self.tool_offset)?;
        arms.set_tool_offset(&settings.tool_offset);
        let scene = self.scene.build(&arm.link_joints(), body.as_ref(), &arms, &settings.limits.position)?;
        settings.scene = scene.in_force;
        settings.check(arms.joint_count(), settings.interface).map_err(invalid)?;
        Ok(ServoParameters {
            joints,
            arms,
            goal_frame: frames.goal,
            tool_frame: frames.tool,
            idle_keep_outs: scene.idle,
            joint_states: self.reliability,
            period: self.trajectory.period(settings.interface, arm.period),
            settings,
            realtime_priority: arm.realtime_priority,
            simulated_time: arm.simulated_time,
        })
    }
}

/// The right one of two arms.
pub(super) struct RightArm {
    /// The kinematics, in the base frame of the left arm.
    pub chain: Chain,
    /// The joint names, base first.
    pub joints: Vec<String>,
    /// The body; `None` if it is like the left arm's.
    pub body: Option<RightBody>,
}

/// The frames of goals and twists.
pub(super) struct Frames {
    /// The name of the frame of goals.
    pub goal: String,
    /// The name of the tool's frame, in which twists may also be given.
    pub tool: String,
}

/// Converts an error of settings into the error of a parameter.
fn invalid(why: SettingsError) -> ParameterError {
    ParameterError::invalid("settings", "as given", format!("settings that a servo takes: {why}"))
}
