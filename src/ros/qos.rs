//! The contract's quality of service as DDS takes it.

use crate::dds::sample_limits;
use crate::wire::messages::Message;
use crate::wire::{Direction, DurabilityKind, ParameterEvent, ReliabilityKind, TopicContract};
use rustdds::policy::{Durability, History, Reliability};
use rustdds::{Duration, QosPolicies, QosPolicyBuilder};

/// What rclcpp's `ParameterEventsQoS` is: reliable, volatile, the last 1000.
pub(super) fn of_parameter_events() -> QosPolicies {
    of(&TopicContract {
        direction: Direction::Out,
        message: ParameterEvent::TYPE.to_owned(),
        reliability: ReliabilityKind::Reliable,
        durability: DurabilityKind::Volatile,
        depth: 1000,
        rate: "on change".to_owned(),
    })
}

/// The DDS policies of a topic; writers get room for unacknowledged samples and never block.
pub(super) fn of(topic: &TopicContract) -> QosPolicies {
    let reliability = match topic.reliability {
        ReliabilityKind::Reliable => Reliability::Reliable { max_blocking_time: Duration::ZERO },
        ReliabilityKind::BestEffort => Reliability::BestEffort,
    };
    let durability = match topic.durability {
        DurabilityKind::Volatile => Durability::Volatile,
        DurabilityKind::TransientLocal => Durability::TransientLocal,
    };
    let builder = QosPolicyBuilder::new()
        .reliability(reliability)
        .durability(durability)
        .history(History::KeepLast { depth: topic.depth });
    if topic.direction == Direction::In {
        return builder.build();
    }
    builder
        .resource_limits(sample_limits::of_writer(topic.durability == DurabilityKind::TransientLocal))
        .build()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wire::Contract;

    #[test]
    fn writers_never_block_and_descriptions_are_latched() {
        let plant = Contract::builtin().unwrap().plant;
        for (name, topic) in plant.topics() {
            let qos = of(topic);
            let blocking = (topic.reliability == ReliabilityKind::Reliable).then_some(Duration::ZERO);
            assert_eq!(qos.reliable_max_blocking_time(), blocking, "{name}");
            let latched = ["/tf_static", "robot_description", "~/parameters"].contains(&name);
            assert_eq!(qos.durability() == Some(Durability::TransientLocal), latched, "{name}");
            let kept = qos.resource_limits().map(|limits| limits.max_samples);
            let few = if latched { 500 } else { 200_000 };
            assert_eq!(kept, (topic.direction == Direction::Out).then_some(few), "{name}");
        }
        let best_effort = plant.with_best_effort("joint_states");
        let joint_states = best_effort.topics().find(|(name, _)| *name == "joint_states").unwrap().1;
        assert_eq!(joint_states.reliability, ReliabilityKind::BestEffort);
    }
}
