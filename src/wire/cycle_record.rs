//! The record for replay, a message a cycle on `~/events`: what came to the servo, in the order in which it took it, and what it sent.
//!
//! A message is a sequence of values in the encoding of the crate `postcard`: the cycle's number and time \[ns\], each [`Recorded`] as a
//! `Some`, a `None`, and what was sent. So the cycle writes each thing as it comes, without knowing how many there will be.

use super::ServoKind;
use crate::params::Value;
use crate::servo::{Event, Found, GoalMotion, GoalReading, JointOrder, JointReading, Sent, TwistReading};
use serde::{Deserialize, Serialize};
use std::borrow::Cow;
use std::time::Duration;

/// One cycle of a servo.
#[derive(Clone, Debug, PartialEq)]
pub struct CycleRecord<'a> {
    /// Which cycle it is: 0 is the first one of a servo that is new, and every one has its message.
    pub number: u64,
    /// The cycle's time.
    pub now: Duration,
    /// What the servo took, in this order.
    pub events: Vec<Recorded<'a>>,
    /// What it then had to send, arm after arm: velocities [rad/s, prismatic: m/s] or positions \[rad, prismatic: m\]; none where it sends
    /// nothing.
    pub output: Option<Vec<f64>>,
}

/// Parameters that were set, by their names.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct SetParameters {
    /// Names and values.
    pub values: Vec<(String, Value)>,
    /// The keep-outs that were drawn, all of them, a text each.
    pub drawn: Vec<String>,
}

/// What came to a servo. It is [`Event`] with what owns its lists when it is read, and with parameters in place of settings.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Recorded<'a> {
    /// The servo is new, of this kind, with these parameters: all that it has.
    New(ServoKind, SetParameters),
    /// These parameters were set.
    Parameters(SetParameters),
    /// [`Event::Pause`].
    Pause {
        /// Whether to pause, or to go on.
        paused: bool,
        /// How long it was under way.
        ago: Duration,
    },
    /// [`Event::Stop`].
    Stop,
    /// [`Event::Reconfigure`]: how long it was under way.
    Reconfigure(Duration),
    /// [`Event::Found`]: the time of the cycle that asked, the starts, and the positions.
    Found(Duration, u32, Option<Cow<'a, [f64]>>),
    /// [`Event::JointState`].
    JointState {
        /// The number of the arm.
        arm: usize,
        /// The joints' names; none for the arm's own in their order.
        names: Option<Cow<'a, [String]>>,
        /// Their positions \[rad, prismatic: m\].
        positions: Cow<'a, [f64]>,
        /// Their velocities [rad/s, prismatic: m/s].
        velocities: Cow<'a, [f64]>,
        /// Who published it.
        source: u32,
        /// How old it is.
        stamp_age: Option<Duration>,
    },
    /// [`Event::Listeners`].
    Listeners(usize, bool),
    /// [`Event::Rival`].
    Rival(usize, bool),
    /// [`Event::SpeedScaling`].
    SpeedScaling(usize, f64),
    /// [`Event::Goal`].
    #[serde(borrow)]
    Goal(GoalReading<'a>),
    /// [`Event::GoalMotion`].
    #[serde(borrow)]
    GoalMotion(GoalMotion<'a>),
    /// [`Event::Twist`].
    #[serde(borrow)]
    Twist(TwistReading<'a>),
}

impl<'a> Recorded<'a> {
    /// What the record has of an event of a servo with these joints. It has none of settings, which are recorded as
    /// [`Parameters`](Self::Parameters), and of what cannot be used, which changes nothing.
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
            Event::Goal(goal) => Self::Goal(goal),
            Event::GoalMotion(motion) => Self::GoalMotion(motion),
            Event::Twist(twist) => Self::Twist(twist),
            Event::Configure(_) | Event::Unusable(_) => return None,
        })
    }

    /// The event, for a servo with these joints; none where it is of parameters, or of an arm that the servo does not have.
    pub fn event(&self, joints: &'a [JointOrder]) -> Option<Event<'_>> {
        let has = |arm: &usize| *arm < joints.len();
        Some(match self {
            Self::New(..) | Self::Parameters(_) => return None,
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
            Self::Goal(goal) => Event::Goal(bounded_goal(*goal)),
            Self::GoalMotion(GoalMotion::Lost) => Event::GoalMotion(GoalMotion::Lost),
            Self::GoalMotion(GoalMotion::To(goal)) => Event::GoalMotion(GoalMotion::To(bounded_goal(*goal))),
            Self::Twist(twist) => Event::Twist(TwistReading { sent: bounded_sent(twist.sent), ..*twist }),
        })
    }

    /// Adds it to the record of a cycle.
    pub fn write(&self, record: &mut Vec<u8>) {
        put(&Some(self), record);
    }
}

/// No time of a cycle, and none that anything was under way, is longer: what a record says of itself must not overflow.
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
    // Writing into a vector does not fail, and nothing here has a length that is not known.
    let _ = postcard::to_io(value, record);
}

fn take<'a, V: Deserialize<'a>>(record: &mut &'a [u8]) -> Option<V> {
    let (value, rest) = postcard::take_from_bytes(record).ok()?;
    *record = rest;
    Some(value)
}

