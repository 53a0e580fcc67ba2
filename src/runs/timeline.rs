//! A bag's messages, topic by topic.

use super::RunError;
use crate::params::{ParameterStore, Value};
use crate::record::{Bag, BagMessage, Topic, UnreadableParts};
use crate::text::{NAME, shown};
use crate::wire::{CycleLabel, Parameter, ParameterEvent, ServoKind};
use std::collections::BTreeMap;

/// The types that a replay is made of; other messages stay in the bag.
const TYPES: [&str; 7] = [
    "sensor_msgs/msg/JointState",
    "std_msgs/msg/Float64MultiArray",
    "trajectory_msgs/msg/JointTrajectory",
    "geometry_msgs/msg/TwistStamped",
    "geometry_msgs/msg/PoseStamped",
    "diagnostic_msgs/msg/DiagnosticStatus",
    "rcl_interfaces/msg/ParameterEvent",
];

/// Topics that show what is computed from the others.
const PICTURES: [&str; 2] = ["/current_pose", "/pose_error"];

/// Parameters of earlier versions, and their names now.
const RENAMED: [(&str, &str); 1] = [("joint_states_reliability", "states_reliability")];

/// A bag's messages, topic by topic, in order of log time.
#[derive(Debug)]
pub struct Timeline {
    topics: BTreeMap<String, Vec<BagMessage>>,
    /// Of each node from each time on at which it was started, in order.
    parameters: BTreeMap<String, Vec<AnnouncedParameters>>,
    all_topics: Vec<Topic>,
    losses: UnreadableParts,
}

/// What a node announced of its parameters from one start of it to the next.
#[derive(Clone, Debug)]
pub(super) struct AnnouncedParameters {
    /// When it started \[ns\].
    pub since: i64,
    initial: Vec<Parameter>,
    /// In the order in which they were made.
    pub changes: Vec<ParameterEvent>,
    pub numbers: Numbers,
}

/// Which of a node's sets of parameters a label names: how many changes came before it.
#[derive(Clone, Debug, Default)]
pub(super) struct Numbers {
    /// With which each was announced, in order \[ns\].
    stamps: Vec<u64>,
}

impl Numbers {
    /// The label with the number in place of the stamp; a stamp that is not in the bag gets a number beyond all that are.
    pub fn in_label(&self, label: CycleLabel) -> CycleLabel {
        let number = self.stamps.binary_search(&label.settings);
        let settings = number.map_or(u64::MAX, |number| number as u64);
        CycleLabel { settings, ..label }
    }
}

impl Timeline {
    /// Reads what a replay is made of, the whole bag once.
    pub fn read(bag: Bag) -> Self {
        Self::all_of(bag.only(&TYPES))
    }

    /// Reads what nodes announced of their parameters, and nothing else.
    pub(super) fn of_parameters(bag: Bag) -> Self {
        Self::all_of(bag.only(&["rcl_interfaces/msg/ParameterEvent"]))
    }

    fn all_of(mut bag: Bag) -> Self {
        let mut topics: BTreeMap<String, Vec<BagMessage>> = BTreeMap::new();
        for message in bag.by_ref().filter(|message| !PICTURES.iter().any(|end| message.topic.ends_with(end)))
        {
            match topics.get_mut(&*message.topic) {
                Some(messages) => messages.push(message),
                None => drop(topics.insert(message.topic.to_string(), vec![message])),
            }
        }
        let parameters = announced_parameters(&topics);
        Self { topics, parameters, all_topics: bag.topics(), losses: bag.losses().clone() }
    }

    /// What of the bag could not be read.
    pub fn losses(&self) -> &UnreadableParts {
        &self.losses
    }

    /// The topics of the bag.
    pub(super) fn topics(&self) -> &[Topic] {
        &self.all_topics
    }

