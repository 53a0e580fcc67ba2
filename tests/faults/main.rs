//! Tests faults over real DDS with real processes, each on its own hosts (network namespaces). Another vendor's DDS causes the
//! fault. The name of a test tells the outcome, and the case of the same name (cases_*.py) describes the fault. Every command of
//! the servo during the case is checked against the invariants.

#[path = "../dds/host.rs"]
mod host;

mod clock;
mod goals;
#[allow(dead_code, reason = "the tests of dq_core use all of it")]
#[path = "../../src/core/tests/invariants/mod.rs"]
mod invariants;
mod joint_states;
mod network;
mod outcome;
mod partition;
mod processes;
mod realtime;
mod topics;

/// The path of the peer program, which uses another vendor's DDS.
const PEER: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/faults/faults.py");
