//! Creates a node's publishers, subscriptions, servers and clients. ros2-client announces most of them as endpoints of the node.

use super::endpoint_names::EndpointNames;
use super::error::RosError;
use super::graph::{reply_topic, request_topic};
use super::log::Logger;
use super::services::Payload;
use crate::dds::large_replies::ReplyWriter;
use crate::dds::matches::Matches;
use crate::dds::own_datagrams::OwnDatagrams;
use crate::dds::raw_subscription::RawSubscription;
use crate::dds::sample_limits;
use crate::dds::send_backlog::InTimeWriter;
use dq_messages::messages::ServiceType;
use dq_messages::{Direction, DurabilityKind, ReliabilityKind, TopicContract};
use ros2_client::{Client, MessageTypeName, Name, QosProfile, ServiceMapping, ServiceTypeName};
use rustdds::policy::{Durability, History, Lifespan, Reliability, ResourceLimits};
use rustdds::{
    CDRSerializerAdapter, DomainParticipant, Duration, GUID, QosPolicies, QosPolicyBuilder, TopicKind,
};
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::fmt::Display;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// An endpoint to create: its topic, message type and QoS.
#[derive(Clone)]
pub(super) struct Plan {
    /// The fully qualified name of the topic.
    pub name: String,
    /// The message type: `package/msg/Name`.
    pub message: String,
    pub qos: QosPolicies,
    /// The log for warnings about incompatible QoS of the endpoint.
    pub log: Logger,
}

/// The data that the nodes of a participant share.
#[derive(Clone)]
pub(super) struct Domain {
    pub dds: Arc<DomainParticipant>,
    pub matches: Matches,
    pub names: EndpointNames,
    /// Sends packets for the workarounds for RustDDS; `None` in a secured graph, or if the socket could not be opened.
    pub datagrams: Option<Arc<OwnDatagrams>>,
}

/// Creates the endpoints of a node. The node leaves the graph when this value is dropped. Until then ros2-client also announces
/// endpoints that have been dropped.
pub(super) struct Endpoints {
    node: Mutex<ros2_client::Node>,
    pub domain: Domain,
}

impl Endpoints {
    pub fn new(node: ros2_client::Node, domain: Domain) -> Self {
        Self { node: Mutex::new(node), domain }
    }

    /// Creates a publisher.
    pub fn publisher<M: Serialize>(&self, plan: &Plan) -> Result<ros2_client::Publisher<M>, RosError> {
        let publisher =
            self.lock().create_publisher(&self.topic(plan)?, None).map_err(refused(&plan.name))?;
        self.register(publisher.guid(), plan);
        Ok(publisher)
    }

    /// Creates a publisher for messages that soon become obsolete. ros2-client does not announce this publisher as an endpoint of the
    /// node.
    pub fn publisher_in_time<M: Serialize>(&self, plan: &Plan) -> Result<InTimeWriter<M>, RosError> {
        let publisher =
            InTimeWriter::new(&self.domain.dds, &self.topic(plan)?).map_err(refused(&plan.name))?;
        self.register(publisher.guid(), plan);
        Ok(publisher)
    }

    /// Creates a subscription.
    pub fn subscription<M: DeserializeOwned + 'static>(
        &self,
        plan: &Plan,
    ) -> Result<ros2_client::Subscription<M>, RosError> {
        let topic = self.topic(plan)?;
        let subscription = self.lock().create_subscription(&topic, None).map_err(refused(&plan.name))?;
        self.register(subscription.guid(), plan);
        Ok(subscription)
    }

    /// Creates a subscription to messages of any type. ros2-client does not announce this subscription as an endpoint of the node.
    pub fn raw_subscription(
        &self,
        plan: &Plan,
        keep: impl Fn(i32) + Send + Sync + 'static,
    ) -> Result<RawSubscription, RosError> {
        let topic = self.topic(plan)?;
        let subscription =
            RawSubscription::new(&self.domain.dds, &topic, keep).map_err(refused(&plan.name))?;
        self.register(subscription.guid(), plan);
        Ok(subscription)
    }

    /// Creates the reader of requests and the writer of replies of the service with this fully qualified name. ros2-client does not
    /// announce the writer as an endpoint of the node.
    pub fn server<S: ServiceType>(
        &self,
        name: &str,
    ) -> Result<(ros2_client::Subscription<Payload>, ReplyWriter<Payload>), RosError> {
        let (Domain { dds, matches, datagrams, .. }, qos) = (&self.domain, QosPolicies::from(of_services()));
        let (package, service) = split(S::TYPE, "/srv/");
        let topic = |name, part, qos: &QosPolicies| {
            let kind = format!("{package}::srv::dds_::{service}_{part}_");
            dds.create_topic(name, kind, qos, TopicKind::NoKey)
        };
        let of_requests = limited(&qos, sample_limits::of_reader(REQUESTS));
        let requests = topic(request_topic(name), "Request", &of_requests).map_err(refused(name))?;
        let requests = self.lock().create_subscription(&requests, None).map_err(refused(name))?;
        let writer = || {
            let topic = topic(reply_topic(name), "Response", &qos)?;
            dds.create_publisher(&qos)?.create_datawriter_no_key::<_, CDRSerializerAdapter<_>>(&topic, None)
        };
        let writer = writer().map_err(refused(name))?;
        let replies = ReplyWriter::new(writer, reply_topic(name), dds, matches.clone(), datagrams.clone());
        Ok((requests, replies))
    }

    /// Creates a client of the service with this fully qualified name.
    pub fn client<S: ServiceType>(
        &self,
        name: &str,
        mapping: ServiceMapping,
    ) -> Result<Client<Payload, Payload>, RosError> {
        let (service, kind) = service::<S>(name)?;
        let made = self.lock().create_client(mapping, &service, &kind, of_services(), of_services());
        made.map_err(refused(name))
    }

    /// Adds a description of the topic, with the QoS of `plan`, to DDS. If a topic has several descriptions, the largest of their
    /// resource limits apply.
    pub fn topic(&self, plan: &Plan) -> Result<rustdds::Topic, RosError> {
        let (package, message) = split(&plan.message, "/msg/");
        let (name, kind) =
            (format!("rt{}", plan.name), MessageTypeName::new(package, message).dds_msg_type());
        self.domain.dds.create_topic(name, kind, &plan.qos, TopicKind::NoKey).map_err(refused(&plan.name))
    }

    fn register(&self, endpoint: GUID, plan: &Plan) {
        self.domain.matches.register(endpoint, &plan.name, plan.log.warner());
    }

    fn lock(&self) -> MutexGuard<'_, ros2_client::Node> {
        // No code panics while it holds the lock.
        self.node.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

