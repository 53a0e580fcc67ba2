//! A bag's messages, topic by topic.

use super::ReportError;
use crate::record::{Bag, BagMessage};
use crate::ros::ParameterEvent;
use crate::ros::messages::Message;
use std::collections::BTreeMap;

/// The types that a run is made of; other messages stay in the bag.
const TYPES: [&str; 6] = [
    "sensor_msgs/msg/JointState",
    "std_msgs/msg/Float64MultiArray",
    "geometry_msgs/msg/PoseStamped",
    "diagnostic_msgs/msg/DiagnosticStatus",
    "diagnostic_msgs/msg/DiagnosticArray",
    "rcl_interfaces/msg/ParameterEvent",
];

/// A bag's messages, topic by topic, in order of log time.
pub struct Timeline {
    topics: BTreeMap<String, Vec<BagMessage>>,
    parameters: BTreeMap<String, Vec<ParameterEvent>>,
    truncated: bool,
}

impl Timeline {
    /// Reads what a run is made of.
    ///
    /// # Errors
    /// [`ReportError::Bag`] for a damaged one.
    pub fn read(bag: &Bag) -> Result<Self, ReportError> {
        let mut topics: BTreeMap<String, Vec<BagMessage>> = BTreeMap::new();
        for message in bag.messages() {
            let message = message?;
            if TYPES.contains(&&*message.message) {
                topics.entry(message.topic.to_string()).or_default().push(message);
            }
        }
        let mut timeline = Self { topics, parameters: BTreeMap::new(), truncated: bag.truncated() };
        timeline.parameters = timeline.read_parameters();
        Ok(timeline)
    }

    /// Whether the bag ends before its end.
    pub fn truncated(&self) -> bool {
        self.truncated
    }

    /// The messages of a topic; none where there is no such topic.
    pub fn of(&self, topic: &str) -> &[BagMessage] {
        self.topics.get(topic).map_or(&[], Vec::as_slice)
    }

    /// The topics of that type whose name ends with `name`, and what stands before.
    pub fn ending<'a>(&'a self, name: &'a str, message: &'a str) -> impl Iterator<Item = (&'a str, &'a str)> {
        self.topics
            .iter()
            .filter(move |(_, messages)| messages.iter().any(|one| &*one.message == message))
            .filter_map(move |(topic, _)| Some((topic.as_str(), topic.strip_suffix(name)?)))
            .filter(|(_, before)| before.ends_with('/'))
    }

    /// What each node told of its parameters: what it started with, then its changes. Nodes whose start is not in the bag are
    /// left out.
    pub fn parameters(&self) -> &BTreeMap<String, Vec<ParameterEvent>> {
        &self.parameters
    }

    fn read_parameters(&self) -> BTreeMap<String, Vec<ParameterEvent>> {
        let mut nodes: BTreeMap<String, Vec<ParameterEvent>> = BTreeMap::new();
        let mut events: Vec<_> = decode::<ParameterEvent>(self.of("/parameter_events"));
        // Late joiners get the history at once; the stamps tell its order.
        events.sort_by_key(|(_, event)| event.stamp.nanoseconds());
        for (_, event) in events {
            match nodes.get_mut(&event.node) {
                // Again from the start: the node was restarted.
                Some(list) if !event.new_parameters.is_empty() => *list = vec![event],
                Some(list) => list.push(event),
                None if !event.new_parameters.is_empty() => {
                    nodes.insert(event.node.clone(), vec![event]);
                }
                None => {}
            }
        }
        nodes
    }
}

/// The messages that hold what `M` says, with their log times \[ns\].
pub fn decode<M: Message>(messages: &[BagMessage]) -> Vec<(i64, M)> {
    messages.iter().filter_map(|message| Some((message.log_time, message.decode().ok()?))).collect()
}
