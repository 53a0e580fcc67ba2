//! The wire contract `msg_config/topics.yaml`. The nodes create their topics from it.

use dq_messages::{NodeContract, WireError};
use serde::Deserialize;

/// The complete contract.
#[derive(Clone, Debug, Deserialize, PartialEq)]
#[serde(deny_unknown_fields)]
pub struct Contract {
    /// The servo's topics.
    pub servo: NodeContract,
    /// The two-arm servo's topics.
    pub dual: NodeContract,
    /// The plant's topics.
    pub plant: NodeContract,
    /// The guard's topics.
    pub guard: NodeContract,
    /// The additional topics of each servo for viewers. Recordings leave them out, because they can be computed from the other
    /// topics.
    pub pictures: NodeContract,
}

impl Contract {
    /// Returns the built-in contract.
    ///
    /// # Errors
    /// [`WireError::ContractFile`].
    pub fn builtin() -> Result<Self, WireError> {
        serde_saphyr::from_str(include_str!("msg_config/topics.yaml"))
            .map_err(|why| WireError::ContractFile(why.to_string()))
    }

    /// Yields the contract of each node. The topics for viewers (`pictures`) are not included.
    pub fn nodes(&self) -> impl Iterator<Item = &NodeContract> {
        [&self.servo, &self.dual, &self.plant, &self.guard].into_iter()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use dq_messages::messages::{JointState, PoseStamped};
    use dq_messages::{Direction, definition, type_hash};

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
    fn every_topic_of_the_contract_can_be_recorded() {
        let contract = Contract::builtin().unwrap();
        let all = contract.nodes().chain([&contract.pictures]);
        let topics: Vec<_> = all.flat_map(|node| node.topics()).collect();
        assert!(topics.len() >= 10);
        for (name, topic) in topics {
            assert!(definition(&topic.message).is_some(), "{name}: {}", topic.message);
            assert!(type_hash(&topic.message).starts_with("RIHS01_"), "{name}: {}", topic.message);
        }
    }
}
