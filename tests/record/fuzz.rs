//! Tests damaged bytes: the reader always returns.

use crate::bags::{data_file, jazzy, samples, write};
use crate::damage::{apply, damage};
use dq_bags::{Bag, WriterOptions};
use dq_config::ServoParameters;
use dq_figures::Width;
use dq_messages::decode;
use dq_messages::messages::{DiagnosticArray, JointState};
use dq_runs::{plot, recorded, replay};
use proptest::prelude::*;
use proptest::sample::Index;
use std::collections::HashSet;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::PathBuf;
use std::sync::{LazyLock, Mutex};

static PUMA560: LazyLock<ServoParameters> = LazyLock::new(crate::runs::puma560);

/// Complete files with their names: our bags, those of a real ROS 2, and their metadata.
static ORIGINALS: LazyLock<Vec<(&str, Vec<u8>)>> = LazyLock::new(|| {
    let directory = tempfile::tempdir().unwrap();
    let path = |name: &str| directory.path().join(name);
    write(&path("ours"), WriterOptions::default(), &samples(5));
    let mut all = vec![("ours", std::fs::read(data_file(&path("ours"))).unwrap())];
    for (kind, options) in crate::reading::mcap_kinds() {
        crate::reading::mcap_file(&path("kind"), options, "cdr", &samples(5));
        all.push((kind, std::fs::read(path("kind")).unwrap()));
    }
    let demo = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/bag_demo");
    all.push(("demo", std::fs::read(data_file(demo.as_ref())).unwrap()));
    for storage in ["mcap", "sqlite3"] {
        std::fs::create_dir(path(storage)).unwrap();
        let file = std::fs::read(data_file(&jazzy(&path(storage), storage))).unwrap();
        all.push((storage, file));
    }
    all
});

/// The outcomes that were already processed. Much damage has the same outcome, because a chunk is read completely or not at all.
static EXPLAINED: LazyLock<Mutex<HashSet<u64>>> = LazyLock::new(Mutex::default);

/// Reads, draws and replays all data in `bytes`, which must return. Returns the number of messages.
fn take_in(bytes: &[u8]) -> usize {
    let directory = tempfile::tempdir().unwrap();
    let path: PathBuf = directory.path().join("file");
    std::fs::write(&path, bytes).unwrap();
    let Ok(mut bag) = Bag::open(&path) else { return 0 };
    let (mut count, mut outcome) = (0, DefaultHasher::new());
    for message in bag.by_ref() {
        let _ = (decode::<JointState>(&message.cdr), decode::<DiagnosticArray>(&message.cdr));
        (&message.topic, &message.message, message.log_time, &message.cdr).hash(&mut outcome);
        count += 1;
    }
    assert_eq!(bag.topics().iter().map(|topic| topic.count).sum::<u64>(), count);
    assert!(bag.losses().lines().all(|line| line.lines().count() == 1));
    if EXPLAINED.lock().unwrap().insert(outcome.finish()) {
        let recorded = recorded(&path, "bag", &PUMA560);
        let figures = recorded.map(|recorded| plot(&recorded.runs)).unwrap_or_default();
        figures.iter().for_each(|figure| drop(figure.svg(Width::Screen)));
        let _ = replay(&mut Bag::open(&path).unwrap());
    }
    usize::try_from(count).unwrap()
}

#[test]
fn the_originals_are_whole() {
    let counts: Vec<_> = ORIGINALS.iter().map(|(name, bytes)| (*name, take_in(bytes))).collect();
    assert_eq!(counts.len(), 9);
    for (name, count) in counts {
        match name {
            "demo" => assert!(count > 2000),
            "mcap" | "sqlite3" => assert_eq!(count, 2401, "{name}"),
            _ => assert_eq!(count, 75, "{name}"),
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 2000, ..ProptestConfig::default() })]
    #[test]
    fn damaged_files_never_bring_the_reader_down(
        original in any::<Index>(),
        damages in prop::collection::vec(damage(), 1..6),
    ) {
        let mut bytes = original.get(&ORIGINALS).1.clone();
        damages.iter().for_each(|damage| apply(damage, &mut bytes));
        take_in(&bytes);
    }

    #[test]
    fn damaged_metadata_never_brings_the_reader_down(damages in prop::collection::vec(damage(), 1..6)) {
        static METADATA: LazyLock<Vec<u8>> = LazyLock::new(|| {
            std::fs::read(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/data/bag_jazzy_mcap/metadata.yaml")).unwrap()
        });
        let mut bytes = METADATA.clone();
        damages.iter().for_each(|damage| apply(damage, &mut bytes));
        let directory = tempfile::tempdir().unwrap();
        std::fs::write(directory.path().join("metadata.yaml"), bytes).unwrap();
        prop_assert!(Bag::open(directory.path()).is_err(), "there is no data file");
    }
}
