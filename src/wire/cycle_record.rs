//! The record of a servo's cycles on `~/events`, from which the cycles can be replayed. It contains the events that the servo
//! received, in the order of processing, and the commands that it sent.
//!
//! A message contains one or more consecutive cycles. Each cycle is a sequence of values in the encoding of the crate `postcard`:
//!
//! 1. the number and the time \[ns\] of the cycle,
//! 2. each event, as a `Some` with a [`Recorded`],
//! 3. a `None`, which ends the list of events,
//! 4. the output.
//!
//! The list has no length at its beginning, so the servo can write each event at once, before it knows the number of events.

use super::servo_kind::ServoKind;
use dq_common::text::MOST;
use dq_core::servo::{
    Event, GoalMotion, GoalReading, JointGoalReading, JointOrder, JointReading, Sent, Servo, TwistReading,
    WrenchReading,
};
use dq_params::Value;
use dq_search::Found;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::borrow::Cow;
use std::time::Duration;

/// The size of the longest message that [`CycleRecord::read_all`] accepts \[bytes\]: eight times the size of a message with all
/// parameters. Decoding a message takes up to fifty times its size in memory.
const LONGEST: usize = 4 << 20;

/// One cycle of a servo.
#[derive(Clone, Debug, PartialEq)]
pub struct CycleRecord<'a> {
    /// The number of the cycle. Consecutive cycles have consecutive numbers.
    pub number: u64,
    /// The time of the cycle, by the cycle's clock.
    pub now: Duration,
    /// The events in the order of processing.
    pub events: Vec<Recorded<'a>>,
    /// The servo's output, arm after arm: velocities [rad/s, prismatic: m/s] or positions \[rad, prismatic: m\]. `None` if the servo
    /// sent nothing.
    pub output: Option<Vec<f64>>,
}

/// The values of some or all parameters, and all live keep-outs (those drawn on `~/keep_out`).
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct RecordedParameters {
    /// The names and values.
    pub values: Vec<(String, Value)>,
    /// All keep-outs that are drawn on `~/keep_out`, as texts.
    pub drawn: Vec<String>,
}

/// The encoded state of a servo, as [`Servo::saved`] returns it.
#[derive(Clone, Debug, PartialEq)]
pub struct Saved<'a>(pub Cow<'a, [u8]>);

impl Serialize for Saved<'_> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_bytes(&self.0)
    }
}

impl<'de: 'a, 'a> Deserialize<'de> for Saved<'a> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        <&[u8]>::deserialize(deserializer).map(|bytes| Self(Cow::Borrowed(bytes)))
    }
}

impl Saved<'_> {
    /// Encodes the state of `servo` into `bytes`, and replaces the previous contents.
    pub fn encode(servo: &Servo, bytes: &mut Vec<u8>) {
        bytes.clear();
        put(&servo.saved(), bytes);
    }

    /// Restores `servo` to this state. Returns `None` if the state cannot be decoded.
    pub fn restore(&self, servo: &mut Servo) -> Option<()> {
        servo.restore(&mut postcard::Deserializer::from_bytes(&self.0)).ok()
    }
}

