//! Tests damaged and malicious bags: undamaged parts are read, and losses are reported, in bounded memory and time.

use crate::bags::{
    EVENTS, Sample, altered, altered_records, data_file, demo, dq_servo, encode, jazzy, place, read,
    read_through, samples, write,
};
use crate::measured;
use crate::reading::mcap_file;
use crate::runs::puma560;
use dq_bags::{Bag, BagError, WriterOptions};
use dq_figures::Width;
use dq_messages::ParameterEvent;
use dq_messages::messages::{JointState, Message as _, UInt8MultiArray};
use dq_params::Value;
use dq_runs::{plot, recorded, replay};
use dq_wire::{CycleRecord, Recorded, Saved};
use mcap::WriteOptions;
use std::collections::BTreeSet;
use std::path::Path;
use std::time::Duration;

#[track_caller]
fn assert_lines(losses: &[String], path: &Path) {
    let name = path.file_name().unwrap().to_str().unwrap();
    let is_line =
        |line: &String| line.lines().count() == 1 && (line.contains(name) || line.contains("more losses"));
    assert!(losses.iter().all(is_line), "{losses:?}");
}

/// Flips one bit in every 23rd byte in turn. Everything before this byte is read, except for its `chunk`, and losses are reported.
fn flip_each(path: &Path, samples: &[Sample], chunk: usize) {
    let whole = std::fs::read(path).unwrap();
    for at in (8..whole.len() - 8).step_by(23) {
        let mut bytes = whole.clone();
        bytes[at] ^= 1 << (at % 8);
        std::fs::write(path, bytes).unwrap();
        let (read, _, losses) = read_through(path).unwrap();
        assert_lines(&losses, path);
        assert!(read.len() == samples.len() || !losses.is_empty(), "byte {at}: {} read, no loss", read.len());
        // The index is the last part of the file.
        let before = samples.len() * at / whole.len();
        assert!(read.len() + chunk >= before, "byte {at}: {} read of {before}, {losses:?}", read.len());
    }
}

#[test]
fn one_flipped_bit_ends_the_reading_at_its_chunk_and_is_reported() {
    let (_directory, path) = place("file.mcap");
    let samples = samples(30);
    mcap_file(&path, WriteOptions::new().chunk_size(Some(4096)), "cdr", &samples);
    let bytes = std::fs::read(&path).unwrap();
    let chunks = mcap::Summary::read(&bytes).unwrap().unwrap().chunk_indexes.len();
    assert!(chunks >= 8, "{chunks}");
    flip_each(&path, &samples, 2 * samples.len() / chunks);
    let (read, _, _) = read_through(&path).unwrap();
    assert_eq!(read, samples[..read.len()]);
}

/// In such a file, times and numbers have no checksum, so a flipped bit in them is not detected. Every loss is reported.
#[test]
fn one_flipped_bit_in_a_file_without_chunks_ends_the_reading_there() {
    let (_directory, path) = place("file.mcap");
    let samples = samples(10);
    mcap_file(&path, WriteOptions::new().use_chunks(false), "cdr", &samples);
    flip_each(&path, &samples, 10);
}

#[test]
fn chunks_out_of_order_are_read_in_order_after_the_summary_is_lost_too() {
    let (_directory, path) = place("file.mcap");
    let mut samples = samples(50);
    samples.reverse();
    mcap_file(&path, WriteOptions::new().chunk_size(Some(4096)), "cdr", &samples);
    samples.reverse();
    let bytes = std::fs::read(&path).unwrap();
    let last = mcap::Summary::read(&bytes).unwrap().unwrap().chunk_indexes.last().unwrap().clone();
    let end = usize::try_from(last.chunk_start_offset + last.chunk_length).unwrap();
    std::fs::write(&path, &bytes[..end]).unwrap();
    let (read, _, losses) = read_through(&path).unwrap();
    assert_eq!(read, samples);
    assert!(losses.len() == 1 && losses[0].contains("cut off"), "{losses:?}");
}

