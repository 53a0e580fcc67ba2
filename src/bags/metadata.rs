//! Reads and writes `metadata.yaml`, which describes a bag, so that readers need not open the bag's other files.

use super::error::BagError;
use super::qos::Profile;
use dq_common::text_file;
use serde::{Deserialize, Serialize};
use std::fs::File;
use std::io::{ErrorKind, Write};
use std::path::Path;

/// The name of the file in the bag's directory.
pub(super) const FILE_NAME: &str = "metadata.yaml";

/// The size of the longest metadata file that is read \[bytes\]. The metadata of a bag with thousands of files and topics are ten
/// times shorter.
const LIMIT: u64 = 16 << 20;

/// The number of messages in a file or a bag, and their first and last log time.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Span {
    pub messages: u64,
    /// The first and the last log time \[ns\].
    bounds: Option<(i64, i64)>,
}

impl Span {
    /// Adds a message.
    pub fn add(&mut self, log_time: i64) {
        self.messages += 1;
        self.bounds = Some(match self.bounds {
            None => (log_time, log_time),
            Some((first, last)) => (first.min(log_time), last.max(log_time)),
        });
    }

    /// Returns the first log time; 2⁶³−1 without messages, as in rosbag2.
    pub fn start(&self) -> i64 {
        self.bounds.map_or(i64::MAX, |(first, _)| first)
    }

    /// Returns the time from the first to the last log time \[ns\].
    pub fn duration(&self) -> i64 {
        self.bounds.map_or(0, |(first, last)| last.saturating_sub(first))
    }
}

/// The content of `metadata.yaml`, in version 9 of rosbag2's format, which Jazzy writes.
#[derive(Debug, Serialize)]
pub(super) struct Metadata {
    version: u32,
    storage_identifier: &'static str,
    duration: Nanoseconds,
    starting_time: SinceEpoch,
    message_count: u64,
    topics_with_message_count: Vec<TopicCount>,
    compression_format: &'static str,
    compression_mode: &'static str,
    relative_file_paths: Vec<String>,
    files: Vec<FileSpan>,
    custom_data: Option<()>,
    ros_distro: &'static str,
}

#[derive(Debug, Serialize)]
struct Nanoseconds {
    nanoseconds: i64,
}

#[derive(Debug, Serialize)]
struct SinceEpoch {
    nanoseconds_since_epoch: i64,
}

#[derive(Debug, Serialize)]
struct TopicCount {
    topic_metadata: TopicMetadata,
    message_count: u64,
}

/// A topic in the metadata.
#[derive(Clone, Debug, Serialize)]
pub(super) struct TopicMetadata {
    pub name: String,
    pub r#type: String,
    pub serialization_format: &'static str,
    pub offered_qos_profiles: Vec<Profile>,
    pub type_description_hash: String,
}

#[derive(Debug, Serialize)]
struct FileSpan {
    path: String,
    starting_time: SinceEpoch,
    duration: Nanoseconds,
    message_count: u64,
}

impl Metadata {
    /// Creates the metadata of a bag of MCAP files. `total` is the span of the whole bag. `topics` are the topics, each with the number
    /// of its messages. `files` are the names of the files, each with the span of the file.
    pub fn new(
        total: &Span,
        topics: impl Iterator<Item = (TopicMetadata, u64)>,
        files: &[(String, Span)],
        ros_distro: &'static str,
    ) -> Self {
        let start = |span: &Span| SinceEpoch { nanoseconds_since_epoch: span.start() };
        let duration = |span: &Span| Nanoseconds { nanoseconds: span.duration() };
        let file = |(path, span): &(String, Span)| FileSpan {
            path: path.clone(),
            starting_time: start(span),
            duration: duration(span),
            message_count: span.messages,
        };
        Self {
            version: 9,
            storage_identifier: "mcap",
            duration: duration(total),
            starting_time: start(total),
            message_count: total.messages,
            topics_with_message_count: topics
                .map(|(topic_metadata, message_count)| TopicCount { topic_metadata, message_count })
                .collect(),
            compression_format: "",
            compression_mode: "",
            relative_file_paths: files.iter().map(|(path, _)| path.clone()).collect(),
            files: files.iter().map(file).collect(),
            custom_data: None,
            ros_distro,
        }
    }

    /// Replaces the bag's `metadata.yaml` atomically. So there is always a complete file, even after a loss of power.
    ///
    /// # Errors
    /// [`BagError::Write`].
    pub fn write(self, directory: &Path) -> Result<(), BagError> {
        let (path, draft) = (directory.join(FILE_NAME), directory.join(".metadata.yaml.new"));
        let text = yaml(&Document { rosbag2_bagfile_information: self }).map_err(std::io::Error::other);
        let replace = |text: String| {
            let mut file = File::create(&draft)?;
            file.write_all(text.as_bytes())?;
            file.sync_all()?;
            std::fs::rename(&draft, &path)?;
            File::open(directory)?.sync_all()
        };
        text.and_then(replace).map_err(BagError::write(&path))
    }
}

