//! Quality of service, as far as ROS 2 knows it.

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
        /// Lost samples are lost.
        BestEffort = "best_effort",
    }
}

named! {
    /// DDS durability.
    #[derive(Deserialize)]
    #[serde(rename_all = "snake_case")]
    "durability" DurabilityKind {
        /// Only who listens hears.
        Volatile = "volatile",
        /// Late joiners get the last samples.
        TransientLocal = "transient_local",
    }
}

/// What one publisher offers.
#[derive(Clone, Debug, PartialEq)]
pub struct OfferedQos {
    /// Delivery.
    pub reliability: ReliabilityKind,
    /// Whether late joiners get the last samples.
    pub durability: DurabilityKind,
    /// Longest time between samples; `None` for no limit.
    pub deadline: Option<Duration>,
    /// Age at which samples are dropped; `None` for never.
    pub lifespan: Option<Duration>,
    /// Who says that the publisher is alive.
    pub liveliness: LivelinessKind,
    /// How long it is alive without saying so; `None` for ever.
    pub liveliness_lease: Option<Duration>,
}

named! {
    /// DDS liveliness, as far as ROS 2 knows it: who says that the publisher is alive.
    "liveliness" LivelinessKind {
        /// The middleware does.
        Automatic = "automatic",
        /// The publisher does.
        ManualByTopic = "manual_by_topic",
    }
}
