//! The cycle itself.

mod escape_phase;
mod goals;
mod jog;
mod robot;
mod tracking;

use super::escape::Escape;
use super::filters::{Decelerations, Filters, Given, Towards};
use super::link::Link;
use super::setpoint::Setpoint;
use super::settings_error::check_length;
use super::sticks::Sticks;
use super::stream::GoalStream;
use super::{
    Asker, Consent, GoalError, Input, Interface, JointOrder, Motion, MotionLog, Outcome, Reason, Rejection,
    RejectionCounts, Replaced, Revocation, Settings, SettingsError, State, Status, Task,
};
use crate::arm::ArmError;
use crate::dq::UnitDualQuaternion;
use jog::Jog;
use std::sync::Arc;
use std::time::Duration;
pub use tracking::STREAM;
use tracking::{GoalTracking, Tracked};

/// The servo: takes joint states, goals and settings as they come, and makes one command a cycle.
///
/// Once a cycle [`cycle`](Self::cycle) is called with all that has come, or else [`step`](Self::step) after what takes each thing by
/// itself; then the robot is to be sent what [`output`](Self::output) gives, and nothing where that gives none.
pub struct Servo<T: Task> {
    /// Where the arms were measured, and where they should be by now.
    task: T,
    predicted: T,
    link: Link,
    goal_frame: String,
    tool_frame: String,
    settings: Settings<T::Controller>,
    configurations: u64,
    /// Under which of them the goal in the status was last looked at.
    reported: u64,
    period: f64,
    consent: Consent,
    tracking: Option<GoalTracking>,
    jog: Option<Jog>,
    sticks: Sticks,
    /// The time of what comes now.
    clock: Duration,
    /// When the last cycle was.
    stepped: Duration,
    /// The goals of the last moments.
    stream: GoalStream,
    /// Motions of which there is news.
    motions: MotionLog<T::Controller>,
    escape: Escape<T>,
    /// What is wanted, and what filters make of it: the command.
    velocity: Vec<f64>,
    command: Vec<f64>,
    filters: Filters<T>,
    decelerations: Decelerations,
    setpoint: Setpoint,
    /// The arm was driven, or braked: from then on it is sent commands.
    begun: bool,
    status: Status,
    rejections: Arc<RejectionCounts>,
}

impl<T: Task> Servo<T> {
    /// A servo at rest that waits for its first joint states; one cycle a `period`. `joints` are the joint names of each arm;
    /// goals come in `goal_frame`. Twists in the tool's own frame are taken where [`with_tool_frame`](Self::with_tool_frame) names it.
    ///
    /// # Errors
    /// [`SettingsError`] where the joint names or a list in the settings does not have one entry a joint, or a limit is no number or below 0.
    pub fn new(
        mut task: T,
        joints: Vec<JointOrder>,
        goal_frame: &str,
        settings: Settings<T::Controller>,
        period: Duration,
    ) -> Result<Self, SettingsError> {
        let expected = task.joint_count();
        check_length("joints", joints.iter().map(|arm| arm.names().len()).sum(), expected)?;
        settings.check(expected, settings.interface)?;
        task.set_tool_offset(&settings.tool_offset);
        let (zeros, kinds) = (vec![0.0; expected], task.joint_kinds());
        Ok(Self {
            predicted: task.clone(),
            escape: Escape::new(task.clone()),
            filters: Filters::new(&task),
            task,
            link: Link::new(joints, &kinds, period, settings.interface),
            goal_frame: goal_frame.to_owned(),
            tool_frame: String::new(),
            decelerations: Decelerations::new(&settings.limits),
            settings,
            configurations: 0,
            reported: 0,
            period: period.as_secs_f64(),
            consent: Consent::default(),
            tracking: None,
            jog: None,
            sticks: Sticks::default(),
            clock: Duration::ZERO,
            stepped: Duration::ZERO,
            stream: GoalStream::default(),
            motions: MotionLog::default(),
            velocity: zeros.clone(),
            command: zeros,
            setpoint: Setpoint::new(kinds),
            begun: false,
            status: Status::default(),
            rejections: Arc::default(),
        })
    }

