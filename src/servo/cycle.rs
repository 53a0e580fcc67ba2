//! The cycle itself.

mod demand;
mod jog;
mod overtaking;
mod passage;
mod pursuit;
mod robot;

use super::limits::Braking;
use super::link::Link;
use super::setpoint::Setpoint;
use super::stopping::Decelerations;
use super::stream::GoalStream;
use super::way_out::WayOut;
use super::{
    Input, Interface, JointOrder, Rearm, Rejection, RejectionCounts, Replaced, Settings, Status, Task,
};
use crate::arm::ArmError;
use crate::dq::UnitDualQuaternion;
use jog::Jog;
use overtaking::Overtaking;
use pursuit::Pursuit;
pub use pursuit::STREAM;
use std::sync::Arc;
use std::time::Duration;

/// The servo: takes joint states, goals and settings as they come, and makes one command a cycle.
pub struct Servo<T: Task> {
    /// Where the arms were measured, where they should be by now, and where a cycle's motion on would take them.
    task: T,
    predicted: T,
    ahead: T,
    link: Link,
    goal_frame: String,
    tool_frame: String,
    settings: Settings<T::Controller>,
    configurations: u64,
    /// Under which of them the goal in the status was last looked at.
    reported: u64,
    period: f64,
    pursuit: Option<Pursuit>,
    jog: Option<Jog>,
    /// The latest event that makes the servo reject goals that came before it and still wait for TF.
    overtaking: Option<Overtaking>,
    /// When the last cycle was.
    stepped: Duration,
    /// The goals of the last moments.
    stream: GoalStream,
    paused: bool,
    /// `~/pause` (false) was called since the last cycle.
    renewed: bool,
    stopping: bool,
    /// The goal was dropped because something else is controlled.
    another_aim: bool,
    way_out: WayOut,
    target: Vec<f64>,
    ahead_positions: Vec<f64>,
    ahead_target: Vec<f64>,
    /// Room for what the tool leaves free.
    free: Vec<f64>,
    command: Vec<f64>,
    command_before: Vec<f64>,
    setpoint: Setpoint,
    /// The arm was driven, or braked: from then on it is sent commands.
    begun: bool,
    decelerations: Decelerations,
    status: Status,
    rejections: Arc<RejectionCounts>,
    replaced: Replaced,
}

impl<T: Task> Servo<T> {
    /// A servo at rest that waits for its first joint states; one cycle a `period`. `joints` are the joint names of each arm;
    /// goals come in `goal_frame`.
    ///
    /// # Errors
    /// [`ArmError::JointCount`] where the joint names or the limits do not fit the task.
    pub fn new(
        mut task: T,
        joints: Vec<JointOrder>,
        goal_frame: &str,
        settings: Settings<T::Controller>,
        period: Duration,
    ) -> Result<Self, ArmError> {
        let expected = task.joint_count();
        let counts = [
            joints.iter().map(|arm| arm.names().len()).sum(),
            settings.limits.joint_velocity.len(),
            settings.limits.joint_acceleration.len(),
            settings.limits.joint_deceleration.len(),
            settings.limits.position.lower.len(),
            settings.limits.position.upper.len(),
        ];
        if let Some(got) = counts.into_iter().find(|count| *count != expected) {
            return Err(ArmError::JointCount { expected, got });
        }
        task.set_tool_offset(&settings.tool_offset);
        let (zeros, kinds) = (vec![0.0; expected], task.joint_kinds());
        Ok(Self {
            predicted: task.clone(),
            ahead: task.clone(),
            task,
            link: Link::new(joints, &kinds, period, settings.interface),
            goal_frame: goal_frame.to_owned(),
            tool_frame: String::new(),
            decelerations: Decelerations::new(&settings.limits),
            settings,
            configurations: 0,
            reported: 0,
            period: period.as_secs_f64(),
            pursuit: None,
            jog: None,
            overtaking: None,
            stepped: Duration::ZERO,
            stream: GoalStream::default(),
            paused: false,
            renewed: false,
            stopping: false,
            another_aim: false,
            way_out: WayOut::new(expected),
            target: zeros.clone(),
            ahead_positions: zeros.clone(),
            ahead_target: zeros.clone(),
            free: zeros.clone(),
            command_before: zeros.clone(),
            command: zeros,
            setpoint: Setpoint::new(kinds),
            begun: false,
            status: Status::default(),
            rejections: Arc::default(),
            replaced: Replaced::default(),
        })
    }

    /// Puts new settings into force from the next cycle on; other ones end a stall. Where something else is controlled from then
    /// on, the goal is dropped: the arms hold until there is another. Another tool goes to the goal of the one before.
    pub fn configure(&mut self, settings: Settings<T::Controller>) {
        if !T::same_aim(&self.settings.controller, &settings.controller) {
            // The goal was meant for what was controlled then; towards it as something else nobody has asked to move.
            self.another_aim |= self.pursuit.is_some();
            self.drop_goal(self.stepped, Rearm::AnotherAim);
        }
        if self.settings.tool_offset != settings.tool_offset {
            self.take_tool(&settings.tool_offset);
        }
        if self.settings != settings {
            self.pursuit.iter_mut().for_each(Pursuit::try_again);
        }
        self.settings = settings;
        self.configurations += 1;
    }

    /// Puts the tool elsewhere: with it another motion begins, to the same goal.
    fn take_tool(&mut self, tool_offset: &UnitDualQuaternion) {
        for task in [&mut self.task, &mut self.predicted, &mut self.ahead] {
            task.set_tool_offset(tool_offset);
        }
        if let Some(pursuit) = &mut self.pursuit {
            pursuit.begin_anew();
            self.status.goal_count += 1;
        }
    }

