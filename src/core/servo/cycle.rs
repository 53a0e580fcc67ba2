//! The cycle itself.

mod elsewhere;
mod escaping;
mod goals;
mod jog;
mod motion_record;
mod output;
mod own_program;
mod reconfigure;
mod robot;
mod saved;
mod step;
mod tracking;

use super::consent::Asks;
use super::escape::Escape;
use super::explanation::Explanation;
use super::mode::Mode;
use super::settings_error::{check_length, check_period};
use super::stream::GoalStream;
use super::{
    Arms, Asker, Consent, JointOrder, Motion, MotionLog, Outcome, Rejection, RejectionCounts, Replaced,
    Revocation, STREAM, Settings, SettingsError, Status,
};
use dq_algebra::UnitDualQuaternion;
use dq_link::Link;
use elsewhere::Elsewhere;
use output::Output;
pub use own_program::Measured;
use serde::{Deserialize, Serialize};
use std::sync::Arc;
use std::time::Duration;

/// The servo: takes joint states, goals and settings as they come, and makes one command a cycle.
///
/// Once a cycle [`cycle`](Self::cycle) is called with where the joints are. To whom more comes than that calls
/// [`cycle_with`](Self::cycle_with), or [`step`](Self::step) after what takes each thing by itself. Then the robot is to be sent what
/// [`output`](Self::output) gives, and nothing where that gives none.
pub struct Servo {
    robot: Robot,
    frames: Frames,
    settings: Settings,
    /// How often they were changed, and when that was last.
    configurations: u64,
    configured: Option<Duration>,
    clock: Clock,
    /// Who asks, and the consent that comes of it.
    asks: Asks,
    mode: Mode,
    /// What [`Servo::set_goal`] has set since the last cycle.
    set: Option<UnitDualQuaternion>,
    /// The goals of the last moments, and whether the tool's motion explains theirs.
    stream: GoalStream,
    explanation: Explanation,
    escape: Escape,
    elsewhere: Elsewhere,
    output: Output,
    /// Motions of which there is news.
    motions: MotionLog,
    status: Status,
    rejections: Arc<RejectionCounts>,
}

/// What is known of the robot.
struct Robot {
    /// Where the arms were measured.
    arms: Arms,
    /// Where they should be when the next command reaches them.
    predicted: Arms,
    link: Link,
}

/// The frames in which goals and twists come.
struct Frames {
    goal: String,
    /// The tool's own, in which twists may come too; empty for none.
    tool: String,
}

/// The cycle's times.
#[derive(Serialize, Deserialize)]
struct Clock {
    /// From one cycle to the next \[s\].
    period: f64,
    /// The time of what comes now.
    now: Duration,
    /// When the last cycle was.
    stepped: Duration,
}

impl Servo {
    /// A servo at rest that waits for its first joint states; one cycle a `period`. `joints` are the joint names of each arm;
    /// goals come in `goal_frame`. Twists in the tool's own frame are taken where [`with_tool_frame`](Self::with_tool_frame) names it.
    ///
    /// # Errors
    /// [`SettingsError`] where the joint names or a list in the settings does not have one entry a joint, a limit is no number or below 0,
    /// or the period is 0.
    pub fn new(
        mut arms: Arms,
        joints: Vec<JointOrder>,
        goal_frame: &str,
        settings: Settings,
        period: Duration,
    ) -> Result<Self, SettingsError> {
        let expected = arms.joint_count();
        check_length("joints", joints.iter().map(|arm| arm.names().len()).sum(), expected)?;
        settings.check(expected, settings.interface)?;
        check_period(period)?;
        arms.set_tool_offset(&settings.tool_offset);
        let kinds = arms.joint_kinds();
        Ok(Self {
            frames: Frames { goal: goal_frame.to_owned(), tool: String::new() },
            clock: Clock { period: period.as_secs_f64(), now: Duration::ZERO, stepped: Duration::ZERO },
            asks: Asks::default(),
            mode: Mode::Idle,
            set: None,
            stream: GoalStream::default(),
            explanation: Explanation::default(),
            motions: MotionLog::default(),
            escape: Escape::new(arms.clone()),
            output: Output::new(&arms, &settings, period.as_secs_f64()),
            elsewhere: Elsewhere::new(arms.clone()),
            robot: Robot {
                predicted: arms.clone(),
                arms,
                link: Link::new(joints, &kinds, period, settings.interface),
            },
            settings,
            configurations: 0,
            configured: None,
            status: Status::default(),
            rejections: Arc::default(),
        })
    }

