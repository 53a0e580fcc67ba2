//! Errors of the command line itself.

use dq_ros::ros::{NetworkEnd, RosError};
use std::path::PathBuf;
use thiserror::Error;

/// A command line with an invalid value.
#[derive(Debug, Error)]
#[error("{0}")]
pub(super) struct Usage(pub String);

/// A recording that lacks messages.
#[derive(Debug, Error)]
#[error("{dropped} messages were dropped: {directory:?} lacks them")]
pub(super) struct Incomplete {
    pub dropped: u64,
    pub directory: PathBuf,
}

/// This process has lost the network. A new process can join the graph again.
#[derive(Debug, Error)]
#[error("{0}: start this program again")]
pub(super) struct NetworkLost(pub NetworkEnd);

/// Returns whether the error is caused by the user's request.
pub(super) fn is_ros_usage(error: &RosError) -> bool {
    matches!(
        error,
        RosError::Environment { .. }
            | RosError::Name(_)
            | RosError::NoFreePort { .. }
            | RosError::Security { .. }
    )
}
