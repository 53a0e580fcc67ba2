//! Tests the reading of other bags, valid and damaged ones.

use crate::bags::{Sample, data_file, jazzy, read, read_through, samples, topics};
use dq_bags::Bag;
use dq_messages::messages::{JointState, PoseStamped};
use mcap::{Compression, WriteOptions, Writer, records::MessageHeader};
use std::collections::BTreeMap;
use std::path::Path;

#[test]
fn bags_of_a_real_ros_2_are_read_from_either_storage() {
    for storage in ["mcap", "sqlite3"] {
        let directory = tempfile::tempdir().unwrap();
        let bag = jazzy(directory.path(), storage);
        for path in [bag.clone(), data_file(&bag)] {
            let expected = [
                ("/dq_servo/current_pose", 800),
                ("/forward_velocity_controller/commands", 800),
                ("/goal_pose", 1),
                ("/joint_states", 800),
            ];
            assert_eq!(topics(&path), expected.map(|(name, count)| (name.to_owned(), count)));
            let messages = read(&path);
            assert_eq!(messages.len(), 2401);
            assert!(messages.is_sorted_by_key(|message| message.time));
            assert!(messages.iter().all(|message| message.cdr.starts_with(&[0, 1, 0, 0])));
            let goal = messages.iter().find(|message| message.topic == "/goal_pose").unwrap();
            assert_eq!((goal.message.as_str(), goal.cdr.len() % 4), ("geometry_msgs/msg/PoseStamped", 0));
        }
    }
}

#[test]
fn messages_of_a_real_ros_2_are_decoded() {
    let directory = tempfile::tempdir().unwrap();
    let bag = jazzy(directory.path(), "mcap");
    let of = |topic: &str| Bag::open(&bag).unwrap().find(|message| &*message.topic == topic).unwrap();
    let state: JointState = of("/joint_states").decode().unwrap();
    assert_eq!((state.name.len(), state.position.len(), state.velocity.len()), (6, 6, 6));
    let goal: PoseStamped = of("/goal_pose").decode().unwrap();
    let q = &goal.pose.orientation;
    assert!((q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w - 1.0).abs() < 1e-12, "{goal:?}");
    let error = of("/goal_pose").decode::<JointState>().unwrap_err().to_string();
    assert!(error.contains("PoseStamped of /goal_pose"), "{error}");
    let mut short = of("/joint_states");
    short.cdr.truncate(50);
    assert!(short.decode::<JointState>().is_err());
    short.cdr.truncate(3);
    assert!(short.decode::<JointState>().is_err());
}

/// Writes the samples as an MCAP file of this kind.
pub fn mcap_file(path: &Path, options: WriteOptions, encoding: &str, samples: &[Sample]) {
    let mut writer = Writer::with_options(std::fs::File::create(path).unwrap(), options).unwrap();
    for sample in samples {
        let schema = writer.add_schema(&sample.message, "ros2msg", b"").unwrap();
        let channel = writer.add_channel(schema, &sample.topic, encoding, &BTreeMap::new()).unwrap();
        let time = u64::try_from(sample.time).unwrap();
        let header = MessageHeader { channel_id: channel, sequence: 0, log_time: time, publish_time: time };
        writer.write_to_known_channel(&header, &sample.cdr).unwrap();
    }
    writer.finish().unwrap();
}

/// Returns the options for every form in which an MCAP file can store messages, with their names.
pub fn mcap_kinds() -> [(&'static str, WriteOptions); 5] {
    let small = || WriteOptions::new().chunk_size(Some(4096));
    [
        ("plain", small().compression(None)),
        ("lz4", small().compression(Some(Compression::Lz4))),
        ("zstd", small().compression(Some(Compression::Zstd))),
        ("no checksums", small().calculate_chunk_crcs(false)),
        ("no chunks", WriteOptions::new().use_chunks(false)),
    ]
}

#[test]
pub fn mcap_files_of_every_kind_are_read_in_order() {
    let directory = tempfile::tempdir().unwrap();
    for (kind, options) in mcap_kinds() {
        let path = directory.path().join("file.mcap");
        let mut samples = samples(50);
        samples.reverse();
        mcap_file(&path, options, "cdr", &samples);
        samples.reverse();
        assert_eq!(read(&path), samples, "{kind}");
    }
}

#[test]
fn messages_of_other_encodings_are_skipped_and_counted() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("file.mcap");
    mcap_file(&path, WriteOptions::new(), "json", &samples(1));
    let (read, topics, losses) = read_through(&path).unwrap();
    assert_eq!((read, topics, losses.len()), (Vec::new(), Vec::new(), 13));
    assert!(losses.iter().all(|line| line.contains("not encoded in CDR")), "{losses:?}");
    let file = data_file(&jazzy(directory.path(), "sqlite3"));
    let (whole, ..) = read_through(&file).unwrap();
    let json = "UPDATE topics SET serialization_format = 'json' WHERE name = '/joint_states'";
    rusqlite::Connection::open(&file).unwrap().execute(json, []).unwrap();
    let (read, topics, losses) = read_through(&file).unwrap();
    assert!(topics.iter().all(|topic| topic.name != "/joint_states"), "{topics:?}");
    let passed_over = format!("{} messages of /joint_states are skipped", whole.len() - read.len());
    assert!(read.len() < whole.len() && losses.len() == 1 && losses[0].contains(&passed_over), "{losses:?}");
}