    /// Puts new settings into force from the next cycle on. Other ones end a stall where they were last changed longer than
    /// `progress_timeout` ago: whoever changes them all the time restarts no watch. Another tool, or something else that is controlled,
    /// revokes the consent: nobody has asked to move that.
    ///
    /// # Errors
    /// [`SettingsError`] where [`new`](Self::new) would not take them either, or they are for commands of another kind; those in force stay.
    pub fn configure(&mut self, settings: Settings) -> Result<(), SettingsError> {
        settings.check(self.robot.arms.joint_count(), self.settings.interface)?;
        if self.settings.controller.aim != settings.controller.aim {
            self.revoke_motion(Revocation::AnotherAim);
        }
        if self.settings.tool_offset != settings.tool_offset {
            self.robot.arms.set_tool_offset(&settings.tool_offset);
            self.robot.predicted.set_tool_offset(&settings.tool_offset);
            self.escape.set_tool_offset(&settings.tool_offset);
            self.elsewhere.set_tool_offset(&settings.tool_offset);
            self.output.filters.set_tool_offset(&settings.tool_offset);
            self.explanation.restart();
            self.revoke_motion(Revocation::AnotherTool);
        }
        if self.settings != settings {
            if self.settings.scene != settings.scene {
                self.output.filters.set_scene(settings.scene.as_deref());
            }
            self.settings = settings;
            let before = self.configured.replace(self.clock.now);
            self.look_again(before);
        }
        self.configurations += 1;
        Ok(())
    }

    /// Revokes what was asked for until the last cycle, as what moves, or is to, is another thing from now on. What was set is answered before
    /// the cycle takes it, so that a goal in the same cycle may have been sent after that.
    fn revoke_motion(&mut self, why: Revocation) {
        self.set = None;
        self.asks.revoke(self.clock.stepped, self.clock.now, why);
        self.end_motion(Outcome::Revoked(why));
        if let Some(pursuit) = self.mode.pursuit_mut() {
            // They were of another tool, or of another part of the pose.
            (pursuit.record.meter, pursuit.record.settled) = (None, false);
        }
    }

    /// Decelerates and holds, or asks for the goal in force once more and goes on from the measured state. A request to go on that cannot be
    /// met is counted as rejected.
    pub fn pause(&mut self, paused: bool) {
        if paused {
            return self.asks.pause();
        }
        // What is rejected is counted.
        let _ = self.resume(Duration::ZERO);
    }

    /// Asks for the goal in force once more, with a request sent so long `ago`, and goes on from the measured state.
    ///
    /// # Errors
    /// [`Rejection::Late`], [`Rejection::Overtaken`] and [`Rejection::StreamsOn`], which are counted; a pause goes on.
    pub(super) fn resume(&mut self, ago: Duration) -> Result<(), Rejection> {
        let (now, silence) = (self.clock.now, self.silence());
        let resumed = match ago > self.settings.rearm_timeout {
            true => Err(Rejection::Late(ago)),
            false => self.asks.resume(now.saturating_sub(ago), now, silence),
        };
        let was_revoked = self.counted(resumed)?;
        let joints = self.output.command.len();
        if let Some(pursuit) = self.mode.pursuit_mut() {
            if was_revoked {
                pursuit.begin_anew(Asker::Resume, joints);
                self.motions.count += 1;
            }
            pursuit.try_again();
            self.robot.link.try_again();
        }
        Ok(())
    }