/// Encodes a value as YAML.
pub(super) fn yaml(value: &impl Serialize) -> Result<String, serde_saphyr::ser::Error> {
    serde_saphyr::to_string(value)
}

/// The parts of `metadata.yaml` that this crate needs to read a bag. Every version of the format has them.
#[derive(Debug, Default, Deserialize)]
pub(super) struct Contents {
    #[serde(default)]
    pub compression_format: String,
    pub relative_file_paths: Vec<String>,
}

#[derive(Debug, Deserialize, Serialize)]
struct Document<T> {
    rosbag2_bagfile_information: T,
}

impl Contents {
    /// Returns whether the bag is compressed in a way that this crate does not support.
    pub fn is_packed_otherwise(&self) -> bool {
        !["", "zstd"].contains(&self.compression_format.as_str())
    }
}

/// Reads the metadata of the bag in `directory`, if the file exists.
///
/// # Errors
/// [`BagError::Damaged`] if the metadata cannot be read.
pub(super) fn read(directory: &Path) -> Result<Option<Contents>, BagError> {
    let path = directory.join(FILE_NAME);
    let text = match text_file::read(&path, LIMIT) {
        Ok(text) => text,
        Err(why) if why.kind() == ErrorKind::NotFound => return Ok(None),
        Err(why) => return Err(BagError::damaged(&path, &why.to_string())),
    };
    let document: Document<Contents> = serde_saphyr::from_str(&text).map_err(|why| {
        let why = why.to_string();
        BagError::damaged(&path, why.lines().next().unwrap_or_default())
    })?;
    Ok(Some(document.rosbag2_bagfile_information))
}

#[cfg(test)]
mod tests {
    use super::*;
    use dq_messages::{DurabilityKind, LivelinessKind, OfferedQos, ReliabilityKind};
    use serde_json::Value;

    #[test]
    fn written_messages_read_back_with_any_file_name() {
        for file in ["run_0.mcap", "my run: \"7\" {é}_0.mcap", "1_0.mcap", "- x", "~"] {
            let directory = tempfile::tempdir().unwrap();
            let metadata = Metadata::new(
                &Span::default(),
                std::iter::empty(),
                &[(file.to_owned(), Span::default())],
                "jazzy",
            );
            metadata.write(directory.path()).unwrap();
            assert_eq!(read(directory.path()).unwrap().unwrap().relative_file_paths, [file]);
        }
    }

    /// The bytes of metadata equal those of a real ROS 2, except for the history of publishers, which DDS does not announce.
    #[test]
    fn written_bytes_equal_those_of_a_real_ros_2() {
        let theirs = include_str!("../../tests/data/bag_jazzy_mcap/metadata.yaml");
        let theirs = theirs.replace("keep_last", "unknown").replace("depth: 10", "depth: 0");
        let offered = OfferedQos {
            reliability: ReliabilityKind::Reliable,
            durability: DurabilityKind::Volatile,
            deadline: None,
            lifespan: None,
            liveliness: LivelinessKind::Automatic,
            liveliness_lease: None,
        };
        let topic = |(name, message, count): (&str, &str, u64)| {
            let topic = TopicMetadata {
                name: name.to_owned(),
                r#type: message.to_owned(),
                serialization_format: "cdr",
                offered_qos_profiles: vec![Profile::from(&offered)],
                type_description_hash: dq_messages::type_hash(message).to_owned(),
            };
            (topic, count)
        };
        let topics = [
            ("/dq_servo/current_pose", "geometry_msgs/msg/PoseStamped", 800),
            ("/forward_velocity_controller/commands", "std_msgs/msg/Float64MultiArray", 800),
            ("/goal_pose", "geometry_msgs/msg/PoseStamped", 1),
            ("/joint_states", "sensor_msgs/msg/JointState", 800),
        ];
        let start = 1_795_212_835_812_389_887;
        let span = Span { messages: 2401, bounds: Some((start, start + 7_989_157_395)) };
        let files = [("real_mcap_0.mcap".to_owned(), span)];
        let metadata = Metadata::new(&span, topics.into_iter().map(topic), &files, "jazzy");
        let ours = yaml(&Document { rosbag2_bagfile_information: metadata }).unwrap();
        let value = |text: &str| serde_saphyr::from_str::<Value>(text).unwrap();
        assert_eq!(value(&ours), value(&theirs));
    }

    #[test]
    fn a_span_is_that_of_its_messages_in_any_order() {
        let mut span = Span::default();
        assert_eq!((span.start(), span.duration()), (i64::MAX, 0));
        [7, 3, 5].iter().for_each(|time| span.add(*time));
        assert_eq!((span.messages, span.start(), span.duration()), (3, 3, 4));
    }
}
