//! Tests the writer of bags.

use crate::bags::{Sample, data_file, place, read, read_through, samples, topics, write};
use dq_bags::{Bag, BagError, BagWriter, TopicRecord, WriterOptions};
use dq_messages::type_hash;
use std::path::Path;
use std::time::Duration;

#[test]
fn written_messages_are_read_back_bit_for_bit() {
    let ((_directory, bag), samples) = (place("bag"), samples(100));
    let summary = write(&bag, WriterOptions::default(), &samples);
    assert_eq!((summary.messages, summary.files, summary.dropped), (1500, 1, 0));
    for path in [bag.clone(), data_file(&bag)] {
        assert_eq!(read(&path), samples);
        let counts = topics(&path);
        assert_eq!((counts.len(), counts.iter().map(|(_, count)| count).sum()), (summary.topics, 1500_u64));
    }
    std::fs::remove_file(bag.join("metadata.yaml")).unwrap();
    assert_eq!(read(&bag), samples, "without metadata.yaml");
}

#[test]
fn messages_out_of_order_are_read_in_order() {
    let directory = tempfile::tempdir().unwrap();
    let mut shuffled = samples(50);
    shuffled.chunks_mut(7).for_each(<[_]>::reverse);
    let options = WriterOptions { max_duration: Some(Duration::from_millis(100)), max_size: None };
    let summary = write(&directory.path().join("bag"), options, &shuffled);
    assert!(summary.files >= 5, "{summary:?}");
    shuffled.sort_by_key(|sample| sample.time);
    assert_eq!(read(&directory.path().join("bag")), shuffled);
}

#[test]
fn files_are_split_by_size_and_by_duration_and_no_message_is_lost() {
    let directory = tempfile::tempdir().unwrap();
    let samples = samples(5000);
    let by_size = WriterOptions { max_size: Some(40_000), max_duration: None };
    let by_duration = WriterOptions { max_size: None, max_duration: Some(Duration::from_secs(13)) };
    for (name, options, at_least) in [("size", by_size, 2), ("duration", by_duration, 5)] {
        let bag = directory.path().join(name);
        let summary = write(&bag, options, &samples);
        assert!(summary.files >= at_least, "{name}: {summary:?}");
        assert!(bag.join(format!("{name}_{}.mcap", summary.files - 1)).exists());
        assert_eq!(read(&bag), samples, "{name}");
        std::fs::remove_file(bag.join("metadata.yaml")).unwrap();
        assert_eq!(read(&bag), samples, "{name} without metadata.yaml");
    }
}

#[test]
fn the_file_says_what_rosbag2_s_does() {
    let (_directory, bag) = place("bag");
    write(&bag, WriterOptions::default(), &samples(1));
    let bytes = std::fs::read(data_file(&bag)).unwrap();
    let summary = mcap::Summary::read(&bytes).unwrap().unwrap();
    assert!(summary.chunk_indexes.iter().all(|chunk| chunk.compression == "zstd"));
    assert_eq!(summary.channels.len(), 13);
    for channel in summary.channels.values() {
        let schema = channel.schema.as_ref().unwrap();
        assert_eq!((schema.encoding.as_str(), channel.message_encoding.as_str()), ("ros2msg", "cdr"));
        assert_eq!(channel.metadata["topic_type_hash"], type_hash(&schema.name));
        let qos: serde_json::Value =
            serde_saphyr::from_str(&channel.metadata["offered_qos_profiles"]).unwrap();
        assert_eq!(qos[0]["reliability"], "reliable");
        assert_eq!(qos[1]["reliability"], "best_effort");
        assert_eq!(qos[1]["durability"], "transient_local");
        assert_eq!(
            (&qos[0]["lifespan"]["sec"], &qos[0]["lifespan"]["nsec"]),
            (&10.into(), &250_000_000.into())
        );
        assert_eq!(qos[0]["deadline"]["sec"], 9_223_372_036_u64);
    }
    let header = mcap::read::LinearReader::new(&bytes).unwrap().next().unwrap().unwrap();
    assert!(matches!(header, mcap::records::Record::Header(header) if header.profile == "ros2"));
}

