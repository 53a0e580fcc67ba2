//! Publishes the record for replay on `~/events` while somebody subscribes. The record has the inputs and the output of the servo in
//! each cycle.
//!
//! Recording does not change the servo. For each new subscriber, and once per [`STATE_INTERVAL`], the record includes the servo's
//! saved state, so that a replay can begin there. One message holds several cycles, because the readers of rosbag2 keep only ten
//! messages. If nobody subscribes, the cycle does no work for the record.

use dq_core::servo::{Event, JointOrder, Rejection, Servo};
use dq_messages::NodeContract;
use dq_messages::messages::UInt8MultiArray;
use dq_params::{ParameterStore, Value};
use dq_ros::ros::{Node, Publisher, RosError};
use dq_space::space::KeepOut;
use dq_wire::{CycleRecord, Recorded, RecordedParameters, Saved, ServoKind};
use std::borrow::Cow;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Duration;

/// The time that one message covers. Ten messages, the number that the readers of rosbag2 keep, cover a second.
const BATCH: Duration = Duration::from_millis(100);

/// The length from which a message is published at once, even before [`BATCH`] has passed \[bytes\].
const FULL: usize = 1 << 18;

/// The longest record of one cycle \[bytes\]. A longer record is left out, and the replay reports a missing cycle.
const LONGEST: usize = 1 << 20;

/// The interval at which the record includes the servo's state. After a lost message the replay continues at the next state.
const STATE_INTERVAL: Duration = Duration::from_secs(5);

/// The topic of the record, and the number of its subscribers. The thread of the cycle and the thread of the report share this value.
pub(super) struct EventsTopic {
    publisher: Publisher<UInt8MultiArray>,
    readers: AtomicUsize,
}

impl EventsTopic {
    /// Creates the topic of the node.
    pub fn new(node: &mut Node, contract: &NodeContract) -> Result<Arc<Self>, RosError> {
        let publisher = node.publisher(contract, "~/events")?;
        Ok(Arc::new(Self { publisher, readers: AtomicUsize::new(0) }))
    }

    /// Counts the subscribers. Counting takes a lock that discovery uses too, so the cycle does not call this function.
    pub fn update_readers(&self) {
        self.readers.store(self.publisher.readers(), Ordering::Relaxed);
    }
}

/// A servo's parameters, encoded for the record.
pub(super) struct ParameterRecord {
    /// [`Recorded::Begin`] with all parameters.
    all: Vec<u8>,
    /// [`Recorded::Parameters`] with the changed parameters only.
    changed: Vec<u8>,
}

impl ParameterRecord {
    /// Encodes the parameters in `store` of a servo of this kind. `changes` are the parameters that changed last, and `drawn` are
    /// the keep-outs of `~/keep_out`.
    pub fn new(
        kind: ServoKind,
        store: &ParameterStore,
        changes: &[(String, Value)],
        drawn: &[KeepOut],
    ) -> Self {
        // Parsing the text of a keep-out gives the same keep-out to the last bit.
        let drawn: Vec<_> = drawn.iter().map(ToString::to_string).collect();
        let changed = RecordedParameters { values: changes.to_vec(), drawn: drawn.clone() };
        let all = RecordedParameters { values: store.values().collect(), drawn };
        Self { all: encoded(&Recorded::Begin(kind, all)), changed: encoded(&Recorded::Parameters(changed)) }
    }
}

fn encoded(event: &Recorded) -> Vec<u8> {
    let mut bytes = Vec::new();
    event.write(&mut bytes);
    bytes
}

/// Writes the record for replay. The cycle owns and calls it.
pub(super) struct EventsRecord {
    topic: Arc<EventsTopic>,
    joints: Vec<JointOrder>,
    parameters: ParameterRecord,
    /// The number of the cycle in progress.
    number: u64,
    /// The number of subscribers at the beginning of the cycle in progress.
    readers: usize,
    /// The time at which the servo's state was last recorded.
    begun: Duration,
    /// The message in progress. No other owner shares this memory, so adding a cycle copies nothing.
    message: Arc<UInt8MultiArray>,
    /// The time of the first cycle in the message.
    first: Duration,
    /// Where the record of the latest cycle begins in the message \[bytes\].
    start: usize,
    /// The servo's state, encoded.
    saved: Vec<u8>,
}

