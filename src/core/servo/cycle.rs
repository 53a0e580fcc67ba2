//! The cycle of the servo.

mod contact;
mod escaping;
mod goals;
mod jog;
mod joint_goals;
mod joint_line;
mod motion_record;
mod output;
mod own_program;
mod reconfigure;
mod robot;
mod saved;
mod step;
mod tracking;

use super::consent::MotionRequests;
use super::explanation::Explanation;
use super::mode::Mode;
use super::settings_error::{check_length, check_period};
use super::stream::GoalStream;
use super::{
    Arms, Consent, JointOrder, Motion, MotionLog, Outcome, Rejection, RejectionCounts, Replaced, Requester,
    Revocation, STREAM, Settings, SettingsError, Status,
};
use dq_algebra::UnitDualQuaternion;
use dq_contact::{Admittance, ContactState};
use dq_kinematics::control::LawMemory;
use dq_link::Link;
use dq_search::Escape;
use joint_line::JointLine;
use output::Output;
pub use own_program::Measured;
use serde::{Deserialize, Serialize};
use std::sync::Arc;
use std::time::Duration;

/// A servo: takes joint states, goals and settings, and computes one command per cycle.
///
/// Call [`cycle`](Self::cycle) once per control period with the measured joint positions. To pass other inputs too, call
/// [`cycle_with`](Self::cycle_with) instead, or pass each input to its own method and then call [`step`](Self::step). After the
/// cycle, send [`output`](Self::output) to the robot. If the output is `None`, send nothing.
pub struct Servo {
    robot: Robot,
    frames: Frames,
    settings: Settings,
    /// Number of successful calls of [`configure`](Servo::configure), including calls that changed no setting.
    configurations: u64,
    /// When the settings were last changed; `None` if they never were.
    configured: Option<Duration>,
    clock: Clock,
    /// The requests, and the consent that follows from them.
    requests: MotionRequests,
    mode: Mode,
    /// The goal that the program has set by [`Servo::set_goal`] since the last cycle, if any.
    set: Option<UnitDualQuaternion>,
    /// The recent goals of a stream. The servo estimates the twist of a moving goal from them.
    stream: GoalStream,
    explanation: Explanation,
    escape: Escape,
    /// The memory that the law passes from cycle to cycle during a motion.
    law_memory: LawMemory,
    contact: ContactState,
    joint_line: JointLine,
    output: Output,
    /// The motion updates that the next call of [`Servo::take_motions`] returns.
    motions: MotionLog,
    status: Status,
    rejections: Arc<RejectionCounts>,
}

/// The state of the robot.
struct Robot {
    /// The arms at the measured positions.
    arms: Arms,
    /// The arms at the positions predicted for the time at which the next command takes effect.
    predicted: Arms,
    link: Link,
}

/// The frames of goals and twists.
struct Frames {
    goal: String,
    /// The name of the tool's own frame. Twists may also be given in this frame. Empty if the frame has no name.
    tool: String,
}

/// The times of the cycle.
#[derive(Serialize, Deserialize)]
struct Clock {
    /// The control period \[s\].
    period: f64,
    /// The time of the current inputs.
    now: Duration,
    /// The time of the last cycle.
    stepped: Duration,
}

impl Servo {
    /// Creates a servo at rest that waits for its first joint states. It runs one cycle every `period`. `joints` are the joint
    /// names of each arm; goals are in `goal_frame`. To allow twists in the tool's own frame, name that frame with
    /// [`with_tool_frame`](Self::with_tool_frame).
    ///
    /// # Errors
    /// [`SettingsError`] if the joint names or a list in the settings do not have one entry per joint, if a limit is NaN or below
    /// 0, or if the period is 0.
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
            requests: MotionRequests::default(),
            mode: Mode::Idle,
            set: None,
            stream: GoalStream::default(),
            explanation: Explanation::default(),
            motions: MotionLog::default(),
            escape: Escape::new(arms.clone()),
            law_memory: LawMemory::default(),
            contact: ContactState::default(),
            output: Output::new(&arms, &settings, period.as_secs_f64()),
            joint_line: JointLine::new(arms.clone()),
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