    /// What the bag has instead of something that it has not.
    pub(super) fn what_else(&self) -> String {
        const SHOWN: usize = 10;
        let names: Vec<_> =
            self.all_topics.iter().take(SHOWN).map(|topic| shown(&topic.name, NAME)).collect();
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

    /// What a node announced of its parameters since its last start, if that is in the bag.
    pub(super) fn parameters(&self, node: &str) -> Option<&AnnouncedParameters> {
        self.lives(node).last()
    }

    /// The same from each of its starts on that are in the bag, in order.
    pub(super) fn lives(&self, node: &str) -> &[AnnouncedParameters] {
        self.parameters.get(node).map_or(&[], Vec::as_slice)
    }

    /// The nodes whose start is in the bag and that declared a parameter of that name.
    pub(super) fn nodes_with<'a>(&'a self, parameter: &'a str) -> impl Iterator<Item = &'a str> {
        let has = move |last: &AnnouncedParameters| last.initial.iter().any(|one| one.name == parameter);
        let nodes = self.parameters.iter().filter(move |(_, lives)| lives.last().is_some_and(has));
        nodes.map(|(node, _)| node.as_str())
    }
}

/// Of each node from each of its starts on, from its latched `~/parameters`. Who joins late may get several at once: the stamps give their
/// order.
fn announced_parameters(
    topics: &BTreeMap<String, Vec<BagMessage>>,
) -> BTreeMap<String, Vec<AnnouncedParameters>> {
    let latched = topics.iter().filter(|(topic, _)| topic.ends_with("/parameters"));
    let events = |messages: &Vec<BagMessage>| {
        messages.iter().filter_map(|one| one.decode().ok()).map(with_names_of_today).collect()
    };
    latched.flat_map(|(_, messages)| known_by_states(sorted(events(messages)))).collect()
}

fn with_names_of_today(mut event: ParameterEvent) -> ParameterEvent {
    for parameter in event.new_parameters.iter_mut().chain(&mut event.changed_parameters) {
        if let Some((_, now)) = RENAMED.iter().find(|(before, _)| *before == parameter.name) {
            (*now).clone_into(&mut parameter.name);
        }
    }
    event
}

fn sorted(mut events: Vec<ParameterEvent>) -> Vec<ParameterEvent> {
    events.sort_by_key(|event| event.stamp.nanoseconds());
    events
}

/// Each message has all parameters, and what has changed since the one before, which is nothing at the node's start.
fn known_by_states(states: Vec<ParameterEvent>) -> BTreeMap<String, Vec<AnnouncedParameters>> {
    let mut nodes = BTreeMap::<String, Vec<(AnnouncedParameters, Vec<Parameter>)>>::new();
    for event in states {
        let state = event.new_parameters.clone();
        let lives = nodes.entry(event.node.clone()).or_default();
        match lives.last_mut() {
            Some((known, before)) if !event.changed_parameters.is_empty() => {
                let changed = state.iter().filter(|now| !before.contains(now)).cloned().collect();
                known.change(ParameterEvent {
                    changed_parameters: changed,
                    new_parameters: Vec::new(),
                    ..event
                });
                *before = state;
            }
            // The same once more, for who joined late.
            Some((known, _)) if known.since == event.stamp.nanoseconds() => {}
            _ => lives.push((AnnouncedParameters::new(event), state)),
        }
    }
    let lives = |lives: Vec<(AnnouncedParameters, _)>| lives.into_iter().map(|(known, _)| known).collect();
    nodes.into_iter().map(|(node, states)| (node, lives(states))).collect()
}

impl AnnouncedParameters {
    fn new(start: ParameterEvent) -> Self {
        let numbers = Numbers { stamps: vec![CycleLabel::settings_of(&start.stamp)] };
        Self { since: start.stamp.nanoseconds(), initial: start.new_parameters, changes: Vec::new(), numbers }
    }

    fn change(&mut self, event: ParameterEvent) {
        self.numbers.stamps.push(CycleLabel::settings_of(&event.stamp));
        self.changes.push(event);
    }
}

impl AnnouncedParameters {
    /// The store with which the node started.
    pub fn initial(&self, kind: ServoKind) -> Result<ParameterStore, RunError> {
        let mut store = kind.store()?;
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wire::messages::Time;

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
    fn labels_name_parameters_by_stamp() {
        let mut known = AnnouncedParameters::new(announced(1_700_000_000, false));
        known.change(announced(1_700_000_005, true));
        let number =
            |settings| known.numbers.in_label(CycleLabel { settings, ..CycleLabel::default() }).settings;
        assert_eq!(number(1_700_000_000_000_000_001), 0);
        assert_eq!(number(1_700_000_005_000_000_001), 1);
        assert_eq!(number(1_700_000_005_000_000_002), u64::MAX, "not in the bag");
    }

    #[test]
    fn states_are_told_apart_by_what_differs_and_a_start_begins_anew() {
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
