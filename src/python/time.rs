//! Times from Python, in seconds.

use super::arrays::wrong;
use pyo3::prelude::*;
use std::time::Duration;

/// Converts `seconds` to a duration. Returns an error if they are negative or not finite.
pub(super) fn duration(seconds: f64, what: &str) -> PyResult<Duration> {
    let wrong = |why| wrong(format!("{what} is {seconds} s: {why}"));
    Duration::try_from_secs_f64(seconds).map_err(wrong)
}

/// Returns how old a joint state with this stamp is. A stamp that is ahead of `now` by a rounding error counts as `now`.
pub(super) fn age(now: f64, stamp: f64) -> PyResult<Duration> {
    let wrong = || {
        wrong(format!("stamp is {stamp} s and now is {now} s: a joint state is not measured in the future"))
    };
    let age = if (now - stamp).abs() < 1e-6 { 0.0 } else { now - stamp };
    Duration::try_from_secs_f64(age).map_err(|_| wrong())
}
