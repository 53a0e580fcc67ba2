//! Replays a recorded run without DDS. The servo cycle gets the recorded inputs of the bag's servos (`~/events`) at the recorded
//! times. The replay compares the commands of this cycle with the recorded commands.

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

/// The comparison of a servo's replayed commands with the recorded ones.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Replayed {
    /// The name of the servo's node.
    pub node: String,
    /// The number of commands that were compared.
    pub commands: u64,
    /// The number of commands that differ in any bit.
    pub different: u64,
    /// The number of differing commands that the replay does not send at all.
    pub not_sent: u64,
    /// The largest difference of a joint's command, in `unit`.
    pub largest_difference: f64,
    /// The unit of the commands.
    pub unit: &'static str,
    /// The time of the cycle with the first differing command, counted from the first compared cycle \[s\]; `None` if no command
    /// differs.
    pub first_difference_s: Option<f64>,
    /// The time intervals in which commands were compared \[s\], counted from the first compared cycle.
    pub judged_s: Vec<(f64, f64)>,
    /// The number of commands that could not be compared. The comparison begins at a cycle with a saved state. After a missing cycle,
    /// it pauses until the next cycle with a saved state.
    pub not_judged: u64,
    /// The number of missing cycles.
    pub inputs_missing: u64,
    /// The number of skipped cycles: those that repeat an earlier cycle or are out of order.
    pub repeated: u64,
    /// The number of messages that cannot be read.
    pub damaged: u64,
    /// The motions of the replay. Their times count from the first compared cycle \[s\].
    pub motions: Vec<MotionRow>,
    /// The reason why no command of this servo was compared; `None` if at least one command was compared.
    pub why_not: Option<String>,
}

/// Replays every servo of a bag from the servo's first cycle with a saved state. After missing cycles, continues at the next cycle
/// with a saved state.
///
/// # Errors
/// [`RunError::NotReplayable`] with the reason if no command of any servo could be compared; [`RunError`] if a servo's parameters
/// are invalid.
pub fn replay(bag: &mut Bag) -> Result<Vec<Replayed>, RunError> {
    /// The largest number of servos that are replayed.
    const MOST: usize = 64;
    let mut servos = BTreeMap::<_, Replica>::new();
    bag.give_only(&[UInt8MultiArray::TYPE]);
    // Without a topic of records, the bag is rejected before any message is read.
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

/// Returns the names of the servos' nodes in a bag, each with the time from which the servo can be replayed. The time is in seconds
/// after the bag's beginning; `None` if the servo cannot be replayed. Reads no more of the bag than necessary.
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

/// The replay of a servo.
struct Replica {
    replayed: Replayed,
    motions: MotionRows,
    /// The time of the first cycle that was compared.
    first: Option<Duration>,
    /// The time of the last cycle that was read.
    last: Option<Duration>,
    running: Option<Running>,
}

/// The servo of the replay, with its parameters. It exists from a cycle with a saved state until a cycle is missing.
struct Running {
    kind: ServoKind,
    store: ParameterStore,
    parameters: ServoParameters,
    servo: Servo,
    /// The number of the next cycle.
    next: u64,
}

impl Running {
    /// Begins the replay at cycle number `number`. Returns `None` unless `events` begin with the servo's parameters and its saved
    /// state.
    fn begin(number: u64, events: &[Recorded]) -> Result<Option<Self>, RunError> {
        let [Recorded::Begin(kind, all), Recorded::Saved(saved), ..] = events else { return Ok(None) };
        let mut store = kind.store()?;
        for (name, value) in bounded(all.values.clone())? {
            store.override_initial(&name, value)?;
        }
        let mut parameters = kind.from_store(&store)?;
        parameters.settings = with_drawn(&parameters.settings, &all.drawn)?;
        let mut servo = parameters.build()?;
        let restored = saved.restore(&mut servo);
        Ok(restored.map(|()| Self { kind: *kind, store, parameters, servo, next: number }))
    }

    /// Gives the servo a recorded event.
    fn take(&mut self, recorded: &Recorded) -> Result<(), RunError> {
        // Ignore the result: the recorded servo also rejected the events that this servo rejects.
        if let Recorded::Parameters(RecordedParameters { values, drawn }) = recorded {
            self.store = self.store.with(&bounded(values.clone())?)?;
            let settings = with_drawn(&self.kind.from_store(&self.store)?.settings, drawn)?;
            let _ = self.servo.take(Event::Configure(Box::new(settings)));
        } else if let Some(event) = recorded.event(&self.parameters.joints) {
            let _ = self.servo.take(event);
        }
        Ok(())
    }

    /// Replays a cycle, and returns the output.
    fn cycle(&mut self, record: &CycleRecord) -> Result<Option<&[f64]>, RunError> {
        self.servo.begin(record.now);
        record.events.iter().try_for_each(|event| self.take(event))?;
        self.servo.step(record.now);
        self.next += 1;
        Ok(self.servo.output())
    }
}

/// Returns a copy of `settings` with the live keep-outs `drawn`, which were recorded in the bag as texts.
///
/// # Errors
/// [`RunError::KeepOut`] for a text that is not a keep-out; [`RunError::Scene`] if there are too many keep-outs.
fn with_drawn(settings: &Settings, drawn: &[String]) -> Result<Settings, RunError> {
    let parse =
        |text: &String| text.parse().map_err(|why| RunError::KeepOut { keep_out: shown(text, NAME), why });
    let keep_outs: Vec<KeepOut> = drawn.iter().map(parse).collect::<Result<_, _>>()?;
    Ok(settings.keeping_out_of(&keep_outs)?)
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
        // A saved state that is damaged may still be decoded. The cycle may then panic.
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

    /// Returns the reason why no command was compared; `None` if at least one command was compared.
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
    let (law, gains) = kind.law_of(motion);
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

#[cfg(test)]
mod tests {
    use super::*;
    use dq_config::NodeParameters;
    use dq_wire::Saved;

    /// If the replay left out an invalid keep-out, it would compare the recorded commands with those of a servo that has other
    /// keep-outs.
    #[test]
    fn a_live_keep_out_that_is_invalid_ends_the_replay_by_name() {
        let begin = |keep_out: &str| {
            let drawn = vec!["post sphere 0.5 0 0.5 0.1".to_owned(), keep_out.to_owned()];
            let (store, ..) = ServoParameters::start("/dq_servo", Vec::new()).unwrap();
            let all = RecordedParameters { values: store.values().collect(), drawn };
            let events = [Recorded::Begin(ServoKind::OneArm, all), Recorded::Saved(Saved((&[][..]).into()))];
            Running::begin(1, &events).map(|_| ()).map_err(|why| why.to_string())
        };
        assert_eq!(begin("table half_space 0 0 1 0"), Ok(()));
        let why = begin("table half_space 0 0").unwrap_err();
        assert!(why.starts_with("the live keep-out \"table half_space 0 0\" in the bag: "), "{why}");
    }
}
