//! Limits on how many samples RustDDS keeps of a topic.
//!
//! RustDDS 0.15.1 stops a reliable writer for all readers once `max_samples` (8192 unless set otherwise) wait for one of them, whatever the
//! history's depth (`writer_send_buffer.rs`), and keeps that many of a transient-local topic. This goes when a writer keeps its history's
//! depth and leaves readers behind that do not acknowledge.
//!
//! For the readers of a participant it keeps as many samples of a topic as the largest `max_samples` of the participant's endpoints on that
//! topic (64 by default), whether they were taken or not, and whatever their size (`dds_cache.rs`).

use rustdds::policy::ResourceLimits;

/// Where late joiners get nothing: a frozen `ros2 topic echo` would stop the commands after 16 s. This holds 200 s at 1 kHz.
const UNACKNOWLEDGED: i32 = 200_000;

/// Where late joiners get what was latched. A reader that acknowledges none of so many blocks the next one, which late joiners then miss.
const LATCHED: i32 = 500;

/// The limits of a writer, which may be of a latched topic.
pub(crate) fn of_writer(is_latched: bool) -> ResourceLimits {
    let max_samples = if is_latched { LATCHED } else { UNACKNOWLEDGED };
    ResourceLimits { max_samples, max_instances: 1, max_samples_per_instance: max_samples }
}

/// Returns the limits of a reader of a topic with this history depth.
pub(crate) fn of_reader(depth: i32) -> ResourceLimits {
    ResourceLimits { max_samples: depth, max_instances: 1, max_samples_per_instance: depth }
}

/// The samples that a writer may keep on a topic that its participant also reads. It writes little there, and the participant's readers keep
/// as many.
const OF_INPUT: i32 = 64;

/// Returns the limits of a writer on a topic that its participant also reads.
pub(crate) fn of_writer_to_input() -> ResourceLimits {
    of_reader(OF_INPUT)
}
