//! The contract's quality of service as DDS takes it.

use crate::wire::messages::Message;
use crate::wire::{Direction, DurabilityKind, ParameterEvent, ReliabilityKind, TopicContract};
use rustdds::policy::{Durability, History, Reliability, ResourceLimits};
use rustdds::{Duration, QosPolicies, QosPolicyBuilder};

/// Samples that a writer keeps for readers that have not acknowledged them. RustDDS stops a reliable writer for all
/// readers once this many are waiting for one (8192 unless set otherwise): a frozen `ros2 topic echo` would stop the
/// commands after 16 s. This holds 200 s at 1 kHz.
const UNACKNOWLEDGED_SAMPLES: i32 = 200_000;

/// Samples that RustDDS keeps of a transient-local topic, whatever its history's depth and even where nobody reads. A reader that
/// acknowledges none of so many blocks the next one, which late joiners then miss.
const LATCHED_SAMPLES: i32 = 500;

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
    let max_samples = match topic.durability {
        DurabilityKind::Volatile => UNACKNOWLEDGED_SAMPLES,
        DurabilityKind::TransientLocal => LATCHED_SAMPLES,
    };
    let limits = ResourceLimits { max_samples, max_instances: 1, max_samples_per_instance: max_samples };
    builder.resource_limits(limits).build()
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
