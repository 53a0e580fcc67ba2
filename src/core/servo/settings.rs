//! The settings of a servo.

use dq_common::named;
use dq_contact::Compliance;
use dq_kinematics::arm::bounds;
use dq_kinematics::control::Controller;
use dq_params::Parameters;

use super::{Interface, Limits, Reconfigure};
use dq_algebra::UnitDualQuaternion;
use dq_metrics::Tolerance;
use dq_search::Question;
use dq_space::space::{KeepOut, Scene, SceneError};
use std::sync::Arc;
use std::time::Duration;

named! {
    /// What the servo does with a goal that the arm cannot reach.
    "goal_beyond_reach" BeyondReach {
        /// Rejects the goal.
        Reject = "reject",
        /// Moves the arm as near to the goal as possible.
        Approach = "approach",
    }
}

named! {
    /// What the servo does with a goal in a frame that moves.
    "mode" GoalFrameMode {
        /// The goal stays at its pose at the time of its stamp.
        Latch = "latch",
        /// The goal moves with its frame.
        Follow = "follow",
    }
}

/// How to treat goals in TF frames.
#[derive(Clone, Copy, Debug, PartialEq, Parameters)]
pub struct GoalFrames {
    /// how long a goal in a TF frame waits for its transform, and how long a followed frame may lack one \[s\]
    // At most `STREAM`: if a goal waited longer for its transform, its publisher would count as silent.
    #[parameter(default = GoalFrames::default().tf_timeout.as_secs_f64(), range = 0.0..=1.5)]
    pub tf_timeout: Duration,
    /// how the next goal in a TF frame behaves. latch: it stays at its pose at the time of its stamp. follow: it moves with its
    /// frame
    #[parameter(name = "frame_mode", one_of = GoalFrameMode::NAMES, default = GoalFrames::default().mode)]
    pub mode: GoalFrameMode,
}

impl Default for GoalFrames {
    fn default() -> Self {
        Self { mode: GoalFrameMode::Latch, tf_timeout: Duration::from_millis(500) }
    }
}

/// The posture of an arm with redundant joints. The arm moves to these joint positions as far as it can without disturbing the motion
/// of the tool. The [`default`](Self::default) has no effect, because its gain is 0.
#[derive(Clone, Debug, Default, PartialEq, Parameters)]
#[parameters(prefix = "posture.")]
pub struct Posture {
    /// posture: an arm with joints to spare moves its joints to these positions, as far as the tool leaves them free. One number
    /// per joint; empty: the positions in which the motion began \[rad, m\]
    #[parameter(range = -bounds::JOINT_ANGLE..=bounds::JOINT_ANGLE)]
    pub positions: Vec<f64>,
    /// rate at which the joints move to the posture; 0: not at all [1/s]
    #[parameter(default = 1.0, range = 0.0..=10.0)]
    pub gain: f64,
}

