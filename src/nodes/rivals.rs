//! Detects other nodes that send commands to an arm.
//!
//! Discovery shows only possible publishers: a killed publisher counts until its lease ends, and a servo that never had a goal
//! sends nothing. Therefore, if discovery shows other publishers, the node also subscribes to the topic of its own commands.

use super::guards::GuardStatuses;
use dq_messages::NodeContract;
use dq_ros::ros::{EndpointId, Node, Publisher, RosError, Subscription};
use dq_wire::Command;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};
use tokio::time::{MissedTickBehavior, interval};

/// The interval at which to check for other publishers.
const INTERVAL: Duration = Duration::from_millis(50);

/// A publisher counts as present for this time after its last command.
const PRESENCE: Duration = Duration::from_secs(1);

/// Another publisher of the commands to one arm, if there is one.
#[derive(Default)]
pub(super) struct Rival {
    is_there: AtomicBool,
    publisher: Mutex<Option<EndpointId>>,
}

impl Rival {
    /// Watches for publishers other than `publisher` on the `topic` of the contract until the node is dropped. Guards do not count
    /// as rivals.
    pub fn watch<M: Command>(
        node: &mut Node,
        contract: &NodeContract,
        publisher: &Publisher<M>,
        topic: &str,
        guards: GuardStatuses,
    ) -> Result<Arc<Self>, RosError> {
        let (rival, own) = (Arc::new(Self::default()), publisher.id());
        let (watched, own_topic) = (rival.clone(), node.own_topic::<M>(contract, topic)?);
        let log = node.log().clone();
        node.run(async move {
            let mut ticks = interval(INTERVAL);
            ticks.set_missed_tick_behavior(MissedTickBehavior::Delay);
            let (mut subscription, mut heard) = (None::<Subscription<M>>, None);
            loop {
                ticks.tick().await;
                let suspects = own_topic.other_publishers(own).saturating_sub(guards.publishers());
                if suspects == 0 {
                    subscription = None;
                } else if subscription.is_none() {
                    let why = |why: &RosError| {
                        log.warn(&format!(
                            "other publishers of commands to the arm cannot be detected: {why}"
                        ))
                    };
                    subscription = own_topic.subscribe().inspect_err(why).ok();
                    if subscription.is_none() {
                        return;
                    }
                }
                if let Some(subscription) = &subscription {
                    subscription.each(|command, origin| {
                        if origin.publisher != own && !command.is_of_guard() {
                            heard = Some((origin.publisher, Instant::now()));
                        }
                    });
                }
                watched.set(heard.filter(|(_, at)| at.elapsed() <= PRESENCE).map(|(publisher, _)| publisher));
            }
        });
        Ok(rival)
    }

    /// Returns whether another publisher sends commands to the arm.
    pub fn is_there(&self) -> bool {
        self.is_there.load(Ordering::Relaxed)
    }

    /// Returns the other publisher, if one sends commands to the arm.
    pub fn publisher(&self) -> Option<EndpointId> {
        *self.publisher.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn set(&self, publisher: Option<EndpointId>) {
        *self.publisher.lock().unwrap_or_else(PoisonError::into_inner) = publisher;
        self.is_there.store(publisher.is_some(), Ordering::Relaxed);
    }
}
