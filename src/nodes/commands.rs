//! The commands to all arms. Whatever ends the cycle that makes them, a panic or a hang too, the last velocities are zeros; of positions
//! the last ones stay, which is to stand too.

use super::guards::{self, GuardStatuses};
use super::shutdown::{Outcome, SHORTEST_FAREWELL, ShutdownError};
use crate::ros::{Node, Publisher, RosError};
use crate::servo::{Interface, JointOrder};
use crate::wire::messages::{Float64MultiArray, JointTrajectory, Message};
use crate::wire::status::rivalry;
use crate::wire::{NodeContract, Rewrite, Wiring, command_array, command_topic, command_trajectory};
use std::fmt::Display;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;
use tokio::sync::watch;

/// The publishers of commands. They outlive the cycle.
pub(super) struct Commands {
    arms: Vec<ArmCommands>,
    /// Whether any command was sent: before, even zeros might be a step for a robot that another servo moves.
    begun: AtomicBool,
    ended: AtomicBool,
}

/// The commands to one arm.
struct ArmCommands {
    to: To,
    joint_count: usize,
    guards: GuardStatuses,
    /// Whether anybody subscribed that is no guard, when it was last looked.
    heard: AtomicBool,
}

/// What its controller takes.
enum To {
    Velocities(Sent<Float64MultiArray>),
    Positions(Sent<Float64MultiArray>),
    Trajectories(Sent<JointTrajectory>),
}

/// A publisher of commands, and the message that each of them is written into.
struct Sent<M: Message> {
    publisher: Publisher<M>,
    /// Nobody but the cycle holds it.
    message: Mutex<Arc<M>>,
}

impl<M: Message + Rewrite> Sent<M> {
    fn new(publisher: Publisher<M>, message: M) -> Self {
        Self { publisher, message: Mutex::new(Arc::new(message)) }
    }

    fn publish(&self, numbers: &[f64], label: &impl Display) {
        let mut message = self.message.lock().unwrap_or_else(PoisonError::into_inner);
        Arc::make_mut(&mut message).rewrite(numbers, label);
        self.publisher.publish(message.clone());
    }
}

impl ArmCommands {
    fn publish(&self, numbers: &[f64], label: &impl Display) {
        match &self.to {
            To::Velocities(to) | To::Positions(to) => to.publish(numbers, label),
            To::Trajectories(to) => to.publish(numbers, label),
        }
    }

    /// Zeros to an arm that takes velocities; one that takes positions stands where it was sent last.
    fn stand(&self) {
        if let To::Velocities(to) = &self.to {
            to.publisher.publish(command_array(vec![0.0; self.joint_count], ""));
        }
    }

    fn topic(&self) -> &str {
        match &self.to {
            To::Velocities(to) | To::Positions(to) => to.publisher.topic(),
            To::Trajectories(to) => to.publisher.topic(),
        }
    }

    /// How many subscribe that are no guards.
    fn readers(&self) -> usize {
        let all = match &self.to {
            To::Velocities(to) | To::Positions(to) => to.publisher.readers(),
            To::Trajectories(to) => to.publisher.readers(),
        };
        all.saturating_sub(self.guards.publishers())
    }

    fn dropped(&self) -> u64 {
        match &self.to {
            To::Velocities(to) | To::Positions(to) => to.publisher.dropped(),
            To::Trajectories(to) => to.publisher.dropped(),
        }
    }

    /// How many others publish that are no guards.
    fn rivals(&self) -> usize {
        let all = match &self.to {
            To::Velocities(to) | To::Positions(to) => to.publisher.other_publishers(),
            To::Trajectories(to) => to.publisher.other_publishers(),
        };
        all.saturating_sub(self.guards.publishers())
    }
}

/// At the end so many zeros are sent, over [`SHORTEST_FAREWELL`].
const ZEROS_AT_THE_END: u32 = 10;

