//! Bags for the tests.

use dq_bags::{Bag, BagError, BagMessage, BagWriter, Topic, TopicRecord, WriterOptions};
use dq_messages::messages::{Message, UInt8MultiArray};
use dq_messages::{DurabilityKind, LivelinessKind, OfferedQos, ReliabilityKind, decode, definition};
use dq_wire::CycleRecord;
use rustdds::RepresentationIdentifier;
use rustdds::serialization::to_writer_with_rep_id;
use serde_json::Value;
use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Duration;

/// A message that is not yet in a bag.
#[derive(Clone, Debug, PartialEq)]
pub struct Sample {
    pub topic: String,
    pub message: String,
    pub time: i64,
    pub cdr: Vec<u8>,
}

impl From<BagMessage> for Sample {
    fn from(read: BagMessage) -> Self {
        Self {
            topic: read.topic.to_string(),
            message: read.message.to_string(),
            time: read.log_time,
            cdr: read.cdr,
        }
    }
}

/// Returns all recordable messages that a real ROS 2 Jazzy encoded, `rounds` times. The times of the messages are a millisecond
/// apart.
pub fn samples(rounds: usize) -> Vec<Sample> {
    let all: Vec<Value> = serde_json::from_str(include_str!("../data/cdr_jazzy.json")).unwrap();
    let text = |case: &Value, key: &str| case[key].as_str().unwrap().to_owned();
    let known: Vec<_> = all.iter().filter(|case| definition(&text(case, "type")).is_some()).collect();
    assert_eq!(known.len(), 15);
    let sample = |(index, case): (usize, &&Value)| Sample {
        topic: format!("/ns/{}", text(case, "type").rsplit('/').next().unwrap().to_lowercase()),
        message: text(case, "type"),
        time: 1_795_000_000_000_000_000 + 1_000_000 * i64::try_from(index).unwrap(),
        cdr: hex::decode(text(case, "cdr")).unwrap(),
    };
    known.iter().cycle().take(rounds * known.len()).enumerate().map(sample).collect()
}

/// Returns the QoS of a latched, reliable publisher.
pub fn latched() -> OfferedQos {
    OfferedQos {
        reliability: ReliabilityKind::Reliable,
        durability: DurabilityKind::TransientLocal,
        deadline: None,
        lifespan: Some(Duration::from_millis(10_250)),
        liveliness: LivelinessKind::Automatic,
        liveliness_lease: None,
    }
}

/// Writes the samples into a new bag, with every topic announced by two publishers.
pub fn write(directory: &Path, options: WriterOptions, samples: &[Sample]) -> dq_bags::WrittenBag {
    let mut bag = BagWriter::create(directory, options).unwrap();
    let mut ids = std::collections::BTreeMap::new();
    for sample in samples {
        let id = *ids.entry(&sample.topic).or_insert_with(|| {
            let lossy = OfferedQos { reliability: ReliabilityKind::BestEffort, ..latched() };
            let record = TopicRecord::new(&sample.topic, &sample.message);
            bag.add_topic(&TopicRecord { offered: vec![latched(), lossy], ..record }).unwrap()
        });
        bag.write(id, sample.time, sample.time - 5, &sample.cdr).unwrap();
    }
    bag.finish().unwrap()
}

/// Returns all messages of an undamaged bag.
#[track_caller]
pub fn read(path: &Path) -> Vec<Sample> {
    let (samples, _, losses) = read_through(path).unwrap();
    assert_eq!(losses, [""; 0]);
    samples
}

/// The messages, topics and losses of a bag.
type Contents = (Vec<Sample>, Vec<Topic>, Vec<String>);

/// Returns all messages, topics and losses of a bag.
pub fn read_through(path: &Path) -> Result<Contents, BagError> {
    let mut bag = Bag::open(path)?;
    let samples = bag.by_ref().map(Sample::from).collect();
    Ok((samples, bag.topics(), bag.losses().lines().collect()))
}

/// Returns the topics of a bag with their numbers of messages.
pub fn topics(path: &Path) -> Vec<(String, u64)> {
    let (_, topics, _) = read_through(path).unwrap();
    topics.into_iter().map(|topic| (topic.name, topic.count)).collect()
}

/// Unpacks the bag of a real `ros2 bag record` into `into`, and returns its directory.
pub fn jazzy(into: &Path, storage: &str) -> PathBuf {
    let packed =
        Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data")).join(format!("bag_jazzy_{storage}"));
    let directory = into.join("jazzy");
    std::fs::create_dir(&directory).unwrap();
    for entry in packed.read_dir().unwrap().map(Result::unwrap) {
        let name = entry.file_name().into_string().unwrap();
        let bytes = std::fs::read(entry.path()).unwrap();
        let (name, bytes) = match name.strip_suffix(".zst") {
            Some(name) => (name.to_owned(), zstd::decode_all(&bytes[..]).unwrap()),
            None => (name, bytes),
        };
        std::fs::write(directory.join(name), bytes).unwrap();
    }
    directory
}