#[test]
fn a_cut_off_file_gives_every_whole_chunk_before_the_cut() {
    let directory = tempfile::tempdir().unwrap();
    let (path, cut) = (directory.path().join("file.mcap"), directory.path().join("cut.mcap"));
    let samples = samples(100);
    mcap_file(&path, WriteOptions::new().chunk_size(Some(4096)), "cdr", &samples);
    let bytes = std::fs::read(&path).unwrap();
    let mut counts = Vec::new();
    for length in (8..bytes.len()).step_by(97).chain([bytes.len() - 1]) {
        std::fs::write(&cut, &bytes[..length]).unwrap();
        let (read, _, losses) = read_through(&cut).unwrap();
        assert!(losses.len() == 1 && losses[0].contains("cut off"), "{length}: {losses:?}");
        assert_eq!(read, samples[..read.len()], "{length}");
        counts.push(read.len());
        // The file system had no time to write the rest.
        std::fs::write(&cut, [&bytes[..length], &[0; 5000]].concat()).unwrap();
        let (then, _, losses) = read_through(&cut).unwrap();
        assert_eq!(then.len(), read.len(), "{length} of {}: {losses:?}", bytes.len());
    }
    assert!(counts.is_sorted() && counts[0] == 0 && counts.last() == Some(&1500));
    counts.dedup();
    assert!(counts.len() > 20, "{counts:?}");
}

#[test]
fn foreign_and_empty_bags_get_one_line_that_names_the_file() {
    let directory = tempfile::tempdir().unwrap();
    let path = |name: &str| directory.path().join(name);
    for (name, content) in [
        ("empty.mcap", Vec::new()),
        ("text.mcap", b"no bag at all".to_vec()),
        ("short.db3", b"SQLite format 3\0 and no more".to_vec()),
        ("picture.db3", [&[0x89][..], b"PNG\r\n\x1a\n and so on"].concat()),
        ("packed.mcap.zstd", zstd::encode_all(&b"no bag at all"[..], 1).unwrap()),
    ] {
        std::fs::write(path(name), content).unwrap();
        check_refused(&path(name), name);
    }
    let other = rusqlite::Connection::open(path("other.db3")).unwrap();
    other.execute_batch("CREATE TABLE planets (name TEXT)").unwrap();
    check_refused(&path("other.db3"), "other.db3");
    check_refused(&path("missing"), "missing");
    for (name, metadata) in [
        ("no_files", None),
        ("no_yaml", Some("{{{")),
        ("other_yaml", Some("a: 1")),
        ("no_names", Some("rosbag2_bagfile_information: {relative_file_paths: []}")),
        ("lost", Some("rosbag2_bagfile_information: {relative_file_paths: [lost_0.mcap]}")),
        (
            "packed",
            Some("rosbag2_bagfile_information: {relative_file_paths: [a.mcap], compression_format: lz4}"),
        ),
    ] {
        std::fs::create_dir(path(name)).unwrap();
        if let Some(text) = metadata {
            std::fs::write(path(name).join("metadata.yaml"), text).unwrap();
        }
        check_refused(&path(name), name);
    }
}

fn check_refused(path: &Path, name: &str) {
    let message = Bag::open(path).err().unwrap_or_else(|| panic!("{name} was opened")).to_string();
    assert!(message.contains(name) && message.lines().count() == 1, "{message}");
}