fn refused<E: Display>(what: &str) -> impl FnOnce(E) -> RosError {
    let error = RosError::create(what);
    move |why| error(&why)
}

fn split<'a>(kind: &'a str, between: &str) -> (&'a str, &'a str) {
    kind.split_once(between).unwrap_or(("", kind))
}

fn service<S: ServiceType>(name: &str) -> Result<(Name, ServiceTypeName), RosError> {
    let (package, service) = split(S::TYPE, "/srv/");
    Ok((Name::parse(name).map_err(refused(name))?, ServiceTypeName::new(package, service)))
}

/// Returns the QoS of ROS 2 services: reliable, volatile, keep last 10. If the history is full, a write may block for a moment.
fn of_services() -> QosProfile {
    QosProfile::publisher_default().history(ros2_client::qos::History::KeepLast { depth: 10 })
}

/// The number of requests that a service stores. With 10, a busy service lost requests of a client that sent them at 100 Hz.
const REQUESTS: i32 = 32;

/// Returns the QoS of `/parameter_events`: `ParameterEventsQoS` of rclcpp.
pub(super) fn of_parameter_events() -> QosPolicies {
    const DEPTH: i32 = 1000;
    QosPolicyBuilder::new()
        .reliability(Reliability::Reliable { max_blocking_time: Duration::ZERO })
        .durability(Durability::Volatile)
        .history(History::KeepLast { depth: DEPTH })
        // A limit is necessary, because the recorder's participant also reads this topic, and stores as many samples as its writer.
        .resource_limits(sample_limits::of_reader(DEPTH))
        .build()
}

/// Returns the QoS of `/rosout`, as in rcl. The topic is latched: a node stores its latest 1000 lines, each for ten seconds.
pub(super) fn of_rosout() -> QosPolicies {
    QosPolicyBuilder::new()
        .reliability(Reliability::Reliable { max_blocking_time: Duration::ZERO })
        .durability(Durability::TransientLocal)
        .history(History::KeepLast { depth: 1000 })
        .lifespan(Lifespan { duration: Duration::from_secs(10) })
        .build()
}

/// Returns the DDS policies of a topic. Writers store unacknowledged samples up to [`sample_limits`], and never block.
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
    let limits = match topic.direction {
        Direction::In => sample_limits::of_reader(topic.depth),
        Direction::Out => sample_limits::of_writer(topic.durability == DurabilityKind::TransientLocal),
    };
    builder.resource_limits(limits).build()
}

/// Returns the DDS policies of a publisher on a topic to which its own node subscribes.
pub(super) fn of_publisher_to_input(topic: &TopicContract) -> QosPolicies {
    limited(&of(topic), sample_limits::of_writer_to_input())
}

fn limited(qos: &QosPolicies, limits: ResourceLimits) -> QosPolicies {
    qos.modify_by(&QosPolicyBuilder::new().resource_limits(limits).build())
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use dq_messages::NodeContract;
    use std::collections::BTreeMap;

    /// Returns the contract of the plant, as an example of a node that publishes and subscribes.
    pub fn plant() -> NodeContract {
        let file = include_str!("../../../msg_config/topics.yaml");
        serde_saphyr::from_str::<BTreeMap<String, NodeContract>>(file).unwrap().remove("plant").unwrap()
    }

    #[test]
    fn writers_never_block_and_descriptions_are_latched() {
        let plant = plant();
        for (name, topic) in plant.topics() {
            let qos = of(topic);
            let blocking = (topic.reliability == ReliabilityKind::Reliable).then_some(Duration::ZERO);
            assert_eq!(qos.reliable_max_blocking_time(), blocking, "{name}");
            let latched = ["/tf_static", "robot_description", "~/parameters"].contains(&name);
            assert_eq!(qos.durability() == Some(Durability::TransientLocal), latched, "{name}");
            let kept = qos.resource_limits().map(|limits| limits.max_samples);
            let few = if latched { 500 } else { 200_000 };
            let expected = if topic.direction == Direction::Out { few } else { topic.depth };
            assert_eq!(kept, Some(expected), "{name}");
        }
        let best_effort = plant.with_best_effort("joint_states");
        let joint_states = best_effort.topics().find(|(name, _)| *name == "joint_states").unwrap().1;
        assert_eq!(joint_states.reliability, ReliabilityKind::BestEffort);
    }
}