    /// Decelerates to rest and drops the goal; a publisher that goes on with goals or twists must pause first. A servo that is paused
    /// stays so.
    pub fn stop(&mut self) {
        self.asks.stop(self.clock.now);
        self.drop_goal(Revocation::Stopped);
    }

    /// Drops the goal, if there is one.
    fn drop_goal(&mut self, why: Revocation) {
        self.set = None;
        if self.mode.pursuit().is_some() {
            self.enter(Mode::Idle, Outcome::Revoked(why));
        }
    }

    /// Goes over to the next mode: what was before has come to that end.
    fn enter(&mut self, next: Mode, end: Outcome) {
        self.end_motion(end);
        self.stream.clear();
        self.explanation.restart();
        self.mode = next;
    }

    /// A publisher that is silent for longer than this has let go.
    fn silence(&self) -> Duration {
        self.settings.rearm_timeout.max(STREAM)
    }

    /// What is [taken](Self::take) from here on comes at `now`.
    pub fn begin(&mut self, now: Duration) {
        self.clock.now = now;
    }

    /// The time of what comes now.
    pub(super) fn now(&self) -> Duration {
        self.clock.now
    }

    /// Whether the last command was zero for every joint.
    pub fn at_rest(&self) -> bool {
        self.output.at_rest()
    }

    /// The last joint velocity command [rad/s, prismatic: m/s]. What is to be sent is [`output`](Self::output).
    pub fn command(&self) -> &[f64] {
        &self.output.command
    }

    /// What is to be sent to the robot after this cycle, joint after joint: velocities [rad/s, prismatic: m/s] or positions
    /// \[rad, prismatic: m\], by its [`Interface`](super::Interface). Where it is none, nothing is to be sent: before the arm was driven, as
    /// what nobody has asked for might be a motion for a controller of another kind, and to an arm that takes positions and was elsewhere since.
    pub fn output(&self) -> Option<&[f64]> {
        self.output.to_send()
    }

    /// Whether the arm may move: who asked for it, and what revoked that.
    pub fn consent(&self) -> &Consent {
        self.asks.consent()
    }

    /// The motions of which there is news since this was last asked, the oldest first: each when it begins, when the arm stalls, and when
    /// it ends. Of many that nobody asks for the last [`MOTIONS`](super::MOTIONS) are kept.
    pub fn take_motions(&mut self) -> impl Iterator<Item = Motion> {
        self.motions.news.drain(..)
    }

    /// What the last cycle did.
    pub fn status(&self) -> &Status {
        &self.status
    }

    /// Messages rejected so far. Who keeps them does not see later ones.
    pub fn rejections(&self) -> &Arc<RejectionCounts> {
        &self.rejections
    }

    /// Commands that the last gate has replaced by braking.
    pub fn replaced(&self) -> &Replaced {
        self.output.filters.replaced()
    }

    /// How often the settings were changed.
    pub fn configurations(&self) -> u64 {
        self.configurations
    }

    /// The settings in force.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// The arms at the last joint state; none before the first.
    pub fn arms(&self) -> Option<&Arms> {
        self.robot.link.received().map(|_| &self.robot.arms)
    }

    /// The controlled pose at the last joint state; none before the first.
    pub fn pose(&self) -> Option<UnitDualQuaternion> {
        self.arms().map(Arms::pose)
    }

    /// The smallest singular value of the Jacobian of what is controlled, at the joint state of the last cycle.
    pub fn smallest_singular_value(&self) -> f64 {
        self.settings.controller.smallest_singular_value(self.robot.arms.state())
    }

    /// Counts a rejection.
    pub(super) fn counted<V>(&mut self, result: Result<V, Rejection>) -> Result<V, Rejection> {
        result.inspect_err(|rejection| Arc::make_mut(&mut self.rejections).count(rejection))
    }
}
