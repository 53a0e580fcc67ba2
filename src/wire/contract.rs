//! The wire contract: `msg_config/topics.yaml`, which the nodes create their topics from.

use super::error::RosError;
use super::messages::Message;
use rustdds::policy::{Durability, History, Reliability, ResourceLimits};
use rustdds::{Duration, QosPolicies, QosPolicyBuilder};
use serde::Deserialize;
use std::collections::BTreeMap;

/// Samples that a writer keeps for readers that have not acknowledged them. RustDDS stops a reliable writer for all
/// readers once this many are waiting for one (8192 unless set otherwise): a frozen `ros2 topic echo` would stop the
/// commands after 16 s. This holds 200 s at 1 kHz.
const UNACKNOWLEDGED_SAMPLES: i32 = 200_000;

/// One topic of the contract.
#[derive(Clone, Debug, Deserialize, PartialEq)]
#[serde(deny_unknown_fields)]
pub struct TopicContract {
    /// Whether the node publishes or subscribes.
    pub direction: Direction,
    /// `package/msg/Name`.
    #[serde(rename = "type")]
    pub message: String,
    /// Delivery.
    pub reliability: ReliabilityKind,
    /// Whether late joiners get the last samples.
    pub durability: DurabilityKind,
    /// Samples kept.
    pub depth: i32,
    /// How often, for people.
    pub rate: String,
}

/// The node's side of a topic.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "snake_case")]
pub enum Direction {
    /// Subscribed.
    In,
    /// Published.
    Out,
}

/// DDS reliability.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "snake_case")]
pub enum ReliabilityKind {
    /// Lost samples are sent again.
    Reliable,
    /// Lost samples are lost.
    BestEffort,
}

/// DDS durability.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "snake_case")]
pub enum DurabilityKind {
    /// Only who listens hears.
    Volatile,
    /// Late joiners get the last samples.
    TransientLocal,
}

/// The topics of one node by their names there.
#[derive(Clone, Debug, Deserialize, PartialEq)]
#[serde(transparent)]
pub struct NodeContract {
    topics: BTreeMap<String, TopicContract>,
}

/// The whole contract.
#[derive(Clone, Debug, Deserialize, PartialEq)]
#[serde(deny_unknown_fields)]
pub struct Contract {
    /// The servo's topics.
    pub servo: NodeContract,
    /// The two-arm servo's topics.
    pub dual: NodeContract,
    /// The plant's topics.
    pub plant: NodeContract,
}

impl Contract {
    /// The contract that is built in.
    ///
    /// # Errors
    /// [`RosError::ContractFile`].
    pub fn builtin() -> Result<Self, RosError> {
        serde_saphyr::from_str(include_str!("../../msg_config/topics.yaml"))
            .map_err(|why| RosError::ContractFile(why.to_string()))
    }

    /// Every node's topics.
    pub fn nodes(&self) -> impl Iterator<Item = &NodeContract> {
        [&self.servo, &self.dual, &self.plant].into_iter()
    }
}

impl NodeContract {
    /// The topic called `name`, checked to be of type `M` and of that direction.
    ///
    /// # Errors
    /// [`RosError::Contract`].
    pub fn topic<M: Message>(&self, name: &str, direction: Direction) -> Result<&TopicContract, RosError> {
        self.topics
            .get(name)
            .filter(|topic| topic.message == M::TYPE && topic.direction == direction)
            .ok_or_else(|| RosError::Contract { topic: name.to_owned(), message: M::TYPE })
    }

    /// The same contract with the topic `name` subscribed best effort.
    pub fn with_best_effort(mut self, name: &str) -> Self {
        if let Some(topic) = self.topics.get_mut(name) {
            topic.reliability = ReliabilityKind::BestEffort;
        }
        self
    }

    /// Names and topics.
    pub fn topics(&self) -> impl Iterator<Item = (&str, &TopicContract)> {
        self.topics.iter().map(|(name, topic)| (name.as_str(), topic))
    }
}

impl TopicContract {
    /// The DDS policies; writers get room for unacknowledged samples and never block.
    pub(super) fn qos(&self) -> QosPolicies {
        let reliability = match self.reliability {
            ReliabilityKind::Reliable => Reliability::Reliable { max_blocking_time: Duration::ZERO },
            ReliabilityKind::BestEffort => Reliability::BestEffort,
        };
        let durability = match self.durability {
            DurabilityKind::Volatile => Durability::Volatile,
            DurabilityKind::TransientLocal => Durability::TransientLocal,
        };
        let builder = QosPolicyBuilder::new()
            .reliability(reliability)
            .durability(durability)
            .history(History::KeepLast { depth: self.depth });
        if self.direction == Direction::In {
            return builder.build();
        }
        let limits = ResourceLimits {
            max_samples: UNACKNOWLEDGED_SAMPLES,
            max_instances: 1,
            max_samples_per_instance: UNACKNOWLEDGED_SAMPLES,
        };
        builder.resource_limits(limits).build()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ros::messages::{JointState, PoseStamped};

    #[test]
    fn the_built_in_contract_holds_for_its_topics_and_no_others() {
        let servo = Contract::builtin().unwrap().servo;
        assert!(servo.topic::<PoseStamped>("goal_pose", Direction::In).is_ok());
        for (topic, direction) in [("goal_pose", Direction::Out), ("goal", Direction::In)] {
            assert!(servo.topic::<PoseStamped>(topic, direction).is_err());
        }
        assert!(servo.topic::<JointState>("goal_pose", Direction::In).is_err());
    }

    #[test]
    fn writers_never_block_and_descriptions_are_latched() {
        let plant = Contract::builtin().unwrap().plant;
        for (name, topic) in plant.topics() {
            let qos = topic.qos();
            assert_eq!(qos.reliable_max_blocking_time(), Some(Duration::ZERO), "{name}");
            let latched = ["/tf_static", "robot_description"].contains(&name);
            assert_eq!(qos.durability() == Some(Durability::TransientLocal), latched, "{name}");
            assert_eq!(qos.resource_limits().is_some(), topic.direction == Direction::Out, "{name}");
        }
        let best_effort = plant.with_best_effort("joint_states");
        let joint_states = best_effort.topics().find(|(name, _)| *name == "joint_states").unwrap().1;
        assert_eq!(joint_states.reliability, ReliabilityKind::BestEffort);
    }
}
