//! The topics of a node, in the form that `msg_config/topics.yaml` has for each node.

use super::messages::Message;
use super::{DurabilityKind, ReliabilityKind, WireError};
use serde::Deserialize;
use std::collections::BTreeMap;

/// One topic of a node: its direction, type and QoS.
#[derive(Clone, Debug, Deserialize, PartialEq)]
#[serde(deny_unknown_fields)]
pub struct TopicContract {
    /// Whether the node publishes the topic or subscribes to it.
    pub direction: Direction,
    /// The type of the messages: `package/msg/Name`.
    #[serde(rename = "type")]
    pub message: String,
    /// Whether lost samples are sent again.
    pub reliability: ReliabilityKind,
    /// Whether late joiners get the last samples.
    pub durability: DurabilityKind,
    /// The number of samples that are kept.
    pub depth: i32,
    /// The publishing rate, for people who read the file. Programs ignore it.
    pub rate: String,
}

impl TopicContract {
    /// Creates a topic on which the node publishes `M`, with ROS 2's default QoS: reliable, volatile, the last 10 samples.
    pub fn output<M: Message>() -> Self {
        Self::new::<M>(Direction::Out)
    }

    /// Creates a topic to which the node subscribes for `M`, with ROS 2's default QoS: reliable, volatile, the last 10 samples.
    pub fn input<M: Message>() -> Self {
        Self::new::<M>(Direction::In)
    }

    fn new<M: Message>(direction: Direction) -> Self {
        Self {
            direction,
            message: M::TYPE.to_owned(),
            reliability: ReliabilityKind::Reliable,
            durability: DurabilityKind::Volatile,
            depth: 10,
            rate: String::new(),
        }
    }

    /// Makes the topic transient local: late joiners get the last `depth` samples.
    #[must_use]
    pub fn latched(self, depth: i32) -> Self {
        Self { durability: DurabilityKind::TransientLocal, depth, ..self }
    }
}

/// Whether a node publishes a topic or subscribes to it.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "snake_case")]
pub enum Direction {
    /// The node subscribes.
    In,
    /// The node publishes.
    Out,
}

/// The topics of one node. The keys are the names that the node uses, before remapping.
#[derive(Clone, Debug, Deserialize, PartialEq)]
#[serde(transparent)]
pub struct NodeContract {
    topics: BTreeMap<String, TopicContract>,
}

impl NodeContract {
    /// Creates a node's contract from its topics. Each has the name by which the node refers to it.
    pub fn new<N: Into<String>>(topics: impl IntoIterator<Item = (N, TopicContract)>) -> Self {
        Self { topics: topics.into_iter().map(|(name, topic)| (name.into(), topic)).collect() }
    }

    /// Returns the topic `name`. The topic must have messages of type `M` and the direction `direction`.
    ///
    /// # Errors
    /// [`WireError::Contract`] if the contract has no such topic.
    pub fn topic<M: Message>(&self, name: &str, direction: Direction) -> Result<&TopicContract, WireError> {
        self.topics
            .get(name)
            .filter(|topic| topic.message == M::TYPE && topic.direction == direction)
            .ok_or_else(|| WireError::Contract { topic: name.to_owned(), message: M::TYPE })
    }

    /// Makes the topic `name` best effort.
    pub fn with_best_effort(mut self, name: &str) -> Self {
        if let Some(topic) = self.topics.get_mut(name) {
            topic.reliability = ReliabilityKind::BestEffort;
        }
        self
    }

    /// Adds the topics of `other`.
    pub fn with(mut self, other: Self) -> Self {
        self.topics.extend(other.topics);
        self
    }

    /// Returns the names and the topics.
    pub fn topics(&self) -> impl Iterator<Item = (&str, &TopicContract)> {
        self.topics.iter().map(|(name, topic)| (name.as_str(), topic))
    }
}
