//! Which topics are recorded.

use crate::ros::{Contract, RosError};
use std::collections::BTreeSet;

/// Topics that every ROS 2 node has, and bags should.
const EVERY_NODE: [(&str, &str); 2] =
    [("/parameter_events", "rcl_interfaces/msg/ParameterEvent"), ("/rosout", "rcl_interfaces/msg/Log")];

/// Which topics are recorded.
#[derive(Clone, Debug)]
pub struct Selection(Rule);

#[derive(Clone, Debug)]
enum Rule {
    /// These fully qualified names.
    Names(BTreeSet<String>),
    /// These names with their types: absolute, or below any namespace.
    Contract(Vec<(String, String)>),
}

impl Selection {
    /// The topics of `msg_config/topics.yaml` in every namespace, by name and type, with `/parameter_events` and
    /// `/rosout`.
    ///
    /// # Errors
    /// [`RosError::ContractFile`].
    pub fn contract() -> Result<Self, RosError> {
        let contract = Contract::builtin()?;
        let ours = contract.nodes().flat_map(|node| node.topics());
        let ours = ours.map(|(name, topic)| (name.trim_start_matches('~').to_owned(), topic.message.clone()));
        let every_node = EVERY_NODE.map(|(name, message)| (name.to_owned(), message.to_owned()));
        Ok(Self(Rule::Contract(ours.chain(every_node).collect())))
    }

    /// The topics with these fully qualified names.
    pub fn names(names: impl IntoIterator<Item = String>) -> Self {
        Self(Rule::Names(names.into_iter().collect()))
    }

    /// Whether the topic of that name and type is one of them.
    pub(super) fn has(&self, name: &str, message: &str) -> bool {
        match &self.0 {
            Rule::Names(names) => names.contains(name),
            Rule::Contract(topics) => topics.iter().any(|(ours, of)| {
                let tail = ours.trim_start_matches('/');
                of == message && (name == ours || name.strip_suffix(tail).is_some_and(|ns| ns.ends_with('/')))
            }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_contract_selects_by_name_below_any_namespace_and_by_type() {
        let contract = Selection::contract().unwrap();
        let (state, status) = ("sensor_msgs/msg/JointState", "diagnostic_msgs/msg/DiagnosticStatus");
        for (name, message) in [
            ("/joint_states", state),
            ("/left/joint_states", state),
            ("/dq_servo/status", status),
            ("/a/b/renamed/status", status),
            ("/left/forward_velocity_controller/commands", "std_msgs/msg/Float64MultiArray"),
            ("/tf_static", "tf2_msgs/msg/TFMessage"),
            ("/rosout", "rcl_interfaces/msg/Log"),
            ("/parameter_events", "rcl_interfaces/msg/ParameterEvent"),
        ] {
            assert!(contract.has(name, message), "{name}");
        }
        for (name, message) in
            [("/joint_states", status), ("/my_joint_states", state), ("/other", state), ("/commands", state)]
        {
            assert!(!contract.has(name, message), "{name}");
        }
    }
}
