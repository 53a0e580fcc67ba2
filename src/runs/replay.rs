//! A recorded run once more, without DDS: what came to its servos, as `~/events` has it, through the servo cycle, at the cycle's own
//! times, and what they sent beside what is recorded.

use super::announced::bounded;
use super::motion_rows::MotionRows;
use super::{MotionRow, RunError};
use crate::config::ServoParameters;
use crate::params::ParameterStore;
use crate::record::{Bag, Topic};
use crate::servo::{Event, Motion, Servo, Settings};
use crate::space::KeepOut;
use crate::text::{NAME, shown};
use crate::wire::messages::{Message, UInt8MultiArray};
use crate::wire::{CycleRecord, MotionContext, MotionReport, Recorded, RecordedParameters, ServoKind};
use serde::Serialize;
use std::collections::BTreeMap;
use std::time::Duration;

/// A servo's commands, recorded and replayed.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Replayed {
    /// The servo's node.
    pub node: String,
    /// Commands compared.
    pub commands: u64,
    /// Commands that differ in any bit.
    pub different: u64,
    /// Of these, commands where the replay sends none.
    pub not_sent: u64,
    /// Largest difference of a joint's command, in the `unit`.
    pub largest_difference: f64,
    /// The unit of the commands.
    pub unit: &'static str,
    /// The cycle's time of the first command that differs, from the first one on \[s\].
    pub first_difference_s: Option<f64>,
    /// From when to when commands were compared, by the cycle's time from the first one on \[s\].
    pub judged_s: Vec<(f64, f64)>,
    /// Commands that could not be compared: cycles before them are not in the bag.
    pub not_judged: u64,
    /// Cycles that the bag does not have, and that ended a comparison.
    pub inputs_missing: u64,
    /// The motions of the replay, which count from the first command on \[s\].
    pub motions: Vec<MotionRow>,
    /// Why nothing is replayed.
    pub why_not: Option<String>,
}

/// Replays every servo of a bag, from each cycle on in which it was new, as long as the bag has all that came to it.
///
/// # Errors
/// [`RunError::NotReplayable`] where the bag has no record of a servo from such a cycle on; what is said of its parameters.
pub fn replay(bag: &mut Bag) -> Result<Vec<Replayed>, RunError> {
    /// Servos that are replayed; nobody runs more of them.
    const MOST: usize = 64;
    let mut servos = BTreeMap::<_, Replica>::new();
    bag.give_only(&[UInt8MultiArray::TYPE]);
    let is_record = |topic: &Topic| topic.name.ends_with("/events") && topic.message == UInt8MultiArray::TYPE;
    // What the bag says of its topics is enough to refuse it.
    let messages = if bag.topics().iter().any(is_record) { Some(bag) } else { None };
    for message in messages.into_iter().flatten() {
        let Some(node) = message.topic.strip_suffix("/events") else { continue };
        if servos.contains_key(&message.topic) || servos.len() < MOST {
            let servo = servos.entry(message.topic.clone()).or_insert_with(|| Replica::new(node));
            let bytes = message.decode::<UInt8MultiArray>().map(|message| message.data).unwrap_or_default();
            servo.take(&bytes)?;
        }
    }
    let replayed: Vec<_> = servos.into_values().map(Replica::finish).collect();
    if replayed.iter().any(|servo| servo.why_not.is_none()) {
        return Ok(replayed);
    }
    let unknown = "it has no record of what came to a servo: nobody had set the parameter events of the servo, or ~/events was not \
                   recorded (`dq_servo record` and --record do both)";
    let why = replayed.into_iter().find_map(|servo| servo.why_not);
    Err(RunError::NotReplayable(why.unwrap_or_else(|| unknown.to_owned())))
}

/// A servo that repeats a recorded one.
struct Replica {
    replayed: Replayed,
    motions: MotionRows,
    /// The time of the first cycle.
    first: Option<Duration>,
    running: Option<Running>,
}

/// It goes on, as long as no cycle is missing.
struct Running {
    kind: ServoKind,
    store: ParameterStore,
    parameters: ServoParameters,
    servo: Servo,
    /// The number of the next cycle.
    next: u64,
}

impl Running {
    fn new(kind: ServoKind, all: &RecordedParameters) -> Result<Self, RunError> {
        let mut store = kind.store()?;
        for (name, value) in bounded(all.values.clone())? {
            store.override_initial(&name, value)?;
        }
        let mut parameters = kind.from_store(&store)?;
        parameters.settings = with_drawn(parameters.settings, &all.drawn);
        Ok(Self { kind, store, servo: parameters.build()?, parameters, next: 0 })
    }

