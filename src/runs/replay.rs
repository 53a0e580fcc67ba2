//! A recorded run once more, without DDS: what came to its servos, as `~/events` has it, through the servo cycle, at the cycle's own
//! times, and what they sent beside what is recorded.

use super::announced::bounded;
use super::motion_rows::MotionRows;
use super::{MotionRow, RunError};
use dq_bags::{Bag, Topic};
use dq_common::text::{NAME, shown};
use dq_config::ServoParameters;
use dq_core::servo::{Event, Motion, Servo, Settings};
use dq_messages::messages::{Message, UInt8MultiArray};
use dq_params::ParameterStore;
use dq_space::space::KeepOut;
use dq_wire::{CycleRecord, MotionContext, MotionReport, Recorded, RecordedParameters, ServoKind};
use serde::Serialize;
use std::collections::BTreeMap;
use std::panic::{AssertUnwindSafe, catch_unwind};
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
    /// Commands that could not be compared: cycles before them are not in the bag, and no beginning since.
    pub not_judged: u64,
    /// Cycles that the bag does not have, and that ended a comparison until the next beginning.
    pub inputs_missing: u64,
    /// Cycles that are in the bag more than once or out of order. They are compared once.
    pub repeated: u64,
    /// Messages that cannot be read.
    pub damaged: u64,
    /// The motions of the replay, which count from the first command on \[s\].
    pub motions: Vec<MotionRow>,
    /// Why nothing is replayed.
    pub why_not: Option<String>,
}

/// Replays every servo of a bag from the first cycle on with which a replay can begin, and after missing cycles from the next such one.
///
/// # Errors
/// [`RunError::NotReplayable`] if no command of any servo could be compared: why; what is wrong with a servo's parameters.
pub fn replay(bag: &mut Bag) -> Result<Vec<Replayed>, RunError> {
    /// Servos that are replayed; nobody runs more of them.
    const MOST: usize = 64;
    let mut servos = BTreeMap::<_, Replica>::new();
    bag.give_only(&[UInt8MultiArray::TYPE]);
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
    let unknown = "it has no record of what came to a servo: ~/events was not recorded (`dq_servo record`, --record and \
                   `ros2 bag record -a` do)";
    let why = replayed.into_iter().find_map(|servo| servo.why_not);
    Err(RunError::NotReplayable(why.unwrap_or_else(|| unknown.to_owned())))
}

fn is_record(topic: &Topic) -> bool {
    topic.name.ends_with("/events") && topic.message == UInt8MultiArray::TYPE
}

/// Returns for each servo of a bag, by its node, from how many seconds after the bag's beginning it can be replayed, or `None` if it cannot
/// be. Reads no more of the bag than necessary.
pub fn replayable_from(mut bag: Bag) -> BTreeMap<String, Option<f64>> {
    let records = bag.topics().into_iter().filter(is_record);
    let node = |topic: &str| topic.strip_suffix("/events").map(|node| shown(node, NAME));
    let mut found: BTreeMap<_, _> = records.filter_map(|topic| Some((node(&topic.name)?, None))).collect();
    let mut first = None;
    while found.values().any(Option::is_none)
        && let Some(message) = bag.next()
    {
        let first = *first.get_or_insert(message.log_time);
        let Some(since @ None) = node(&message.topic).and_then(|node| found.get_mut(&node)) else { continue };
        let record = message.decode::<UInt8MultiArray>().map(|message| message.data).unwrap_or_default();
        let cycles = CycleRecord::read_all(&record).unwrap_or_default();
        if cycles.iter().any(|cycle| matches!(cycle.events.first(), Some(Recorded::Begin(..)))) {
            *since = Some(Duration::from_nanos(message.log_time.abs_diff(first)).as_secs_f64());
        }
    }
    found
}

