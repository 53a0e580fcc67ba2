//! What a stock ROS 2 expects, by what of it the registries have: nodes on eProsima Fast DDS as rmw_fastrtps makes them, and
//! colcon workspaces.

#[path = "../dds/host.rs"]
mod host;

mod fastdds;
mod workspace;

/// The peer on Eclipse Cyclone is not used here.
const PEER: &str = "";
