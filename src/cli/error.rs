//! The errors of the command line itself.

use dq_ros::ros::{NetworkEnd, RosError};
use std::path::PathBuf;
use thiserror::Error;

/// A command line that asks for something that is not there.
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

/// The node has lost the others on the network; a new process of it finds them again.
#[derive(Debug, Error)]
#[error("{0}: start this program again")]
pub(super) struct NetworkLost(#[source] pub NetworkEnd);

/// Whether what was asked of the network cannot be.
pub(super) fn is_ros_usage(error: &RosError) -> bool {
    matches!(error, RosError::Environment { .. } | RosError::Name(_) | RosError::Security { .. })
}
