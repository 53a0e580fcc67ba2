//! The quality of service, with the policies of ROS 2.

use dq_common::named;
use serde::Deserialize;
use std::time::Duration;

named! {
    /// DDS reliability.
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
    /// DDS durability.
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
    /// The longest time between samples; `None` for no limit.
    pub deadline: Option<Duration>,
    /// The age at which samples are dropped; `None` for never.
    pub lifespan: Option<Duration>,
    /// The party that asserts that the publisher is alive.
    pub liveliness: LivelinessKind,
    /// How long the publisher is alive without assertion; `None` for ever.
    pub liveliness_lease: Option<Duration>,
}

named! {
    /// DDS liveliness as in ROS 2: who asserts that the publisher is alive.
    "liveliness" LivelinessKind {
        /// The middleware asserts it.
        Automatic = "automatic",
        /// The publisher asserts it.
        ManualByTopic = "manual_by_topic",
    }
}