impl Commands {
    /// The publishers of the node, for arms with these joints that take such commands, one a `period`.
    pub fn new<T: Wiring>(
        node: &mut Node,
        contract: &NodeContract,
        arms: &[JointOrder],
        (interface, period): (Interface, Duration),
    ) -> Result<Self, RosError> {
        let to = |(prefix, joints): (&&str, &JointOrder)| {
            let topic = format!("{prefix}{}", command_topic(interface));
            let joint_count = joints.names().len();
            let zeros = vec![0.0; joint_count];
            let to = match interface {
                Interface::Velocity => {
                    To::Velocities(Sent::new(node.publisher(contract, &topic)?, command_array(zeros, "")))
                }
                Interface::Position => {
                    To::Positions(Sent::new(node.publisher(contract, &topic)?, command_array(zeros, "")))
                }
                Interface::Trajectory => {
                    let message = command_trajectory(joints.names().to_vec(), zeros, period, "");
                    To::Trajectories(Sent::new(node.publisher(contract, &topic)?, message))
                }
            };
            let guards = guards::subscribe(node, contract, prefix)?;
            Ok(ArmCommands { to, joint_count, guards, heard: AtomicBool::new(false) })
        };
        let arms = T::ARMS.iter().zip(arms).map(to).collect::<Result<_, RosError>>()?;
        Ok(Self { arms, begun: AtomicBool::new(false), ended: AtomicBool::new(false) })
    }

    /// To each arm its part of the command, made from what `label` says; where it has ended, arms are to stand.
    pub fn publish(&self, command: &[f64], label: &impl Display) {
        self.begun.store(true, Ordering::Relaxed);
        if self.has_ended() {
            return self.stand();
        }
        let mut rest = command;
        for arm in &self.arms {
            let (part, others) = rest.split_at(arm.joint_count);
            arm.publish(part, label);
            rest = others;
        }
    }

    /// Lets the arms stand at once.
    pub fn stand(&self) {
        self.arms.iter().for_each(ArmCommands::stand);
    }

    /// Whether nothing but zeros is sent any more.
    pub fn has_ended(&self) -> bool {
        self.ended.load(Ordering::Relaxed)
    }

    /// Sends zeros, now and for a moment, whatever the cycle does meanwhile; nothing else is sent any more.
    pub fn end(&self) {
        self.ended.store(true, Ordering::Relaxed);
        if !self.begun.load(Ordering::Relaxed) {
            return;
        }
        for _ in 0..ZEROS_AT_THE_END {
            self.stand();
            std::thread::sleep(SHORTEST_FAREWELL / ZEROS_AT_THE_END);
        }
    }

    /// Of each arm, the full name of its topic and how many subscribe to it.
    pub fn readers(&self) -> impl Iterator<Item = (&str, usize)> {
        self.arms.iter().map(|arm| (arm.topic(), arm.readers()))
    }

    /// Looks who subscribes to them. That takes a lock which discovery holds too, so it is not the cycle's to do.
    pub fn look_for_readers(&self) {
        self.arms.iter().for_each(|arm| arm.heard.store(arm.readers() > 0, Ordering::Relaxed));
    }

    /// Whether anybody subscribed to the commands for the arm number `arm` when it was last looked.
    pub fn are_heard(&self, arm: usize) -> bool {
        self.arms.get(arm).is_some_and(|arm| arm.heard.load(Ordering::Relaxed))
    }

    /// The full name of the commands' topic for the arm number `arm`.
    pub fn topic(&self, arm: usize) -> &str {
        self.arms.get(arm).map_or("", ArmCommands::topic)
    }

    /// Commands that found no room in a writer.
    pub fn dropped(&self) -> u64 {
        self.arms.iter().map(ArmCommands::dropped).sum()
    }

    /// What to say where others publish commands too.
    pub fn rivals(&self) -> Option<String> {
        let arm = self.arms.iter().find(|arm| arm.rivals() > 0)?;
        Some(rivalry(arm.topic(), arm.rivals() + 1))
    }

    /// What the guards of each arm say.
    pub fn guards(&self) -> impl Iterator<Item = GuardStatuses> {
        self.arms.iter().map(|arm| arm.guards.clone())
    }
}

