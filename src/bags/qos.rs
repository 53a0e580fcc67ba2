//! The QoS that publishers offer, in the format of rosbag2 of Jazzy.

use dq_messages::OfferedQos;
use serde::Serialize;
use std::time::Duration;

/// The duration that rosbag2 writes for infinity: 2⁶³−1 ns.
const INFINITE: Duration = Duration::new(9_223_372_036, 854_775_807);

/// The QoS that one publisher offers.
#[derive(Clone, Debug, Serialize)]
pub(super) struct Profile {
    history: &'static str,
    depth: u32,
    reliability: &'static str,
    durability: &'static str,
    deadline: Time,
    lifespan: Time,
    liveliness: &'static str,
    liveliness_lease_duration: Time,
    avoid_ros_namespace_conventions: bool,
}

#[derive(Clone, Debug, Serialize)]
struct Time {
    sec: u64,
    nsec: u32,
}

impl From<Option<Duration>> for Time {
    fn from(duration: Option<Duration>) -> Self {
        let duration = duration.unwrap_or(INFINITE);
        Self { sec: duration.as_secs(), nsec: duration.subsec_nanos() }
    }
}

impl From<&OfferedQos> for Profile {
    /// Writes history and depth as unknown, as rosbag2 does: DDS does not announce them.
    fn from(offered: &OfferedQos) -> Self {
        Self {
            history: "unknown",
            depth: 0,
            reliability: offered.reliability.name(),
            durability: offered.durability.name(),
            deadline: offered.deadline.into(),
            lifespan: offered.lifespan.into(),
            liveliness: offered.liveliness.name(),
            liveliness_lease_duration: offered.liveliness_lease.into(),
            avoid_ros_namespace_conventions: false,
        }
    }
}