    /// Takes what the recorded servo took.
    fn take(&mut self, recorded: &Recorded) -> Result<(), RunError> {
        // What is rejected was rejected before.
        if let Recorded::Parameters(RecordedParameters { values, drawn }) = recorded {
            self.store = self.store.with(&bounded(values.clone())?)?;
            let settings = with_drawn(self.kind.from_store(&self.store)?.settings, drawn);
            let _ = self.servo.take(Event::Configure(Box::new(settings)));
        } else if let Some(event) = recorded.event(&self.parameters.joints) {
            let _ = self.servo.take(event);
        }
        Ok(())
    }

    /// Repeats a cycle: what is sent.
    fn cycle(&mut self, record: &CycleRecord) -> Result<Option<&[f64]>, RunError> {
        self.servo.begin(record.now);
        record.events.iter().try_for_each(|event| self.take(event))?;
        self.servo.step(record.now);
        self.next += 1;
        Ok(self.servo.output())
    }
}

/// These settings with what was drawn to keep out of besides, as far as that can be read.
fn with_drawn(settings: Settings, drawn: &[String]) -> Settings {
    let solids: Vec<KeepOut> = drawn.iter().filter_map(|text| text.parse().ok()).collect();
    settings.keeping_out_of(&solids).unwrap_or(settings)
}

impl Replica {
    fn new(node: &str) -> Self {
        let replayed = Replayed { node: shown(node, NAME), ..Replayed::default() };
        Self { motions: MotionRows::new(&replayed.node), replayed, first: None, running: None }
    }

    /// Takes the record of the next cycle that is in the bag.
    fn take(&mut self, bytes: &[u8]) -> Result<(), RunError> {
        let Some(record) = CycleRecord::read(bytes) else { return Ok(()) };
        let missing = self.running.as_ref().map_or(0, |running| record.number.abs_diff(running.next));
        let mut begins = false;
        if let Some(Recorded::New(kind, all)) = record.events.first() {
            let running = Running::new(*kind, all)?;
            let takes_positions = running.parameters.settings.interface.takes_positions();
            self.replayed.unit = if takes_positions { "rad, prismatic: m" } else { "rad/s, prismatic: m/s" };
            (self.running, begins) = (Some(running), true);
            self.motions.start_over();
        } else if missing > 0 {
            self.running = None;
            self.replayed.inputs_missing = self.replayed.inputs_missing.saturating_add(missing);
        }
        let Some(running) = &mut self.running else {
            self.replayed.not_judged += u64::from(record.output.is_some());
            return Ok(());
        };
        let first = *self.first.get_or_insert(record.now);
        let time = record.now.saturating_sub(first).as_secs_f64();
        let sent = running.cycle(&record)?;
        self.replayed.compare(sent, record.output.as_deref(), time, begins);
        for motion in running.servo.take_motions() {
            self.motions.take(time, 0, report(running.kind, &motion));
        }
        Ok(())
    }

    fn finish(mut self) -> Replayed {
        self.replayed.motions = self.motions.finish();
        let node = &self.replayed.node;
        self.replayed.why_not = self.first.is_none().then(|| {
            format!(
                "the record of {node} does not begin in it: the recording began later, or another version of dq_servo made it (`dq_servo \
                 param set events true` lets a record begin anew when the arm stands)"
            )
        });
        self.replayed
    }
}

fn report(kind: ServoKind, motion: &Motion) -> MotionReport {
    let why = motion.why(|joint| format!("joint {joint}"));
    let (law, gains) = (kind.law(&motion.controller), kind.gains(&motion.controller));
    MotionReport::new(motion, MotionContext { law, gains, why, ..MotionContext::default() })
}

impl Replayed {
    fn compare(&mut self, replayed: Option<&[f64]>, recorded: Option<&[f64]>, time: f64, begins: bool) {
        match self.judged_s.last_mut().filter(|_| !begins) {
            Some((_, end)) => *end = time,
            None => self.judged_s.push((time, time)),
        }
        if replayed.is_none() && recorded.is_none() {
            return;
        }
        self.commands += 1;
        let [one, other] = [replayed, recorded].map(Option::unwrap_or_default);
        let same = |(a, b): (&f64, &f64)| a.to_bits() == b.to_bits();
        if one.len() != other.len() || !one.iter().zip(other).all(same) {
            self.not_sent += u64::from(one.is_empty());
            let differences = one.iter().zip(other).map(|(a, b)| (a - b).abs());
            self.different += 1;
            self.largest_difference = differences.fold(self.largest_difference, f64::max);
            self.first_difference_s.get_or_insert(time);
        }
    }
}
