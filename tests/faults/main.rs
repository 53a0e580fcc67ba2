//! Tests faults over real DDS with real processes, each on its own hosts (network namespaces). Another vendor's DDS causes the fault. The
//! name of a test tells the outcome, and the case of this name (cases_*.py) describes it. Every command of the servo in the meantime is
//! checked against the invariants.

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

/// The peer with another vendor's DDS.
const PEER: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/faults/faults.py");
