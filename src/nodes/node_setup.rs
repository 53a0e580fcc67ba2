//! The data that the parts of a servo node need to create their topics.

use dq_messages::NodeContract;
use dq_ros::ros::Node;
use dq_wire::ServoKind;

/// A servo node during its construction.
pub(super) struct NodeSetup<'a> {
    pub node: &'a mut Node,
    pub kind: ServoKind,
    pub contract: &'a NodeContract,
}
