//! Tests the live page: the server by its frames and headers, and the page in a real browser.

mod browser;
#[path = "../dds/host.rs"]
mod host;
mod page;
mod server;

/// The path of the peer program, which these tests do not use.
const PEER: &str = "";