#[test]
fn a_chunk_that_lies_about_its_beginning_is_read_in_order() {
    let (_directory, path) = place("file.mcap");
    let samples = samples(50);
    mcap_file(&path, WriteOptions::new().chunk_size(Some(4096)), "cdr", &samples);
    let mut bytes = std::fs::read(&path).unwrap();
    let chunks = mcap::Summary::read(&bytes).unwrap().unwrap().chunk_indexes;
    for (chunk, start) in [(&chunks[1], i64::MAX), (&chunks[3], 0)] {
        let place = usize::try_from(chunk.chunk_start_offset).unwrap() + 9;
        bytes[place..place + 8].copy_from_slice(&start.to_le_bytes());
    }
    std::fs::write(&path, bytes).unwrap();
    assert_eq!(read(&path), samples);
}

#[test]
fn a_message_whose_data_are_missing_is_reported_and_not_counted() {
    let directory = tempfile::tempdir().unwrap();
    let file = data_file(&jazzy(directory.path(), "sqlite3"));
    let mut bytes = std::fs::read(&file).unwrap();
    // In the header of a row, the type of its data is changed from a blob to null.
    assert_eq!(std::mem::replace(&mut bytes[153_772], 0), 0x81);
    std::fs::write(&file, bytes).unwrap();
    let (read, topics, losses) = read_through(&file).unwrap();
    assert_eq!((read.len(), topics.iter().map(|topic| topic.count).sum()), (2400, 2400_u64));
    assert!(matches!(&losses[..], [line] if line.contains("1 messages cannot be read")), "{losses:?}");
}

#[test]
fn a_damaged_page_of_sqlite_takes_its_own_messages() {
    let directory = tempfile::tempdir().unwrap();
    let file = data_file(&jazzy(directory.path(), "sqlite3"));
    let whole = std::fs::read(&file).unwrap();
    for page in [10, 60, 100] {
        let mut bytes = whole.clone();
        bytes[4096 * page..4096 * page + 64].fill(0xff);
        std::fs::write(&file, &bytes).unwrap();
        let (read, _, losses) = read_through(&file).unwrap();
        assert_lines(&losses, &file);
        assert!(read.len() > 2300, "page {page}: {} read, {losses:?}", read.len());
        assert!(read.len() == 2401 || !losses.is_empty(), "page {page}");
    }
}

#[test]
fn a_bag_without_sound_metadata_is_read_by_the_names_of_its_files() {
    let (_directory, bag) = place("bag");
    let samples = samples(20);
    write(&bag, WriterOptions::default(), &samples);
    for text in ["", "{{{", "\u{0}", "rosbag2_bagfile_information: {version: 9}"] {
        std::fs::write(bag.join("metadata.yaml"), text).unwrap();
        let (read, _, losses) = read_through(&bag).unwrap();
        assert!(
            read == samples && losses.len() == 1 && losses[0].contains("metadata.yaml"),
            "{text:?}: {losses:?}"
        );
    }
}

#[test]
fn a_bag_with_lost_and_foreign_files_gives_the_others() {
    let (_directory, bag) = place("bag");
    let samples = samples(20);
    write(&bag, WriterOptions::default(), &samples);
    std::fs::write(bag.join("bag_2.mcap"), "no bag at all").unwrap();
    let metadata = "rosbag2_bagfile_information: {relative_file_paths: [bag_0.mcap, bag_1.mcap, bag_2.mcap]}";
    std::fs::write(bag.join("metadata.yaml"), metadata).unwrap();
    let (read, _, losses) = read_through(&bag).unwrap();
    assert_eq!(read, samples);
    assert!(
        losses.len() == 2 && losses[0].contains("bag_1.mcap") && losses[1].contains("bag_2.mcap"),
        "{losses:?}"
    );
}

