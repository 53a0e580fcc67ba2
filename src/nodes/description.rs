//! The robot description from a topic. A servo without a robot description in its parameters waits for this topic before it starts.
//! A running servo warns if the topic describes another arm.

use super::throttle::Throttle;
use super::{NodeArguments, NodeError, Prepared};
use dq_config::NodeParameters;
use dq_description::Description;
use dq_messages::NodeContract;
use dq_messages::messages::StringMessage;
use dq_params::{ParameterStore, Value};
use dq_ros::ros::{Node, RosError, Session};
use dq_wire::Contract;
use std::time::Duration;
use tokio::task::spawn_blocking;
use tokio::time::{Instant, interval};

/// The name of the topic.
const TOPIC: &str = "robot_description";

/// The shortest time between two warnings that the node waits for a description, and between two warnings that a new description is
/// not used.
const REMINDER: Duration = Duration::from_secs(5);

impl<P: NodeParameters> NodeArguments<P> {
    /// Waits for a message on the topic `robot_description`, and prepares the node from the description and the command line.
    ///
    /// # Errors
    /// [`NodeError`] if the description has no arm between the base frame and the tool frame, or if the network fails.
    pub async fn when_described(self, session: &Session) -> Result<Prepared<P>, NodeError> {
        let (names, logging) = self.node();
        let mut node = session.node(names, logging)?;
        let descriptions = node.subscription::<StringMessage>(&Contract::builtin()?.servo, TOPIC)?;
        let mut reminder = interval(REMINDER);
        loop {
            tokio::select! {
                description = descriptions.next() => {
                    let topic = descriptions.topic().to_owned();
                    let refused = |why| NodeError::Description { topic, why: Box::new(why) };
                    // The blocking task leaves this thread free to handle signals.
                    let read = spawn_blocking(move || self.describe(description.data)).await;
                    return read.map_err(|why| NodeError::Thread(why.into()))?.map_err(refused);
                }
                _ = reminder.tick() => {
                    let topic = descriptions.topic();
                    node.log().warn(&format!("waiting for the arm: nothing on {topic} describes it yet"));
                }
            }
        }
    }
}

/// Warns of a robot description whose arm between the base frame and the tool frame differs from the arm in use. The servo keeps the
/// arm in use.
pub(super) fn watch(
    node: &mut Node,
    contract: &NodeContract,
    store: &ParameterStore,
) -> Result<(), RosError> {
    let text = |name: &str| match store.get(name) {
        Some(Value::String(text)) => text.clone(),
        _ => String::new(),
    };
    let [in_force, base, tool] = [TOPIC, "base_frame", "tool_frame"].map(text);
    if in_force.is_empty() {
        return Ok(());
    }
    let descriptions = node.subscription::<StringMessage>(contract, TOPIC)?;
    let log = node.log().clone();
    node.run(async move {
        let (began, mut warning_due) = (Instant::now(), Throttle::new(REMINDER));
        loop {
            let came = descriptions.next().await.data;
            let (from, to) = (base.clone(), tool.clone());
            // The blocking task leaves this thread free for the node's other tasks.
            let why = match spawn_blocking(move || Description::read(&came, &from, &to)).await {
                Ok(Ok(read)) if read.arm.urdf() == in_force => continue,
                Ok(Ok(_)) => {
                    format!("it has another arm between {base} and {tool}: restart the servo to use it")
                }
                Ok(Err(why)) => why.to_string(),
                Err(why) => why.to_string(),
            };
            if warning_due.is_due(began.elapsed()) {
                log.warn(&format!("the description on {} is not used: {why}", descriptions.topic()));
            }
        }
    });
    Ok(())
}
