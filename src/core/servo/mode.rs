//! What the servo is doing: idle, moving to a goal, or following a twist. Each variant of `Mode` owns the state that its monitoring
//! needs, so this state ends with the mode.

use super::error_trend::ErrorTrend;
use super::escape_phase::EscapePhase;
use super::oscillation::Oscillation;
use super::progress::{BRISK, Progress, SHARE};
use super::{Goal, Outcome, Reconfiguration, Reconfigure, Requester, STREAM, Stall, Twist};
use dq_algebra::UnitDualQuaternion;
use dq_kinematics::control::SignMemory;
use dq_metrics::{GoalError, MotionMeter, Tolerance};
use serde::{Deserialize, Serialize};
use std::time::Duration;

/// The next goal of a stream restarts the monitoring of progress only if it has moved by more than this fraction of the remaining
/// error.
const LEAST_MOTION: f64 = 0.1;

/// What the servo is doing.
#[derive(Default, Serialize, Deserialize)]
pub(super) enum Mode {
    /// Idle: there is neither a goal nor a twist.
    #[default]
    Idle,
    /// Moving the tool to a goal.
    Goal(Box<Pursuit>),
    /// Moving the tool by a twist.
    Jog(Jog),
}

impl Mode {
    pub fn pursuit(&self) -> Option<&Pursuit> {
        if let Self::Goal(pursuit) = self { Some(pursuit) } else { None }
    }

    /// Returns the pursuit of a goal to which the law moves the arm. Returns `None` if the arm moves along the joint line instead.
    pub fn law_pursuit(&self) -> Option<&Pursuit> {
        self.pursuit().filter(|pursuit| !pursuit.follows_joint_line())
    }

    pub fn pursuit_mut(&mut self) -> Option<&mut Pursuit> {
        if let Self::Goal(pursuit) = self { Some(pursuit) } else { None }
    }

    pub fn jog(&self) -> Option<&Jog> {
        if let Self::Jog(jog) = self { Some(jog) } else { None }
    }
}

/// The current twist.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Jog {
    pub twist: Twist,
    pub publisher: u32,
    pub received: Duration,
}

/// The current goal and the motion to it.
#[derive(Serialize, Deserialize)]
pub(super) struct Pursuit {
    pub goal: Goal,
    /// Whether the goal is joint positions, which are the end of the joint line. `goal` is then the pose at these positions.
    pub by_joints: bool,
    /// The stamp of the goal's last message \[ns\].
    pub stamp: i64,
    /// The sender of the request.
    pub asker: Requester,
    /// When a message or the goal's frame last updated the goal.
    pub received: Duration,
    /// When the goal's last message arrived.
    heard: Duration,
    /// The goal with which the motion began. If a stream moves the goal away from `begun` by more than the tolerances, the moved goal
    /// replaces `begun`.
    begun: Goal,
    /// When a moved goal last replaced `begun`; `None` if none has.
    pub moved: Option<Duration>,
    /// The joint positions at which the motion began \[rad, prismatic: m\]. A motion that directly follows another one takes over its
    /// positions; see [`take_over`](Self::take_over). Empty until the servo first tracks the goal, and after a reconfiguration until
    /// the servo tracks the goal again.
    pub posture: Vec<f64>,
    /// The sign of the goal's quaternion. The servo chooses the sign by the arm's pose when it first tracks the goal; `None` before
    /// that.
    pub sign: Option<SignMemory>,
    /// The result of the reach check; `None` until the servo has checked this goal. The first entry is the value of
    /// [`configurations`](super::Servo::configurations) at the time of the check. The second entry is true if the goal is beyond reach.
    pub beyond_reach: Option<(u64, bool)>,
    /// Since when TF has lacked the frame with which the goal moves; `None` if TF has the frame.
    pub lost: Option<Duration>,
    pub record: Record,
    pub watch: Watch,
}

