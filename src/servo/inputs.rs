//! One cycle from what came for it to its command. A node feeds it live, a replay from a bag, a test from a list: only the source,
//! the clock and what becomes of the command differ.

use super::{ArmFigures, JointReading, Rejection, Sent, Servo, Settings, Task};
use crate::arm::ArmError;
use std::time::Duration;

/// What is asked of a servo between two cycles.
#[derive(Clone, Debug, PartialEq)]
pub enum Request<C> {
    /// [`Servo::configure`].
    Configure(Box<Settings<C>>),
    /// [`Servo::pause`]; a request to go on that was under way for longer than `rearm_timeout` is rejected.
    Pause {
        /// Whether to pause, or to go on.
        paused: bool,
        /// How long it was under way.
        ago: Duration,
    },
    /// [`Servo::stop`].
    Stop,
}

/// A goal as it came.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GoalReading<'a> {
    /// Position \[m\].
    pub position: [f64; 3],
    /// Orientation (x, y, z, w).
    pub orientation_xyzw: [f64; 4],
    /// The frame that both are in; empty for the servo's own.
    pub frame_id: &'a str,
    /// When its sender says that it holds \[ns\]; 0 where it does not say.
    pub stamp: i64,
    /// For how long it has waited, since it came, until its frame was found.
    pub waited: Duration,
    /// By whom it was sent, and how long before it came.
    pub sent: Sent,
}

/// What has become of the goal in force, which moves with its frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum GoalMotion<'a> {
    /// The frame has taken it there.
    To(GoalReading<'a>),
    /// It is not known any more where the frame is.
    Lost,
}

/// A twist as it came.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TwistReading<'a> {
    /// Velocity of the tool point [m/s].
    pub linear: [f64; 3],
    /// Angular velocity of the tool [rad/s].
    pub angular: [f64; 3],
    /// The frame along whose axes both are; empty for the servo's own.
    pub frame_id: &'a str,
    /// By whom it was sent, and how long before it came.
    pub sent: Sent,
}

/// Where the inputs of cycles come from. Each method gives what has come since the cycle before, in the order in which it came,
/// and learns at once what the servo makes of it; a message that cannot be decoded is given as its [`Rejection`].
pub trait Source<C> {
    /// Gives what was asked of the servo; `ask` fails where that is not taken.
    fn requests(&mut self, ask: impl FnMut(Request<C>) -> Result<(), Rejection>);

    /// Gives the joint states of the arm number `arm`; `take` is [`Servo::take_joint_state`].
    fn joint_states(
        &mut self,
        arm: usize,
        take: impl FnMut(Result<&JointReading, Rejection>) -> Result<bool, Rejection>,
    );

    /// Gives the goals; `take` is [`Servo::take_stamped_goal`].
    fn goals(&mut self, take: impl FnMut(Result<GoalReading, Rejection>) -> Result<(), Rejection>);

    /// Gives what has become of the goal that moves with its frame; `take` is [`Servo::move_goal`].
    fn goal_motions(&mut self, _take: impl FnMut(GoalMotion)) {}

    /// Gives the twists; `take` is [`Servo::take_twist`].
    fn twists(&mut self, _take: impl FnMut(Result<TwistReading, Rejection>) -> Result<(), Rejection>) {}

    /// Whether anyone subscribes to the commands for the arm number `arm`; none where that was not looked at.
    fn listeners(&mut self, _arm: usize) -> Option<bool> {
        None
    }

    /// Whether anyone else sends commands to the arm number `arm`; none where that was not looked at.
    fn rival(&mut self, _arm: usize) -> Option<bool> {
        None
    }

    /// What a recorded cycle found out of the arm number `arm`; none where the cycle finds out by itself.
    fn recorded(&mut self, _arm: usize) -> Option<ArmFigures> {
        None
    }
}

