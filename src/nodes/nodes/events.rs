//! The record for replay on `~/events`: a message a cycle, of what the servo took and what it had to send.
//!
//! It begins with a servo that is new, as nothing else can be repeated: the node replaces its own by one when the arm stands and
//! somebody listens. Where the parameter `events` is off there is nothing to do in a cycle.

use crate::wire::messages::UInt8MultiArray;
use crate::wire::{CycleRecord, EVENTS, NodeContract, Recorded, RecordedParameters, ServoKind};
use dq_config::ServoParameters;
use dq_core::servo::{Event, JointOrder, Rejection, Servo, Settings, SettingsError, State};
use dq_params::{ParameterStore, Value};
use dq_ros::ros::{Node, Publisher, RosError};
use dq_space::space::KeepOut;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

/// A record is no longer [bytes]: of a cycle to which more came it is left out, and the replay sees that one is missing.
const LONGEST: usize = 1 << 20;

/// Records of this length find their room made [bytes]; one arm's take some 200.
const USUAL: usize = 1 << 14;

/// An arm whose joints are all commanded to go more slowly than this [rad/s, prismatic: m/s] stands, as one does that is held where it has
/// arrived: to stop is less than one cycle's deceleration.
const STANDS: f64 = 1e-3;

/// Who the cycle and the report share: the topic, and whether anybody listens.
pub(super) struct EventsTopic {
    publisher: Publisher<UInt8MultiArray>,
    is_heard: AtomicBool,
}

impl EventsTopic {
    /// The topic of the node.
    pub fn new(node: &mut Node, contract: &NodeContract) -> Result<Arc<Self>, RosError> {
        let publisher = node.publisher(contract, "~/events")?;
        Ok(Arc::new(Self { publisher, is_heard: AtomicBool::new(false) }))
    }

    /// Looks whether anybody subscribes. That takes a lock which discovery holds too, so it is not the cycle's to do.
    pub fn look_for_readers(&self) {
        self.is_heard.store(self.publisher.readers() > 0, Ordering::Relaxed);
    }
}

/// A servo that is new, and the first event of its record.
pub(super) struct NewServo {
    servo: Servo,
    event: Vec<u8>,
}

impl NewServo {
    /// With the parameters of a store, which are these, and what is drawn.
    pub fn new(
        kind: ServoKind,
        store: &ParameterStore,
        drawn: &[KeepOut],
        parameters: &ServoParameters,
    ) -> Result<Box<Self>, SettingsError> {
        let values = store.values();
        let all = RecordedParameters { values: values.collect(), drawn: texts(drawn) };
        Ok(Box::new(Self { servo: parameters.build()?, event: encoded(&Recorded::New(kind, all)) }))
    }
}

/// As the record has them, which a replay reads to the last bit.
fn texts(drawn: &[KeepOut]) -> Vec<String> {
    drawn.iter().map(ToString::to_string).collect()
}

fn encoded(event: &Recorded) -> Vec<u8> {
    let mut bytes = Vec::new();
    event.write(&mut bytes);
    bytes
}

/// A change of the parameters, or of what is drawn.
#[derive(Clone, Copy)]
pub(super) struct Change<'a> {
    /// All parameters after it.
    pub store: &'a ParameterStore,
    /// Those that were set.
    pub changes: &'a [(String, Value)],
    /// All that is drawn after it.
    pub drawn: &'a [KeepOut],
}

/// What a change of the parameters is to the record.
pub(super) enum RecordChange {
    /// There is to be none.
    Off,
    /// It is to begin, with this servo.
    Begin(Box<NewServo>),
    /// It has this event.
    Goes(Vec<u8>),
}

/// Makes of each change of the parameters what it is to the record.
pub(super) struct RecordChanges {
    pub kind: ServoKind,
    /// Whether the record has begun.
    pub has_begun: Arc<AtomicBool>,
}

impl RecordChanges {
    /// What a change is that has led to these settings. One of `events` itself lets the record
    /// begin anew, and so does any as long as it has not begun.
    ///
    /// # Errors
    /// Why there is no servo to begin with.
    pub fn of(
        &self,
        Change { store, changes, drawn }: Change<'_>,
        settings: &Settings,
    ) -> Result<RecordChange, String> {
        if !matches!(store.get(EVENTS), Some(Value::Bool(true))) {
            return Ok(RecordChange::Off);
        }
        let begins = changes.iter().any(|(name, _)| name == EVENTS);
        if begins || !self.has_begun.load(Ordering::Relaxed) {
            self.has_begun.store(false, Ordering::Relaxed);
            let mut parameters = self.kind.from_store(store).map_err(|why| why.to_string())?;
            parameters.settings.clone_from(settings);
            let next = NewServo::new(self.kind, store, drawn, &parameters);
            return Ok(RecordChange::Begin(next.map_err(|why| why.to_string())?));
        }
        let changed = RecordedParameters { values: changes.to_vec(), drawn: texts(drawn) };
        Ok(RecordChange::Goes(encoded(&Recorded::Parameters(changed))))
    }
}

