//! What ROS 2 expects of a node, on RustDDS: names and remaps, `--ros-args`, services for every
//! vendor's clients, parameter services. The nodes see this facade, never a type of RustDDS.

#[cfg(test)]
pub(crate) mod alone;
mod announcement;
pub mod args;
mod client;
mod clock;
mod discovery;
mod endpoint;
mod environment;
mod error;
mod graph;
mod log;
pub mod names;
mod namesakes;
mod node;
mod origin;
mod parameter_client;
mod parameter_server;
mod participant;
mod qos;
mod raw;
mod reader;
mod security;
mod service;
mod session;
mod topic;
mod topics;
mod writer;

pub use crate::dds::ended_threads::{NetworkEnd, NetworkWatch};
pub use crate::dds::own_domain::OwnDomain;
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
pub use node::Node;
pub use origin::Origin;
pub use parameter_client::ParameterClient;
pub use parameter_server::ParameterServer;
pub use raw::{RawMessage, RawSubscription};
pub use session::Session;
pub use topics::{OwnTopic, Publisher, Subscription};
