//! Exit codes: 0 success; 1 failure, including a panic; 2 invalid arguments or environment; 3 success, but a recording lacks
//! messages; 4 the network was lost or came late, so that a restart helps. For each code except 0, a line on stderr says why.

use super::error::{Incomplete, NetworkLost, Usage, is_ros_usage};
use super::print::StdoutError;
use dq_core::servo::Rejection;
use dq_kinematics::arm::ArmError;
use dq_nodes::NodeError;
use dq_params::ParameterError;
use dq_ros::ros::args::ArgsError;
use dq_ros::ros::names::NameError;
use dq_ros::{log_file, stderr};
use std::panic::AssertUnwindSafe;
use std::process::ExitCode;
use std::time::Duration;

/// Prints the error of `result`, if any, and returns the exit code.
pub(super) fn code(result: anyhow::Result<()>) -> ExitCode {
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) if error.downcast_ref().is_some_and(StdoutError::is_closed) => ExitCode::SUCCESS,
        Err(error) => {
            stderr::line(format!("error: {}", one_line(&format!("{error:#}"))));
            ExitCode::from(number(&error))
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
        stderr::line(format!("error: {}{place}", one_line(why)));
    }));
    // The hook has printed the panic.
    let code = std::panic::catch_unwind(AssertUnwindSafe(program)).unwrap_or(ExitCode::FAILURE);
    log_file::flush(LAST_LINES);
    stderr::flush(LAST_LINES);
    code
}

/// The time to wait until the last lines are written. A stopped terminal must not keep the program alive.
const LAST_LINES: Duration = Duration::from_millis(500);

fn one_line(text: &str) -> String {
    text.replace('\n', " ")
}

fn number(error: &anyhow::Error) -> u8 {
    if error.is::<Incomplete>() {
        return 3;
    }
    if error.is::<NetworkLost>() {
        return 4;
    }
    if is_usage(error) { 2 } else { 1 }
}

/// Returns whether the error is caused by the user's request rather than by its execution.
fn is_usage(error: &anyhow::Error) -> bool {
    let node = |error: &NodeError| match error {
        NodeError::Config(_) | NodeError::Arm(_) | NodeError::Settings(_) => true,
        NodeError::Ros(error) => is_ros_usage(error),
        NodeError::Description { .. }
        | NodeError::Wire(_)
        | NodeError::Thread(_)
        | NodeError::Realtime(_) => false,
    };
    let of_tools = super::tools::is_usage;
    error.is::<Usage>()
        || error.is::<ArgsError>()
        || error.is::<ParameterError>()
        || error.is::<NameError>()
        || error.is::<ArmError>()
        || error.is::<Rejection>()
        || error.downcast_ref().is_some_and(is_ros_usage)
        || error.downcast_ref().is_some_and(node)
        || of_tools(error)
}

#[cfg(test)]
mod tests {
    use super::super::tools::recording::is_complete;
    use super::*;
    use dq_bags::WrittenBag;
    use dq_ros::ros::RosError;
    use std::path::Path;

    #[test]
    fn a_recording_that_lacks_messages_has_a_code_of_its_own_and_their_number() {
        let bag = WrittenBag { messages: 100, topics: 2, dropped: 7, files: 1 };
        let lacks = anyhow::Error::from(is_complete(Path::new("run"), &bag).unwrap_err());
        assert_eq!(
            (number(&lacks), lacks.to_string().as_str()),
            (3, "7 messages were dropped: \"run\" lacks them")
        );
        assert!(is_complete(Path::new("run"), &WrittenBag { dropped: 0, ..bag }).is_ok());
        assert_eq!(number(&Usage(String::new()).into()), 2);
        assert_eq!(number(&anyhow::anyhow!("failed")), 1);
        let lost = anyhow::Error::from(NetworkLost(dq_ros::ros::NetworkEnd::Stopped));
        assert_eq!(number(&lost), 4);
        // The code is not 4, because a restart would not help.
        let full = RosError::NoFreePort { domain: 0, first: 7410, last: 7648 };
        assert_eq!(number(&full.into()), 2);
        assert_eq!(format!("{lost:#}").matches("DDS has ended").count(), 1, "{lost:#}");
    }
}
