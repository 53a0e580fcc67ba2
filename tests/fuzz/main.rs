//! Tests damaged input: every reader answers without a panic, with one line, and in bounded memory.
//!
//! Starts from a corpus (tests/data/fuzz, the files of msg_config, messages of a real ROS 2) and damages it at random. CI runs
//! cases for some seconds. `FUZZ_FACTOR=1000 cargo test --test fuzz` runs 1000 times as many cases.

#[path = "../record/damage.rs"]
mod damage;
#[path = "../record/memory.rs"]
mod memory;

mod environment;
mod messages;
mod names;
mod parameters;

use memory::measured;
use proptest::prelude::ProptestConfig;
use std::fmt::Display;

/// Returns the number of cases: `in_ci` times `FUZZ_FACTOR`. The seeds of earlier failures (tests/proptest-regressions) are run
/// first.
fn cases(in_ci: u32) -> ProptestConfig {
    let factor =
        std::env::var("FUZZ_FACTOR").map_or(1, |text| text.parse().expect("FUZZ_FACTOR is a number"));
    ProptestConfig { cases: in_ci.saturating_mul(factor), ..ProptestConfig::default() }
}

/// Fails unless the message is one nonempty line.
fn assert_one_line(message: &dyn Display) {
    let text = message.to_string();
    assert!(!text.is_empty() && text.lines().count() == 1, "{text:?}");
}

/// Returns the lines of a corpus file, without its comments.
fn corpus(text: &'static str) -> Vec<&'static str> {
    text.lines().filter(|line| !line.is_empty() && !line.starts_with('#')).collect()
}
