//! The parameters that the nodes of a bag announced on `~/parameters`.

use super::{MOST_JOINTS, RunError};
use dq_bags::{Bag, BagMessage, Topic};
use dq_common::text::{NAME, shown};
use dq_messages::messages::Message;
use dq_messages::{Parameter, ParameterEvent};
use dq_params::{ParameterStore, Value};
use dq_wire::ServoKind;
use std::collections::BTreeMap;

/// The announced parameters, and the topics of the bag.
#[derive(Debug)]
pub(super) struct Announced {
    /// The parameters of each node. There is one entry per start of the node, in order.
    parameters: BTreeMap<String, Vec<AnnouncedParameters>>,
    topics: Vec<Topic>,
}

/// The parameters that a node announced from one start to the next.
#[derive(Clone, Debug)]
pub(super) struct AnnouncedParameters {
    /// When the node started, by the stamp of its first announcement \[ns\].
    pub since: i64,
    initial: Vec<Parameter>,
    /// The changes in order.
    pub changes: Vec<ParameterEvent>,
}

impl Announced {
    /// Reads the whole bag for its topics and the announced parameters.
    pub fn read(bag: Bag) -> Self {
        let mut bag = bag.only(&[ParameterEvent::TYPE]);
        let parameters = announced_parameters(bag.by_ref());
        Self { parameters, topics: bag.topics() }
    }

    /// Returns the topics of the bag.
    pub fn topics(&self) -> &[Topic] {
        &self.topics
    }

    /// Describes the content of the bag. Errors about something that the bag lacks end with this text.
    pub fn what_else(&self) -> String {
        const SHOWN: usize = 10;
        let names: Vec<_> = self.topics.iter().take(SHOWN).map(|topic| shown(&topic.name, NAME)).collect();
        match self.topics.len() {
            0 => "it has no topics at all".to_owned(),
            count if count > SHOWN => format!("it has {} and {} more", names.join(", "), count - SHOWN),
            _ => format!("it has {}", names.join(", ")),
        }
    }

    /// Returns the parameters of a node, with one entry per start of the node, in order. The list is empty if the bag has no such
    /// node.
    pub fn lives(&self, node: &str) -> &[AnnouncedParameters] {
        self.parameters.get(node).map_or(&[], Vec::as_slice)
    }

    /// Yields the names of the nodes that announced this parameter when they last started.
    pub fn nodes_with<'a>(&'a self, parameter: &'a str) -> impl Iterator<Item = &'a str> {
        let has = move |last: &AnnouncedParameters| last.initial.iter().any(|one| one.name == parameter);
        let nodes = self.parameters.iter().filter(move |(_, lives)| lives.last().is_some_and(has));
        nodes.map(|(node, _)| node.as_str())
    }
}

/// Returns the parameters of each node from its latched `~/parameters`, with one entry per start, in order. A late subscriber may
/// receive several messages at once, so the stamps of the messages give their order.
fn announced_parameters(
    messages: impl Iterator<Item = BagMessage>,
) -> BTreeMap<String, Vec<AnnouncedParameters>> {
    let latched = messages.filter(|message| message.topic.ends_with("/parameters"));
    known_by_states(sorted(latched.filter_map(|message| message.decode().ok()).collect()))
}

fn sorted(mut events: Vec<ParameterEvent>) -> Vec<ParameterEvent> {
    events.sort_by_key(|event| event.stamp.nanoseconds());
    events
}

/// Groups the messages by node and by start of the node. Each message has all parameters, and names the parameters that have
/// changed since the previous message. A message without changed parameters shows that the node has started.
fn known_by_states(states: Vec<ParameterEvent>) -> BTreeMap<String, Vec<AnnouncedParameters>> {
    let mut nodes = BTreeMap::<String, Vec<(AnnouncedParameters, Vec<Parameter>)>>::new();
    for event in states {
        let state = event.new_parameters.clone();
        let lives = nodes.entry(event.node.clone()).or_default();
        match lives.last_mut() {
            Some((known, before)) if !event.changed_parameters.is_empty() => {
                let changed = state.iter().filter(|now| !before.contains(now)).cloned().collect();
                known.changes.push(ParameterEvent {
                    changed_parameters: changed,
                    new_parameters: Vec::new(),
                    ..event
                });
                *before = state;
            }
            // The message is a repetition for a late subscriber.
            Some((known, _)) if known.since == event.stamp.nanoseconds() => {}
            _ => lives.push((AnnouncedParameters::new(event), state)),
        }
    }
    let lives = |lives: Vec<(AnnouncedParameters, _)>| lives.into_iter().map(|(known, _)| known).collect();
    nodes.into_iter().map(|(node, states)| (node, lives(states))).collect()
}