impl<T: Task> Servo<T> {
    /// The whole cycle at time `now`: requests, then joint states, then goals and their motions, then twists, then the [`step`](Self::step)
    /// to the next command, whose joint velocities it returns [rad/s, prismatic: m/s]. What is to be sent to the arm is not these but
    /// [`output`](Self::output). Whatever is rejected is counted, and the last good one of its kind stays in force.
    ///
    /// # Errors
    /// As [`step`](Self::step).
    pub fn cycle(
        &mut self,
        now: Duration,
        source: &mut impl Source<T::Controller>,
    ) -> Result<&[f64], ArmError> {
        self.begin(now);
        source.requests(|request| match request {
            Request::Configure(settings) => {
                let taken = self.configure(*settings).map_err(Rejection::Settings);
                self.counted(taken)
            }
            Request::Pause { paused: false, ago } if ago > self.settings().rearm_timeout => {
                self.counted(Err(Rejection::Late(ago)))
            }
            Request::Pause { paused, .. } => {
                self.pause(paused);
                Ok(())
            }
            Request::Stop => {
                self.stop();
                Ok(())
            }
        });
        for arm in 0..self.arm_figures().count() {
            source.joint_states(arm, |state| match state {
                Ok(reading) => self.take_joint_state(arm, reading, now),
                Err(malformed) => self.counted(Err(malformed)),
            });
            if let Some(listeners) = source.listeners(arm) {
                self.set_listeners(arm, listeners);
            }
            if let Some(rival) = source.rival(arm) {
                self.set_rival(arm, rival);
            }
            if let Some(figures) = source.recorded(arm) {
                self.repeat_with(arm, figures);
            }
        }
        source.goals(|goal| match goal {
            Ok(goal) => self.take_stamped_goal(&goal, now),
            Err(malformed) => self.counted(Err(malformed)),
        });
        // A motion that is rejected is counted.
        source.goal_motions(|motion| drop(self.move_goal(&motion, now)));
        source.twists(|twist| match twist {
            Ok(twist) => self.take_twist(&twist, now),
            Err(malformed) => self.counted(Err(malformed)),
        });
        self.step(now)
    }
}

/// The inputs of one cycle as a list: the source of replays and tests.
#[derive(Clone, Debug)]
pub struct Inputs<'a, C> {
    /// What is asked of the servo.
    pub requests: Vec<Request<C>>,
    /// Joint states, each with the number of its arm.
    pub joint_states: Vec<(usize, JointReading<'a>)>,
    /// What a recorded cycle found out of each arm; empty where the cycle finds out by itself.
    pub recorded: Vec<ArmFigures>,
    /// Goals.
    pub goals: Vec<GoalReading<'a>>,
    /// What has become of a goal that moves with its frame.
    pub goal_motions: Vec<GoalMotion<'a>>,
    /// Twists.
    pub twists: Vec<TwistReading<'a>>,
}

impl<C> Default for Inputs<'_, C> {
    fn default() -> Self {
        Self {
            requests: Vec::new(),
            joint_states: Vec::new(),
            recorded: Vec::new(),
            goals: Vec::new(),
            goal_motions: Vec::new(),
            twists: Vec::new(),
        }
    }
}

/// What the servo rejects it counts.
impl<C: Clone> Source<C> for Inputs<'_, C> {
    fn requests(&mut self, mut ask: impl FnMut(Request<C>) -> Result<(), Rejection>) {
        for request in self.requests.iter().cloned() {
            let _ = ask(request);
        }
    }

    fn joint_states(
        &mut self,
        arm: usize,
        mut take: impl FnMut(Result<&JointReading, Rejection>) -> Result<bool, Rejection>,
    ) {
        for (_, reading) in self.joint_states.iter().filter(|(of, _)| *of == arm) {
            let _ = take(Ok(reading));
        }
    }

    fn goals(&mut self, mut take: impl FnMut(Result<GoalReading, Rejection>) -> Result<(), Rejection>) {
        for goal in &self.goals {
            let _ = take(Ok(*goal));
        }
    }

    fn goal_motions(&mut self, take: impl FnMut(GoalMotion)) {
        self.goal_motions.iter().copied().for_each(take);
    }

    fn twists(&mut self, mut take: impl FnMut(Result<TwistReading, Rejection>) -> Result<(), Rejection>) {
        for twist in &self.twists {
            let _ = take(Ok(*twist));
        }
    }

    fn recorded(&mut self, arm: usize) -> Option<ArmFigures> {
        self.recorded.get(arm).copied()
    }
}
