//! What may change while the servo runs.

use dq_common::named;
use dq_kinematics::control::Controller;

use super::{Interface, Limits, Reconfigure};
use dq_algebra::UnitDualQuaternion;
use dq_space::space::{KeepOut, Scene, SceneError};
use std::sync::Arc;
use std::time::Duration;

/// How near counts as arrived.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tolerance {
    /// Distance of the tool from the goal \[m\].
    pub linear: f64,
    /// Angle between tool and goal \[rad\].
    pub angular: f64,
}

named! {
    /// What becomes of a goal that the arm cannot reach.
    "goal_beyond_reach" BeyondReach {
        /// It is rejected.
        Reject = "reject",
        /// The arm goes as near as it can.
        Approach = "approach",
    }
}

named! {
    /// What becomes of a goal in a frame that moves.
    "mode" GoalFrameMode {
        /// It stays where it was at its stamp.
        Latch = "latch",
        /// It moves with its frame.
        Follow = "follow",
    }
}

/// How goals in frames of TF are taken.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GoalFrames {
    /// What becomes of them.
    pub mode: GoalFrameMode,
    /// How long a goal waits for its transform, and how long a frame that is followed may be silent.
    pub transform_timeout: Duration,
}

impl Default for GoalFrames {
    fn default() -> Self {
        Self { mode: GoalFrameMode::Latch, transform_timeout: Duration::from_millis(500) }
    }
}

/// Where the joints go, as far as the tool leaves them free; by default nowhere.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Posture {
    /// Joint positions \[rad, prismatic: m\], one a joint; empty: nowhere.
    pub positions: Vec<f64>,
    /// How fast they go there [1/s]; 0: not at all.
    pub gain: f64,
}

/// The servo's live settings.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// The law and its gains.
    pub controller: Controller,
    /// The tool that is controlled, in the tool frame of the arm.
    pub tool_offset: UnitDualQuaternion,
    /// How goals in frames of TF are taken, where they are.
    pub goal_frames: GoalFrames,
    /// What becomes of a goal that the arm cannot reach.
    pub beyond_reach: BeyondReach,
    /// Whether the motion of a goal that moves is added to the law's.
    pub feed_forward: bool,
    /// δ of the double-cover rule.
    pub sign_hysteresis: f64,
    /// Speed, acceleration and position limits.
    pub limits: Limits,
    /// What the arm must keep out of, and its body; none where it need not.
    pub scene: Option<Arc<Scene>>,
    /// What an arm of more joints than the tool needs does with the rest.
    pub posture: Posture,
    /// How near counts as arrived.
    pub goal_tolerance: Tolerance,
    /// Age by receipt at which a joint state is stale.
    pub state_timeout: Duration,
    /// A robot that was away for longer must be asked for anew, a goal that was under way for longer is rejected, and a stick of which
    /// nothing was heard for longer was let go of.
    pub rearm_timeout: Duration,
    /// From a command to the joint state that shows it; none: estimated.
    pub latency: Option<Duration>,
    /// The rate at which what pulls at the joints of an arm that takes velocities is balanced [1/s]; 0: not at all.
    pub integral: f64,
    /// Age by receipt at which a goal is stale; none: goals are latched.
    pub goal_timeout: Option<Duration>,
    /// Age by receipt at which a twist is stale.
    pub twist_timeout: Duration,
    /// Time without progress after which a motion is given up; none: never.
    pub progress_timeout: Option<Duration>,
    /// Whether an arm that has stalled goes to another configuration in which the goal can be reached.
    pub reconfigure: Reconfigure,
    /// What kind of commands the robot takes; it stays as it is while the servo runs.
    pub interface: Interface,
    /// How far a joint that takes positions may be from where it was sent and should be \[rad, prismatic: m\].
    pub following_error: f64,
}

impl Settings {
    /// The same, with `more` to keep out of besides, where there is a scene.
    ///
    /// # Errors
    /// [`SceneError`] where that is more than a scene may have.
    pub fn keeping_out_of(&self, more: &[KeepOut]) -> Result<Self, SceneError> {
        let mut settings = self.clone();
        if let Some(scene) = settings.scene.as_mut().filter(|_| !more.is_empty()) {
            *scene = Arc::new(scene.besides(more.to_vec())?);
        }
        Ok(settings)
    }
}