    /// Puts new settings into force from the next cycle on; other ones end a stall. Another tool, or something else that is controlled,
    /// revokes the consent: nobody has asked to move that.
    ///
    /// # Errors
    /// [`SettingsError`] where [`new`](Self::new) would not take them either, or they are for commands of another kind; those in force stay.
    pub fn configure(&mut self, settings: Settings<T::Controller>) -> Result<(), SettingsError> {
        settings.check(self.task.joint_count(), self.settings.interface)?;
        if !T::same_aim(&self.settings.controller, &settings.controller) {
            self.revoke_motion(Revocation::AnotherAim);
        }
        if self.settings.tool_offset != settings.tool_offset {
            self.task.set_tool_offset(&settings.tool_offset);
            self.predicted.set_tool_offset(&settings.tool_offset);
            self.escape.set_tool_offset(&settings.tool_offset);
            self.filters.set_tool_offset(&settings.tool_offset);
            self.revoke_motion(Revocation::AnotherTool);
        }
        if self.settings != settings {
            self.tracking.iter_mut().for_each(GoalTracking::try_again);
        }
        self.settings = settings;
        self.configurations += 1;
        Ok(())
    }

    /// Revokes what was asked for until now, as what moves, or is to, is another thing from now on.
    fn revoke_motion(&mut self, why: Revocation) {
        self.consent.revoke_present(self.clock, why);
        // What was set is answered before the cycle takes it, so that a goal in the same cycle may have been sent after that.
        self.consent.revoke_before(self.stepped, self.clock, why);
        self.end_motion(Outcome::Revoked(why));
        self.tracking.iter_mut().for_each(GoalTracking::forget_motion);
    }

    /// Decelerates and holds, or asks for the goal in force once more and goes on from the measured state.
    pub fn pause(&mut self, paused: bool) {
        if paused {
            self.consent.pause();
        } else if self.consent.resume(self.clock)
            && let Some(tracking) = &mut self.tracking
        {
            tracking.begin_anew(Asker::Resume, self.command.len());
            self.status.goal_count += 1;
        }
        self.tracking.iter_mut().for_each(GoalTracking::try_again);
    }

    /// Decelerates to rest and drops the goal; a stick that is held must be let go of. A servo that is paused stays so.
    pub fn stop(&mut self) {
        self.consent.stop(self.clock);
        self.drop_goal(Revocation::Stopped);
    }

    /// Drops the goal.
    fn drop_goal(&mut self, why: Revocation) {
        self.end_motion(Outcome::Revoked(why));
        self.tracking = None;
        self.stream.clear();
        self.status.joint_at_limit = None;
    }

    /// What comes from here on comes at `now`.
    pub(super) fn begin(&mut self, now: Duration) {
        self.clock = now;
    }

    /// Whether the last command was zero for every joint.
    pub fn at_rest(&self) -> bool {
        self.command.iter().all(|speed| *speed == 0.0)
    }

    /// The last joint velocity command [rad/s, prismatic: m/s]. What is to be sent is [`output`](Self::output).
    pub fn command(&self) -> &[f64] {
        &self.command
    }

    /// What is to be sent to the robot after this cycle, joint after joint: velocities [rad/s, prismatic: m/s] or positions
    /// \[rad, prismatic: m\], by its [`Interface`]. Where it is none, nothing is to be sent: before the arm was driven, as what nobody has
    /// asked for might be a motion for a controller of another kind, and to an arm that takes positions and was elsewhere since.
    pub fn output(&self) -> Option<&[f64]> {
        match self.settings.interface {
            Interface::Velocity => self.begun.then_some(self.command.as_slice()),
            Interface::Position | Interface::Trajectory => self.setpoint.get(),
        }
    }

    /// Takes joint velocities [rad/s, prismatic: m/s] and an `output`, as [`output`](Self::output) gives it, for its own of the last cycle. So
    /// a replay that begins in the middle of a recording goes on where the recorded servo was. Lists that do not have one number a joint are
    /// of another arm, and are ignored.
    pub fn adopt(&mut self, command: &[f64], output: &[f64]) {
        if [command.len(), output.len()] != [self.command.len(); 2] {
            return;
        }
        self.begun = true;
        self.command.copy_from_slice(command);
        self.link.amend_command(command);
        if self.settings.interface.takes_positions() {
            self.setpoint.place(output);
        }
    }

