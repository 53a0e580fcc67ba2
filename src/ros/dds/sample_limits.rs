//! Limits how many samples RustDDS stores for a topic.
//!
//! RustDDS 0.15.1 blocks a reliable writer once `max_samples` samples (default 8192) wait for the acknowledgment of any reader.
//! Then no reader gets further samples. The history depth does not matter (`writer_send_buffer.rs`). For a transient-local topic,
//! RustDDS always stores `max_samples` samples. Delete this module when a writer respects its history depth and drops readers that
//! do not acknowledge.
//!
//! RustDDS also stores received samples for the readers of a participant. For each topic, it stores as many samples as the largest
//! `max_samples` of the participant's endpoints on that topic (default 64). RustDDS keeps the samples even after they were taken, and
//! regardless of their size (`dds_cache.rs`).

use rustdds::policy::ResourceLimits;

/// The limit for topics that are not latched. A frozen reader, such as a stopped `ros2 topic echo`, blocks a writer that publishes
/// at 1 kHz after 200 s. With RustDDS's default limit, it would block the writer after 8 s.
const UNACKNOWLEDGED: i32 = 200_000;

/// The limit for latched topics. While one reader has left this many samples unacknowledged, the writer cannot write the next
/// sample. Readers that join later then miss that sample.
const LATCHED: i32 = 500;

/// Returns the limits of a writer. `is_latched` is true if the topic is latched.
pub(crate) fn of_writer(is_latched: bool) -> ResourceLimits {
    let max_samples = if is_latched { LATCHED } else { UNACKNOWLEDGED };
    ResourceLimits { max_samples, max_instances: 1, max_samples_per_instance: max_samples }
}

/// Returns the limits of a reader of a topic with this history depth.
pub(crate) fn of_reader(depth: i32) -> ResourceLimits {
    ResourceLimits { max_samples: depth, max_instances: 1, max_samples_per_instance: depth }
}

/// The number of samples that a writer stores on a topic that its own participant also reads. RustDDS then stores as many received
/// samples of the topic, so the number is small. Such a writer needs no more, because it writes few samples.
const OF_INPUT: i32 = 64;

/// Returns the limits of a writer on a topic that its participant also reads.
pub(crate) fn of_writer_to_input() -> ResourceLimits {
    of_reader(OF_INPUT)
}