/// An event of a servo in a record. Unlike an [`Event`], a decoded `Recorded` owns its lists, and it has parameters in place of
/// settings.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Recorded<'a> {
    /// The kind of the servo, and all its parameters. A replay can begin at this cycle, from the state in the next event,
    /// [`Saved`](Self::Saved).
    Begin(ServoKind, RecordedParameters),
    /// The state of the servo before the cycle.
    Saved(Saved<'a>),
    /// Parameters were set. Contains the changed parameters, and all keep-outs that are drawn on `~/keep_out`.
    Parameters(RecordedParameters),
    /// A request to pause or to resume: [`Event::Pause`].
    Pause {
        /// Whether to pause or to resume.
        paused: bool,
        /// The age of the request on arrival.
        ago: Duration,
    },
    /// A request to stop: [`Event::Stop`].
    Stop,
    /// A request to go to another configuration ([`Event::Reconfigure`]), with the age of the request on arrival.
    Reconfigure(Duration),
    /// The result of a search ([`Event::Found`]): the time at which the servo asked for the search, the number of starts that the
    /// search tried, and the positions that it found.
    Found(Duration, u32, Option<Cow<'a, [f64]>>),
    /// A joint state: [`Event::JointState`].
    JointState {
        /// The number of the arm.
        arm: usize,
        /// The names of the joints; `None` for the arm's own joints in their order.
        names: Option<Cow<'a, [String]>>,
        /// The positions of the joints \[rad, prismatic: m\].
        positions: Cow<'a, [f64]>,
        /// The velocities of the joints [rad/s, prismatic: m/s].
        velocities: Cow<'a, [f64]>,
        /// The number of the publisher.
        source: u32,
        /// The age of the joint state by its stamp; `None` if the age is unknown.
        stamp_age: Option<Duration>,
    },
    /// [`Event::Listeners`]: the number of the arm, and whether anyone subscribes to its commands.
    Listeners(usize, bool),
    /// [`Event::Rival`]: the number of the arm, and whether another publisher sends commands to it.
    Rival(usize, bool),
    /// [`Event::SpeedScaling`]: the number of the arm, and the fraction of the commanded speed at which it moves.
    SpeedScaling(usize, f64),
    /// A goal: [`Event::Goal`].
    #[serde(borrow)]
    Goal(GoalReading<'a>),
    /// A motion of the goal's frame: [`Event::GoalMotion`].
    #[serde(borrow)]
    GoalMotion(GoalMotion<'a>),
    /// A twist: [`Event::Twist`].
    #[serde(borrow)]
    Twist(TwistReading<'a>),
    /// The sender of a goal that waits for its frame: [`Event::Waits`].
    Waits(Sent),
    /// A joint goal: [`Event::JointGoal`].
    JointGoal {
        /// The position of each joint, arm after arm \[rad, prismatic: m\]; `None` for a joint that the message does not name.
        positions: Cow<'a, [Option<f64>]>,
        /// The time stamp of the message \[ns\].
        stamp: i64,
        /// The sender of the message, and the age of the message on arrival.
        sent: Sent,
    },
    /// A wrench: [`Event::Wrench`].
    #[serde(borrow)]
    Wrench(WrenchReading<'a>),
    /// The present wrench counts as no contact: [`Event::Tare`].
    Tare,
    /// The identification of the load on the wrench sensor begins: [`Event::IdentifyTool`].
    IdentifyTool,
}

impl<'a> Recorded<'a> {
    /// Converts an event of a servo with these joints. Returns `None` for settings, because their parameters are recorded instead
    /// as [`Parameters`](Self::Parameters). Also returns `None` for unusable messages, because they change nothing.
    pub fn of(event: &Event<'a>, joints: &[JointOrder]) -> Option<Self> {
        Some(match *event {
            Event::Pause { paused, ago } => Self::Pause { paused, ago },
            Event::Stop => Self::Stop,
            Event::Reconfigure { ago } => Self::Reconfigure(ago),
            Event::Found(Found { asked, starts, positions }) => {
                Self::Found(asked, starts, positions.map(Cow::Borrowed))
            }
            Event::JointState(arm, JointReading { names, positions, velocities, source, stamp_age }) => {
                let is_own = joints.get(arm).is_some_and(|own| own.names() == names);
                Self::JointState {
                    arm,
                    names: (!is_own).then_some(Cow::Borrowed(names)),
                    positions: Cow::Borrowed(positions),
                    velocities: Cow::Borrowed(velocities),
                    source,
                    stamp_age,
                }
            }
            Event::Listeners(arm, listeners) => Self::Listeners(arm, listeners),
            Event::Rival(arm, rival) => Self::Rival(arm, rival),
            Event::SpeedScaling(arm, factor) => Self::SpeedScaling(arm, factor),
            Event::Waits(sent) => Self::Waits(sent),
            Event::Goal(goal) => Self::Goal(goal),
            Event::JointGoal(JointGoalReading { positions, stamp, sent }) => {
                Self::JointGoal { positions: Cow::Borrowed(positions), stamp, sent }
            }
            Event::GoalMotion(motion) => Self::GoalMotion(motion),
            Event::Twist(twist) => Self::Twist(twist),
            Event::Wrench(wrench) => Self::Wrench(wrench),
            Event::Tare => Self::Tare,
            Event::IdentifyTool => Self::IdentifyTool,
            Event::Configure(_) | Event::Unusable(_) => return None,
        })
    }

    /// Returns the event to pass to a servo with these joints. Returns `None` for parameters and saved states, which are not events
    /// of the servo, and for an arm that the servo does not have.
    pub fn event(&self, joints: &'a [JointOrder]) -> Option<Event<'_>> {
        let has = |arm: &usize| *arm < joints.len();
        Some(match self {
            Self::Begin(..) | Self::Saved(_) | Self::Parameters(_) => return None,
            Self::Pause { paused, ago } => Event::Pause { paused: *paused, ago: bounded(*ago) },
            Self::Stop => Event::Stop,
            Self::Reconfigure(ago) => Event::Reconfigure { ago: bounded(*ago) },
            Self::Found(asked, starts, positions) => Event::Found(Found {
                asked: bounded(*asked),
                starts: *starts,
                positions: positions.as_deref(),
            }),
            Self::JointState { arm, names, positions, velocities, source, stamp_age } => {
                let names = names.as_deref().or(joints.get(*arm).map(JointOrder::names))?;
                let stamp_age = stamp_age.map(bounded);
                Event::JointState(
                    *arm,
                    JointReading { names, positions, velocities, source: *source, stamp_age },
                )
            }
            Self::Listeners(arm, listeners) => Event::Listeners(has(arm).then_some(*arm)?, *listeners),
            Self::Rival(arm, rival) => Event::Rival(has(arm).then_some(*arm)?, *rival),
            Self::SpeedScaling(arm, factor) => Event::SpeedScaling(has(arm).then_some(*arm)?, *factor),
            Self::Waits(sent) => Event::Waits(bounded_sent(*sent)),
            Self::JointGoal { positions, stamp, sent } => {
                Event::JointGoal(JointGoalReading { positions, stamp: *stamp, sent: bounded_sent(*sent) })
            }
            Self::Goal(goal) => Event::Goal(bounded_goal(*goal)),
            Self::GoalMotion(GoalMotion::Lost) => Event::GoalMotion(GoalMotion::Lost),
            Self::GoalMotion(GoalMotion::To(goal)) => Event::GoalMotion(GoalMotion::To(bounded_goal(*goal))),
            Self::Wrench(wrench) => {
                Event::Wrench(WrenchReading { stamp_age: wrench.stamp_age.map(bounded), ..*wrench })
            }
            Self::Tare => Event::Tare,
            Self::IdentifyTool => Event::IdentifyTool,
            Self::Twist(twist) => Event::Twist(TwistReading { sent: bounded_sent(twist.sent), ..*twist }),
        })
    }

    /// Appends the event to the record of a cycle.
    pub fn write(&self, record: &mut Vec<u8>) {
        put(&Some(self), record);
    }
}

/// Limits a duration from a record to `u64::MAX` ns, so that a corrupt record cannot cause an overflow.
fn bounded(time: Duration) -> Duration {
    time.min(Duration::from_nanos(u64::MAX))
}

fn bounded_sent(sent: Sent) -> Sent {
    Sent { ago: bounded(sent.ago), ..sent }
}

fn bounded_goal(goal: GoalReading<'_>) -> GoalReading<'_> {
    GoalReading { waited: bounded(goal.waited), sent: bounded_sent(goal.sent), ..goal }
}

fn put(value: &impl Serialize, record: &mut Vec<u8>) {
    // Writing to a vector cannot fail, and every length is known.
    let _ = postcard::to_io(value, record);
}

fn take<'a, V: Deserialize<'a>>(record: &mut &'a [u8]) -> Option<V> {
    let (value, rest) = postcard::take_from_bytes(record).ok()?;
    *record = rest;
    Some(value)
}

impl<'a> CycleRecord<'a> {
    /// Appends the beginning of a cycle's record to `record`.
    pub fn begin(number: u64, now: Duration, record: &mut Vec<u8>) {
        put(&(number, u64::try_from(now.as_nanos()).unwrap_or(u64::MAX)), record);
    }

    /// Appends the servo's output to `record`. This ends the record of the cycle.
    pub fn end(output: Option<&[f64]>, record: &mut Vec<u8>) {
        put(&(None::<()>, output), record);
    }

    /// Reads all cycles of a message on `~/events`. Returns `None` if the message is damaged, of another version, or too long.
    pub fn read_all(mut record: &'a [u8]) -> Option<Vec<Self>> {
        if record.len() > LONGEST {
            return None;
        }
        let mut cycles = Vec::new();
        while !record.is_empty() {
            cycles.push(Self::read(&mut record)?);
        }
        Some(cycles)
    }

    fn read(record: &mut &'a [u8]) -> Option<Self> {
        let (number, now) = take::<(u64, u64)>(record)?;
        let mut events = Vec::new();
        while let Some(event) = take(record)? {
            if events.len() == MOST {
                return None;
            }
            events.push(event);
        }
        let output = take(record)?;
        Some(Self { number, now: Duration::from_nanos(now), events, output })
    }
}
