//! Lists the topics and services of other participants, and detects nodes that share a name.

use crate::dds::incompatible_qos::is_latched;
use crate::dds::matches::Matches;
use dq_messages::{DurabilityKind, LivelinessKind, OfferedQos, ReliabilityKind};
use rustdds::policy::{Liveliness, Reliability};
use rustdds::{DomainParticipant, GUID, QosPolicies};
use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

/// A topic of other participants.
#[derive(Clone, Debug, PartialEq)]
pub struct GraphTopic {
    /// The message type: `package/msg/Name`.
    pub message: String,
    /// The QoS that each publisher offers; empty if the topic is only subscribed to.
    pub offered: Vec<OfferedQos>,
    /// Whether a subscriber requests latched messages: those from before it existed.
    pub is_requested_latched: bool,
}

impl GraphTopic {
    fn new(message: String) -> Self {
        Self { message, offered: Vec::new(), is_requested_latched: false }
    }
}

/// Returns the topics of all other participants by name. If a topic has several types, returns the type of one of its
/// publishers.
pub(super) fn topics(participant: &DomainParticipant) -> BTreeMap<String, GraphTopic> {
    let mut topics: BTreeMap<String, GraphTopic> = BTreeMap::new();
    for writer in participant.discovered_writers() {
        let data = &writer.publication_topic_data;
        let Some((name, message)) = ros_names(&data.topic_name, &data.type_name) else { continue };
        let topic = topics.entry(name).or_insert(GraphTopic::new(message));
        topic.offered.push(offered(&data.qos()));
    }
    for reader in participant.discovered_readers() {
        let data = &reader.subscription_topic_data;
        let Some((name, message)) = ros_names(data.topic_name(), data.type_name()) else { continue };
        let topic = topics.entry(name).or_insert(GraphTopic::new(message));
        topic.is_requested_latched |= is_latched(&data.qos());
    }
    topics
}

/// Returns the services of all other participants. A service counts only if it has both a request reader and a reply writer.
pub(super) fn services(participant: &DomainParticipant) -> BTreeSet<String> {
    let (readers, writers) = (participant.discovered_readers(), participant.discovered_writers());
    let requests = readers
        .iter()
        .filter_map(|reader| service_name(reader.subscription_topic_data.topic_name(), "rq", "Request"));
    let replies: BTreeSet<_> = writers
        .iter()
        .filter_map(|writer| service_name(&writer.publication_topic_data.topic_name, "rr", "Reply"))
        .collect();
    requests.filter(|name| replies.contains(name)).map(str::to_owned).collect()
}

/// Returns the DDS topic of requests to the service with this fully qualified name.
pub(super) fn request_topic(service: &str) -> String {
    format!("rq{service}Request")
}

/// Returns the DDS topic of replies of the service with this fully qualified name.
pub(super) fn reply_topic(service: &str) -> String {
    format!("rr{service}Reply")
}

/// Returns the service name of a DDS topic: `rq/x/pauseRequest` belongs to the service `/x/pause`.
fn service_name<'a>(topic: &'a str, prefix: &str, suffix: &str) -> Option<&'a str> {
    topic.strip_prefix(prefix)?.strip_suffix(suffix).filter(|name| name.starts_with('/'))
}

/// Returns the ROS 2 names of a DDS topic and a DDS type: `rt/x` is `/x`, `package::msg::dds_::Name_` is `package/msg/Name`.
fn ros_names(topic: &str, message: &str) -> Option<(String, String)> {
    let name = topic.strip_prefix("rt").filter(|name| name.starts_with('/'))?;
    let (package, message) = message.split_once("::msg::dds_::")?;
    Some((name.to_owned(), format!("{package}/msg/{}", message.strip_suffix('_')?)))
}

/// Converts the offered QoS. For policies that are not announced, the default of DDS applies.
fn offered(qos: &QosPolicies) -> OfferedQos {
    let reliability = match qos.reliability() {
        Some(Reliability::Reliable { .. }) => ReliabilityKind::Reliable,
        Some(Reliability::BestEffort) | None => ReliabilityKind::BestEffort,
    };
    let durability = if is_latched(qos) { DurabilityKind::TransientLocal } else { DurabilityKind::Volatile };
    let (liveliness, lease) = match qos.liveliness() {
        Some(Liveliness::ManualByTopic { lease_duration }) => {
            (LivelinessKind::ManualByTopic, Some(lease_duration))
        }
        Some(
            Liveliness::Automatic { lease_duration } | Liveliness::ManualByParticipant { lease_duration },
        ) => (LivelinessKind::Automatic, Some(lease_duration)),
        None => (LivelinessKind::Automatic, None),
    };
    OfferedQos {
        reliability,
        durability,
        deadline: qos.deadline().and_then(|deadline| finite(deadline.0)),
        lifespan: qos.lifespan().and_then(|lifespan| finite(lifespan.duration)),
        liveliness,
        liveliness_lease: lease.and_then(finite),
    }
}

fn finite(duration: rustdds::Duration) -> Option<Duration> {
    (duration != rustdds::Duration::INFINITE).then(|| duration.into())
}

/// Detects nodes that share a name. Every node with parameters serves `list_parameters` under its own name, so this counts the
/// reply writers of that service.
pub struct NameWatch {
    matches: Matches,
    reply_topic: String,
    /// The GUID of this process's participant.
    ours: GUID,
    name: String,
    /// The number of nodes in this process that have the name: 1 or 0.
    here: usize,
}

impl NameWatch {
    pub(super) fn new(matches: Matches, ours: GUID, name: &str, is_own: bool) -> Self {
        let reply_topic = reply_topic(&format!("{name}/list_parameters"));
        Self { matches, reply_topic, ours, name: name.to_owned(), here: usize::from(is_own) }
    }

    /// Returns a warning if several nodes in the domain have the name.
    pub fn warning(&self) -> Option<String> {
        let count = self.here + self.matches.remote_writers(&self.reply_topic, self.ours);
        (count > 1).then(|| {
            format!(
                "{count} nodes are called {}: each needs a name of its own (one that was killed counts for up to a minute)",
                self.name
            )
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_those_of_ros_2_and_services_are_not_topics() {
        let names = ros_names("rt/left/joint_states", "sensor_msgs::msg::dds_::JointState_");
        assert_eq!(names, Some(("/left/joint_states".to_owned(), "sensor_msgs/msg/JointState".to_owned())));
        assert_eq!(ros_names("rq/x/pauseRequest", "std_srvs::srv::dds_::SetBool_Request_"), None);
        assert_eq!(service_name("rq/x/pauseRequest", "rq", "Request"), Some("/x/pause"));
        assert_eq!(service_name("rt/x/pauseRequest", "rq", "Request"), None);
        assert_eq!(
            ros_names("ros_discovery_info", "rmw_dds_common::msg::dds_::ParticipantEntitiesInfo_"),
            None
        );
    }
}
