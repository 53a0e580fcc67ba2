//! A ROS 2 node on ros2-client: names and remapping, `--ros-args`, services for clients of every vendor, parameter services. No
//! type of ros2-client or RustDDS appears in the interface of this module.

pub mod args;
mod client;
mod clock;
mod endpoint_names;
mod endpoints;
mod environment;
mod error;
mod graph;
mod log;
mod log_format;
pub mod names;
mod node;
mod parameter_client;
mod parameter_server;
mod release;
mod resolver;
mod services;
mod session;
mod topics;
mod unread_variables;

pub use crate::dds::ended_threads::{NetworkEnd, NetworkWatch};
pub use crate::dds::own_domain::OwnDomain;
pub use crate::dds::raw_subscription::{RawMessage, RawSubscription};
pub use args::{LogLevel, RosArgs};
pub use client::Client;
pub use clock::Clock;
pub use endpoint_names::{EndpointId, EndpointNames, Origin};
pub use environment::{Environment, Reach};
pub use error::RosError;
pub use graph::{GraphTopic, NameWatch};
pub use log::{Logger, Logging};
pub use names::NodeName;
pub use node::Node;
pub use parameter_client::ParameterClient;
pub use parameter_server::ParameterServer;
pub use resolver::Resolver;
pub use session::Session;
pub use topics::{OwnTopic, Publisher, Publishing, Subscription};