    /// Whether no motion is under way, and no twist in force: a goal that comes next begins as from rest.
    pub fn is_idle(&self) -> bool {
        let ended = |tracking: &GoalTracking| tracking.recorded.is_some_and(|outcome| outcome.is_end());
        self.jog.is_none() && self.tracking.as_ref().is_none_or(ended)
    }

    /// Whether there is neither a goal nor a twist.
    pub fn is_free(&self) -> bool {
        self.jog.is_none() && self.tracking.is_none()
    }

    /// Puts the servo at rest as one that has sent nothing for a while. Somebody else may have moved the arm meanwhile: one that takes
    /// positions is next sent on from where it then is. A replay needs that where the recorded servo had sent nothing for some cycles,
    /// which a recording of what was sent does not have.
    pub fn stand_anew(&mut self) {
        self.setpoint.release();
        self.command.fill(0.0);
        self.link.stand_anew(self.stepped + Duration::from_secs_f64(self.period));
    }

    /// Whether the arm may move: who asked for it, and what revoked that.
    pub fn consent(&self) -> &Consent {
        &self.consent
    }

    /// The motions of which there is news since this was last asked, the oldest first: each when it begins, when the arm stalls, and when
    /// it ends. Of many that nobody asks for the last [`MOTIONS`](super::MOTIONS) are kept.
    pub fn take_motions(&mut self) -> impl Iterator<Item = Motion<T::Controller>> {
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
        self.filters.replaced()
    }

    /// How often the settings were changed.
    pub fn configurations(&self) -> u64 {
        self.configurations
    }

    /// The settings in force.
    pub fn settings(&self) -> &Settings<T::Controller> {
        &self.settings
    }

    /// The controlled pose at the last joint state; none before the first.
    pub fn pose(&self) -> Option<UnitDualQuaternion> {
        self.link.received().map(|_| self.task.pose())
    }

    /// The smallest singular value of the Jacobian of what is controlled, at the joint state of the last cycle.
    pub fn smallest_singular_value(&self) -> f64 {
        self.task.smallest_singular_value(&self.settings.controller)
    }

    /// One cycle at time `now`: the next command, by what is known then. It returns the joint velocities [rad/s, prismatic: m/s]; what is to
    /// be sent to the arm is not these but [`output`](Self::output).
    ///
    /// # Errors
    /// None in practice: [`new`](Self::new) and [`configure`](Self::configure) have checked that all lists have one entry a joint.
    pub fn step(&mut self, now: Duration) -> Result<&[f64], ArmError> {
        let elapsed = now.saturating_sub(std::mem::replace(&mut self.stepped, now));
        self.clock = now;
        self.look_at_robot(now);
        self.watch_jog(now);
        self.task.evaluate(self.link.measured())?;
        self.watch_setpoint(now);
        let (standing, reason) = self.reason_to_stand(now);
        if self.at_rest() {
            // A motion begins with what is seen of the goal from then on: with that a recorded one can be repeated.
            self.stream.clear();
        }
        let tracked = self.track(now);
        let driven = standing.is_none();
        if driven {
            self.want(now, tracked.as_ref())?;
        }
        self.set_command(driven, tracked.as_ref());
        self.move_setpoint(driven, elapsed);
        self.link.command(now, &self.command);
        self.report(now, (standing, reason), tracked.map(|tracked| tracked.error))?;
        if self.at_rest() {
            self.consent.stand();
        }
        self.status.consent = self.consent;
        Ok(&self.command)
    }

    /// The velocity that is wanted, by the twist or by the law, where the arm is when the command reaches it.
    fn want(&mut self, now: Duration, tracked: Option<&Tracked>) -> Result<(), ArmError> {
        self.predicted.evaluate(self.link.predicted())?;
        match (self.jog, tracked) {
            (Some(jog), _) => self.obey(&jog.twist),
            (None, Some(tracked)) => self.obey_law(now, tracked)?,
            (None, None) => self.velocity.fill(0.0),
        }
        Ok(())
    }