/// The record of the motion so far.
#[derive(Default, Serialize, Deserialize)]
pub(super) struct Record {
    pub meter: Option<MotionMeter>,
    /// When the motion began, and the controlled pose at that time; `None` until the servo has measured the pose.
    pub start: Option<(Duration, UnitDualQuaternion)>,
    /// The largest commanded speed of each joint so far, as a fraction of its limit.
    pub peak_speeds: Vec<f64>,
    /// When the smallest singular value was last computed.
    pub looked: Duration,
    /// The last recorded outcome of the motion; `None` before the first.
    pub outcome: Option<Outcome>,
    /// The recent errors.
    pub trend: ErrorTrend,
    /// Whether the arm has settled. A settled arm remains settled if it exceeds the tolerances only a little.
    pub settled: bool,
    /// Whether the arm has started a reconfiguration.
    pub reconfigured: bool,
}

impl Record {
    fn new(joint_count: usize) -> Self {
        Self { peak_speeds: vec![0.0; joint_count], ..Self::default() }
    }

    /// Returns whether the motion has ended, by its last recorded outcome.
    pub fn is_over(&self) -> bool {
        self.outcome.is_some_and(|outcome| outcome.is_end())
    }
}

/// Monitors whether a driven arm gets nearer to its goal.
#[derive(Serialize, Deserialize)]
pub(super) struct Watch {
    /// The goal for which the monitoring began.
    goal: Goal,
    /// The error of the arm in the last cycle.
    pub error: GoalError,
    pub progress: Progress,
    /// Like `progress`, but the law's error must shrink by the larger fraction [`BRISK`](super::progress::BRISK). If it shrinks
    /// more slowly, a reconfiguration may be better than the law.
    pub pace: Progress,
    /// The size of the error that the law feeds back.
    pub law_error: f64,
    /// The fraction of the law's gains that the delay allows.
    pub gain_factor: f64,
    pub escape: EscapePhase,
    /// The reason why the motion has stalled; `None` if the motion has not stalled.
    pub stall: Option<Stall>,
    /// Information about another configuration in which the goal can be reached.
    pub reconfiguration: Reconfiguration,
    pub oscillation: Oscillation,
}

impl Watch {
    fn new(goal: Goal) -> Self {
        Self {
            goal,
            error: GoalError::default(),
            progress: Progress::new(SHARE),
            pace: Progress::new(BRISK),
            law_error: 0.0,
            gain_factor: 1.0,
            escape: EscapePhase::default(),
            stall: None,
            reconfiguration: Reconfiguration::Unknown,
            oscillation: Oscillation::default(),
        }
    }

    /// Restarts the monitoring for `goal`, except the monitoring of oscillations: a moving goal causes a restart every few cycles,
    /// and oscillations take longer to detect.
    fn restart(&mut self, goal: Goal) {
        *self = Self { oscillation: std::mem::take(&mut self.oscillation), ..Self::new(goal) };
    }

    /// Returns whether the monitoring continues for `goal`, the next goal of a stream. It does if `goal` is near the goal for which
    /// the monitoring began.
    fn goes_on_for(&self, goal: &Goal, tolerance: &Tolerance) -> bool {
        let reach = Tolerance {
            linear: tolerance.linear.max(LEAST_MOTION * self.error.position),
            angular: tolerance.angular.max(LEAST_MOTION * self.error.rotation),
        };
        self.goal.is_same(goal, &reach)
    }

    /// Stalls the motion for the reason `stall`. If `reconfigure` allows it, starts a search for another configuration, unless the
    /// motion has already searched.
    pub fn give_up(&mut self, stall: Stall, reconfigure: Reconfigure, now: Duration) {
        self.stall = Some(stall);
        self.oscillation.restart();
        self.reconfiguration = match self.reconfiguration {
            Reconfiguration::Underway(_) => Reconfiguration::Taken,
            Reconfiguration::Unknown
                if reconfigure != Reconfigure::Never && stall.allows_reconfiguration() =>
            {
                Reconfiguration::Searching(now)
            }
            same => same,
        };
    }
}

impl Pursuit {
    /// Creates a motion to `goal`, received at `received` from `asker` in a message with time stamp `stamp` \[ns\].
    pub fn new(goal: Goal, stamp: i64, asker: Requester, received: Duration, joint_count: usize) -> Self {
        Self {
            goal,
            by_joints: false,
            stamp,
            asker,
            received,
            heard: received,
            begun: goal,
            moved: None,
            posture: Vec::with_capacity(joint_count),
            sign: None,
            beyond_reach: None,
            lost: None,
            record: Record::new(joint_count),
            watch: Watch::new(goal),
        }
    }

