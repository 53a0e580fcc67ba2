//! Writes a rosbag2 directory: MCAP files and `metadata.yaml`.

use super::error::BagError;
use super::files::{LYRICAL, file_name};
use super::mcap_output::McapOutput;
use super::metadata::{Metadata, Span, TopicMetadata, yaml};
use super::qos::Profile;
use dq_messages::OfferedQos;
use dq_messages::{definition, type_hash};
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant};

/// The limits at which the writer begins a new file. Without limits, the bag has one file.
#[derive(Clone, Copy, Debug, Default)]
pub struct WriterOptions {
    /// A file is full once it has this size \[bytes\]. A file can exceed the size by a chunk, because it grows by whole chunks.
    pub max_size: Option<u64>,
    /// A file is full once the log time of a message is this much after the file's first log time.
    pub max_duration: Option<Duration>,
}

/// The description of a topic that the bag stores.
#[derive(Clone, Debug)]
pub struct TopicRecord {
    /// The fully qualified name of the topic.
    pub name: String,
    /// The type of the messages: `package/msg/Name`.
    pub message: String,
    /// The QoS that the topic's publishers offer.
    pub offered: Vec<OfferedQos>,
    /// The definition by which readers decode the messages; `None` for the types of `msg_config/interfaces`. It is the text of the
    /// type's `.msg` file, followed by the texts of all types that it uses. Before each of the other texts come a line of 80 `=`
    /// and a line `MSG: package/Name`.
    pub definition: Option<String>,
    /// The RIHS01 hash of the type. If this is `None` and the type is in `msg_config/interfaces`, the writer uses the hash from
    /// there. For another type it writes an empty hash, as rosbag2 does.
    pub hash: Option<String>,
}

impl TopicRecord {
    /// Creates a topic whose type is in `msg_config/interfaces`. The QoS of its publishers is not known.
    pub fn new(name: impl Into<String>, message: impl Into<String>) -> Self {
        let (name, message) = (name.into(), message.into());
        Self { name, message, offered: Vec::new(), definition: None, hash: None }
    }
}

/// The id of a topic in one [`BagWriter`]. Other writers reject this id.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TopicId {
    writer: u64,
    number: usize,
}

/// The number of [`BagWriter`]s that this process has created so far.
static WRITERS: AtomicU64 = AtomicU64::new(0);

/// The counts of a finished bag.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct WrittenBag {
    /// The number of messages written.
    pub messages: u64,
    /// The number of topics, including those without messages.
    pub topics: usize,
    /// The number of messages that were dropped before they reached the writer, because the recorder's queue was full. [`BagWriter`]
    /// sets 0.
    pub dropped: u64,
    /// The number of files, without `metadata.yaml`.
    pub files: usize,
}

/// A bag that is being written. If it is dropped without a call of [`BagWriter::finish`], the bag is still valid, but errors are
/// not reported.
pub struct BagWriter {
    number: u64,
    directory: PathBuf,
    options: WriterOptions,
    topics: Vec<Entry>,
    file: McapOutput,
    files: Vec<(String, Span)>,
    total: Span,
    metadata_state: MetadataState,
    distro: &'static str,
}

/// The state of the bag at the latest write of `metadata.yaml`.
struct MetadataState {
    topics: usize,
    messages: u64,
    since: Instant,
}

/// The longest time for which the counts in `metadata.yaml` may be out of date. The writer replaces the file this often. So the bag
/// has useful metadata even if the recorder is killed.
const METADATA: Duration = Duration::from_secs(3);

struct Entry {
    metadata: TopicMetadata,
    qos_yaml: String,
    definition: String,
    /// The channel of the topic in the open file.
    channel: u16,
    count: u64,
}

impl Entry {
    fn new(record: &TopicRecord, definition: String) -> Self {
        let metadata = TopicMetadata {
            name: record.name.clone(),
            r#type: record.message.clone(),
            serialization_format: "cdr",
            offered_qos_profiles: record.offered.iter().map(Profile::from).collect(),
            type_description_hash: record
                .hash
                .clone()
                .unwrap_or_else(|| type_hash(&record.message).to_owned()),
        };
        // A list of numbers and words can always be encoded.
        let qos_yaml = yaml(&metadata.offered_qos_profiles).unwrap_or_default();
        Self { metadata, qos_yaml, definition, channel: 0, count: 0 }
    }

    /// Adds a channel for the topic to the file.
    fn join(&mut self, file: &mut McapOutput) -> Result<(), BagError> {
        self.channel = file.add(&self.metadata, &self.definition, &self.qos_yaml)?;
        Ok(())
    }
}

impl BagWriter {
    /// Begins a bag in a new directory. Its files get the names that the ROS release in `ROS_DISTRO` would give them.
    ///
    /// # Errors
    /// [`BagError::Exists`], [`BagError::Write`].
    pub fn create(directory: &Path, options: WriterOptions) -> Result<Self, BagError> {
        Self::of(distro(), directory, options)
    }

    fn of(distro: &'static str, directory: &Path, options: WriterOptions) -> Result<Self, BagError> {
        std::fs::create_dir(directory).map_err(|why| match why.kind() {
            ErrorKind::AlreadyExists => BagError::Exists(directory.to_owned()),
            _ => BagError::write(directory)(why),
        })?;
        let name = file_name(directory, 0, distro);
        let file = McapOutput::create(directory.join(&name))?;
        let directory = directory.to_owned();
        let files = vec![(name, Span::default())];
        let (total, topics) = (Span::default(), Vec::new());
        let metadata_state = MetadataState { topics: 0, messages: 0, since: Instant::now() };
        let number = WRITERS.fetch_add(1, Ordering::Relaxed);
        let mut writer =
            Self { number, directory, options, topics, file, files, total, metadata_state, distro };
        writer.write_metadata()?;
        Ok(writer)
    }

