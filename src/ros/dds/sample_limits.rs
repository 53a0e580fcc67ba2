//! How many samples a writer may keep.
//!
//! RustDDS 0.15.1 stops a reliable writer for all readers once `max_samples` (8192 unless set otherwise) wait for one of them, whatever the
//! history's depth (`writer_send_buffer.rs`), and keeps that many of a transient-local topic. This goes when a writer keeps its history's
//! depth and leaves readers behind that do not acknowledge.

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