#[test]
fn the_definitions_are_those_that_a_real_ros_2_writes() {
    let directory = tempfile::tempdir().unwrap();
    let bytes = std::fs::read(data_file(&crate::bags::jazzy(directory.path(), "mcap"))).unwrap();
    let summary = mcap::Summary::read(&bytes).unwrap().unwrap();
    assert_eq!(summary.schemas.len(), 3);
    // Ignore comments and blanks around words.
    let bare = |text: &str| {
        let words = |line: &str| {
            line.split('#').next().unwrap_or_default().split_whitespace().collect::<Vec<_>>().join(" ")
        };
        text.lines().map(words).filter(|line| !line.is_empty()).collect::<Vec<_>>()
    };
    for schema in summary.schemas.values() {
        let theirs = std::str::from_utf8(&schema.data).unwrap();
        let ours = dq_messages::definition(&schema.name).unwrap();
        assert_eq!(bare(&ours), bare(theirs), "{}", schema.name);
    }
    for channel in summary.channels.values() {
        assert_eq!(channel.metadata["topic_type_hash"], type_hash(&channel.schema.as_ref().unwrap().name));
    }
}

#[test]
fn what_was_flushed_is_read_while_the_bag_is_written_and_however_it_ends() {
    let directory = tempfile::tempdir().unwrap();
    let (path, samples) = (directory.path().join("bag"), samples(20));
    let mut bag = BagWriter::create(&path, WriterOptions::default()).unwrap();
    assert_eq!(read_through(&path).unwrap().0, [], "from the start there is a bag");
    let id = bag.add_topic(&TopicRecord::new(&samples[0].topic, &samples[0].message)).unwrap();
    let ours: Vec<_> = samples.iter().filter(|sample| sample.topic == samples[0].topic).cloned().collect();
    let (flushed, lost) = ours.split_at(15);
    flushed.iter().for_each(|sample| bag.write(id, sample.time, sample.time, &sample.cdr).unwrap());
    bag.flush().unwrap();
    lost.iter().for_each(|sample| bag.write(id, sample.time, sample.time, &sample.cdr).unwrap());
    assert_eq!(read(&path), flushed, "it is whole to any reader");
    // These are the files that a killed recorder leaves.
    let killed = directory.path().join("killed");
    std::fs::create_dir(&killed).unwrap();
    std::fs::copy(data_file(&path), killed.join("killed_0.mcap")).unwrap();
    assert_eq!(read_through(&killed).unwrap().0, flushed);
    drop(bag);
    assert_eq!(read(&path), ours, "dropped, not killed");
}

#[test]
fn places_and_types_that_cannot_be_are_refused() {
    let directory = tempfile::tempdir().unwrap();
    let create = |path: &Path| BagWriter::create(path, WriterOptions::default());
    let taken = create(directory.path()).err().unwrap();
    assert!(matches!(taken, BagError::Exists(_)) && taken.to_string().contains("exists already"), "{taken}");
    for path in ["/proc/nowhere", "/nonexistent/directory/bag"] {
        let error = create(Path::new(path)).err().unwrap();
        assert!(matches!(error, BagError::Write { .. }) && error.to_string().contains(path), "{error}");
    }
    let mut bag = create(&directory.path().join("bag")).unwrap();
    let record = TopicRecord::new("/x", "a/msg/B");
    assert!(matches!(bag.add_topic(&record), Err(BagError::UnknownType { .. })));
}

/// The types are a type of the caller, a type of ROS 2 that this program does not have, and a type that uses other types.
#[test]
fn types_that_only_the_caller_defines_are_recorded_for_any_reader() {
    let (_directory, path) = place("bag");
    let separator = "=".repeat(80);
    let header = dq_messages::definition("std_msgs/msg/Header").unwrap();
    let image = "std_msgs/Header header\nuint32 height\nuint32 width\nstring encoding\nuint8 is_bigendian\nuint32 step\nuint8[] data\n";
    let image = format!("{image}{separator}\nMSG: std_msgs/Header\n{header}");
    let stamp = [&[0, 1, 0, 0][..], &[1, 0, 0, 0, 2, 0, 0, 0], &[1, 0, 0, 0, 0, 0, 0, 0]].concat();
    let picture =
        [&stamp[..], &[1, 0, 0, 0, 2, 0, 0, 0], b"\x06\0\0\0mono8\0\0\0", &[2, 0, 0, 0], &[2, 0, 0, 0, 7, 8]];
    let types = [
        ("my_msgs/msg/Battery", "float32 voltage\nbool charging", BATTERY, vec![0, 1, 0, 0, 0, 0, 72, 65, 1]),
        ("std_msgs/msg/Bool", "bool data", BOOL, vec![0, 1, 0, 0, 1]),
        ("sensor_msgs/msg/Image", &*image, IMAGE, picture.concat()),
    ];
    let mut bag = BagWriter::create(&path, WriterOptions::default()).unwrap();
    let mut samples = Vec::new();
    for ((message, definition, hash, cdr), time) in types.into_iter().zip(1..) {
        let record = TopicRecord {
            definition: Some(definition.to_owned()),
            hash: Some(hash.to_owned()),
            ..TopicRecord::new(format!("/{}", message.replace('/', "_")), message)
        };
        let id = bag.add_topic(&record).unwrap();
        bag.write(id, time, time, &cdr).unwrap();
        samples.push(Sample { topic: record.name, message: record.message, time, cdr });
    }
    bag.finish().unwrap();
    assert_eq!(read(&path), samples);
    assert_eq!(crate::interop::peer_samples(&["read", path.to_str().unwrap()]), samples);
    let only: Vec<_> =
        Bag::open(&path).unwrap().only(&[samples[1].message.clone()]).map(Sample::from).collect();
    assert_eq!(only, samples[1..2]);
}

