//! Tests that PyPI `rosbags`, an independent implementation, reads our bags, and that we read its bags.

use crate::bags::{Sample, data_file, place, read, read_through, samples, topics, write};
use dq_bags::WriterOptions;
use serde::Deserialize;
use std::path::Path;
use std::process::{Command, Output};

#[derive(Deserialize)]
struct Line {
    topic: String,
    r#type: String,
    time: i64,
    cdr: String,
}

/// Runs `tests/record/rosbags_peer.py` with the Python of tests/install.sh.
fn peer(arguments: &[&str]) -> Output {
    const PYTHON: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/target/venv/bin/python");
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/record/rosbags_peer.py");
    Command::new(PYTHON).arg(script).args(arguments).output().unwrap()
}

pub fn peer_samples(arguments: &[&str]) -> Vec<Sample> {
    let output = peer(arguments);
    assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
    let lines: Vec<Line> = serde_json::from_slice(&output.stdout).unwrap();
    let sample = |line: Line| Sample {
        topic: line.topic,
        message: line.r#type,
        time: line.time,
        cdr: hex::decode(line.cdr).unwrap(),
    };
    lines.into_iter().map(sample).collect()
}

fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

#[test]
fn rosbags_reads_every_recorded_message_bit_for_bit() {
    let directory = tempfile::tempdir().unwrap();
    let samples = samples(200);
    let split = WriterOptions { max_size: None, max_duration: Some(std::time::Duration::from_secs(1)) };
    for (name, options) in [("one", WriterOptions::default()), ("several files: \"yes\"", split)] {
        let bag = directory.path().join(name);
        write(&bag, options, &samples);
        assert_eq!(peer_samples(&["read", text(&bag)]), samples, "{name}");
    }
}

#[test]
fn bags_of_rosbags_are_read() {
    let directory = tempfile::tempdir().unwrap();
    for kind in ["mcap", "zstd", "sqlite3", "message", "file", "message_mcap", "file_mcap"] {
        let bag = directory.path().join(kind);
        let written = peer_samples(&["write", text(&bag), kind]);
        assert_eq!(written.len(), 2000);
        assert_eq!(read(&bag), written, "{kind}");
        assert_eq!(read(&data_file(&bag)), written, "{kind}, the file alone");
        let names: Vec<_> = topics(&bag).into_iter().map(|(name, _)| name).collect();
        assert_eq!(names, ["/number", "/text"]);
        std::fs::remove_file(bag.join("metadata.yaml")).unwrap();
        assert_eq!(read(&bag), written, "{kind}, without metadata.yaml");
    }
}

/// A limitation of rosbags 0.11.9: it needs the footer, which a killed recorder does not write. `mcap recover` (Foxglove's tool) adds one.
#[test]
fn rosbags_needs_the_footer_of_a_file() {
    let (_directory, bag) = place("bag");
    write(&bag, WriterOptions::default(), &samples(10));
    let bytes = std::fs::read(data_file(&bag)).unwrap();
    std::fs::write(data_file(&bag), &bytes[..bytes.len() - 20]).unwrap();
    assert_eq!(read_through(&bag).unwrap().0, samples(10));
    let output = peer(&["read", text(&bag)]);
    assert!(String::from_utf8_lossy(&output.stderr).contains("File end magic is invalid"));
}
