//! Describes two endpoints that do not match because of their QoS.
//!
//! RustDDS 0.15.1 reports the QoS of both endpoints but not the incompatible policy. Delete this module when the event names the
//! policy.

use rustdds::QosPolicies;
use rustdds::policy::{Durability, Reliability};

/// The policy that a subscriber requests and the publisher does not offer.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Mismatch {
    requested: String,
    offered: String,
    remedy: &'static str,
}

/// ROS 2's name for delivery without retransmission.
const BEST_EFFORT: &str = "BEST_EFFORT";

/// Returns whether a publisher offers, or a subscriber requests, messages from before the subscriber existed.
pub(crate) fn is_latched(qos: &QosPolicies) -> bool {
    !matches!(qos.durability(), None | Some(Durability::Volatile))
}

impl Mismatch {
    /// Finds the policy that makes `requested` and `offered` incompatible. If several policies do, prefers reliability, then
    /// durability, because ROS 2 users set these two.
    pub fn new(requested: &QosPolicies, offered: &QosPolicies) -> Self {
        let is_reliable = |qos: &QosPolicies| matches!(qos.reliability(), Some(Reliability::Reliable { .. }));
        if is_reliable(requested) && !is_reliable(offered) {
            return Self::of("RELIABLE", BEST_EFFORT, "publish RELIABLE or subscribe BEST_EFFORT");
        }
        if is_latched(requested) && !is_latched(offered) {
            return Self::of("TRANSIENT_LOCAL", "VOLATILE", "publish TRANSIENT_LOCAL or subscribe VOLATILE");
        }
        let policy = offered.compliance_failure_wrt(requested);
        let policy =
            policy.map_or_else(|| "policy".to_owned(), |policy| format!("{policy:?}").to_uppercase());
        Self {
            requested: format!("a stricter {policy}"),
            offered: format!("its {policy}"),
            remedy: "the subscriber may ask for no more than the publisher offers",
        }
    }

    /// Returns whether the endpoints do not match because the publisher offers best effort only.
    pub fn is_reliability(&self) -> bool {
        self.offered == BEST_EFFORT
    }

    fn of(requested: &str, offered: &str, remedy: &'static str) -> Self {
        Self { requested: requested.to_owned(), offered: offered.to_owned(), remedy }
    }

    /// Returns the warning for the log of our node, which subscribes to `topic` and does not receive from the publisher `peer`.
    pub fn warning_of_subscriber(&self, topic: &str, peer: &str) -> String {
        let Self { requested, offered, remedy } = self;
        format!(
            "{topic} is not heard from {peer}: it offers {offered}, this node asks for {requested}; {remedy}"
        )
    }

    /// Returns the warning for the log of our node, which publishes `topic` but does not reach the subscriber `peer`.
    pub fn warning_of_publisher(&self, topic: &str, peer: &str) -> String {
        let Self { requested, offered, remedy } = self;
        format!(
            "{topic} is not heard by {peer}: it asks for {requested}, this node offers {offered}; {remedy}"
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rustdds::QosPolicyBuilder;
    use rustdds::policy::Deadline;

    fn reliable() -> QosPolicyBuilder {
        QosPolicyBuilder::new()
            .reliability(Reliability::Reliable { max_blocking_time: rustdds::Duration::ZERO })
    }

    #[test]
    fn a_warning_names_topic_peer_policy_and_remedy() {
        let best_effort = QosPolicyBuilder::new().reliability(Reliability::BestEffort).build();
        let mismatch = Mismatch::new(&reliable().build(), &best_effort);
        assert_eq!(
            mismatch.warning_of_subscriber("/joint_states", "/driver"),
            "/joint_states is not heard from /driver: it offers BEST_EFFORT, this node asks for RELIABLE; \
             publish RELIABLE or subscribe BEST_EFFORT"
        );
        let latched = reliable().durability(Durability::TransientLocal).build();
        let mismatch = Mismatch::new(&latched, &reliable().build());
        assert_eq!(
            mismatch.warning_of_publisher("/status", "/recorder"),
            "/status is not heard by /recorder: it asks for TRANSIENT_LOCAL, this node offers VOLATILE; \
             publish TRANSIENT_LOCAL or subscribe VOLATILE"
        );
        let hurried = reliable().deadline(Deadline(rustdds::Duration::from_millis(1))).build();
        let warning = Mismatch::new(&hurried, &reliable().build()).warning_of_publisher("/status", "/x");
        assert!(
            warning.contains("it asks for a stricter DEADLINE, this node offers its DEADLINE"),
            "{warning}"
        );
    }
}
