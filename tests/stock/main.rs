//! Tests the expectations of a stock ROS 2, as far as its parts are in the registries: nodes on eProsima Fast DDS like those of
//! rmw_fastrtps, and colcon workspaces.

#[path = "../dds/host.rs"]
mod host;

mod fastdds;
mod workspace;

/// The peer on Eclipse Cyclone is not used here.
const PEER: &str = "";
