//! What the parts of a servo node make their topics from.

use dq_messages::NodeContract;
use dq_ros::ros::Node;
use dq_wire::ServoKind;

/// A servo node in the making: from here its parts have their topics.
pub(super) struct Wiring<'a> {
    pub node: &'a mut Node,
    pub kind: ServoKind,
    pub contract: &'a NodeContract,
}