/// The record, which the cycle writes.
pub(super) struct EventsRecord {
    topic: Arc<EventsTopic>,
    joints: Vec<JointOrder>,
    /// The servo with which it is to begin.
    next: Option<Box<NewServo>>,
    /// The number of the cycle in progress, once it has begun.
    number: Option<u64>,
    has_begun: Arc<AtomicBool>,
    /// What the cycle is written into: nobody else holds it.
    message: Arc<UInt8MultiArray>,
}

impl EventsRecord {
    /// Of a servo with these joints, which begins with `next` where it is on from the start.
    pub fn new(topic: Arc<EventsTopic>, joints: Vec<JointOrder>, next: Option<Box<NewServo>>) -> Self {
        let has_begun = Arc::default();
        Self { topic, joints, next, number: None, has_begun, message: Arc::default() }
    }

    /// What makes the changes that [`change`](Self::change) takes.
    pub fn changes(&self, kind: ServoKind) -> RecordChanges {
        RecordChanges { kind, has_begun: self.has_begun.clone() }
    }

    /// Whether it is due to begin: a servo is to be begun with, somebody listens, and the arm neither moves nor is about to.
    fn is_due(&self, servo: &Servo) -> bool {
        let is_free = matches!(
            servo.status().state,
            State::WaitingForState | State::Holding | State::Paused | State::Stalled | State::Settled
        );
        self.next.is_some()
            && self.topic.is_heard.load(Ordering::Relaxed)
            && is_free
            && servo.command().iter().all(|speed| speed.abs() < STANDS)
    }

    /// Begins the servo's cycle at `now`, and with it the record where it is due and `may_begin`: whether the servo is a new one from now
    /// on.
    pub fn begin(&mut self, servo: &mut Servo, now: Duration, may_begin: bool) -> bool {
        let next = if may_begin && self.is_due(servo) { self.next.take() } else { None };
        let event = next.map(|next| {
            let NewServo { servo: mut new, event } = *next;
            new.succeed(servo);
            *servo = new;
            self.has_begun.store(true, Ordering::Relaxed);
            self.number = Some(0);
            event
        });
        servo.begin(now);
        if let Some(number) = self.number {
            let record = &mut Arc::make_mut(&mut self.message).data;
            record.reserve(USUAL);
            CycleRecord::begin(number, now, record);
            record.extend(event.iter().flatten());
        }
        event.is_some()
    }

    /// Lets the servo take an event, of which the record has a note.
    ///
    /// # Errors
    /// The servo's.
    pub fn take(&mut self, servo: &mut Servo, event: Event) -> Result<bool, Rejection> {
        if self.number.is_none() {
            return servo.take(event);
        }
        let record = &mut Arc::make_mut(&mut self.message).data;
        let (before, is_state) = (record.len(), matches!(event, Event::JointState(..)));
        if before < LONGEST
            && let Some(event) = Recorded::of(&event, &self.joints)
        {
            event.write(record);
        }
        let taken = servo.take(event);
        // Joint states of other joints are none of the servo's, and there may be very many of them.
        if is_state && taken.is_err() {
            record.truncate(before);
        }
        taken
    }

    /// Notes that the servo has taken other settings, by a change of the parameters that is this to the record.
    pub fn change(&mut self, change: RecordChange) {
        match change {
            RecordChange::Off => (self.next, self.number) = (None, None),
            RecordChange::Begin(next) => {
                (self.next, self.number) = (Some(next), None);
                self.has_begun.store(false, Ordering::Relaxed);
            }
            RecordChange::Goes(event) if self.number.is_some() => {
                Arc::make_mut(&mut self.message).data.extend(event);
            }
            // It was to begin anew just when this was set: with a servo that lacks it, it does not.
            RecordChange::Goes(_) => self.next = None,
        }
    }

    /// Ends the cycle, with what the servo has to send.
    pub fn end(&mut self, output: Option<&[f64]>) {
        let Some(number) = &mut self.number else { return };
        *number += 1;
        let record = &mut Arc::make_mut(&mut self.message).data;
        CycleRecord::end(output, record);
        if record.len() < LONGEST {
            self.topic.publisher.publish(self.message.clone());
        }
    }
}
