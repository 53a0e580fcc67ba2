//! A bag's messages, topic by topic.

use super::RunError;
use crate::config::NodeParameters;
use crate::params::{ParameterStore, Value};
use crate::record::{Bag, BagMessage, Losses, Topic};
use crate::wire::{Parameter, ParameterEvent};
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
    parameters: BTreeMap<String, AnnouncedParameters>,
    all_topics: Vec<Topic>,
    losses: Losses,
}

/// What a node announced of its parameters.
#[derive(Clone, Debug)]
pub(super) struct AnnouncedParameters {
    initial: Vec<Parameter>,
    /// In the order in which they were made.
    pub changes: Vec<ParameterEvent>,
}

impl Timeline {
    /// Reads what a run is made of, the whole bag once.
    pub fn read(bag: Bag) -> Self {
        let mut topics: BTreeMap<String, Vec<BagMessage>> = BTreeMap::new();
        let mut bag = bag.only(&TYPES);
        for message in bag.by_ref() {
            match topics.get_mut(&*message.topic) {
                Some(messages) => messages.push(message),
                None => drop(topics.insert(message.topic.to_string(), vec![message])),
            }
        }
        let parameters = announced_parameters(topics.get("/parameter_events").map_or(&[], Vec::as_slice));
        Self { topics, parameters, all_topics: bag.topics(), losses: bag.losses().clone() }
    }

    /// What of the bag could not be read.
    pub fn losses(&self) -> &Losses {
        &self.losses
    }

    /// What the bag has instead of something that it has not.
    pub(super) fn what_else(&self) -> String {
        const SHOWN: usize = 10;
        let names: Vec<_> = self.all_topics.iter().take(SHOWN).map(|topic| topic.name.as_str()).collect();
        match self.all_topics.len() {
            0 => "it has no topics at all".to_owned(),
            count if count > SHOWN => format!("it has {} and {} more", names.join(", "), count - SHOWN),
            _ => format!("it has {}", names.join(", ")),
        }
    }

    /// The messages of a topic; none where there is no such topic.
    pub(super) fn of(&self, topic: &str) -> &[BagMessage] {
        self.topics.get(topic).map_or(&[], Vec::as_slice)
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

    /// What a node announced of its parameters, if its start is in the bag.
    pub(super) fn parameters(&self, node: &str) -> Option<&AnnouncedParameters> {
        self.parameters.get(node)
    }

    /// The nodes whose start is in the bag and that declared a parameter of that name.
    pub(super) fn nodes_with<'a>(&'a self, parameter: &'a str) -> impl Iterator<Item = &'a str> {
        let has =
            move |announced: &AnnouncedParameters| announced.initial.iter().any(|one| one.name == parameter);
        self.parameters.iter().filter(move |(_, announced)| has(announced)).map(|(node, _)| node.as_str())
    }
}

/// Of each node, since it was last started. A late joiner gets the history at once: the stamps give its order.
fn announced_parameters(messages: &[BagMessage]) -> BTreeMap<String, AnnouncedParameters> {
    let mut nodes: BTreeMap<String, AnnouncedParameters> = BTreeMap::new();
    let mut events: Vec<_> = messages.iter().filter_map(|one| one.decode::<ParameterEvent>().ok()).collect();
    events.sort_by_key(|event| event.stamp.nanoseconds());
    for event in events {
        if !event.new_parameters.is_empty() {
            let announced = AnnouncedParameters { initial: event.new_parameters, changes: Vec::new() };
            nodes.insert(event.node, announced);
        } else if let Some(announced) = nodes.get_mut(&event.node) {
            announced.changes.push(event);
        }
    }
    nodes
}

impl AnnouncedParameters {
    /// The store with which the node started.
    pub fn initial<P: NodeParameters>(&self) -> Result<ParameterStore, RunError> {
        let mut store = P::store();
        for (name, value) in values(self.initial.clone())? {
            store.override_initial(&name, value)?;
        }
        Ok(store)
    }
}

/// What a change has set.
pub(super) fn changed(event: ParameterEvent) -> Result<Vec<(String, Value)>, RunError> {
    values(event.changed_parameters)
}

/// Arms of more joints are not explained: what a bag says of itself is not trusted with time and memory.
pub(super) const MOST_JOINTS: usize = 64;

fn values(parameters: Vec<Parameter>) -> Result<Vec<(String, Value)>, RunError> {
    let value = |parameter: Parameter| Some((parameter.name, parameter.value.into_value()?));
    let bounded = |(name, value): (String, Value)| {
        let length = match &value {
            Value::DoubleArray(list) => list.len(),
            Value::StringArray(list) => list.len(),
            _ => 0,
        };
        if length > MOST_JOINTS { Err(RunError::TooMany { name, length }) } else { Ok((name, value)) }
    };
    parameters.into_iter().filter_map(value).map(bounded).collect()
}
