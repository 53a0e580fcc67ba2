//! What the servo is about to do: nothing, a goal, or a twist. What a goal needs to be watched lives inside it, and ends with it.

use super::error_trend::ErrorTrend;
use super::escape_phase::EscapePhase;
use super::oscillation::Oscillation;
use super::progress::{BRISK, Progress, SHARE};
use super::{
    Asker, Goal, GoalError, MotionMeter, Outcome, Reconfiguration, Reconfigure, STREAM, Stall, Tolerance,
    Twist,
};
use dq_algebra::UnitDualQuaternion;
use dq_kinematics::control::SignMemory;
use serde::{Deserialize, Serialize};
use std::time::Duration;

/// A goal of a stream that has moved by less than this part of the distance that is left is no reason to hope again for an arm that
/// gets no nearer.
const REASON_TO_HOPE: f64 = 0.1;

/// What the servo is about to do.
#[derive(Default, Serialize, Deserialize)]
pub(super) enum Mode {
    /// Nothing: there is neither a goal nor a twist.
    #[default]
    Idle,
    /// To bring the tool to a goal.
    Goal(Box<Pursuit>),
    /// To move the tool by a twist.
    Jog(Jog),
}

impl Mode {
    pub fn pursuit(&self) -> Option<&Pursuit> {
        if let Self::Goal(pursuit) = self { Some(pursuit) } else { None }
    }

    pub fn pursuit_mut(&mut self) -> Option<&mut Pursuit> {
        if let Self::Goal(pursuit) = self { Some(pursuit) } else { None }
    }

    pub fn jog(&self) -> Option<&Jog> {
        if let Self::Jog(jog) = self { Some(jog) } else { None }
    }
}

/// The twist in force.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Jog {
    pub twist: Twist,
    pub publisher: u32,
    pub received: Duration,
}

/// The goal in force and the motion to it.
#[derive(Serialize, Deserialize)]
pub(super) struct Pursuit {
    pub goal: Goal,
    /// The stamp of its message \[ns\], and who sent it.
    pub stamp: i64,
    pub asker: Asker,
    /// When it was last heard of, by a message or from its frame, and by a message.
    pub received: Duration,
    heard: Duration,
    /// The goal with which the motion began, or to which a stream has last moved it: one that is the same within the tolerances is no
    /// other.
    begun: Goal,
    /// When a stream last moved the goal, where one has.
    pub moved: Option<Duration>,
    /// Chosen when the first goal is tracked, by where the arm is then.
    pub sign: Option<SignMemory>,
    /// Whether the goal is farther away than the arm reaches, and under which settings that was found out.
    pub beyond_reach: Option<(u64, bool)>,
    /// Since when it is not known where the frame is with which the goal moves.
    pub lost: Option<Duration>,
    pub record: Record,
    pub watch: Watch,
}

/// What the motion was like so far.
#[derive(Default, Serialize, Deserialize)]
pub(super) struct Record {
    pub meter: Option<MotionMeter>,
    /// When the motion began, and the controlled pose then.
    pub start: Option<(Duration, UnitDualQuaternion)>,
    /// Of each joint its largest speed as a part of its limit.
    pub peak_speeds: Vec<f64>,
    /// When the smallest singular value was last looked at.
    pub looked: Duration,
    /// What was last recorded of the motion.
    pub outcome: Option<Outcome>,
    /// How the error came to be what it is.
    pub trend: ErrorTrend,
    /// Whether the arm is within the tolerances of this goal; it may then leave them a little.
    pub settled: bool,
    /// Whether the arm has set out to another configuration.
    pub reconfigured: bool,
}

impl Record {
    fn new(joint_count: usize) -> Self {
        Self { peak_speeds: vec![0.0; joint_count], ..Self::default() }
    }

    /// Whether the motion has come to its end.
    pub fn is_over(&self) -> bool {
        self.outcome.is_some_and(|outcome| outcome.is_end())
    }
}

