//! Exit codes: 0 success; 1 failure, including a panic; 2 invalid arguments or environment; 3 success, but a recording lacks
//! messages; 4 the network was lost, or this host got an address after the start. After 4, start the program again. For each code
//! except 0, a line on stderr says why.

use super::error::Result;
use dq_ros::{log_file, stderr};
use std::panic::AssertUnwindSafe;
use std::process::ExitCode;
use std::time::Duration;

/// Prints the error of `result`, if any, and returns the exit code.
pub(super) fn code(result: Result<()>) -> ExitCode {
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            let code = error.exit_code();
            if code != 0 {
                stderr::line(format!("error: {}", error.line()));
            }
            ExitCode::from(code)
        }
    }
}

/// Runs `program`. A panic in the program or in one of its threads is printed like an error.
pub(super) fn catch(program: impl FnOnce() -> ExitCode) -> ExitCode {
    std::panic::set_hook(Box::new(|panic| {
        let message = panic.payload();
        let why = message.downcast_ref::<&str>().copied();
        let why = why.or_else(|| message.downcast_ref::<String>().map(String::as_str));
        let why = why.unwrap_or("a panic without a message");
        let place = panic.location().map(|at| format!(" ({at})")).unwrap_or_default();
        stderr::line(format!("error: {}{place}", why.replace('\n', " ")));
    }));
    // The hook has printed the panic.
    let code = std::panic::catch_unwind(AssertUnwindSafe(program)).unwrap_or(ExitCode::FAILURE);
    log_file::flush(LAST_LINES);
    stderr::flush(LAST_LINES);
    code
}

/// The time to wait until the last lines are written. A stopped terminal must not keep the program alive.
const LAST_LINES: Duration = Duration::from_millis(500);
