//! Errors that occur when a node joins or uses the ROS graph.

use crate::dds::ports;
use thiserror::Error;

/// An error of the ROS layer. Each message is one line that names the value and what is expected.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum RosError {
    /// An environment variable has a value that ROS 2 does not know.
    #[error("{variable}={value:?}: expected {expected}")]
    Environment {
        /// The name of the variable.
        variable: &'static str,
        /// The given value.
        value: String,
        /// The expected values.
        expected: &'static str,
    },
    /// No other node can be reached.
    #[error("no usable network interface: {0} (bring one up, for example `ip link set lo up`)")]
    NoNetwork(String),
    /// The domain has no port for another participant.
    #[error(
        "domain {domain} has no free UDP port for another participant on this host, which has room for {PARTICIPANTS} (ports {first} to \
         {last}): end other programs there, or use another ROS_DOMAIN_ID"
    )]
    NoFreePort {
        /// The domain.
        domain: u16,
        /// The first port that the domain reserves for a participant.
        first: u16,
        /// The last port that the domain reserves for a participant.
        last: u16,
    },
    /// Every domain is in use.
    #[error("no domain from 1 to {highest} is free on this host")]
    NoFreeDomain {
        /// The highest domain that was tried.
        highest: u16,
    },
    /// Security is requested, and a required file is missing, invalid or out of date.
    #[error("security: {}: {why}", path.display())]
    Security {
        /// The file or folder.
        path: std::path::PathBuf,
        /// The reason.
        why: String,
    },
    /// The middleware refused to create something.
    #[error("DDS could not create {what}: {why}")]
    Create {
        /// What could not be created.
        what: String,
        /// The middleware's message.
        why: String,
    },
    /// The middleware refused to create something, because the permissions of the node's enclave do not allow it.
    #[error("DDS could not create {what}: {why} (the permissions of its enclave do not have it)")]
    NotPermitted {
        /// What could not be created.
        what: String,
        /// The middleware's message.
        why: String,
    },
    /// A name is not a ROS 2 name.
    #[error(transparent)]
    Name(#[from] super::names::NameError),
    /// A message was not published, because nobody subscribed in time.
    #[error("{topic}: {why}")]
    Write {
        /// The name of the topic.
        topic: String,
        /// The reason.
        why: String,
    },
    /// The wire contract does not have the requested topic.
    #[error(transparent)]
    Wire(#[from] dq_messages::WireError),
    /// A service did not appear, or gave no valid answer in time.
    #[error("{service}: {why}")]
    Service {
        /// The name of the service.
        service: String,
        /// The reason.
        why: String,
    },
}

/// A host has ports for this many participants of a domain (RTPS 2.5, section 9.6.2.3).
const PARTICIPANTS: u16 = 120;

impl RosError {
    /// Returns the error for a domain that has no port for another participant.
    pub(super) fn no_free_port(domain: u16) -> Self {
        let [first, last] = [0, PARTICIPANTS - 1].map(|number| ports::of_participant(domain, number));
        Self::NoFreePort { domain, first, last }
    }

    /// Wraps a creation error of the middleware.
    pub(super) fn create(what: impl Into<String>) -> impl FnOnce(&dyn std::fmt::Display) -> Self {
        let what = what.into();
        move |why| {
            let why = why.to_string();
            // DDS Security answers "not allowed" if a permission is missing.
            match why.to_lowercase().contains("not allowed") {
                true => Self::NotPermitted { what, why },
                false => Self::Create { what, why },
            }
        }
    }
}
