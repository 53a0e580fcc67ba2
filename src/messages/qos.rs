//! The quality of service (QoS), with the policies of ROS 2.

use dq_common::named;
use serde::Deserialize;
use std::time::Duration;

named! {
    /// The DDS policy on lost samples.
    #[derive(Deserialize)]
    #[serde(rename_all = "snake_case")]
    "reliability" ReliabilityKind {
        /// Lost samples are sent again.
        Reliable = "reliable",
        /// Lost samples are not sent again.
        BestEffort = "best_effort",
    }
}

named! {
    /// The DDS policy on late joiners.
    #[derive(Deserialize)]
    #[serde(rename_all = "snake_case")]
    "durability" DurabilityKind {
        /// Subscribers get only samples that are published after they join.
        Volatile = "volatile",
        /// Late joiners get the last samples.
        TransientLocal = "transient_local",
    }
}

/// The QoS that one publisher offers.
#[derive(Clone, Debug, PartialEq)]
pub struct OfferedQos {
    /// Whether lost samples are sent again.
    pub reliability: ReliabilityKind,
    /// Whether late joiners get the last samples.
    pub durability: DurabilityKind,
    /// The longest time from one sample to the next; `None` for no limit.
    pub deadline: Option<Duration>,
    /// The age at which samples are dropped; `None` if samples are never dropped.
    pub lifespan: Option<Duration>,
    /// The party that asserts that the publisher is alive.
    pub liveliness: LivelinessKind,
    /// How long a publisher counts as alive without an assertion; `None` for forever.
    pub liveliness_lease: Option<Duration>,
}

named! {
    /// The DDS policy on the party that asserts that the publisher is alive.
    "liveliness" LivelinessKind {
        /// The middleware asserts that the publisher is alive.
        Automatic = "automatic",
        /// The publisher itself asserts that it is alive.
        ManualByTopic = "manual_by_topic",
    }
}
