//! Quality of service, as far as ROS 2 knows it.

use serde::Deserialize;
use std::time::Duration;

/// DDS reliability.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "snake_case")]
pub enum ReliabilityKind {
    /// Lost samples are sent again.
    Reliable,
    /// Lost samples are lost.
    BestEffort,
}

/// DDS durability.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq)]
#[serde(rename_all = "snake_case")]
pub enum DurabilityKind {
    /// Only who listens hears.
    Volatile,
    /// Late joiners get the last samples.
    TransientLocal,
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

/// DDS liveliness, as far as ROS 2 knows it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LivelinessKind {
    /// The middleware.
    Automatic,
    /// The publisher.
    ManualByTopic,
}
