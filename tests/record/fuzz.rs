//! Bytes gone wrong: the reader answers, whatever they are.

use crate::bags::{data_file, jazzy, read, samples, write};
use crate::damage::{apply, damage};
use dq_servo::record::{Bag, WriterOptions};
use dq_servo::ros::messages::{DiagnosticArray, JointState, decode};
use dq_servo::runs::{Fallback, Timeline, plot, recorded, replay};
use proptest::prelude::*;
use proptest::sample::Index;
use std::path::PathBuf;
use std::sync::LazyLock;

static PUMA560: LazyLock<Fallback> = LazyLock::new(crate::runs::puma560);

/// Whole files to start from, by name: bags of ours and of a real ROS 2, and their metadata.
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

/// Reads all there is. What matters is that it comes back.
fn read_through(bytes: &[u8]) -> usize {
    let directory = tempfile::tempdir().unwrap();
    let path: PathBuf = directory.path().join("file");
    std::fs::write(&path, bytes).unwrap();
    let Ok(bag) = Bag::open(&path) else { return 0 };
    let told: u64 = bag.topics().iter().map(|topic| topic.count).sum();
    let mut read = 0;
    for message in bag.messages().filter_map(Result::ok) {
        let _ = (decode::<JointState>(&message.cdr), decode::<DiagnosticArray>(&message.cdr));
        read += 1;
    }
    if let Ok(timeline) = Timeline::read(&bag) {
        let runs = recorded(&timeline, "bag", &PUMA560);
        let _ = runs.map(|runs| plot(&runs).unwrap());
    }
    let _ = replay(&bag);
    // SQLite counts by another path through a broken file than it reads.
    assert!(bytes.starts_with(b"SQLite") || u64::try_from(read).unwrap() <= told);
    read
}

#[test]
fn the_originals_are_whole() {
    let counts: Vec<_> = ORIGINALS.iter().map(|(name, bytes)| (*name, read_through(bytes))).collect();
    assert_eq!(counts.len(), 9);
    for (name, count) in counts {
        match name {
            "demo" => assert!(count > 2000),
            "mcap" | "sqlite3" => assert_eq!(count, 2401, "{name}"),
            _ => assert_eq!(count, 60, "{name}"),
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
        read_through(&bytes);
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
        prop_assert!(read(directory.path()).is_err(), "there is no data file");
    }
}