    /// Applies `settings` from the next cycle on.
    ///
    /// A new tool or a new aim revokes consent, because nobody has requested a motion with this tool or aim.
    ///
    /// A change of the settings ends a stall, unless the previous change was at most `progress_timeout` ago. So changes in quick
    /// succession do not restart a stalled motion again and again.
    ///
    /// # Errors
    /// [`SettingsError`] if [`new`](Self::new) would reject the settings, or if their `interface` differs. The present settings
    /// then remain.
    pub fn configure(&mut self, settings: Settings) -> Result<(), SettingsError> {
        settings.check(self.robot.arms.joint_count(), self.settings.interface)?;
        if self.settings.controller.aim != settings.controller.aim {
            self.revoke_motion(Revocation::AnotherAim);
        }
        if self.settings.tool_offset != settings.tool_offset {
            self.robot.arms.set_tool_offset(&settings.tool_offset);
            self.robot.predicted.set_tool_offset(&settings.tool_offset);
            self.escape.set_tool_offset(&settings.tool_offset);
            self.joint_line.set_tool_offset(&settings.tool_offset);
            self.output.filters.set_tool_offset(&settings.tool_offset);
            self.explanation.restart();
            self.revoke_motion(Revocation::AnotherTool);
            self.renew_joint_goal();
        }
        if self.settings != settings {
            if self.settings.scene != settings.scene {
                self.output.filters.set_scene(settings.scene.as_deref());
            }
            self.settings = settings;
            let before = self.configured.replace(self.clock.now);
            self.settings_changed(before);
        }
        self.configurations += 1;
        Ok(())
    }

    /// Revokes all requests sent up to the last cycle, because the tool or the aim has changed. Does not revoke a goal that was sent
    /// since then: its sender may already know the new settings, because the node confirms them before the cycle applies them.
    fn revoke_motion(&mut self, why: Revocation) {
        self.set = None;
        self.requests.revoke(self.clock.stepped, self.clock.now, why);
        self.end_motion(Outcome::Revoked(why));
        if let Some(pursuit) = self.mode.pursuit_mut() {
            // The metrics so far are those of another tool, or of other components of the pose.
            (pursuit.record.meter, pursuit.record.settled) = (None, false);
        }
    }

    /// If `paused` is true, decelerates the arm to rest. Otherwise ends the pause: requests the current goal again, and continues
    /// from the measured state. If this is impossible, the servo counts a rejection and stays paused.
    pub fn pause(&mut self, paused: bool) {
        if paused {
            return self.requests.pause();
        }
        // `resume` counts the rejection.
        let _ = self.resume(Duration::ZERO);
    }

    /// Requests the current goal again, and continues from the measured state. `ago` is the age of this request on arrival.
    ///
    /// # Errors
    /// [`Rejection::Late`], [`Rejection::Overtaken`] and [`Rejection::StreamsOn`], which are counted. The servo then stays paused.
    pub(super) fn resume(&mut self, ago: Duration) -> Result<(), Rejection> {
        let (now, silence) = (self.clock.now, self.silence());
        let resumed = match ago > self.settings.rearm_timeout {
            true => Err(Rejection::Late(ago)),
            false => self.requests.resume(now.saturating_sub(ago), now, silence),
        };
        let was_revoked = self.counted(resumed)?;
        let joints = self.output.command.len();
        if let Some(pursuit) = self.mode.pursuit_mut() {
            if was_revoked {
                pursuit.restart_motion(Requester::Resume, joints);
                self.motions.count += 1;
            }
            pursuit.try_again();
            self.robot.link.try_again();
        }
        Ok(())
    }

    /// Decelerates to rest and drops the goal. A publisher that merely continues to send goals or twists cannot move the arm again:
    /// it must first be silent for [`STREAM`], or for `rearm_timeout` if that is longer. A paused servo stays paused.
    pub fn stop(&mut self) {
        self.requests.stop(self.clock.now);
        self.drop_goal(Revocation::Stopped);
    }