#[test]
fn a_file_that_is_named_twenty_thousand_times_is_read_once() {
    let (_directory, bag) = place("bag");
    let samples = samples(5);
    write(&bag, WriterOptions::default(), &samples);
    let names = vec!["bag_0.mcap"; 20_000].join(", ");
    let metadata = format!("rosbag2_bagfile_information: {{relative_file_paths: [{names}]}}");
    std::fs::write(bag.join("metadata.yaml"), metadata).unwrap();
    assert_eq!(read(&bag), samples);
}

/// Writes a file of `count` chunks, each of which unpacks to one message of 120 MB.
fn bomb(path: &Path, count: usize) {
    let [sample] = &samples(1)[..1] else { unreachable!() };
    let huge = Sample { cdr: vec![0; 120 << 20], message: JointState::TYPE.to_owned(), ..sample.clone() };
    mcap_file(path, WriteOptions::new().chunk_size(Some(1 << 20)), "cdr", &[huge]);
    let bytes = std::fs::read(path).unwrap();
    let chunk = mcap::Summary::read(&bytes).unwrap().unwrap().chunk_indexes[0].clone();
    let start = usize::try_from(chunk.chunk_start_offset).unwrap();
    let end = start + usize::try_from(chunk.chunk_length).unwrap();
    let all = [&bytes[..start], &bytes[start..end].repeat(count), &bytes[end..]].concat();
    std::fs::write(path, all).unwrap();
}

#[test]
fn chunks_that_unpack_to_24_gb_end_in_bounded_memory() {
    let (_directory, path) = place("bomb.mcap");
    bomb(&path, 200);
    let size = std::fs::metadata(&path).unwrap().len();
    assert!(size < 4 << 20, "{size}");
    let mut bag = Bag::open(&path).unwrap();
    let (_, memory) = measured(|| bag.by_ref().for_each(drop));
    assert!(memory < 700 << 20, "{memory} bytes");
    let losses: Vec<_> = bag.losses().lines().collect();
    assert_lines(&losses, &path);
    assert!(losses.len() > 1, "{losses:?}");
}

/// Writes a bag with one message of this many bytes on the topic of a servo's record: a cycle with millions of stops.
fn record_of_stops(path: &Path, bytes: usize) {
    let stop = postcard_of(&Recorded::Stop);
    let mut record = Vec::new();
    CycleRecord::begin(0, Duration::ZERO, &mut record);
    record.extend(stop.repeat(bytes / stop.len()));
    CycleRecord::end(None, &mut record);
    let cdr = encode(&UInt8MultiArray { data: record, ..UInt8MultiArray::default() });
    let sample = Sample { topic: EVENTS.to_owned(), message: UInt8MultiArray::TYPE.to_owned(), time: 1, cdr };
    write(path, WriterOptions::default(), &[sample]);
}

fn postcard_of(event: &Recorded) -> Vec<u8> {
    let mut record = Vec::new();
    event.write(&mut record);
    record
}

#[test]
fn a_record_of_27_mb_that_is_not_of_a_cycle_is_refused_in_bounded_memory() {
    let (_directory, path) = place("bag");
    record_of_stops(&path, 27 << 20);
    let (refused, memory) = measured(|| replay(&mut Bag::open(&path).unwrap()));
    assert!(refused.unwrap_err().to_string().contains("damaged, or of another version"));
    assert!(memory < 200 << 20, "{memory} bytes");
    // A shorter message is read before it is refused.
    let (_directory, path) = place("bag");
    record_of_stops(&path, 4 << 20);
    let (refused, memory) = measured(|| replay(&mut Bag::open(&path).unwrap()));
    assert!(refused.is_err() && memory < 100 << 20, "{memory} bytes");
}