    /// Adds a topic.
    ///
    /// # Errors
    /// [`BagError::UnknownType`], [`BagError::Write`].
    pub fn add_topic(&mut self, record: &TopicRecord) -> Result<TopicId, BagError> {
        let unknown =
            || BagError::UnknownType { topic: record.name.clone(), message: record.message.clone() };
        let definition =
            record.definition.clone().or_else(|| definition(&record.message)).ok_or_else(unknown)?;
        let mut entry = Entry::new(record, definition);
        entry.join(&mut self.file)?;
        self.topics.push(entry);
        Ok(TopicId { writer: self.number, number: self.topics.len() - 1 })
    }

    /// Writes a message. `cdr` includes the encapsulation header; times are in \[ns\] since the Unix epoch. The message gets into
    /// the file when its chunk is full, or at the next [`BagWriter::flush`].
    ///
    /// # Errors
    /// [`BagError::ForeignTopic`], [`BagError::Write`].
    pub fn write(
        &mut self,
        topic: TopicId,
        log_time: i64,
        publish_time: i64,
        cdr: &[u8],
    ) -> Result<(), BagError> {
        if topic.writer != self.number {
            return Err(BagError::ForeignTopic(self.directory.clone()));
        }
        if self.is_full(log_time) {
            self.split()?;
        }
        let entry = &mut self.topics[topic.number];
        self.file.write(entry.channel, log_time, publish_time, cdr)?;
        entry.count += 1;
        self.total.add(log_time);
        if let Some((_, span)) = self.files.last_mut() {
            span.add(log_time);
        }
        Ok(())
    }

    /// Passes everything written so far to the operating system. From then on, readers find a valid bag with all topics, even if
    /// this process is killed. The counts in the metadata are at most some seconds old.
    ///
    /// # Errors
    /// [`BagError::Write`], also if someone has removed the file or changed its length.
    pub fn flush(&mut self) -> Result<(), BagError> {
        self.file.flush()?;
        let MetadataState { topics, messages, since } = self.metadata_state;
        let is_old = self.total.messages > messages && since.elapsed() >= METADATA;
        if is_old || self.topics.len() > topics { self.write_metadata() } else { Ok(()) }
    }

    /// Closes the bag.
    ///
    /// # Errors
    /// [`BagError::Write`].
    pub fn finish(mut self) -> Result<WrittenBag, BagError> {
        self.file.close()?;
        self.write_metadata()?;
        Ok(WrittenBag {
            messages: self.total.messages,
            topics: self.topics.len(),
            dropped: 0,
            files: self.files.len(),
        })
    }

    /// Returns whether a message with this time belongs in a new file.
    fn is_full(&self, log_time: i64) -> bool {
        let Some((_, span)) = self.files.last().filter(|(_, span)| span.messages > 0) else { return false };
        let too_long = self.options.max_duration.is_some_and(|limit| {
            u128::try_from(log_time.saturating_sub(span.start())).is_ok_and(|age| age >= limit.as_nanos())
        });
        too_long || self.options.max_size.is_some_and(|limit| self.file.size() >= limit)
    }

    fn split(&mut self) -> Result<(), BagError> {
        self.file.close()?;
        let name = file_name(&self.directory, self.files.len(), self.distro);
        self.file = McapOutput::create(self.directory.join(&name))?;
        self.topics.iter_mut().try_for_each(|entry| entry.join(&mut self.file))?;
        self.files.push((name, Span::default()));
        self.write_metadata()
    }

    fn write_metadata(&mut self) -> Result<(), BagError> {
        let topics = self.topics.iter().map(|entry| (entry.metadata.clone(), entry.count));
        Metadata::new(&self.total, topics, &self.files, self.distro).write(&self.directory)?;
        let (topics, messages) = (self.topics.len(), self.total.messages);
        self.metadata_state = MetadataState { topics, messages, since: Instant::now() };
        Ok(())
    }
}

/// Returns the ROS release whose format the writer uses: the release of the environment if it is Lyrical, otherwise Jazzy.
fn distro() -> &'static str {
    let is_lyrical = std::env::var("ROS_DISTRO").is_ok_and(|name| name == LYRICAL);
    if is_lyrical { LYRICAL } else { "jazzy" }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Bag;

    #[test]
    fn a_bag_of_lyrical_is_read_in_the_order_of_its_files_with_metadata_and_without() {
        let folder = tempfile::tempdir().unwrap();
        let directory = folder.path().join("run");
        let options =
            WriterOptions { max_duration: Some(Duration::from_nanos(1)), ..WriterOptions::default() };
        let mut writer = BagWriter::of(LYRICAL, &directory, options).unwrap();
        let topic = writer.add_topic(&TopicRecord::new("/t", "std_msgs/msg/String")).unwrap();
        (0..12).for_each(|time| writer.write(topic, time, time, &[0, 1, 0, 0, time as u8]).unwrap());
        assert_eq!(writer.finish().unwrap().files, 12);
        let numbers = |directory: &Path| {
            Bag::open(directory).unwrap().map(|message| message.cdr[4]).collect::<Vec<_>>()
        };
        assert_eq!(numbers(&directory), (0..12).collect::<Vec<_>>());
        let metadata = std::fs::read_to_string(directory.join("metadata.yaml")).unwrap();
        assert!(metadata.contains("ros_distro: lyrical") && metadata.contains("- 11_run_2"), "{metadata}");
        std::fs::remove_file(directory.join("metadata.yaml")).unwrap();
        assert_eq!(numbers(&directory), (0..12).collect::<Vec<_>>());
    }
}
