//! The input events of a servo. A node takes the events from live messages, a replay takes them from a bag, and a test from a list.
//! Node, replay and test differ only in their clock and in what they do with the command.

use super::{JointReading, Rejection, Servo, Settings};
use dq_contact::WrenchReading;
use dq_search::Found;
use serde::{Deserialize, Serialize};
use std::time::Duration;

/// The sender of a message, and the message's age on arrival.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Sent {
    /// The number of the publisher.
    pub by: u32,
    /// The age of the message on arrival; 0 if it is unknown.
    pub ago: Duration,
}

/// An input for a servo's next cycle.
#[derive(Clone, Debug)]
pub enum Event<'a> {
    /// Calls [`Servo::configure`].
    Configure(Box<Settings>),
    /// Calls [`Servo::pause`]. The servo rejects a request to resume if it is older than `rearm_timeout`, if a revocation is newer
    /// than the request, or if a publisher still sends revoked goals.
    Pause {
        /// Whether to pause or to resume.
        paused: bool,
        /// The age of the request on arrival.
        ago: Duration,
    },
    /// Calls [`Servo::stop`].
    Stop,
    /// Calls [`Servo::reconfigure`]. A request older than `rearm_timeout` is rejected.
    Reconfigure {
        /// The age of the request on arrival.
        ago: Duration,
    },
    /// The result of a search that [`Servo::ask`] started. The servo ignores the result if it no longer waits for this search.
    Found(Found<'a>),
    /// Calls [`Servo::take_joint_state`] for the arm with this number.
    JointState(usize, JointReading<'a>),
    /// Calls [`Servo::set_listeners`] for the arm with this number.
    Listeners(usize, bool),
    /// Calls [`Servo::set_rival`] for the arm with this number.
    Rival(usize, bool),
    /// Calls [`Servo::set_speed_scaling`] for the arm with this number.
    SpeedScaling(usize, f64),
    /// A goal has arrived, and [waits](GoalReading::waited) for its frame. Meanwhile its publisher does not count as silent.
    Waits(Sent),
    /// Calls [`Servo::take_stamped_goal`].
    Goal(GoalReading<'a>),
    /// Calls [`Servo::take_joint_goal`].
    JointGoal(JointGoalReading<'a>),
    /// Calls [`Servo::move_goal`].
    GoalMotion(GoalMotion<'a>),
    /// Calls [`Servo::take_twist`].
    Twist(TwistReading<'a>),
    /// Calls [`Servo::take_wrench`].
    Wrench(WrenchReading<'a>),
    /// Calls [`Servo::tare`].
    Tare,
    /// Calls [`Servo::identify_tool`].
    IdentifyTool,
    /// A message could not be converted, for this reason.
    Unusable(Rejection),
}

/// A goal as received.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct GoalReading<'a> {
    /// Position \[m\].
    pub position: [f64; 3],
    /// Orientation (x, y, z, w).
    pub orientation_xyzw: [f64; 4],
    /// The frame of position and orientation; empty for the base frame.
    pub frame_id: &'a str,
    /// The time stamp of the message \[ns\]; 0 if there is none.
    pub stamp: i64,
    /// How long the goal has waited for its frame since it arrived.
    pub waited: Duration,
    /// The sender of the message, and its age on arrival.
    pub sent: Sent,
}

/// A joint goal as received.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JointGoalReading<'a> {
    /// The position of each joint, arm after arm \[rad, prismatic: m\]. A joint that has `None` keeps its position of the current joint
    /// goal or, if there is no joint goal, its measured position.
    pub positions: &'a [Option<f64>],
    /// The time stamp of the message \[ns\]; 0 if there is none.
    pub stamp: i64,
    /// The sender of the message, and its age on arrival.
    pub sent: Sent,
}

/// A change of the pose of the current goal, because the goal's frame has moved or is lost.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum GoalMotion<'a> {
    /// The frame has moved the goal to this pose.
    #[serde(borrow)]
    To(GoalReading<'a>),
    /// TF no longer has the frame.
    Lost,
}

/// A twist as received.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct TwistReading<'a> {
    /// Velocity of the tool point [m/s].
    pub linear: [f64; 3],
    /// Angular velocity of the tool [rad/s].
    pub angular: [f64; 3],
    /// The frame of both velocities; empty for the base frame.
    pub frame_id: &'a str,
    /// The sender of the message, and its age on arrival.
    pub sent: Sent,
}

impl Servo {
    /// Runs a whole cycle at time `now`: takes the events in their order, then the goal set by [`set_goal`](Servo::set_goal), and
    /// [computes](Self::step) the next command. Returns the joint velocities of this command [rad/s, prismatic: m/s]. To drive the
    /// arm, send [`output`](Self::output) instead.
    ///
    /// The servo counts rejected events. After a rejection, the last valid input of the same kind remains in force.
    pub fn cycle_with<'a>(&mut self, now: Duration, events: impl IntoIterator<Item = Event<'a>>) -> &[f64] {
        self.begin(now);
        for event in events {
            // `take` counts a rejection.
            let _ = self.take(event);
        }
        let _ = self.take_set_goal(now);
        self.step(now)
    }

    /// Takes one event. Call it after [`begin`](Self::begin). Returns false for a joint state or a wrench of a second publisher,
    /// which the servo ignores.
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
            Event::Waits(sent) => self.wait_for_frame(sent),
            Event::Goal(goal) => self.take_stamped_goal(&goal, now)?,
            Event::JointGoal(goal) => self.take_joint_goal(&goal, now)?,
            Event::GoalMotion(motion) => self.move_goal(&motion, now)?,
            Event::Twist(twist) => self.take_twist(&twist, now)?,
            Event::Wrench(wrench) => return self.take_wrench(&wrench, now),
            Event::Tare => self.tare(),
            Event::IdentifyTool => self.identify_tool(),
            Event::Unusable(why) => self.counted(Err(why))?,
        }
        Ok(true)
    }
}