#[test]
fn a_bag_without_a_record_is_refused_before_it_is_read() {
    let (_directory, path) = place("bag");
    let image = Sample {
        cdr: vec![0; 100 << 20],
        message: UInt8MultiArray::TYPE.to_owned(),
        topic: "/image".to_owned(),
        time: 1,
    };
    write(&path, WriterOptions::default(), &[image]);
    let mut bag = Bag::open(&path).unwrap();
    let (refused, memory) = measured(|| replay(&mut bag));
    assert!(refused.unwrap_err().to_string().contains("no record of what came to a servo"));
    assert!(memory < 1 << 20, "{memory} bytes");
}

#[test]
fn a_compressed_file_that_unpacks_to_gigabytes_ends_in_bounded_memory() {
    let (_directory, path) = place("bomb.mcap.zstd");
    let (_other, inner) = place("file.mcap");
    mcap_file(&inner, WriteOptions::new(), "cdr", &samples(5));
    let mut packer = zstd::Encoder::new(std::fs::File::create(&path).unwrap(), 1).unwrap();
    std::io::copy(&mut std::fs::File::open(&inner).unwrap(), &mut packer).unwrap();
    std::io::copy(&mut std::io::Read::take(std::io::repeat(0), 1 << 30), &mut packer).unwrap();
    packer.finish().unwrap();
    let (read, memory) = measured(|| read_through(&path).unwrap());
    assert!(memory < 300 << 20, "{memory} bytes");
    assert_eq!(read.0, samples(5));
    assert!(read.2[0].contains("more than"), "{:?}", read.2);
}

#[test]
fn a_database_that_computes_its_messages_is_rejected() {
    let (_directory, path) = place("bag.db3");
    let database = rusqlite::Connection::open(&path).unwrap();
    let tables =
        "CREATE TABLE topics (id INTEGER PRIMARY KEY, name TEXT, type TEXT, serialization_format TEXT);
        INSERT INTO topics VALUES (1, '/joint_states', 'sensor_msgs/msg/JointState', 'cdr');
        CREATE TABLE messages (id INTEGER PRIMARY KEY, topic_id INTEGER, timestamp INTEGER,
            data BLOB GENERATED ALWAYS AS (zeroblob(100000000)) VIRTUAL);
        WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n WHERE i < 500)
            INSERT INTO messages (id, topic_id, timestamp) SELECT i, 1, i FROM n";
    database.execute_batch(tables).unwrap();
    let (opened, memory) = measured(|| Bag::open(&path).map(Iterator::count));
    assert!(memory < 300 << 20, "{memory} bytes");
    assert!(matches!(opened, Err(BagError::NotABag { .. })), "{opened:?}");
}

#[test]
fn reading_a_bag_in_wal_mode_changes_nothing_beside_it() {
    let directory = tempfile::tempdir().unwrap();
    let file = data_file(&jazzy(directory.path(), "sqlite3"));
    rusqlite::Connection::open(&file)
        .unwrap()
        .query_row("PRAGMA journal_mode = WAL", [], |_| Ok(()))
        .unwrap();
    let around = || {
        let entries = file.parent().unwrap().read_dir().unwrap().map(|entry| entry.unwrap().path());
        entries.map(|path| (path.clone(), std::fs::read(path).unwrap())).collect::<BTreeSet<_>>()
    };
    let before = around();
    assert_eq!(read(&file).len(), 2401);
    assert_eq!(around(), before);
    // Files that a killed recorder left are named, even if nothing in them can be read.
    std::fs::write(format!("{}-wal", file.display()), "something").unwrap();
    let (read, _, losses) = read_through(&file).unwrap();
    assert!(read.len() == 2401 && losses.len() == 1 && losses[0].contains("-wal"), "{losses:?}");
}

