//! What can go wrong between a node and the ROS graph.

use thiserror::Error;

/// An error of the ROS room. Each message is one line that names the value and what would be right.
#[derive(Debug, Error)]
pub enum RosError {
    /// An environment variable has a value that ROS 2 does not know.
    #[error("{variable}={value:?}: expected {expected}")]
    Environment {
        /// The variable.
        variable: &'static str,
        /// Its value.
        value: String,
        /// What would be right.
        expected: &'static str,
    },
    /// There is no way to reach any other node.
    #[error("no usable network interface: {0} (bring one up, for example `ip link set lo up`)")]
    NoNetwork(String),
    /// Each domain has somebody.
    #[error("no domain from 1 to {highest} is free on this host")]
    NoFreeDomain {
        /// The highest that was looked at.
        highest: u16,
    },
    /// Security was asked for, and a file that it takes is missing, wrong or out of date.
    #[error("security: {}: {why}", path.display())]
    Security {
        /// The file or folder.
        path: std::path::PathBuf,
        /// What is wrong with it.
        why: String,
    },
    /// The middleware refused to make something.
    #[error("DDS could not create {what}: {why}")]
    Create {
        /// The thing.
        what: String,
        /// The middleware's words.
        why: String,
    },
    /// A name is not a ROS 2 name.
    #[error(transparent)]
    Name(#[from] super::names::NameError),
    /// A sample could not be written.
    #[error("{topic}: {why}")]
    Write {
        /// The topic.
        topic: String,
        /// The middleware's words.
        why: String,
    },
    /// The wire contract does not have what was asked of it.
    #[error(transparent)]
    Wire(#[from] dq_messages::WireError),
    /// A service did not answer in time.
    #[error("{service}: {why}")]
    Service {
        /// The service.
        service: String,
        /// What happened.
        why: String,
    },
}

/// What to do about an enclave that lacks a permission.
const NOT_PERMITTED: &str = " (the permissions of its enclave do not have it; launch_scripts/dq_servo_keystore.sh makes an enclave \
                             of an earlier version anew once its folder is removed)";

impl RosError {
    /// Wraps a creation error of the middleware.
    pub(super) fn create(what: impl Into<String>) -> impl FnOnce(&dyn std::fmt::Display) -> Self {
        let what = what.into();
        move |why| {
            let why = why.to_string();
            // DDS Security's word for what the permissions lack, of an enclave that an earlier version made as a rule.
            let is_refused = why.to_lowercase().contains("not allowed");
            let hint = if is_refused { NOT_PERMITTED } else { "" };
            Self::Create { what, why: why + hint }
        }
    }
}