    /// Drops the goal, if there is one.
    fn drop_goal(&mut self, why: Revocation) {
        self.set = None;
        if self.mode.pursuit().is_some() {
            self.enter(Mode::Idle, Outcome::Revoked(why));
        }
    }

    /// Ends the present motion with the outcome `end`, and changes to the mode `next`.
    fn enter(&mut self, next: Mode, end: Outcome) {
        self.end_motion(end);
        self.stream.clear();
        self.explanation.restart();
        self.law_memory.reset();
        if !matches!(&next, Mode::Goal(pursuit) if !pursuit.by_joints) {
            self.contact.offset = Admittance::default();
        }
        self.mode = next;
    }

    /// Returns how long a publisher may be silent before its request lapses.
    fn silence(&self) -> Duration {
        self.settings.rearm_timeout.max(STREAM)
    }

    /// Sets the time `now` at which the following inputs are [taken](Self::take).
    pub fn begin(&mut self, now: Duration) {
        self.clock.now = now;
    }

    /// Returns the time of the current inputs.
    pub(super) fn now(&self) -> Duration {
        self.clock.now
    }

    /// Returns whether the last command moves no joint. Even such a command may not be zero: it may keep a joint still against a
    /// payload or gravity.
    pub fn at_rest(&self) -> bool {
        self.output.at_rest()
    }

    /// Returns the last joint velocity command [rad/s, prismatic: m/s]. To drive the robot, send [`output`](Self::output).
    pub fn command(&self) -> &[f64] {
        &self.output.command
    }

    /// Returns the output for the robot after this cycle, or `None` if nothing is to be sent. The output has one number per joint:
    /// its velocity [rad/s, prismatic: m/s] or position \[rad, prismatic: m\], as [`Interface`](super::Interface) says.
    ///
    /// The output is `None` until the servo first drives the arm. Before that, even a command of zeros could be dangerous: a
    /// controller that expects positions would move the arm to zero. For an arm that takes positions, the output becomes `None` again
    /// when something else moves the arm, until the servo next drives the arm.
    pub fn output(&self) -> Option<&[f64]> {
        self.output.to_send()
    }

    /// Returns the consent: the last request, the event that has revoked it, and whether the arm may move.
    pub fn consent(&self) -> &Consent {
        self.requests.consent()
    }

    /// Returns the motion updates since the last call, the oldest first. There is an update when a motion begins, when it stalls, and
    /// when it ends. The servo keeps at most the latest [`MOTIONS`](super::MOTIONS) updates.
    pub fn take_motions(&mut self) -> impl Iterator<Item = Motion> {
        self.motions.updates.drain(..)
    }

    /// Returns the report of the last cycle.
    pub fn status(&self) -> &Status {
        &self.status
    }

    /// Returns the counts of rejected messages so far. A clone of the `Arc` keeps the counts that it had when it was cloned.
    pub fn rejections(&self) -> &Arc<RejectionCounts> {
        &self.rejections
    }

    /// Returns how many commands the final check has replaced by a stop, and the violation by the last replaced command.
    pub fn replaced(&self) -> &Replaced {
        self.output.filters.replaced()
    }

    /// Returns the number of successful calls of [`configure`](Self::configure), including calls that changed no setting.
    pub fn configurations(&self) -> u64 {
        self.configurations
    }

    /// Returns the present settings.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// Returns the arms at the last joint state, or `None` before the first.
    pub fn arms(&self) -> Option<&Arms> {
        self.robot.link.received().map(|_| &self.robot.arms)
    }

    /// Returns the controlled pose at the last joint state, or `None` before the first.
    pub fn pose(&self) -> Option<UnitDualQuaternion> {
        self.arms().map(Arms::pose)
    }

    /// Returns the smallest singular value of the Jacobian of the controlled pose at the joint state of the last cycle.
    pub fn smallest_singular_value(&self) -> f64 {
        self.settings.controller.smallest_singular_value(self.robot.arms.state())
    }

    /// Counts a rejection in `result`, and returns `result`.
    pub(super) fn counted<V>(&mut self, result: Result<V, Rejection>) -> Result<V, Rejection> {
        result.inspect_err(|rejection| Arc::make_mut(&mut self.rejections).count(rejection))
    }
}
