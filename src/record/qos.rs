//! The QoS that publishers offer, as rosbag2 of Jazzy writes it.

use crate::ros::{DurabilityKind, LivelinessKind, OfferedQos, ReliabilityKind};
use std::time::Duration;

/// rosbag2's infinite duration: 2⁶³−1 ns.
const INFINITE: Duration = Duration::new(9_223_372_036, 854_775_807);

/// A YAML list, one item a publisher. History and depth are not announced over DDS, which rosbag2 calls unknown.
pub(super) fn profiles_yaml(offered: &[OfferedQos]) -> String {
    if offered.is_empty() {
        return "[]".to_owned();
    }
    offered.iter().map(profile_yaml).collect::<Vec<_>>().join("\n")
}

fn profile_yaml(offered: &OfferedQos) -> String {
    let reliability = match offered.reliability {
        ReliabilityKind::Reliable => "reliable",
        ReliabilityKind::BestEffort => "best_effort",
    };
    let durability = match offered.durability {
        DurabilityKind::TransientLocal => "transient_local",
        DurabilityKind::Volatile => "volatile",
    };
    let liveliness = match offered.liveliness {
        LivelinessKind::Automatic => "automatic",
        LivelinessKind::ManualByTopic => "manual_by_topic",
    };
    let time = |name: &str, duration: Option<Duration>| {
        let duration = duration.unwrap_or(INFINITE);
        format!("  {name}:\n    sec: {}\n    nsec: {}\n", duration.as_secs(), duration.subsec_nanos())
    };
    format!(
        "- history: unknown\n  depth: 0\n  reliability: {reliability}\n  durability: {durability}\n{}{}  liveliness: \
         {liveliness}\n{}  avoid_ros_namespace_conventions: false",
        time("deadline", offered.deadline),
        time("lifespan", offered.lifespan),
        time("liveliness_lease_duration", offered.liveliness_lease),
    )
}