/// What remains to be done when the cycle has ended, or panicked with a message: zeros, unless it has sent them, and the report.
pub(super) fn last_words(
    commands: Arc<Commands>,
    end: watch::Sender<Option<Outcome>>,
) -> impl FnOnce(Result<Outcome, String>) {
    move |ended| {
        let outcome = ended.unwrap_or_else(|panic| Err(ShutdownError::Failed(panic)));
        if matches!(outcome, Err(ShutdownError::Failed(_))) {
            commands.end();
        }
        end.send_replace(Some(outcome));
    }
}

#[cfg(test)]
mod tests {
    use super::super::cycle_thread::{self, Schedule};
    use super::super::shutdown;
    use super::*;
    use crate::ros::Subscription;
    use crate::ros::alone::{node, outside};
    use crate::servo::OneArm;
    use crate::wire::Contract;
    use std::ops::ControlFlow;
    use std::time::Duration;

    async fn received(commands: &Subscription<Float64MultiArray>) -> Vec<f64> {
        let next = tokio::time::timeout(Duration::from_secs(10), commands.next()).await;
        next.expect("a command").data
    }

    const PERIOD: Duration = Duration::from_millis(2);

    /// A cycle that sends `command` until `end`, and what came of it: the last command, and the outcome.
    async fn ends(end: impl Fn() -> ControlFlow<Outcome> + Send + 'static) -> (Vec<f64>, Outcome) {
        let ((_one, mut node), (_other, mut robot)) = (node("servo"), node("robot"));
        let contract = Contract::builtin().unwrap();
        let arms = [JointOrder::new(vec!["one".to_owned(), "other".to_owned()])];
        let commands = Arc::new(
            Commands::new::<OneArm>(&mut node, &contract.servo, &arms, (Interface::Velocity, PERIOD))
                .unwrap(),
        );
        let heard = robot.subscription(&contract.plant, "forward_velocity_controller/commands").unwrap();
        let (sender, mut outcome) = watch::channel(None);
        let (go, may_end) = (Arc::new(AtomicBool::new(false)), commands.clone());
        let asked = go.clone();
        let tick = move |_| {
            may_end.publish(&[0.5, -0.5], &"");
            if asked.load(Ordering::Relaxed) { end() } else { ControlFlow::Continue(()) }
        };
        let last_words = last_words(commands.clone(), sender);
        cycle_thread::spawn("servo", Schedule { period: PERIOD, realtime_priority: 0 }, tick, last_words)
            .unwrap();
        assert_eq!(received(&heard).await, [0.5, -0.5]);
        go.store(true, Ordering::Relaxed);
        let outcome = shutdown::ended(&mut outcome, Duration::from_secs(10)).await;
        let mut last = received(&heard).await;
        while let Ok(next) = tokio::time::timeout(Duration::from_millis(300), heard.next()).await {
            last = next.data;
        }
        (last, outcome)
    }

    #[tokio::test(flavor = "multi_thread")]
    async fn a_cycle_that_panics_in_motion_leaves_zeros_and_the_reason() {
        if outside("nodes::commands::tests::a_cycle_that_panics_in_motion_leaves_zeros_and_the_reason") {
            return;
        }
        let (last, outcome) = ends(|| panic!("by zero")).await;
        assert_eq!(last, [0.0, 0.0]);
        assert_eq!(outcome, Err(ShutdownError::Failed("by zero".to_owned())));
    }

    #[tokio::test(flavor = "multi_thread")]
    async fn a_cycle_that_cannot_go_on_leaves_zeros_and_the_reason() {
        if outside("nodes::commands::tests::a_cycle_that_cannot_go_on_leaves_zeros_and_the_reason") {
            return;
        }
        let failed = Err(ShutdownError::Failed("no such joint".to_owned()));
        let why = failed.clone();
        assert_eq!(ends(move || ControlFlow::Break(why.clone())).await, (vec![0.0, 0.0], failed));
    }
}
