//! A bag's messages, topic by topic.

use super::RunError;
use crate::config::{NodeParameters, ParameterStore, Value};
use crate::record::{Bag, BagMessage};
use crate::ros::messages::Message;
use crate::ros::{Parameter, ParameterEvent};
use std::collections::BTreeMap;

/// The types that a run is made of; other messages stay in the bag.
const TYPES: [&str; 5] = [
    "sensor_msgs/msg/JointState",
    "std_msgs/msg/Float64MultiArray",
    "geometry_msgs/msg/PoseStamped",
    "diagnostic_msgs/msg/DiagnosticStatus",
    "rcl_interfaces/msg/ParameterEvent",
];

/// A bag's messages, topic by topic, in order of log time.
#[derive(Debug)]
pub struct Timeline {
    topics: BTreeMap<String, Vec<BagMessage>>,
    parameters: BTreeMap<String, ToldParameters>,
    truncated: bool,
}

/// What a node told of its parameters.
#[derive(Clone, Debug)]
pub(super) struct ToldParameters {
    initial: Vec<Parameter>,
    /// In the order in which they were made.
    pub changes: Vec<ParameterEvent>,
}

impl Timeline {
    /// Reads what a run is made of.
    ///
    /// # Errors
    /// [`RunError::Bag`] for a damaged one.
    pub fn read(bag: &Bag) -> Result<Self, RunError> {
        let mut topics: BTreeMap<String, Vec<BagMessage>> = BTreeMap::new();
        for message in bag.messages() {
            let message = message?;
            if TYPES.contains(&&*message.message) {
                topics.entry(message.topic.to_string()).or_default().push(message);
            }
        }
        let parameters = told_parameters(topics.get("/parameter_events").map_or(&[], Vec::as_slice));
        Ok(Self { topics, parameters, truncated: bag.truncated() })
    }

    /// Whether the bag ends before its end.
    pub fn truncated(&self) -> bool {
        self.truncated
    }

    /// The messages of a topic, with their log times \[ns\]; none where there is no such topic. What is damaged is left out.
    pub(super) fn of<M: Message>(&self, topic: &str) -> Vec<(i64, M)> {
        let messages = self.topics.get(topic).into_iter().flatten();
        messages.filter_map(|message| Some((message.log_time, message.decode().ok()?))).collect()
    }

    /// The topics of that type whose name ends with `name`, and what stands before.
    pub(super) fn ending<'a>(
        &'a self,
        name: &'a str,
        message: &'a str,
    ) -> impl Iterator<Item = (&'a str, &'a str)> {
        let of_type = move |messages: &[BagMessage]| messages.iter().any(|one| &*one.message == message);
        self.topics
            .iter()
            .filter(move |(_, messages)| of_type(messages))
            .filter_map(move |(topic, _)| Some((topic.as_str(), topic.strip_suffix(name)?)))
            .filter(|(_, before)| before.ends_with('/'))
    }

    /// What a node told of its parameters, if its start is in the bag.
    pub(super) fn parameters(&self, node: &str) -> Option<&ToldParameters> {
        self.parameters.get(node)
    }

    /// The nodes whose start is in the bag and that declared a parameter of that name.
    pub(super) fn nodes_with<'a>(&'a self, parameter: &'a str) -> impl Iterator<Item = &'a str> {
        let has = move |told: &ToldParameters| told.initial.iter().any(|one| one.name == parameter);
        self.parameters.iter().filter(move |(_, told)| has(told)).map(|(node, _)| node.as_str())
    }
}

/// Of each node, since it was last started. A late joiner gets the history at once: the stamps tell its order.
fn told_parameters(messages: &[BagMessage]) -> BTreeMap<String, ToldParameters> {
    let mut nodes: BTreeMap<String, ToldParameters> = BTreeMap::new();
    let mut events: Vec<_> = messages.iter().filter_map(|one| one.decode::<ParameterEvent>().ok()).collect();
    events.sort_by_key(|event| event.stamp.nanoseconds());
    for event in events {
        if !event.new_parameters.is_empty() {
            let told = ToldParameters { initial: event.new_parameters, changes: Vec::new() };
            nodes.insert(event.node, told);
        } else if let Some(told) = nodes.get_mut(&event.node) {
            told.changes.push(event);
        }
    }
    nodes
}

impl ToldParameters {
    /// The store with which the node started.
    pub fn initial<P: NodeParameters>(&self) -> Result<ParameterStore, RunError> {
        let mut store = P::store();
        for (name, value) in values(self.initial.clone()) {
            store.override_initial(&name, value)?;
        }
        Ok(store)
    }
}

/// What a change has set.
pub(super) fn changed(event: ParameterEvent) -> Vec<(String, Value)> {
    values(event.changed_parameters)
}

fn values(parameters: Vec<Parameter>) -> Vec<(String, Value)> {
    let value = |parameter: Parameter| Some((parameter.name, parameter.value.into_value()?));
    parameters.into_iter().filter_map(value).collect()
}
