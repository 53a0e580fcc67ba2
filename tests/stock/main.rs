//! Tests the expectations of a stock ROS 2, if the registries have its parts: nodes on eProsima Fast DDS like those of
//! rmw_fastrtps, and colcon workspaces.

#[path = "../dds/host.rs"]
mod host;

mod fastdds;
mod workspace;

/// The path of the peer program on Eclipse Cyclone, which these tests do not use.
const PEER: &str = "";