    /// Makes the next command of what is wanted where the arm is `driven`; else the arm comes to rest.
    fn set_command(&mut self, driven: bool, tracked: Option<&Tracked>) {
        self.decelerations.update(&self.settings.limits, &self.command);
        let escapes = self.tracking.as_ref().is_some_and(|tracking| tracking.watch.escape.is_escaping());
        let goal = tracked.filter(|_| self.jog.is_none()).map(|tracked| Towards {
            pose: tracked.goal,
            moving: tracked.moving.filter(|_| !escapes),
            gain_factor: self.status.gain_factor,
            escape: escapes.then_some(&self.escape.direction),
        });
        let given = Given {
            settings: &self.settings,
            task: &self.predicted,
            positions: self.link.predicted(),
            goal,
            link: &self.link,
            before: &self.command,
            decelerations: &self.decelerations,
            period: self.period,
        };
        if driven {
            self.filters.drive(&given, &mut self.velocity);
            self.status.joint_at_limit = self.filters.held_back().map(|joint| joint + 1);
            let way = self.period * self.escape.direction.along(&self.velocity);
            self.tracking.iter_mut().for_each(|tracking| tracking.watch.escape.travel(way));
        } else {
            self.filters.stop(&given, &mut self.velocity);
        }
        std::mem::swap(&mut self.command, &mut self.velocity);
    }

    /// Says what the cycle did, and watches what became of the motion.
    fn report(
        &mut self,
        now: Duration,
        (standing, reason): (Option<State>, Option<Reason>),
        error: Option<GoalError>,
    ) -> Result<(), ArmError> {
        let arrived = self.measure(now, error);
        self.status.latency = self.link.latency(self.settings.latency);
        self.status.state = standing.unwrap_or(self.driving_state(arrived));
        self.status.too_far = self.link.too_far(now);
        self.status.reason = reason;
        self.watch_progress(now, error)?;
        self.record_motion(now);
        self.report_goal();
        self.status.input = match (&self.jog, &self.tracking) {
            (Some(_), _) => Input::Twist,
            (None, Some(_)) => Input::Goal,
            (None, None) => Input::None,
        };
        let watch = self.tracking.as_ref().map(|tracking| &tracking.watch);
        self.status.stall = watch.and_then(|watch| watch.stall);
        self.status.leaving_singularity =
            standing.is_none() && watch.is_some_and(|watch| watch.escape.is_escaping());
        Ok(())
    }

    /// Has the goal in force in the status, and whether it is beyond reach: found out anew for another goal and under other settings only.
    fn report_goal(&mut self) {
        let goal = self.tracking.as_ref().map(|tracking| tracking.goal);
        if (goal, self.configurations) != (self.status.goal, self.reported) {
            let point = goal.map(|goal| goal.base_from_goal().translation());
            self.status.goal_beyond_reach = point.is_some_and(|point| self.beyond_reach(&point).is_some());
            (self.status.goal, self.reported) = (goal, self.configurations);
        }
        self.status.goal_stamp = self.tracking.as_ref().map_or(0, |tracking| tracking.stamp);
    }

    /// Moves on where an arm that takes positions is sent, `elapsed` after the cycle before; one that is `driven` begins where it is.
    fn move_setpoint(&mut self, driven: bool, elapsed: Duration) {
        self.begun |= driven || !self.at_rest();
        if self.settings.interface.takes_positions() {
            if driven {
                self.setpoint.anchor(self.link.measured());
            }
            let cycles = (elapsed.as_secs_f64() / self.period).round().max(1.0);
            self.setpoint.advance(&self.command, &self.settings.limits.position, self.period, cycles);
        }
    }

    /// Counts a rejection.
    pub(super) fn counted<V>(&mut self, result: Result<V, Rejection>) -> Result<V, Rejection> {
        result.inspect_err(|rejection| Arc::make_mut(&mut self.rejections).count(rejection))
    }
}