/// A servo that repeats a recorded one.
struct Replica {
    replayed: Replayed,
    motions: MotionRows,
    /// The times of the first cycle that was compared, and of the last one that was read.
    first: Option<Duration>,
    last: Option<Duration>,
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
    /// Begins a replay with the cycle of that `number`, if its events allow that.
    fn begin(number: u64, events: &[Recorded]) -> Result<Option<Self>, RunError> {
        let [Recorded::Begin(kind, all), Recorded::Saved(saved), ..] = events else { return Ok(None) };
        let mut store = kind.store()?;
        for (name, value) in bounded(all.values.clone())? {
            store.override_initial(&name, value)?;
        }
        let mut parameters = kind.from_store(&store)?;
        parameters.settings = with_drawn(parameters.settings, &all.drawn);
        let mut servo = parameters.build()?;
        let restored = saved.restore(&mut servo);
        Ok(restored.map(|()| Self { kind: *kind, store, parameters, servo, next: number }))
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
        let motions = MotionRows::new(&replayed.node);
        Self { motions, replayed, first: None, last: None, running: None }
    }

    /// Replays the cycles of the next message in the bag.
    fn take(&mut self, bytes: &[u8]) -> Result<(), RunError> {
        match CycleRecord::read_all(bytes) {
            Some(cycles) => cycles.iter().try_for_each(|cycle| self.cycle(cycle)),
            None => {
                self.replayed.damaged += 1;
                Ok(())
            }
        }
    }

    fn cycle(&mut self, record: &CycleRecord) -> Result<(), RunError> {
        if self.last.is_some_and(|last| record.now <= last) {
            self.replayed.repeated += 1;
            return Ok(());
        }
        self.last = Some(record.now);
        let missing = self.running.as_ref().map_or(0, |running| record.number.abs_diff(running.next));
        if missing > 0 {
            self.running = None;
            self.replayed.inputs_missing = self.replayed.inputs_missing.saturating_add(missing);
        }
        let begins = self.running.is_none();
        if begins {
            self.running = Running::begin(record.number, &record.events)?;
            self.motions.start_over();
        }
        let Some(running) = &mut self.running else {
            self.replayed.not_judged += u64::from(record.output.is_some());
            return Ok(());
        };
        let takes_positions = running.parameters.settings.interface.takes_positions();
        self.replayed.unit = if takes_positions { "rad, prismatic: m" } else { "rad/s, prismatic: m/s" };
        let first = *self.first.get_or_insert(record.now);
        let time = record.now.saturating_sub(first).as_secs_f64();
        // A damaged state may decode and still be inconsistent.
        let cycle = AssertUnwindSafe(|| running.cycle(record).map(|sent| sent.map(<[f64]>::to_vec)));
        let Ok(sent) = catch_unwind(cycle) else {
            self.running = None;
            self.replayed.damaged += 1;
            return Ok(());
        };
        self.replayed.compare(sent?.as_deref(), record.output.as_deref(), time, begins);
        for motion in running.servo.take_motions() {
            self.motions.take(time, 0, report(running.kind, &motion));
        }
        Ok(())
    }

    fn finish(mut self) -> Replayed {
        self.replayed.why_not = self.why_not();
        self.replayed.motions = self.motions.finish();
        self.replayed
    }

    /// Returns the reason if no command was compared.
    fn why_not(&self) -> Option<String> {
        let Replayed { node, commands, not_judged, damaged, .. } = &self.replayed;
        let why = match (self.first, self.last) {
            _ if *commands > 0 => return None,
            (Some(_), _) if *not_judged == 0 => "the servo sent no command while it was recorded".to_owned(),
            (Some(_), _) => format!(
                "cycles are missing before each of its {not_judged} commands: messages were lost, or two servos of that name were recorded"
            ),
            (None, Some(_)) => {
                "no beginning of it is in the bag: record for longer, as one comes each 5 s".to_owned()
            }
            (None, None) => format!(
                "nothing can be read of its {damaged} messages: they are damaged, or of another version of dq_servo"
            ),
        };
        Some(format!("the record of {node} cannot be replayed: {why}"))
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