#[test]
fn pipes_and_devices_are_not_waited_for() {
    let (_directory, bag) = place("bag");
    let samples = samples(5);
    write(&bag, WriterOptions::default(), &samples);
    let pipe = |name: &str| {
        assert!(std::process::Command::new("mkfifo").arg(bag.join(name)).status().unwrap().success());
        bag.join(name)
    };
    assert!(matches!(Bag::open(&pipe("pipe")), Err(BagError::NotABag { .. })));
    assert!(matches!(Bag::open(Path::new("/dev/zero")), Err(BagError::NotABag { .. })));
    std::fs::remove_file(bag.join("metadata.yaml")).unwrap();
    pipe("metadata.yaml");
    pipe("bag_1.mcap");
    let (read, _, losses) = read_through(&bag).unwrap();
    assert_eq!((read, losses.len()), (samples, 2));
}

#[test]
fn times_and_numbers_of_2_to_the_63_are_taken_as_they_are() {
    let far = Duration::MAX;
    let hostile: [fn(&mut CycleRecord, Duration); 4] = [
        |record, far| record.now = if record.output.is_some() { far } else { record.now },
        |record, _| record.number += u64::from(record.number > 100) << 63,
        |record, far| {
            record.events.push(Recorded::Pause { paused: false, ago: far });
            record.events.push(Recorded::Reconfigure(far));
            record.events.push(Recorded::Found(far, u32::MAX, Some(vec![f64::NAN; 1000].into())));
        },
        |record, far| {
            record.events.push(Recorded::Listeners(usize::MAX, true));
            let positions = vec![f64::INFINITY; 1000].into();
            record.events.push(Recorded::JointState {
                arm: 7,
                names: None,
                positions,
                velocities: Vec::new().into(),
                source: u32::MAX,
                stamp_age: Some(far),
            });
        },
    ];
    for change in hostile {
        let (_directory, path) = place("bag");
        altered_records(&path, |record| change(record, far));
        let replayed = replay(&mut Bag::open(&path).unwrap()).unwrap();
        assert!(replayed[0].commands > 0, "{replayed:?}");
    }
}

/// This holds for any other content of the bag.
#[test]
fn saved_states_that_no_servo_can_have_are_skipped() {
    let (_directory, path) = place("bag");
    for seed in 0..40_usize {
        let _ = std::fs::remove_dir_all(&path);
        altered_records(&path, |record| {
            if let Some(Recorded::Saved(Saved(bytes))) = record.events.get_mut(1) {
                let bytes = bytes.to_mut();
                let places = if seed < 20 { 1 } else { seed };
                for place in 0..places {
                    let at = (seed * 7919 + place * 104_729) % bytes.len().min(4000);
                    bytes[at] ^= 1 << (seed % 8);
                }
                bytes.truncate(if seed % 10 == 9 { bytes.len() / 2 } else { bytes.len() });
            }
        });
        if let Ok(replayed) = replay(&mut Bag::open(&path).unwrap()) {
            assert_eq!(replayed.len(), 1);
        }
    }
}

#[test]
fn a_hundred_thousand_joint_names_are_one_line() {
    let names = || (0..100_000).map(|i| format!("joint_{i}")).collect::<Vec<_>>();
    let (_directory, path) = place("parameters");
    altered::<ParameterEvent>(&path, |event| {
        for parameter in event.new_parameters.iter_mut().filter(|parameter| parameter.name == "joints") {
            parameter.value.string_array_value = names();
        }
    });
    let (_other, records) = place("records");
    altered_records(&records, |record| {
        if let Some(Recorded::Begin(_, all)) = record.events.first_mut() {
            all.values.push(("joints".to_owned(), Value::StringArray(names())));
        }
    });
    let explained = recorded(&path, "bag", &puma560()).unwrap_err();
    for why in [explained, replay(&mut Bag::open(&records).unwrap()).unwrap_err()] {
        assert!(
            why.to_string().contains("joints has 100000") && why.to_string().lines().count() == 1,
            "{why}"
        );
    }
    let (_directory, path) = place("states");
    let mut left = 20;
    altered::<JointState>(&path, |state| {
        if left > 0 {
            left -= 1;
            (state.name, state.position) = (names(), vec![0.5; 100_000]);
        }
    });
    let runs = recorded(&path, "bag", &puma560()).unwrap().runs;
    assert!(runs[0].samples.len() > 100);
}

