//! The live page: the server by its frames and headers, and the page in a real browser.

mod browser;
#[path = "../dds/host.rs"]
mod host;
mod page;
mod server;

/// For the host's peers, of which there are none here.
const PEER: &str = "";
