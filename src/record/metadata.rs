//! `metadata.yaml`: what rosbag2 knows of a bag without opening its files.

use super::error::BagError;
use super::interfaces::type_hash;
use serde::Deserialize;
use std::fmt::Write as _;
use std::path::Path;

/// The file's name in the bag's directory.
pub(super) const FILE_NAME: &str = "metadata.yaml";

/// Messages and the time that they span.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Span {
    pub messages: u64,
    /// First and last log time \[ns\].
    bounds: Option<(i64, i64)>,
}

impl Span {
    /// One message more.
    pub fn add(&mut self, log_time: i64) {
        self.messages += 1;
        self.bounds = Some(match self.bounds {
            None => (log_time, log_time),
            Some((first, last)) => (first.min(log_time), last.max(log_time)),
        });
    }

    /// The first log time; rosbag2 writes 2⁶³−1 where there is none.
    pub fn start(&self) -> i64 {
        self.bounds.map_or(i64::MAX, |(first, _)| first)
    }

    /// From the first to the last log time \[ns\].
    pub fn duration(&self) -> i64 {
        self.bounds.map_or(0, |(first, last)| last.saturating_sub(first))
    }
}

/// A topic as the metadata tell it.
pub(super) struct TopicLine<'a> {
    pub name: &'a str,
    pub message: &'a str,
    pub qos_yaml: &'a str,
    pub count: u64,
}

/// Replaces the bag's `metadata.yaml` at once, so that there is a whole one at every moment.
///
/// # Errors
/// [`BagError::Write`].
pub(super) fn write(
    directory: &Path,
    total: &Span,
    topics: &[TopicLine],
    files: &[(String, Span)],
) -> Result<(), BagError> {
    let (path, draft) = (directory.join(FILE_NAME), directory.join(".metadata.yaml.new"));
    std::fs::write(&draft, yaml(total, topics, files)).map_err(BagError::write(&path))?;
    std::fs::rename(&draft, &path).map_err(BagError::write(&path))
}

/// Version 9, as rosbag2 of Jazzy writes it.
fn yaml(total: &Span, topics: &[TopicLine], files: &[(String, Span)]) -> String {
    let mut text = format!(
        "rosbag2_bagfile_information:\n  version: 9\n  storage_identifier: mcap\n  duration:\n    nanoseconds: {}\n  \
         starting_time:\n    nanoseconds_since_epoch: {}\n  message_count: {}\n",
        total.duration(),
        total.start(),
        total.messages
    );
    text.push_str("  topics_with_message_count:");
    text.push_str(if topics.is_empty() { " []\n" } else { "\n" });
    topics.iter().for_each(|topic| topic_yaml(topic, &mut text));
    text.push_str("  compression_format: \"\"\n  compression_mode: \"\"\n  relative_file_paths:\n");
    files.iter().for_each(|(path, _)| text.push_str(&format!("    - {}\n", scalar(path))));
    text.push_str("  files:\n");
    files.iter().for_each(|(path, span)| file_yaml(path, span, &mut text));
    text.push_str("  custom_data: ~\n  ros_distro: jazzy\n");
    text
}

fn topic_yaml(topic: &TopicLine, text: &mut String) {
    let TopicLine { name, message, qos_yaml, count } = topic;
    // Writing to a String cannot fail.
    let _ = write!(
        text,
        "    - topic_metadata:\n        name: {name}\n        type: {message}\n        serialization_format: cdr\n"
    );
    if *qos_yaml == "[]" {
        text.push_str("        offered_qos_profiles: []\n");
    } else {
        text.push_str("        offered_qos_profiles:\n");
        qos_yaml.lines().for_each(|line| text.push_str(&format!("          {line}\n")));
    }
    let hash = scalar(type_hash(message));
    let _ = write!(text, "        type_description_hash: {hash}\n      message_count: {count}\n");
}

fn file_yaml(path: &str, span: &Span, text: &mut String) {
    let (path, start, duration) = (scalar(path), span.start(), span.duration());
    let _ = write!(
        text,
        "    - path: {path}\n      starting_time:\n        nanoseconds_since_epoch: {start}\n      duration:\n        \
         nanoseconds: {duration}\n      message_count: {}\n",
        span.messages
    );
}

/// A YAML string, in quotes where it needs them.
fn scalar(text: &str) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "_-./".contains(c);
    let starts_plain = text.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_');
    if starts_plain && text.chars().all(plain) {
        return text.to_owned();
    }
    // A JSON string is a YAML string.
    serde_json::Value::from(text).to_string()
}

/// What reading a bag needs of its metadata.
#[derive(Debug, Default, Deserialize)]
pub(super) struct Metadata {
    #[serde(default)]
    pub compression_format: String,
    #[serde(default)]
    pub compression_mode: String,
    pub relative_file_paths: Vec<String>,
}

#[derive(Deserialize)]
struct Document {
    rosbag2_bagfile_information: Metadata,
}

/// The metadata of the bag in `directory`, if it has any.
///
/// # Errors
/// [`BagError::Read`], [`BagError::Damaged`].
pub(super) fn read(directory: &Path) -> Result<Option<Metadata>, BagError> {
    let path = directory.join(FILE_NAME);
    let bytes = match std::fs::read(&path) {
        Ok(bytes) => bytes,
        Err(why) if why.kind() == std::io::ErrorKind::NotFound => return Ok(None),
        Err(why) => return Err(BagError::read(&path)(why)),
    };
    let text = String::from_utf8(bytes).map_err(|_| BagError::damaged(&path, "it is no UTF-8 text"))?;
    let document: Document = serde_saphyr::from_str(&text).map_err(|why| {
        let why = why.to_string();
        BagError::damaged(&path, why.lines().next().unwrap_or_default())
    })?;
    Ok(Some(document.rosbag2_bagfile_information))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_reads_back_whatever_the_file_is_called() {
        for file in ["run_0.mcap", "my run: \"7\" {é}_0.mcap", "1_0.mcap", "- x", "~"] {
            let text = yaml(&Span::default(), &[], &[(file.to_owned(), Span::default())]);
            let document: Document = serde_saphyr::from_str(&text).unwrap();
            assert_eq!(document.rosbag2_bagfile_information.relative_file_paths, [file]);
        }
    }

    #[test]
    fn a_span_is_that_of_its_messages_in_any_order() {
        let mut span = Span::default();
        assert_eq!((span.start(), span.duration()), (i64::MAX, 0));
        [7, 3, 5].iter().for_each(|time| span.add(*time));
        assert_eq!((span.messages, span.start(), span.duration()), (3, 3, 4));
    }
}