    /// Decelerates and holds, or goes on from the measured state: after a stall, and after an absence of the robot, too.
    pub fn pause(&mut self, paused: bool) {
        self.renewed |= !paused;
        self.paused = paused;
        self.pursuit.iter_mut().for_each(Pursuit::try_again);
    }

    /// Decelerates to rest and drops the goal; a twist moves the arm only once it has ceased. A servo that is paused stays so.
    pub fn stop(&mut self) {
        self.drop_goal(self.stepped, Rearm::Stopped);
        self.jog.iter_mut().for_each(|jog| jog.bar(Rearm::Stopped));
        self.another_aim = false;
        self.stopping = true;
    }

    /// Drops the goal, with those up to that time whose frames are still to be found.
    fn drop_goal(&mut self, until: Duration, why: Rearm) {
        self.overtake(until, until, why);
        self.pursuit = None;
        self.stream.clear();
        self.status.joint_at_limit = None;
    }

    /// Whether the last command was zero for every joint.
    pub fn at_rest(&self) -> bool {
        self.command.iter().all(|speed| *speed == 0.0)
    }

    /// The last joint velocity command [rad/s].
    pub fn command(&self) -> &[f64] {
        &self.command
    }

    /// What is sent to the robot in this cycle: velocities [rad/s] or positions \[rad\], by its [`Interface`]; none before the arm was
    /// driven, as what nobody has asked for might be a motion for a controller of another kind, and none to an arm that takes
    /// positions and was elsewhere since.
    pub fn output(&self) -> Option<&[f64]> {
        match self.settings.interface {
            Interface::Velocity => self.begun.then_some(self.command.as_slice()),
            Interface::Position | Interface::Trajectory => self.setpoint.get(),
        }
    }

    /// Goes on from where a servo at rest was that sent `output`, as [`output`](Self::output).
    pub fn resume(&mut self, output: &[f64]) {
        self.begun = true;
        if self.settings.interface.takes_positions() {
            self.setpoint.anchor(output);
        }
    }

    /// Becomes a servo that stood for a while and sent nothing, so that an arm that takes positions is sent on from where it is, and may
    /// have been moved by somebody else: as it was recorded.
    pub fn stand_anew(&mut self) {
        self.setpoint.release();
        self.command.fill(0.0);
        self.command_before.fill(0.0);
        self.link.stand_anew(self.stepped + Duration::from_secs_f64(self.period));
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
        &self.replaced
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

    /// One cycle at time `now`: the next command, by what is known then.
    ///
    /// # Errors
    /// None in practice: the counts were checked when the servo was made.
    pub fn step(&mut self, now: Duration) -> Result<&[f64], ArmError> {
        let elapsed = now.saturating_sub(std::mem::replace(&mut self.stepped, now));
        self.look_at_robot(now);
        self.watch_jog(now);
        self.task.evaluate(self.link.measured())?;
        self.status.latency = self.link.latency(self.settings.latency);
        self.watch_setpoint(now);
        let (standing, reason) = self.reason_to_stand(now);
        self.target.fill(0.0);
        if self.at_rest() {
            // A motion begins with what is seen of the goal from then on: with that a recorded one can be repeated.
            self.stream.clear();
        }
        if standing.is_none() {
            self.predicted.evaluate(self.link.predicted())?;
        }
        let error = self.pursue(now, standing.is_none())?;
        if standing.is_none() {
            self.jog();
        }
        self.set_command(standing.is_none());
        self.move_setpoint(standing.is_none(), elapsed);
        self.link.command(now, &self.command);
        let arrived = self.measure(now, error);
        self.status.state = standing.unwrap_or(self.driving_state(arrived));
        self.status.reason = reason;
        self.watch_progress(now, error)?;
        self.report_goal();
        self.status.input = match (&self.jog, &self.pursuit) {
            (Some(_), _) => Input::Twist,
            (None, Some(_)) => Input::Goal,
            (None, None) => Input::None,
        };
        let watch = self.pursuit.as_ref().map(|pursuit| &pursuit.watch);
        self.status.stall = watch.and_then(|watch| watch.stall);
        self.status.leaving_singularity =
            standing.is_none() && watch.is_some_and(|watch| watch.passage.is_leaving());
        self.stopping &= !self.at_rest();
        Ok(&self.command)
    }

    /// Has the goal in force in the status, and whether it is beyond reach: found out anew for another goal and under other settings only.
    fn report_goal(&mut self) {
        let goal = self.pursuit.as_ref().map(|pursuit| pursuit.goal);
        if (goal, self.configurations) != (self.status.goal, self.reported) {
            let point = goal.map(|goal| goal.base_from_goal().translation());
            self.status.goal_beyond_reach = point.is_some_and(|point| self.beyond_reach(&point).is_some());
            (self.status.goal, self.reported) = (goal, self.configurations);
        }
    }

    /// Moves the command on, towards the target where the arm is `driven`, else to rest.
    fn set_command(&mut self, driven: bool) {
        let (limits, period, delay) = (&self.settings.limits, self.period, self.link.delay());
        self.decelerations.update(limits, &self.command_before, &self.command);
        self.command_before.copy_from_slice(&self.command);
        let (command, before) = (&mut self.command, &self.command_before);
        if driven {
            let predicted = self.link.predicted();
            let decelerations = self.decelerations.each();
            limits.approach(command, &self.target, decelerations, period);
            limits.brake(command, before, predicted, &Braking { decelerations, period, delay });
            limits.brake_tool(&self.predicted.tool_speed(command), command, before, decelerations, period);
        } else {
            self.decelerations.stop(command, period);
        }
        self.replaced.guard(command, before, limits, &self.decelerations, period);
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