/// The settings of a servo. All except `interface` can change while the servo runs.
///
/// Each field with a `parameter` attribute is a ROS 2 parameter of the servo. The other fields come from parameters that are declared
/// elsewhere.
#[derive(Clone, Debug, PartialEq, Parameters)]
pub struct Settings {
    /// The law and its gains.
    pub controller: Controller,
    /// The pose of the controlled tool in the tool frame of the arm.
    pub tool_offset: UnitDualQuaternion,
    /// How to treat goals in TF frames.
    pub goal_frames: GoalFrames,
    /// what happens to a goal that the arm cannot reach. reject: the servo rejects it. approach: the arm moves as near to the goal as
    /// possible
    #[parameter(name = "goal_beyond_reach", one_of = BeyondReach::NAMES, default = BeyondReach::Reject)]
    pub beyond_reach: BeyondReach,
    /// adds the motion of a moving goal to the law's, so that the tool does not lag behind
    #[parameter(default = true)]
    pub feed_forward: bool,
    /// how far past a half turn from the goal the law keeps its direction of rotation: the sine of half of the angle beyond the half
    /// turn
    // The δ of the rule by which the law chooses between q and −q, which are the same pose.
    #[parameter(default = 0.1, range = 0.0..=0.9)]
    pub hysteresis: f64,
    /// Speed, acceleration and position limits.
    #[parameter(group)]
    pub limits: Limits,
    /// The arm's body and the obstacles from which it must keep clear; `None` if there is nothing to keep clear of.
    pub scene: Option<Arc<Scene>>,
    /// How goals yield to the wrench at the tool; `None` if they do not.
    pub contact: Option<Compliance>,
    /// The joint positions to which a redundant arm moves as far as it can without disturbing the motion of the tool.
    pub posture: Posture,
    /// The goal tolerance.
    #[parameter(group)]
    pub goal_tolerance: Tolerance,
    /// age from which a joint state is stale; the arm then decelerates \[s\]
    #[parameter(default = 0.1, range = 0.001..=10.0)]
    pub state_timeout: Duration,
    /// a robot whose joint states were missing for longer moves again only after a new goal or ~/pause (false); a goal older than
    /// this is rejected; a joystick that is silent for longer counts as released \[s\]
    #[parameter(default = 1.0, range = 0.1..=3600.0)]
    pub rearm_timeout: Duration,
    /// time from a command to the joint state that shows its effect; 0: estimated from stamps and motion \[s\]
    #[parameter(range = 0.0..=0.5)]
    pub latency: Option<Duration>,
    /// rate at which the servo balances a payload, or gravity that the robot does not compensate for; only for an arm that takes
    /// velocities; 0: not at all [1/s]
    #[parameter(range = 0.0..=10.0)]
    pub integral: f64,
    /// age from which a goal is stale; 0: goals never are \[s\]
    #[parameter(range = 0.0..=3600.0)]
    pub goal_timeout: Option<Duration>,
    /// age from which a twist is stale; the arm then decelerates, and holds \[s\]
    #[parameter(default = 0.1, range = 0.01..=1.0)]
    pub twist_timeout: Duration,
    /// time without progress after which a motion stalls and the arm holds; 0: never \[s\]
    #[parameter(default = 5.0, range = 0.0..=3600.0)]
    pub progress_timeout: Option<Duration>,
    /// whether a stalled arm moves to another configuration in which it can reach the goal, along a straight line in joint space.
    /// never, ask (when ~/reconfigure is called), or always
    #[parameter(one_of = Reconfigure::NAMES, default = Reconfigure::Ask)]
    pub reconfigure: Reconfigure,
    /// The kind of commands that the robot takes. It does not change while the servo runs.
    #[parameter(group)]
    pub interface: Interface,
    /// largest distance between the setpoint of a joint and its predicted position; if it is larger, the arm holds; only for an arm that
    /// takes positions \[rad, m\]
    #[parameter(default = 0.2, range = 0.001..=3.0)]
    pub following_error: f64,
}

impl Settings {
    /// Returns the question for a search: which joint positions reach `goal`? The arm is at the positions `from` \[rad, prismatic:
    /// m\].
    pub fn question<'a>(&'a self, goal: &'a UnitDualQuaternion, from: &'a [f64]) -> Question<'a> {
        let (aim, tolerance, tool_offset) = (self.controller.aim, self.goal_tolerance, &self.tool_offset);
        Question { goal, aim, tolerance, tool_offset, from, limits: &self.limits }
    }

    /// Returns the settings with the additional keep-outs `more`. Without a scene, the settings remain as they are.
    ///
    /// # Errors
    /// [`SceneError`] if the scene would have too many parts.
    pub fn keeping_out_of(&self, more: &[KeepOut]) -> Result<Self, SceneError> {
        let mut settings = self.clone();
        if let Some(scene) = settings.scene.as_mut().filter(|_| !more.is_empty()) {
            *scene = Arc::new(scene.besides(more.to_vec())?);
        }
        Ok(settings)
    }
}