    /// Returns whether a goal received from `asker` at `now` belongs to the stream of this motion, and so continues the motion.
    pub fn streams(&self, asker: Requester, now: Duration) -> bool {
        self.asker == asker && now.saturating_sub(self.heard) <= STREAM
    }

    /// Continues to the next `goal` of the stream, received at `now` with time stamp `stamp` \[ns\].
    pub fn stream_to(&mut self, goal: Goal, stamp: i64, now: Duration, tolerance: &Tolerance) {
        if !self.begun.is_same(&goal, tolerance) {
            (self.begun, self.moved) = (goal, Some(now));
        }
        self.move_to(goal, now, tolerance);
        (self.stamp, self.heard) = (stamp, now);
    }

    /// Takes over state from the previous motion `before`:
    ///
    /// - always: the posture, so that the arm does not drift from goal to goal,
    /// - if `before` has not ended: the quaternion sign, and the monitoring of oscillations,
    /// - if, in addition, the goal is the same within `tolerance`: the monitoring of progress.
    pub fn take_over(&mut self, before: &mut Self, tolerance: &Tolerance) {
        std::mem::swap(&mut self.posture, &mut before.posture);
        if before.record.is_over() {
            return;
        }
        let carried =
            |sign: &SignMemory| sign.carried(before.goal.base_from_goal(), self.goal.base_from_goal());
        self.sign = before.sign.as_ref().map(carried);
        std::mem::swap(&mut self.watch.oscillation, &mut before.watch.oscillation);
        if before.begun.is_same(&self.goal, tolerance) {
            std::mem::swap(&mut self.watch, &mut before.watch);
            self.record.reconfigured = self.is_reconfiguring();
        }
    }

    /// Moves the goal to the pose `goal`, because the stream or the goal's frame has moved it at `now`.
    pub fn move_to(&mut self, goal: Goal, now: Duration, tolerance: &Tolerance) {
        let carried = |sign: &SignMemory| sign.carried(self.goal.base_from_goal(), goal.base_from_goal());
        self.sign = self.sign.as_ref().map(carried);
        self.record.settled &= self.goal == goal;
        if self.goal != goal {
            self.beyond_reach = None;
            self.record.trend.restart();
        }
        (self.goal, self.received, self.lost) = (goal, now, None);
        if !self.watch.goes_on_for(&goal, tolerance) {
            self.watch.restart(goal);
        }
    }

    /// Restarts the motion on a request of `asker`.
    pub fn restart_motion(&mut self, asker: Requester, joint_count: usize) {
        let Self { goal, by_joints, stamp, received, lost, .. } = *self;
        *self = Self { by_joints, lost, ..Self::new(goal, stamp, asker, received, joint_count) };
    }

    /// Ends a stall, and restarts the monitoring. A reconfiguration that is under way continues.
    pub fn try_again(&mut self) {
        let (underway, law_error, error) =
            (self.watch.reconfiguration, self.watch.law_error, self.watch.error);
        let gain_factor = self.watch.gain_factor;
        self.watch.restart(self.watch.goal);
        (self.watch.law_error, self.watch.error, self.watch.gain_factor) = (law_error, error, gain_factor);
        if matches!(underway, Reconfiguration::Underway(_)) {
            self.watch.reconfiguration = underway;
        }
    }

    /// Returns whether the arm is moving to another configuration.
    pub fn is_reconfiguring(&self) -> bool {
        matches!(self.watch.reconfiguration, Reconfiguration::Underway(_))
    }

    /// Returns whether the arm moves along the joint line, and not by the law.
    pub fn follows_joint_line(&self) -> bool {
        self.by_joints || self.is_reconfiguring()
    }

    /// Returns the sign chosen for the goal's quaternion: +1 or −1.
    pub fn sign(&self) -> f64 {
        self.sign.as_ref().map_or(1.0, SignMemory::sign)
    }
}
