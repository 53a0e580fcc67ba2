//! Faults over real DDS: real processes, each test on hosts of its own (network namespaces), another vendor's DDS as the one who
//! brings the fault. The name of a test says the outcome; the case of that name (cases_*.py) states it. Every command that the servo sent
//! meanwhile is held against the invariants.

#[path = "../dds/host.rs"]
mod host;

mod clock;
mod goals;
mod joint_states;
mod network;
mod outcome;
mod partition;
mod processes;
mod realtime;
mod topics;

/// The peer with the DDS of another vendor.
const PEER: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/faults/faults.py");