/// Watches whether the arm gets nearer, as long as it is driven.
#[derive(Serialize, Deserialize)]
pub(super) struct Watch {
    /// The goal for which it began.
    goal: Goal,
    /// How far the arm was when it was last looked at.
    pub error: GoalError,
    pub progress: Progress,
    /// The same of the law's own error, for an arm that need not wait for a law that creeps.
    pub pace: Progress,
    /// The size of the law's own error.
    pub law_error: f64,
    /// The part of the law's gains that the delay allows.
    pub gain_factor: f64,
    pub escape: EscapePhase,
    /// Why the motion was given up, until there is reason to try again.
    pub stall: Option<Stall>,
    /// What is known of a way round that.
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

    /// Begins anew for `goal`. Only the watch for oscillations goes on: a goal that moves gets here every few cycles.
    fn restart(&mut self, goal: Goal) {
        *self = Self { oscillation: std::mem::take(&mut self.oscillation), ..Self::new(goal) };
    }

    /// Whether `goal`, of a stream, is too near to the one for which this began to be reason to begin anew.
    fn goes_on_for(&self, goal: &Goal, tolerance: &Tolerance) -> bool {
        let reach = Tolerance {
            linear: tolerance.linear.max(REASON_TO_HOPE * self.error.position),
            angular: tolerance.angular.max(REASON_TO_HOPE * self.error.rotation),
        };
        self.goal.is_same(goal, &reach)
    }

    /// Gives the motion up for `stall`, and looks for a way round it where that is wanted and was not done yet.
    pub fn give_up(&mut self, stall: Stall, reconfigure: Reconfigure, now: Duration) {
        self.stall = Some(stall);
        self.oscillation.restart();
        self.reconfiguration = match self.reconfiguration {
            Reconfiguration::Underway(_) => Reconfiguration::Taken,
            Reconfiguration::Unknown if reconfigure != Reconfigure::Never && stall.may_be_gone_round() => {
                Reconfiguration::Searching(now)
            }
            same => same,
        };
    }
}

impl Pursuit {
    /// To `goal`, whose message has that stamp \[ns\] and sender, and could be taken at `received`; of an arm with so many joints.
    pub fn new(goal: Goal, stamp: i64, asker: Asker, received: Duration, joint_count: usize) -> Self {
        Self {
            goal,
            stamp,
            asker,
            received,
            heard: received,
            begun: goal,
            moved: None,
            sign: None,
            beyond_reach: None,
            lost: None,
            record: Record::new(joint_count),
            watch: Watch::new(goal),
        }
    }

    /// Whether a goal that came from `asker` at `now` goes on with this motion: it is of the same stream.
    pub fn streams(&self, asker: Asker, now: Duration) -> bool {
        self.asker == asker && now.saturating_sub(self.heard) <= STREAM
    }

    /// Goes on to `goal` of the same stream, whose message has that stamp \[ns\] and could be taken at `now`.
    pub fn stream_to(&mut self, goal: Goal, stamp: i64, now: Duration, tolerance: &Tolerance) {
        if !self.begun.is_same(&goal, tolerance) {
            (self.begun, self.moved) = (goal, Some(now));
        }
        self.move_to(goal, now, tolerance);
        (self.stamp, self.heard) = (stamp, now);
    }

    /// Takes over from the motion before. Of one that has come to its end nothing is left. Of one that is under way the sign goes on; and
    /// what is the same goal within `tolerance` gives no new hope to an arm that gets no nearer.
    pub fn take_over(&mut self, before: &mut Self, tolerance: &Tolerance) {
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

    /// Moves on to `goal`, where a stream or its frame has taken it by `now`.
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

    /// Begins the motion anew, as `asker` asks for it, of an arm with so many joints.
    pub fn begin_anew(&mut self, asker: Asker, joint_count: usize) {
        let Self { goal, stamp, received, lost, .. } = *self;
        *self = Self { lost, ..Self::new(goal, stamp, asker, received, joint_count) };
    }

    /// Ends a stall, and what was found out since; a reconfiguration that is under way is no stall, and goes on.
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

    /// Whether the arm goes to another configuration.
    pub fn is_reconfiguring(&self) -> bool {
        matches!(self.watch.reconfiguration, Reconfiguration::Underway(_))
    }

    /// The sign chosen for the goal: +1 or −1.
    pub fn sign(&self) -> f64 {
        self.sign.as_ref().map_or(1.0, SignMemory::sign)
    }
}