/// Returns the bag's first data file.
pub fn data_file(directory: &Path) -> PathBuf {
    let mut files: Vec<_> = directory.read_dir().unwrap().map(|entry| entry.unwrap().path()).collect();
    let endings = ["mcap", "db3", "zstd"];
    files.retain(|path| {
        path.extension().is_some_and(|extension| endings.iter().any(|ending| extension == *ending))
    });
    files.sort();
    files.swap_remove(0)
}

/// Encodes a message in the form in which it is sent.
pub fn encode(message: &impl Message) -> Vec<u8> {
    let mut bytes = vec![0, 1, 0, 0];
    to_writer_with_rep_id(&mut bytes, message, RepresentationIdentifier::CDR_LE).unwrap();
    bytes
}

/// Changes the message in the sample.
pub fn alter<M: Message>(sample: &mut Sample, alter: impl FnOnce(&mut M)) {
    let mut message: M = decode(&sample.cdr).unwrap();
    alter(&mut message);
    sample.cdr = encode(&message);
}

/// Changes the cycles in the sample.
pub fn alter_cycles(sample: &mut Sample, alter_them: impl FnOnce(&mut Vec<CycleRecord>)) {
    alter(sample, |message: &mut UInt8MultiArray| {
        let bytes = std::mem::take(&mut message.data);
        let mut cycles = CycleRecord::read_all(&bytes).unwrap();
        alter_them(&mut cycles);
        for cycle in cycles {
            CycleRecord::begin(cycle.number, cycle.now, &mut message.data);
            cycle.events.iter().for_each(|event| event.write(&mut message.data));
            CycleRecord::end(cycle.output.as_deref(), &mut message.data);
        }
    });
}

/// Returns the number of recorded cycles in these samples.
pub fn cycles_of(samples: &[Sample]) -> usize {
    let records = samples.iter().filter(|sample| sample.topic == EVENTS);
    let messages = records.map(|sample| decode::<UInt8MultiArray>(&sample.cdr).unwrap());
    messages.map(|message| CycleRecord::read_all(&message.data).unwrap().len()).sum()
}

/// Returns a path in a folder. The folder is deleted with the test.
pub fn place(name: &str) -> (tempfile::TempDir, PathBuf) {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join(name);
    (directory, path)
}

/// The bag of the demo.
pub const DEMO: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/bag_demo");

/// The topic of the record of the demo's servo.
pub const EVENTS: &str = "/dq_servo/events";

pub fn demo() -> Vec<Sample> {
    read(Path::new(DEMO))
}

/// Writes the demo's bag with changed messages.
pub fn demo_with(path: &Path, change: impl FnOnce(&mut Vec<Sample>)) {
    let mut samples = demo();
    change(&mut samples);
    write(path, WriterOptions::default(), &samples);
}

/// Writes the demo's bag with changes to its messages of this type.
pub fn altered<M: Message>(path: &Path, mut change: impl FnMut(&mut M)) {
    demo_with(path, |samples| {
        let of_type = samples.iter_mut().filter(|sample| sample.message == M::TYPE);
        of_type.for_each(|sample| alter(sample, &mut change));
    });
}

/// Writes the demo's bag with changes to its records.
pub fn altered_records(path: &Path, mut change: impl FnMut(&mut CycleRecord)) {
    demo_with(path, |samples| {
        let records = samples.iter_mut().filter(|sample| sample.topic == EVENTS);
        records.for_each(|sample| alter_cycles(sample, |cycles| cycles.iter_mut().for_each(&mut change)));
    });
}

/// Writes the demo's bag without some messages, as `ros2 bag record -a` does, which subscribes late.
pub fn demo_without(path: &Path, mut is_missing: impl FnMut(&Sample) -> bool) {
    demo_with(path, |samples| samples.retain(|sample| !is_missing(sample)));
}

/// Runs the program. Returns its code, stdout and stderr.
pub fn dq_servo(arguments: &[&dyn AsRef<OsStr>]) -> (Option<i32>, String, String) {
    let mut command = Command::new(env!("CARGO_BIN_EXE_dq_servo"));
    let output = command.args(arguments.iter().map(|argument| argument.as_ref())).output().unwrap();
    let [stdout, stderr] = [output.stdout, output.stderr].map(|bytes| String::from_utf8(bytes).unwrap());
    (output.status.code(), stdout, stderr)
}
