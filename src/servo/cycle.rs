//! The cycle itself.

mod elsewhere;
mod escape_phase;
mod escaping;
mod goals;
mod jog;
mod motion_record;
mod output;
mod own_program;
mod reconfigure;
mod robot;
mod step;
mod tracking;

use super::escape::Escape;
use super::link::Link;
use super::settings_error::{check_length, check_period};
use super::sticks::Sticks;
use super::stream::GoalStream;
use super::{
    Arms, Asker, Consent, Held, JointOrder, Motion, MotionLog, Outcome, Rejection, RejectionCounts, Replaced,
    Revocation, Settings, SettingsError, State, Status,
};
use crate::dq::UnitDualQuaternion;
use elsewhere::Elsewhere;
use jog::Jog;
use output::Output;
pub use own_program::Measured;
use std::sync::Arc;
use std::time::Duration;
use tracking::GoalTracking;
pub use tracking::STREAM;

/// The servo: takes joint states, goals and settings as they come, and makes one command a cycle.
///
/// Once a cycle [`cycle`](Self::cycle) is called with where the joints are. To whom more comes than that calls
/// [`cycle_with`](Self::cycle_with), or [`step`](Self::step) after what takes each thing by itself. Then the robot is to be sent what
/// [`output`](Self::output) gives, and nothing where that gives none.
pub struct Servo {
    robot: Robot,
    frames: Frames,
    settings: Settings,
    /// How often they were changed.
    configurations: u64,
    clock: Clock,
    consent: Consent,
    goals: Goals,
    twists: Twists,
    escape: Escape,
    elsewhere: Elsewhere,
    output: Output,
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
struct Clock {
    /// From one cycle to the next \[s\].
    period: f64,
    /// The time of what comes now.
    now: Duration,
    /// When the last cycle was.
    stepped: Duration,
}

/// The goal in force, and what becomes of the motions to goals.
struct Goals {
    /// What [`Servo::set_goal`] has set since the last cycle.
    set: Option<UnitDualQuaternion>,
    tracking: Option<GoalTracking>,
    /// The goals of the last moments.
    stream: GoalStream,
    /// Motions of which there is news.
    motions: MotionLog,
    /// Under which settings the goal in the status was last looked at.
    reported: u64,
}

/// The twist in force, and who holds a stick.
#[derive(Default)]
struct Twists {
    jog: Option<Jog>,
    sticks: Sticks,
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
            consent: Consent::default(),
            goals: Goals {
                set: None,
                tracking: None,
                stream: GoalStream::default(),
                motions: MotionLog::default(),
                reported: 0,
            },
            twists: Twists::default(),
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
            status: Status::default(),
            rejections: Arc::default(),
        })
    }

    /// Puts new settings into force from the next cycle on; other ones end a stall. Another tool, or something else that is controlled,
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
            self.revoke_motion(Revocation::AnotherTool);
        }
        if self.settings != settings {
            if self.settings.scene != settings.scene {
                self.output.filters.set_scene(settings.scene.as_deref());
            }
            self.settings = settings;
            self.look_again();
        }
        self.configurations += 1;
        Ok(())
    }

    /// Revokes what was asked for until now, as what moves, or is to, is another thing from now on.
    fn revoke_motion(&mut self, why: Revocation) {
        self.goals.set = None;
        self.consent.revoke_present(self.clock.now, why);
        // What was set is answered before the cycle takes it, so that a goal in the same cycle may have been sent after that.
        self.consent.revoke_before(self.clock.stepped, self.clock.now, why);
        self.end_motion(Outcome::Revoked(why));
        self.goals.tracking.iter_mut().for_each(GoalTracking::forget_motion);
    }

    /// Decelerates and holds, or asks for the goal in force once more and goes on from the measured state.
    pub fn pause(&mut self, paused: bool) {
        if paused {
            self.consent.pause();
        } else if self.consent.resume(self.clock.now)
            && let Some(tracking) = &mut self.goals.tracking
        {
            tracking.begin_anew(Asker::Resume, self.output.command.len());
            self.status.goal_count += 1;
        }
        self.goals.tracking.iter_mut().for_each(GoalTracking::try_again);
    }

    /// Decelerates to rest and drops the goal; a stick that is held must be let go of. A servo that is paused stays so.
    pub fn stop(&mut self) {
        self.consent.stop(self.clock.now);
        self.drop_goal(Revocation::Stopped);
    }

    /// Drops the goal.
    fn drop_goal(&mut self, why: Revocation) {
        self.goals.set = None;
        self.end_motion(Outcome::Revoked(why));
        self.goals.tracking = None;
        self.goals.stream.clear();
        self.status.joint_at_limit = None;
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

    /// Takes joint velocities [rad/s, prismatic: m/s] and an `output`, as [`output`](Self::output) gives it, for its own of the last cycle. So
    /// a replay that begins in the middle of a recording goes on where the recorded servo was. Lists that do not have one number a joint are
    /// of another arm, and are ignored.
    pub fn adopt(&mut self, command: &[f64], output: &[f64]) {
        if [command.len(), output.len()] == [self.output.command.len(); 2] {
            self.output.adopt(command, output);
            self.robot.link.amend_command(command);
        }
    }

    /// Whether no twist is in force, and no motion under way: a goal that comes next begins as from rest.
    pub fn is_idle(&self) -> bool {
        let over = |tracking: &GoalTracking| tracking.recorded.unwrap_or_default().is_end();
        self.twists.jog.is_none() && self.goals.tracking.as_ref().is_none_or(over)
    }

    /// The goal that an arm holds that stands; none where it moves, or may move.
    pub fn held(&self) -> Option<Held> {
        let (tracking, asked) = (self.goals.tracking.as_ref()?, self.consent.asked()?);
        let stands =
            matches!(self.status.state, State::Paused | State::Holding | State::Stalled | State::StaleGoal);
        let is_of_goal = self.twists.jog.is_none() && !matches!(asked.by, Asker::Twist(_));
        (stands && is_of_goal && self.at_rest())
            .then(|| tracking.held(asked.sent, asked.revoked.is_some()))?
    }

    /// Holds that goal, as a recorded servo did where a replay begins. What comes of its motion counts from here on.
    pub fn hold(&mut self, held: &Held) {
        self.goals.tracking = Some(GoalTracking::from_held(held, self.output.command.len()));
        self.consent.hold(held.asker, held.sent, held.revoked);
    }

    /// Whether there is neither a goal nor a twist.
    pub fn is_free(&self) -> bool {
        self.twists.jog.is_none() && self.goals.tracking.is_none()
    }

    /// Puts the servo at rest as one that has sent nothing for a while. Somebody else may have moved the arm meanwhile: one that takes
    /// positions is next sent on from where it then is. A replay needs that where the recorded servo had sent nothing for some cycles,
    /// which a recording of what was sent does not have.
    pub fn stand_anew(&mut self) {
        self.output.stand_anew();
        self.robot.link.stand_anew(self.clock.stepped + Duration::from_secs_f64(self.clock.period));
    }

    /// Whether the arm may move: who asked for it, and what revoked that.
    pub fn consent(&self) -> &Consent {
        &self.consent
    }

    /// The motions of which there is news since this was last asked, the oldest first: each when it begins, when the arm stalls, and when
    /// it ends. Of many that nobody asks for the last [`MOTIONS`](super::MOTIONS) are kept.
    pub fn take_motions(&mut self) -> impl Iterator<Item = Motion> {
        self.goals.motions.news.drain(..)
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
