//! What a participant makes writers and readers from.

use super::log::Logger;
use super::names::NodeName;
use super::topic::DdsTopic;

/// What an endpoint is made from.
#[derive(Clone)]
pub(super) struct Plan {
    pub topic: DdsTopic,
    /// Whose it is; nobody's is not announced.
    pub node: Option<NodeName>,
    /// Where what QoS keeps from it is logged.
    pub log: Option<Logger>,
}

impl Plan {
    /// An endpoint of no node's.
    pub fn unannounced(topic: DdsTopic) -> Self {
        Self { topic, node: None, log: None }
    }

    /// An endpoint of the node.
    pub fn of(node: &NodeName, topic: DdsTopic) -> Self {
        Self { topic, node: Some(node.clone()), log: None }
    }

    /// The same, of which the log reports what QoS keeps from it.
    pub fn logged(self, log: &Logger) -> Self {
        Self { log: Some(log.clone()), ..self }
    }
}

/// The direction of an endpoint.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
pub(super) enum Kind {
    Reader,
    Writer,
}