impl EventsRecord {
    /// Creates the record of a servo with these joints and parameters.
    pub fn new(topic: Arc<EventsTopic>, joints: Vec<JointOrder>, parameters: ParameterRecord) -> Self {
        Self {
            topic,
            joints,
            parameters,
            number: 0,
            readers: 0,
            begun: Duration::ZERO,
            message: Arc::default(),
            first: Duration::ZERO,
            start: 0,
            saved: Vec::new(),
        }
    }

    /// Returns the joints of each arm.
    pub fn joints(&self) -> &[JointOrder] {
        &self.joints
    }

    fn is_heard(&self) -> bool {
        self.readers > 0
    }

    /// Begins the servo's cycle at `now`, and the record of this cycle.
    pub fn begin(&mut self, servo: &mut Servo, now: Duration) {
        self.number += 1;
        let before = std::mem::replace(&mut self.readers, self.topic.readers.load(Ordering::Relaxed));
        let record = &mut Arc::make_mut(&mut self.message).data;
        if self.readers == 0 {
            record.clear();
            return servo.begin(now);
        }
        if record.is_empty() {
            self.first = now;
        }
        self.start = record.len();
        CycleRecord::begin(self.number, now, record);
        if self.readers > before || now >= self.begun + STATE_INTERVAL {
            self.begun = now;
            record.extend_from_slice(&self.parameters.all);
            Saved::encode(servo, &mut self.saved);
            Recorded::Saved(Saved(Cow::Borrowed(&self.saved))).write(record);
        }
        servo.begin(now);
    }

    /// Passes an event to the servo, and records the event. Returns the servo's answer.
    ///
    /// # Errors
    /// The errors of [`Servo::take`].
    pub fn take(&mut self, servo: &mut Servo, event: Event) -> Result<bool, Rejection> {
        if !self.is_heard() {
            return servo.take(event);
        }
        let record = &mut Arc::make_mut(&mut self.message).data;
        let (before, is_state) = (record.len(), matches!(event, Event::JointState(..)));
        if before - self.start < LONGEST
            && let Some(event) = Recorded::of(&event, &self.joints)
        {
            event.write(record);
        }
        let taken = servo.take(event);
        // Joint states of other joints are not used, and may arrive in large numbers.
        if is_state && taken.is_err() {
            record.truncate(before);
        }
        taken
    }

    /// Records that the servo has applied these parameters.
    pub fn change(&mut self, parameters: ParameterRecord) {
        self.parameters = parameters;
        if self.is_heard() {
            Arc::make_mut(&mut self.message).data.extend_from_slice(&self.parameters.changed);
        }
    }

    /// Ends the cycle with the servo's `output`, and publishes the message if it is due.
    pub fn end(&mut self, now: Duration, output: Option<&[f64]>) {
        if !self.is_heard() {
            return;
        }
        let record = &mut Arc::make_mut(&mut self.message).data;
        CycleRecord::end(output, record);
        if record.len() - self.start > LONGEST {
            record.truncate(self.start);
        }
        if record.len() >= FULL || now.saturating_sub(self.first) >= BATCH {
            self.publish();
        }
    }

    fn publish(&mut self) {
        if !self.message.data.is_empty() {
            self.topic.publisher.publish(self.message.clone());
            Arc::make_mut(&mut self.message).data.clear();
        }
    }
}

/// Publishes the recorded cycles that are not published yet. If a fault ended the servo, the last cycles show its cause.
impl Drop for EventsRecord {
    fn drop(&mut self) {
        // A panic leaves the record of its cycle incomplete.
        if std::thread::panicking() {
            Arc::make_mut(&mut self.message).data.truncate(self.start);
        }
        self.publish();
    }
}