impl<'a> CycleRecord<'a> {
    /// Begins the record of a cycle, over the one before.
    pub fn begin(number: u64, now: Duration, record: &mut Vec<u8>) {
        record.clear();
        put(&(number, u64::try_from(now.as_nanos()).unwrap_or(u64::MAX)), record);
    }

    /// Ends it with what is sent.
    pub fn end(output: Option<&[f64]>, record: &mut Vec<u8>) {
        put(&(None::<()>, output), record);
    }

    /// Reads a record; none where it is damaged, or of another version.
    pub fn read(mut record: &'a [u8]) -> Option<Self> {
        let (number, now) = take::<(u64, u64)>(&mut record)?;
        let mut events = Vec::new();
        while let Some(event) = take(&mut record)? {
            events.push(event);
        }
        let output = take(&mut record)?;
        record.is_empty().then_some(Self { number, now: Duration::from_nanos(now), events, output })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn joints() -> [JointOrder; 2] {
        [["a", "b"], ["c", "d"]].map(|names| JointOrder::new(names.map(str::to_owned).to_vec()))
    }

    #[test]
    fn a_record_reads_back_to_the_last_bit_and_every_part_of_one_is_none() {
        let (joints, numbers) = (joints(), [0.1, -0.0]);
        let others = ["b".to_owned(), "x".to_owned()];
        let state = |names| JointReading {
            names,
            positions: &numbers,
            velocities: &[],
            source: 7,
            stamp_age: Some(Duration::new(0, 5)),
        };
        let goal = GoalReading {
            position: [f64::MIN_POSITIVE, f64::NAN, 1.0 / 3.0],
            orientation_xyzw: [0.0, 0.0, 0.0, 1.0],
            frame_id: "base",
            stamp: -1,
            waited: Duration::from_nanos(3),
            sent: Sent { by: 4, ago: Duration::from_secs(5) },
        };
        let twist =
            TwistReading { linear: [0.1; 3], angular: [0.2; 3], frame_id: "tool", sent: Sent::default() };
        let events = [
            Event::Pause { paused: true, ago: Duration::from_millis(2) },
            Event::Stop,
            Event::Reconfigure { ago: Duration::ZERO },
            Event::Found(Found { asked: Duration::from_secs(9), starts: 3, positions: Some(&numbers) }),
            Event::Found(Found { asked: Duration::from_secs(9), starts: 3, positions: None }),
            Event::JointState(1, state(joints[1].names())),
            Event::JointState(1, state(&others)),
            Event::Listeners(0, true),
            Event::Rival(1, false),
            Event::Goal(goal),
            Event::GoalMotion(GoalMotion::To(goal)),
            Event::GoalMotion(GoalMotion::Lost),
            Event::Twist(twist),
        ];
        let mut bytes = vec![1, 2, 3];
        CycleRecord::begin(300, Duration::from_nanos(1 << 40), &mut bytes);
        let set = SetParameters { values: vec![("p".to_owned(), Value::Double(0.1))], drawn: Vec::new() };
        Recorded::Parameters(set.clone()).write(&mut bytes);
        events.iter().for_each(|event| Recorded::of(event, &joints).unwrap().write(&mut bytes));
        CycleRecord::end(Some(&numbers), &mut bytes);
        let record = CycleRecord::read(&bytes).unwrap();
        assert_eq!((record.number, record.now), (300, Duration::from_nanos(1 << 40)));
        assert_eq!(record.output.as_deref().map(<[f64]>::to_vec), Some(numbers.to_vec()));
        assert!(record.output.unwrap()[1].is_sign_negative());
        assert_eq!(record.events[0], Recorded::Parameters(set));
        let told: Vec<_> = record.events[1..].iter().map(|event| event.event(&joints).unwrap()).collect();
        assert_eq!(format!("{told:?}"), format!("{events:?}"));
        // Of its own joints a state does not have the names.
        let names = |event: &Recorded<'_>| matches!(event, Recorded::JointState { names: Some(_), .. });
        assert_eq!((names(&record.events[6]), names(&record.events[7])), (false, true));
        for length in 0..bytes.len() {
            assert_eq!(CycleRecord::read(&bytes[..length]), None, "{length} of {} bytes", bytes.len());
        }
    }

    #[test]
    fn a_cycle_in_which_six_joints_move_takes_some_hundred_bytes() {
        let joints = [JointOrder::new((1..7).map(|i| format!("shoulder_joint_{i}")).collect())];
        let mut bytes = Vec::new();
        CycleRecord::begin(1_000_000, Duration::from_secs(100_000), &mut bytes);
        let reading = JointReading {
            names: joints[0].names(),
            positions: &[0.5; 6],
            velocities: &[0.5; 6],
            source: 1,
            stamp_age: Some(Duration::from_millis(1)),
        };
        for event in [Event::JointState(0, reading), Event::Listeners(0, true), Event::Rival(0, false)] {
            Recorded::of(&event, &joints).unwrap().write(&mut bytes);
        }
        CycleRecord::end(Some(&[0.5; 6]), &mut bytes);
        assert!(bytes.len() < 190, "{} bytes, 144 of them numbers", bytes.len());
    }

    #[test]
    fn what_names_an_arm_that_is_not_there_is_nothing() {
        let reading = |arm| Recorded::Listeners(arm, true).event(&joints()).is_some();
        assert_eq!((reading(1), reading(2)), (true, false));
    }
}
