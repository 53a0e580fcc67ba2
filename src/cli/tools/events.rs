//! Turns on the record for replay of the servos that are there, for as long as they are recorded.

use crate::params::Value;
use crate::ros::{LogLevel, Logging, Node, ParameterClient, Resolver, RosArgs, RosError, Session};
use crate::stderr;
use crate::wire::EVENTS;
use crate::wire::messages::{Message, UInt8MultiArray};
use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;
use tokio::sync::{oneshot, watch};
use tokio::task::JoinHandle;

/// How long a servo may take to turn it on, and off.
const ON: Duration = Duration::from_secs(10);
const OFF: Duration = Duration::from_secs(1);

/// Within this time a servo's cycle takes what its services have answered.
const CYCLES: Duration = Duration::from_millis(50);

/// Turns it on for each servo that appears; [`finish`](Self::finish) turns it off for those for which it was.
pub(super) struct EventsSwitch {
    end: oneshot::Sender<()>,
    /// The servos that have answered.
    asked: watch::Receiver<BTreeSet<String>>,
    task: JoinHandle<()>,
}

impl EventsSwitch {
    /// As a node of `session`. Must be called within a tokio runtime.
    pub fn start(session: &Session, ros_args: &RosArgs) -> Result<Self, RosError> {
        let node = session
            .node(Resolver::new("dq_servo_events", ros_args)?, Logging::new(ros_args, LogLevel::Warn))?;
        let ((end, ended), (tell, asked)) = (oneshot::channel(), watch::channel(BTreeSet::new()));
        Ok(Self { end, asked, task: tokio::spawn(follow(node, tell, ended)) })
    }

    /// Waits until `servo` has taken it, for `patience` at most: what comes to it from then on is in the record that begins.
    pub async fn has_asked(&self, servo: &str, patience: Duration) {
        let mut asked = self.asked.clone();
        let has_answered = asked.wait_for(|asked| asked.contains(servo));
        let _ = tokio::time::timeout(patience, has_answered).await;
        tokio::time::sleep(CYCLES).await;
    }

    /// Leaves the servos as they were.
    pub async fn finish(self) {
        // One that has ended by itself has nothing to leave.
        let _ = self.end.send(());
        let _ = self.task.await;
    }
}

async fn follow(mut node: Node, tell: watch::Sender<BTreeSet<String>>, mut ended: oneshot::Receiver<()>) {
    let mut were_on = BTreeMap::<String, bool>::new();
    loop {
        let new = servos(&node).into_iter().filter(|servo| !were_on.contains_key(servo));
        for servo in new.collect::<Vec<_>>() {
            let was_on = turn_on(&mut node, &servo).await.unwrap_or_else(|why| {
                stderr::line(format!(
                    "warning: {servo} does not record what comes to it, so the bag can be plotted, and not replayed: {why}"
                ));
                true
            });
            tell.send_if_modified(|asked| asked.insert(servo.clone()));
            were_on.insert(servo, was_on);
        }
        tokio::select! {
            () = node.graph_change() => {}
            _ = &mut ended => break,
        }
    }
    let there = servos(&node);
    for (servo, _) in were_on.iter().filter(|(servo, was_on)| !**was_on && there.contains(*servo)) {
        // One that does not answer any more needs nothing.
        let _ = ParameterClient::new(&mut node, servo, OFF).set(EVENTS, &Value::Bool(false)).await;
    }
}

/// The nodes that could record: their topic is there from their start on.
fn servos(node: &Node) -> BTreeSet<String> {
    let is_record = |message: &str, offered: usize| message == UInt8MultiArray::TYPE && offered > 0;
    let topics = node.graph().into_iter().filter(|(_, topic)| is_record(&topic.message, topic.offered.len()));
    topics.filter_map(|(name, _)| name.strip_suffix("/events").map(str::to_owned)).collect()
}

/// Lets the record begin, from the beginning where it was on already; whether it was.
async fn turn_on(node: &mut Node, servo: &str) -> Result<bool, RosError> {
    let mut parameters = ParameterClient::new(node, servo, ON);
    let was_on = parameters.get(EVENTS).await? == Some(Value::Bool(true));
    if let Err(why) = parameters.set(EVENTS, &Value::Bool(true)).await? {
        stderr::line(format!("warning: {servo} does not record what comes to it: {why}"));
    }
    Ok(was_on)
}