impl AnnouncedParameters {
    fn new(start: ParameterEvent) -> Self {
        Self { since: start.stamp.nanoseconds(), initial: start.new_parameters, changes: Vec::new() }
    }

    /// Returns a store with the parameters with which the node started. Leaves out parameters that this version does not have.
    pub fn initial(&self, kind: ServoKind) -> Result<ParameterStore, RunError> {
        let mut store = kind.store()?;
        for (name, value) in known(self.initial.clone(), &store)? {
            store.override_initial(&name, value)?;
        }
        Ok(store)
    }

    /// Yields the announced parameters that `store` does not have. Such parameters show that the node was of another version than
    /// this program.
    pub fn unknown<'a>(&'a self, store: &'a ParameterStore) -> impl Iterator<Item = &'a str> {
        let names = self.initial.iter().map(|parameter| parameter.name.as_str());
        names.filter(|name| store.declaration(name).is_none())
    }
}

/// Returns the changed values of `event`, except for parameters that the store does not have.
pub(super) fn changed(
    event: ParameterEvent,
    store: &ParameterStore,
) -> Result<Vec<(String, Value)>, RunError> {
    known(event.changed_parameters, store)
}

/// Returns the values of the parameters that the store has.
fn known(mut parameters: Vec<Parameter>, store: &ParameterStore) -> Result<Vec<(String, Value)>, RunError> {
    parameters.retain(|parameter| store.declaration(&parameter.name).is_some());
    values(parameters)
}

fn values(parameters: Vec<Parameter>) -> Result<Vec<(String, Value)>, RunError> {
    let value = |parameter: Parameter| Some((parameter.name, parameter.value.into_value()?));
    bounded(parameters.into_iter().filter_map(value).collect())
}

/// Returns `values`. Fails if a list among them has more than [`MOST_JOINTS`] elements.
pub(super) fn bounded(values: Vec<(String, Value)>) -> Result<Vec<(String, Value)>, RunError> {
    let bounded = |(name, value): (String, Value)| {
        let length = match &value {
            Value::DoubleArray(list) => list.len(),
            Value::StringArray(list) => list.len(),
            _ => 0,
        };
        if length > MOST_JOINTS { Err(RunError::TooMany { name, length }) } else { Ok((name, value)) }
    };
    values.into_iter().map(bounded).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use dq_messages::messages::Time;

    fn announced(sec: i32, changed: bool) -> ParameterEvent {
        let parameter = Parameter { name: format!("p{sec}"), ..Parameter::default() };
        let changed_parameters = if changed { vec![parameter.clone()] } else { Vec::new() };
        let stamp = Time { sec, nanosec: 1 };
        ParameterEvent {
            stamp,
            node: "/n".to_owned(),
            new_parameters: vec![parameter],
            changed_parameters,
            ..Default::default()
        }
    }

    #[test]
    fn states_are_distinguished_by_their_differences_and_a_start_resets_them() {
        let lives = |states| known_by_states(sorted(states)).remove("/n").unwrap();
        let known = lives(vec![announced(3, true), announced(5, true), announced(1, true)]);
        let [known] = known.as_slice() else { panic!("{known:?}") };
        let changes: Vec<_> =
            known.changes.iter().map(|change| change.changed_parameters[0].name.clone()).collect();
        assert_eq!((known.initial[0].name.as_str(), changes), ("p1", vec!["p3".to_owned(), "p5".to_owned()]));
        let restarted =
            lives(vec![announced(1, false), announced(3, true), announced(5, false), announced(5, false)]);
        let each: Vec<_> =
            restarted.iter().map(|life| (life.since / 1_000_000_000, life.changes.len())).collect();
        assert_eq!(each, [(1, 1), (5, 0)], "what a start announced may be there twice");
    }
}
