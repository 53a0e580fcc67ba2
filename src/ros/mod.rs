//! What ROS 2 expects of a node, on RustDDS: names and remaps, `--ros-args`, services for every
//! vendor's clients, parameter services. The nodes see this facade, never a type of RustDDS.

#[cfg(test)]
pub(crate) mod alone;
mod announcement;
pub mod args;
mod client;
mod clock;
mod discovery;
#[cfg(feature = "security")]
mod enclave;
mod endpoint;
mod environment;
mod error;
mod first_found;
#[cfg(feature = "security")]
mod governance;
mod graph;
mod log;
mod lost;
mod matches;
mod mismatch;
pub mod names;
mod namesakes;
mod network_end;
mod node;
mod nudge;
mod origin;
mod own_domain;
mod padded;
mod parameter_client;
mod parameter_server;
mod participant;
mod ports;
mod qos;
mod raw;
mod raw_cdr;
mod reader;
mod security;
mod service;
mod session;
mod topic;
mod topics;
mod writer;

pub use args::RosArgs;
pub use client::Client;
pub use clock::Clock;
pub use discovery::GraphTopic;
pub use environment::{Environment, Reach};
pub use error::RosError;
pub use graph::{EndpointId, EndpointNames};
pub use log::{LogLevel, Logger, Logging};
pub use names::{NodeName, Resolver};
pub use namesakes::NameWatch;
pub use network_end::{NetworkEnd, NetworkWatch};
pub use node::Node;
pub use origin::Origin;
pub use own_domain::OwnDomain;
pub use parameter_client::ParameterClient;
pub use parameter_server::ParameterServer;
pub use raw::{RawMessage, RawSubscription};
pub use session::Session;
pub use topics::{OwnTopic, Publisher, Subscription};