/// RIHS01 hashes, computed by rosbags.
const BATTERY: &str = "RIHS01_c6e5a30b5c8abdf1c19c1daa17a2962be71d548a34e28c97aaa3e89b882c6a9a";
const BOOL: &str = "RIHS01_feb91e995ff9ebd09c0cb3d2aed18b11077585839fb5db80193b62d74528f6c9";
const IMAGE: &str = "RIHS01_d31d41a9a4c4bc8eae9be757b0beed306564f7526c88ea6a4588fb9582527d47";

#[test]
fn a_writer_refuses_the_topic_of_another() {
    let directory = tempfile::tempdir().unwrap();
    let [mut ours, mut other] = ["ours", "other"]
        .map(|name| BagWriter::create(&directory.path().join(name), WriterOptions::default()).unwrap());
    let record = TopicRecord::new("/text", "std_msgs/msg/String");
    let (id, theirs) = (ours.add_topic(&record).unwrap(), other.add_topic(&record).unwrap());
    assert!(matches!(ours.write(theirs, 0, 0, &[0; 4]), Err(BagError::ForeignTopic(_))));
    ours.write(id, 0, 0, &[0; 4]).unwrap();
    assert_eq!(ours.finish().unwrap().messages, 1);
}

/// Begins a bag and writes the samples. Like a killed recorder, the caller never closes the bag.
fn begun(bag: &Path, samples: &[crate::bags::Sample]) -> BagWriter {
    let mut writer = BagWriter::create(bag, WriterOptions::default()).unwrap();
    let mut ids = std::collections::BTreeMap::new();
    for sample in samples {
        let id = *ids
            .entry(&sample.topic)
            .or_insert_with(|| writer.add_topic(&TopicRecord::new(&sample.topic, &sample.message)).unwrap());
        writer.write(id, sample.time, sample.time, &sample.cdr).unwrap();
    }
    writer.flush().unwrap();
    writer
}

#[test]
fn the_bag_of_a_recorder_that_was_killed_is_whole_to_anyone() {
    let ((_directory, bag), samples) = (place("bag"), samples(1));
    std::mem::forget(begun(&bag, &samples));
    assert_eq!(read(&bag), samples);
    assert_eq!(crate::interop::peer_samples(&["read", bag.to_str().unwrap()]), samples);
    let metadata = std::fs::read_to_string(bag.join("metadata.yaml")).unwrap();
    assert!(metadata.contains(&format!("message_count: {}", samples.len())), "{metadata}");
    let names = samples.iter().filter(|sample| metadata.contains(&format!("name: {}", sample.topic)));
    assert_eq!(names.count(), samples.len(), "{metadata}");
}

#[test]
fn a_file_that_somebody_takes_away_ends_the_recording_with_its_name() {
    type Take = fn(&Path);
    let takes: [(Take, &str); 4] = [
        (|file| std::fs::remove_file(file).unwrap(), "was removed"),
        (|file| drop(std::fs::File::create(file).unwrap()), "its length was changed"),
        (
            |file| std::fs::OpenOptions::new().write(true).open(file).unwrap().set_len(100).unwrap(),
            "its length",
        ),
        (
            |file| {
                std::fs::remove_file(file).unwrap();
                std::fs::write(file, "another").unwrap();
            },
            "was replaced",
        ),
    ];
    for (take, why) in takes {
        let directory = tempfile::tempdir().unwrap();
        let (bag, samples) = (directory.path().join("bag"), samples(1));
        let mut writer = begun(&bag, &samples);
        take(&data_file(&bag));
        let told = writer.flush().unwrap_err().to_string();
        assert!(told.contains(why) && told.contains("bag_0.mcap"), "{told}");
        let told = writer.finish().unwrap_err().to_string();
        assert!(told.contains("bag_0.mcap"), "{told}");
    }
}
