//! Tests real processes over secured DDS, each in its own network namespace: members communicate, others get nothing, and a node
//! that cannot be secured does not run.

#[path = "../dds/host.rs"]
mod host;

mod fastdds;
mod governance;
mod insiders;
mod keystore;
mod outsiders;
mod refusals;
mod view;
mod wire;

/// The path of the outsider program, which uses another vendor's DDS.
const PEER: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/security/outsider.py");
