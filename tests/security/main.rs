//! Real processes over secured DDS, each test in a network namespace of its own: who belongs gets through, who does not gets
//! nothing, and a node that cannot be secured does not run.

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

/// The outsider with the DDS of another vendor.
const PEER: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/security/outsider.py");
