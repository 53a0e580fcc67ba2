//! Who else sends commands to an arm.
//!
//! Discovery says who may: one that was killed counts until its lease ends, and one that never had a goal sends nothing. So where there
//! may be somebody, the node listens to its own topic.

use super::guards::GuardStatuses;
use dq_messages::NodeContract;
use dq_ros::ros::{EndpointId, Node, Publisher, RosError, Subscription};
use dq_wire::Command;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};
use tokio::time::{MissedTickBehavior, interval};

/// It is looked so often whether there is one.
const INTERVAL: Duration = Duration::from_millis(50);

/// Who was heard within this time is there.
const PRESENCE: Duration = Duration::from_secs(1);

/// Another publisher of the commands to one arm.
#[derive(Default)]
pub(super) struct Rival {
    is_there: AtomicBool,
    publisher: Mutex<Option<EndpointId>>,
}

impl Rival {
    /// Looks for one beside `publisher` on the `topic` of the contract, as long as the node is there. Guards are none.
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
                    let why =
                        |why: &RosError| log.warn(&format!("who else commands the arm is not heard: {why}"));
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

    /// Whether there is one.
    pub fn is_there(&self) -> bool {
        self.is_there.load(Ordering::Relaxed)
    }

    /// Who it is.
    pub fn publisher(&self) -> Option<EndpointId> {
        *self.publisher.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn set(&self, publisher: Option<EndpointId>) {
        *self.publisher.lock().unwrap_or_else(PoisonError::into_inner) = publisher;
        self.is_there.store(publisher.is_some(), Ordering::Relaxed);
    }
}
