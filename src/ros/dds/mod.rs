//! Workarounds for RustDDS 0.15.1. Each file works around one defect, and says when it can be deleted. The files do not depend on
//! nodes.

pub(crate) mod announcement;
#[cfg(feature = "security")]
pub(crate) mod certificates;
pub(crate) mod ended_threads;
mod events;
mod first_found;
pub(crate) mod first_sample_request;
pub(crate) mod handover;
pub(crate) mod incompatible_qos;
pub(crate) mod interfaces;
pub(crate) mod kept_samples;
pub(crate) mod large_replies;
pub(crate) mod matches;
pub(crate) mod new_address;
pub(crate) mod own_datagrams;
pub(crate) mod own_domain;
pub(crate) mod payload_padding;
#[cfg(feature = "security")]
pub(crate) mod payload_protection;
pub(crate) mod peer_recovery;
pub(crate) mod ports;
pub(crate) mod raw_subscription;
pub(crate) mod sample_limits;
pub(crate) mod send_backlog;
pub(crate) mod static_peers;
pub(crate) mod vendor;
