//! The selection of topics to record.

use dq_config::{DualParameters, GuardParameters, NodeParameters, PlantParameters, ServoParameters};
use dq_ros::ros::{Resolver, RosArgs, RosError};
use dq_wire::Contract;
use std::collections::BTreeSet;

/// The topics that every ROS 2 node has, and that are recorded too.
const EVERY_NODE: [(&str, &str); 2] =
    [("/parameter_events", "rcl_interfaces/msg/ParameterEvent"), ("/rosout", "rcl_interfaces/msg/Log")];

/// The selection of topics to record.
#[derive(Clone, Debug)]
pub struct Selection(Rule);

#[derive(Clone, Debug)]
enum Rule {
    /// The topics with these fully qualified names.
    Names(BTreeSet<String>),
    /// The topics with these names and types, in every namespace.
    Contract(Vec<(String, String)>),
}

impl Selection {
    /// Selects the topics of `msg_config/topics.yaml` in every namespace, by name and type, and also `/parameter_events` and
    /// `/rosout`. Topics that these ROS arguments remap are selected under their new names too.
    ///
    /// # Errors
    /// [`RosError::Wire`], [`RosError::Name`].
    pub fn contract(ros_args: &RosArgs) -> Result<Self, RosError> {
        let contract = Contract::builtin()?;
        let remapped = remapped(&contract, ros_args)?;
        let ours = contract.nodes().flat_map(|node| node.topics());
        let ours = ours.map(|(name, topic)| (name.trim_start_matches('~').to_owned(), topic.message.clone()));
        let every_node = EVERY_NODE.map(|(name, message)| (name.to_owned(), message.to_owned()));
        Ok(Self(Rule::Contract(ours.chain(every_node).chain(remapped).collect())))
    }

    /// Selects the topics with these fully qualified names.
    pub fn names(names: impl IntoIterator<Item = String>) -> Self {
        Self(Rule::Names(names.into_iter().collect()))
    }

    /// Returns whether the topic with this name and type is selected.
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

/// Returns the topics of the nodes under the names that they have after remapping, fully qualified. If a rule's new name is
/// relative, also returns this name without a namespace, so that it is selected in every namespace.
fn remapped(contract: &Contract, ros_args: &RosArgs) -> Result<Vec<(String, String)>, RosError> {
    let nodes = [
        (&contract.servo, ServoParameters::NODE_NAME),
        (&contract.dual, DualParameters::NODE_NAME),
        (&contract.plant, PlantParameters::NODE_NAME),
        (&contract.guard, GuardParameters::NODE_NAME),
    ];
    let mut topics = Vec::new();
    for (contract, node) in nodes {
        let names = Resolver::new(node, ros_args)?;
        for (name, topic) in contract.topics() {
            topics.push((names.topic(name)?, topic.message.clone()));
            let rules =
                ros_args.remaps.iter().filter(|rule| rule.from == name && !rule.to.starts_with(['/', '~']));
            topics.extend(rules.map(|rule| (rule.to.clone(), topic.message.clone())));
        }
    }
    Ok(topics)
}

#[cfg(test)]
mod tests {
    use super::*;
    use dq_ros::ros::args::split;

    #[test]
    fn remapped_topics_are_selected_where_they_are() {
        let line = "--ros-args -r joint_states:=/robot/states -r goal_pose:=target -r ~/status:=/health -r __ns:=/left";
        let (_, args) = split(line.split(' ').map(str::to_owned)).unwrap();
        let selection = Selection::contract(&args).unwrap();
        let (state, pose) = ("sensor_msgs/msg/JointState", "geometry_msgs/msg/PoseStamped");
        let status = "diagnostic_msgs/msg/DiagnosticStatus";
        for (name, message) in [
            ("/robot/states", state),
            ("/left/target", pose),
            ("/right/target", pose),
            ("/health", status),
            ("/left/goal_pose", pose),
        ] {
            assert!(selection.has(name, message), "{name}");
        }
        assert!(!selection.has("/states", state) && !selection.has("/robot/states", pose));
    }

    #[test]
    fn the_contract_selects_by_name_below_any_namespace_and_by_type() {
        let contract = Selection::contract(&RosArgs::default()).unwrap();
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
