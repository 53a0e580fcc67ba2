//! What it takes to encode and decode a message, to write and to read a bag, and to run a closed loop:
//! `cargo bench --bench runs`.

use criterion::{BatchSize, Criterion, Throughput, criterion_group, criterion_main};
use dq_servo::compare::{Arm, ClosedLoop, PLANTS, Task};
use dq_servo::control::Law;
use dq_servo::record::{Bag, BagWriter, TopicRecord, WriterOptions};
use dq_servo::runs::{Timeline, replay};
use dq_servo::wire::decode;
use dq_servo::wire::messages::{DiagnosticStatus, Float64MultiArray, JointState, Message, PoseStamped};
use rustdds::RepresentationIdentifier;
use rustdds::serialization::to_writer_with_rep_id;
use std::hint::black_box;
use std::path::Path;
use tempfile::TempDir;

/// Messages of a bag that is written and read.
const MESSAGES: usize = 10_000;

fn encode<M: Message>(message: &M, into: &mut Vec<u8>) {
    into.clear();
    into.extend([0, 1, 0, 0]);
    to_writer_with_rep_id(into, message, RepresentationIdentifier::CDR_LE).unwrap();
}

/// A message of that type as a real ROS 2 encoded it.
fn of_jazzy<M: Message>() -> M {
    let cases: serde_json::Value = serde_json::from_str(include_str!("../data/cdr_jazzy.json")).unwrap();
    let case = cases.as_array().unwrap().iter().find(|case| case["type"] == M::TYPE).unwrap();
    decode(&hex::decode(case["cdr"].as_str().unwrap()).unwrap()).unwrap()
}

fn message<M: Message>(criterion: &mut Criterion, message: &M) {
    let mut bytes = Vec::new();
    let name = M::TYPE.rsplit('/').next().unwrap();
    criterion.bench_function(&format!("encode/{name}"), |bencher| {
        bencher.iter(|| encode(black_box(message), &mut bytes));
    });
    encode(message, &mut bytes);
    criterion.bench_function(&format!("decode/{name}"), |bencher| {
        bencher.iter(|| decode::<M>(black_box(&bytes)).unwrap());
    });
}

fn messages(criterion: &mut Criterion) {
    message(criterion, &of_jazzy::<JointState>());
    message(criterion, &of_jazzy::<PoseStamped>());
    message(criterion, &Float64MultiArray { data: vec![0.1; 6], ..Float64MultiArray::default() });
    message(criterion, &of_jazzy::<DiagnosticStatus>());
}

/// A bag of joint states, a millisecond apart.
fn write(directory: &Path, cdr: &[u8]) {
    let mut bag = BagWriter::create(directory, WriterOptions::default()).unwrap();
    let (name, message) = ("/joint_states".to_owned(), JointState::TYPE.to_owned());
    let id = bag.add_topic(&TopicRecord { name, message, offered: Vec::new() }).unwrap();
    for number in 0..MESSAGES {
        let time = 1_795_000_000_000_000_000 + 1_000_000 * i64::try_from(number).unwrap();
        bag.write(id, time, time, cdr).unwrap();
    }
    bag.finish().unwrap();
}

fn folder() -> TempDir {
    tempfile::tempdir().unwrap()
}

fn bags(criterion: &mut Criterion) {
    let mut cdr = Vec::new();
    encode(&of_jazzy::<JointState>(), &mut cdr);
    let mut group = criterion.benchmark_group("bag");
    group.sample_size(10).throughput(Throughput::Elements(MESSAGES as u64));
    group.bench_function("write", |bencher| {
        bencher.iter_batched_ref(folder, |new| write(&new.path().join("bag"), &cdr), BatchSize::PerIteration);
    });
    let folder = folder();
    let bag = folder.path().join("whole");
    write(&bag, &cdr);
    group.bench_function("read", |bencher| {
        bencher.iter(|| assert_eq!(Bag::open(&bag).unwrap().count(), MESSAGES));
    });
    let demo = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/bag_demo"));
    let commands = || replay(&Timeline::read(Bag::open(demo).unwrap())).unwrap()[0].commands as u64;
    group.throughput(Throughput::Elements(commands()));
    group.bench_function("replay", |bencher| bencher.iter(commands));
}

/// Random tasks, up to 10 s each, in cycles of 5 ms until the arm has settled.
fn loops(criterion: &mut Criterion) {
    let arms = Arm::builtin().unwrap();
    let arm = arms.iter().find(|arm| arm.name == "puma560").unwrap();
    let tasks: Vec<Task> = (0..32).map(|number| arm.task(1, number).unwrap()).collect();
    let mut group = criterion.benchmark_group("closed_loop");
    group.sample_size(10).throughput(Throughput::Elements(tasks.len() as u64));
    for (law, gain) in [(Law::Diffc, 185.0), (Law::Logc, 2.0)] {
        let controller = arm.parameters.settings.controller.with_law(law, gain);
        for (limits, who) in [(false, "law"), (true, "servo")] {
            let closed_loop = ClosedLoop { arm, controller, plant: PLANTS[0], limits };
            group.bench_function(format!("cycles/{}/{who}", law.name()), |bencher| {
                let run = |number: usize| closed_loop.run(&tasks[number], number as u32).unwrap().outcome;
                bencher.iter(|| (0..tasks.len()).map(run).collect::<Vec<_>>());
            });
        }
    }
}

criterion_group!(benches, messages, bags, loops);
criterion_main!(benches);