#[test]
fn the_smallest_positions_and_the_strangest_names_are_drawn() {
    let (_directory, path) = place("bag");
    let mut odd = false;
    altered::<JointState>(&path, |state| {
        odd = !odd;
        state.position.fill(if odd { 0.0 } else { 5e-324 });
        state.velocity.fill(if odd { -5e-324 } else { 0.0 });
    });
    let runs = recorded(&path, "a\u{0}bag\n<&\u{1b}[31m", &puma560()).unwrap().runs;
    for figure in plot(&runs) {
        let (svg, bad) = (figure.svg(Width::Screen), |c: char| c.is_control() && c != '\n');
        assert!(!svg.contains(bad) && roxmltree::Document::parse(&svg).is_ok(), "{}", figure.name);
    }
}

#[test]
fn the_program_says_what_was_lost_and_draws_the_rest() {
    let (_directory, bag) = place("bag");
    std::fs::create_dir(&bag).unwrap();
    let file = bag.join("bag_0.mcap");
    mcap_file(&file, WriteOptions::new().chunk_size(Some(1 << 16)), "cdr", &demo());
    let whole = std::fs::read(&file).unwrap();
    let out = bag.join("plots");
    let plot_damaged_at = |place: usize| {
        let mut bytes = whole.clone();
        bytes[place] ^= 1;
        std::fs::write(&file, bytes).unwrap();
        std::fs::write(bag.join("metadata.yaml"), "").unwrap();
        let (code, _, said) = dq_servo(&[&"plot", &bag, &"--out", &out]);
        (code, said)
    };
    let (code, said) = plot_damaged_at(2000);
    assert!(code == Some(2) && said.contains("damaged or cut off at byte"), "{said}");
    // Some bytes in this range do not belong to a message.
    let damages = (0..20).map(|number| plot_damaged_at(whole.len() / 2 + 997 * number));
    let losses = |said: &str| said.lines().filter(|line| line.starts_with("warning: ")).count();
    let (code, said) = damages.into_iter().find(|(_, said)| losses(said) == 2).unwrap();
    assert!(said.contains("metadata.yaml") && said.contains("bag_0.mcap"), "{said}");
    assert!(code == Some(0) && out.join("path.png").exists(), "{said}");
}

/// The recorder chooses the names, which may be damaged or malicious. A terminal would interpret control characters.
#[test]
fn names_of_topics_stay_in_their_line() {
    let directory = tempfile::tempdir().unwrap();
    let name = format!("/a\nb\u{1b}[2J{}", "c".repeat(1_000_000));
    let is_tame = |line: &str| line.len() < 1500 && !line.contains(char::is_control) && line.contains("/a");
    let mut messages = samples(1);
    messages.iter_mut().for_each(|message| message.topic.clone_from(&name));
    let path = directory.path().join("file.mcap");
    mcap_file(&path, WriteOptions::new(), "json", &messages);
    let (.., losses) = read_through(&path).unwrap();
    assert!(!losses.is_empty() && losses.iter().all(|line| is_tame(line)), "{losses:?}");
    mcap_file(&path, WriteOptions::new(), "cdr", &messages);
    let refused = recorded(&path, "bag", &puma560()).unwrap_err();
    assert!(is_tame(&refused.to_string()), "{refused}");
    let file = data_file(&jazzy(directory.path(), "sqlite3"));
    let connection = rusqlite::Connection::open(&file).unwrap();
    let json = "UPDATE topics SET serialization_format = 'json', name = ?1 WHERE name = '/joint_states'";
    assert_eq!(connection.execute(json, [&name]).unwrap(), 1);
    drop(connection);
    let (.., losses) = read_through(&file).unwrap();
    assert!(losses.len() == 1 && is_tame(&losses[0]), "{losses:?}");
}
