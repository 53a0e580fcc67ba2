//! Peers on eProsima Fast DDS, built from this checkout; `libfastrtps-dev` brings the library.

use crate::host::assert_success;
use std::process::Command;

/// Compiles the C++ file `source`, a path from the top of the checkout, to a program, whose path it returns.
pub fn compile(source: &str) -> String {
    let program = format!("{}/{}", env!("CARGO_TARGET_TMPDIR"), source.replace(['/', '.'], "_"));
    let source = format!("{}/{source}", env!("CARGO_MANIFEST_DIR"));
    let build = Command::new("g++")
        .args(["-std=c++17", "-O1", "-o", &program, &source, "-lfastrtps", "-lfastcdr"])
        .output()
        .expect("g++");
    assert_success(&build);
    program
}
