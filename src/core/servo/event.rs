//! What comes to a servo for its next cycle. A node takes it live, a replay from a bag, a test from a list: only where it comes from, the
//! clock and what becomes of the command differ.

use super::{Found, JointReading, Rejection, Servo, Settings};
use serde::{Deserialize, Serialize};
use std::time::Duration;

/// Who sent a message, and how long before it came.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Sent {
    /// Its publisher: a number for each.
    pub by: u32,
    /// How long it was under way, where that is known.
    pub ago: Duration,
}

/// What comes to a servo for its next cycle.
#[derive(Clone, Debug)]
pub enum Event<'a> {
    /// [`Servo::configure`].
    Configure(Box<Settings>),
    /// [`Servo::pause`]; a request to go on is dated by when it was sent. It is rejected if that is longer ago than `rearm_timeout`, if
    /// something has revoked the goal since, or if goals that are revoked go on.
    Pause {
        /// Whether to pause, or to go on.
        paused: bool,
        /// How long it was under way.
        ago: Duration,
    },
    /// [`Servo::stop`].
    Stop,
    /// [`Servo::reconfigure`]; a request that was under way for longer than `rearm_timeout` is rejected.
    Reconfigure {
        /// How long it was under way.
        ago: Duration,
    },
    /// What the search came to that was [asked](Servo::ask); nothing where that is not asked any more.
    Found(Found<'a>),
    /// [`Servo::take_joint_state`] of the arm of that number.
    JointState(usize, JointReading<'a>),
    /// [`Servo::set_listeners`] of the arm of that number.
    Listeners(usize, bool),
    /// [`Servo::set_rival`] of the arm of that number.
    Rival(usize, bool),
    /// [`Servo::set_speed_scaling`] of the arm of that number.
    SpeedScaling(usize, f64),
    /// [`Servo::take_stamped_goal`].
    Goal(GoalReading<'a>),
    /// [`Servo::move_goal`].
    GoalMotion(GoalMotion<'a>),
    /// [`Servo::take_twist`].
    Twist(TwistReading<'a>),
    /// A message that nothing can be made of, and why.
    Unusable(Rejection),
}

/// A goal as it came.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
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
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum GoalMotion<'a> {
    /// The frame has taken it there.
    #[serde(borrow)]
    To(GoalReading<'a>),
    /// It is not known any more where the frame is.
    Lost,
}

/// A twist as it came.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
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

impl Servo {
    /// The whole cycle at time `now`: takes the events in their order, then the goal that was [set](Servo::set_goal), and makes the [`step`](Self::step) to the next command, whose joint
    /// velocities it returns [rad/s, prismatic: m/s]. What is to be sent to the arm is not these but [`output`](Self::output). Whatever is
    /// rejected is counted, and the last good one of its kind stays in force.
    pub fn cycle_with<'a>(&mut self, now: Duration, events: impl IntoIterator<Item = Event<'a>>) -> &[f64] {
        self.begin(now);
        for event in events {
            // What is rejected is counted.
            let _ = self.take(event);
        }
        let _ = self.take_set_goal(now);
        self.step(now)
    }

    /// Takes what has come since the cycle before, after [`begin`](Self::begin). True where it counts: a joint state of a second publisher
    /// does not.
    ///
    /// # Errors
    /// The [`Rejection`], which is counted.
    pub fn take(&mut self, event: Event) -> Result<bool, Rejection> {
        let now = self.now();
        match event {
            Event::Configure(settings) => {
                let taken = self.configure(*settings).map_err(Rejection::Settings);
                self.counted(taken)?;
            }
            Event::Reconfigure { ago } if ago > self.settings().rearm_timeout => {
                self.counted(Err(Rejection::Late(ago)))?;
            }
            Event::Pause { paused: true, .. } => self.pause(true),
            Event::Pause { ago, .. } => self.resume(ago)?,
            Event::Stop => self.stop(),
            Event::Reconfigure { ago } => self.reconfigure(ago)?,
            Event::Found(found) => self.take_found(&found),
            Event::JointState(arm, reading) => return self.take_joint_state(arm, &reading, now),
            Event::Listeners(arm, listeners) => self.set_listeners(arm, listeners),
            Event::Rival(arm, rival) => self.set_rival(arm, rival),
            Event::SpeedScaling(arm, factor) => self.set_speed_scaling(arm, factor),
            Event::Goal(goal) => self.take_stamped_goal(&goal, now)?,
            Event::GoalMotion(motion) => self.move_goal(&motion, now)?,
            Event::Twist(twist) => self.take_twist(&twist, now)?,
            Event::Unusable(why) => self.counted(Err(why))?,
        }
        Ok(true)
    }
}
