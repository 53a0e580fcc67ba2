//! Publishes the commands to all arms. At the end, sends zero velocities, even if the cycle has panicked or hangs. A controller
//! that takes positions holds the last positions, so its arm stands still without a further command.

use super::guards::{self, GuardStatuses};
use super::node_setup::NodeSetup;
use super::rivals::Rival;
use super::shutdown::{Outcome, SHORTEST_FINAL_ZEROS, ShutdownError};
use dq_core::servo::{Interface, JointOrder};
use dq_messages::messages::Message;
use dq_ros::ros::{EndpointId, Publisher, Publishing, RosError};
use dq_wire::rivalry;
use dq_wire::{Command, command_topic, with_command};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;
use tokio::sync::watch;

/// The publishers of commands. The cycle and the node share them, so that the node can send zeros after the cycle has ended.
pub(super) struct Commands {
    arms: Vec<ArmCommands>,
    /// Whether any command was sent. If not, the node sends no zeros at its end, because another servo may be moving the robot.
    begun: AtomicBool,
    ended: AtomicBool,
}

/// The commands to one arm.
struct ArmCommands {
    publisher: Box<dyn CommandPublisher>,
    joint_count: usize,
    guards: GuardStatuses,
    /// Whether there was any subscriber other than guards at the last check.
    heard: AtomicBool,
    /// Detects other publishers of commands to this arm.
    rival: Arc<Rival>,
}

/// A publisher of commands. Its message type depends on the arm's controller.
trait CommandPublisher: Send + Sync {
    /// Publishes a command with these numbers.
    fn publish(&self, numbers: &[f64]);
    /// Stops the arm. Works even while the cycle hangs in `publish`.
    fn stand(&self);
    fn publishing(&self) -> &Publishing;
}

/// A publisher of commands of one message type.
struct MessagePublisher<M: Message> {
    publisher: Publisher<M>,
    /// The message into which the commands are written. Only the cycle uses it.
    message: Mutex<Arc<M>>,
    /// The command that stops the arm. `None` if the arm takes positions, because such an arm stops without a further command.
    standstill: Option<Arc<M>>,
}

impl<M: Command> CommandPublisher for MessagePublisher<M> {
    fn publish(&self, numbers: &[f64]) {
        let mut message = self.message.lock().unwrap_or_else(PoisonError::into_inner);
        Arc::make_mut(&mut message).rewrite(numbers);
        self.publisher.publish_in_time(message.clone());
    }

    fn stand(&self) {
        self.standstill.iter().for_each(|standstill| self.publisher.publish(standstill.clone()));
    }

    fn publishing(&self) -> &Publishing {
        &self.publisher
    }
}

/// The settings with which commands are sent.
#[derive(Clone, Copy)]
pub(super) struct Sending {
    pub interface: Interface,
    /// The time between two commands.
    pub period: Duration,
    /// Whether to drop a command if DDS has not sent the earlier commands yet. A cycle with a real-time priority needs this, because
    /// the cycle may run faster than the threads of DDS.
    pub in_time: bool,
}

impl ArmCommands {
    /// Creates the publisher for an arm with these `joints`. The names of the arm's topics begin with `prefix`.
    fn new(
        setup: &mut NodeSetup,
        prefix: &str,
        joints: &JointOrder,
        sending: Sending,
    ) -> Result<Self, RosError> {
        let topic = format!("{prefix}{}", command_topic(sending.interface));
        let joint_count = joints.names().len();
        let guards = guards::subscribe(setup.node, setup.contract, prefix)?;
        let (publisher, rival) = with_command!(sending.interface, M => {
            let zeros = M::create(vec![0.0; joint_count], joints.names(), sending.period);
            Self::publisher(setup, &topic, sending, &guards, zeros)?
        });
        Ok(Self { publisher, joint_count, guards, heard: AtomicBool::new(false), rival })
    }

    /// Creates the publisher, and the [`Rival`] that detects other publishers on `topic`. `zeros` is a command of zeros; later
    /// commands are written into its memory.
    fn publisher<M: Command + Clone>(
        NodeSetup { node, contract, .. }: &mut NodeSetup,
        topic: &str,
        sending: Sending,
        guards: &GuardStatuses,
        zeros: M,
    ) -> Result<(Box<dyn CommandPublisher>, Arc<Rival>), RosError> {
        let publisher = match sending.in_time {
            true => node.publisher_in_time(contract, topic)?,
            false => node.publisher(contract, topic)?,
        };
        let rival = Rival::watch(node, contract, &publisher, topic, guards.clone())?;
        let message = Mutex::new(Arc::new(zeros.clone()));
        let standstill = (!sending.interface.takes_positions()).then(|| Arc::new(zeros));
        Ok((Box::new(MessagePublisher { publisher, message, standstill }), rival))
    }

    fn publishing(&self) -> &Publishing {
        self.publisher.publishing()
    }

    /// Returns the number of subscribers other than guards.
    fn readers(&self) -> usize {
        self.publishing().readers().saturating_sub(self.guards.publishers())
    }

    /// Returns the number of other publishers of commands, without guards.
    fn rivals(&self) -> usize {
        self.publishing().other_publishers().saturating_sub(self.guards.publishers())
    }
}

/// How many zero commands [`Commands::end`] sends, spread over [`SHORTEST_FINAL_ZEROS`].
const ZEROS_AT_THE_END: u32 = 10;

impl Commands {
    /// Creates the publishers of the node. Each element of `arms` has the joints of one arm.
    pub fn new(setup: &mut NodeSetup, arms: &[JointOrder], sending: Sending) -> Result<Self, RosError> {
        let each = setup.kind.arms().iter().zip(arms);
        let arms = each.map(|(prefix, joints)| ArmCommands::new(setup, prefix, joints, sending));
        let arms = arms.collect::<Result<_, RosError>>()?;
        Ok(Self { arms, begun: AtomicBool::new(false), ended: AtomicBool::new(false) })
    }

    /// Sends each arm its part of the command, or stops the arms if [`end`](Self::end) was called. If `end` is called while this
    /// function runs, the last command that is sent stops the arms.
    pub fn publish(&self, command: &[f64]) {
        self.begun.store(true, Ordering::SeqCst);
        if !self.has_ended() {
            let mut rest = command;
            for arm in &self.arms {
                let (part, others) = rest.split_at(arm.joint_count);
                arm.publisher.publish(part);
                rest = others;
            }
        }
        if self.has_ended() {
            self.stand();
        }
    }

    /// Stops the arms at once: sends zero velocities. Arms that take positions get no command, because they hold their last
    /// positions.
    pub fn stand(&self) {
        self.arms.iter().for_each(|arm| arm.publisher.stand());
    }

    /// Returns whether [`end`](Self::end) was called, after which only zeros are sent.
    pub fn has_ended(&self) -> bool {
        self.ended.load(Ordering::SeqCst)
    }

    /// Sends zeros for [`SHORTEST_FINAL_ZEROS`], even if the cycle sends commands or hangs. Sends nothing if no command was sent
    /// before. Blocks all later commands of the cycle.
    pub fn end(&self) {
        self.ended.store(true, Ordering::SeqCst);
        if !self.begun.load(Ordering::SeqCst) {
            return;
        }
        for _ in 0..ZEROS_AT_THE_END {
            self.stand();
            std::thread::sleep(SHORTEST_FINAL_ZEROS / ZEROS_AT_THE_END);
        }
    }

    /// Returns for each arm the full name of the command topic and the number of subscribers.
    pub fn readers(&self) -> impl Iterator<Item = (&str, usize)> {
        self.arms.iter().map(|arm| (arm.publishing().topic(), arm.readers()))
    }

    /// Checks for subscribers. The check takes a lock that discovery uses too, so the cycle does not call this function.
    pub fn update_readers(&self) {
        self.arms.iter().for_each(|arm| arm.heard.store(arm.readers() > 0, Ordering::Relaxed));
    }

    /// Returns whether arm number `arm` had a subscriber at the last check.
    pub fn are_heard(&self, arm: usize) -> bool {
        self.arms.get(arm).is_some_and(|arm| arm.heard.load(Ordering::Relaxed))
    }

    /// Returns whether another publisher sends commands to arm number `arm`.
    pub fn are_contended(&self, arm: usize) -> bool {
        self.arms.get(arm).is_some_and(|arm| arm.rival.is_there())
    }

    /// Returns publisher number `number` of the commands to arm number `arm`. Number 0 is this node. Number 1 is the other node
    /// that sends commands to the arm; `None` if there is no such node.
    pub fn publisher(&self, arm: usize, number: u32) -> Option<EndpointId> {
        let arm = self.arms.get(arm)?;
        if number == 0 { Some(arm.publishing().id()) } else { arm.rival.publisher() }
    }

    /// Returns the full name of the command topic of arm number `arm`.
    pub fn topic(&self, arm: usize) -> &str {
        self.arms.get(arm).map_or("", |arm| arm.publishing().topic())
    }

    /// Returns the number of commands that were dropped because the writer was full or the commands would have had to wait.
    pub fn dropped(&self) -> u64 {
        self.arms.iter().map(|arm| arm.publishing().dropped()).sum()
    }

    /// Returns a warning if other nodes publish commands too.
    pub fn rivals(&self) -> Option<String> {
        let arm = self.arms.iter().find(|arm| arm.rivals() > 0)?;
        Some(rivalry(arm.publishing().topic(), arm.rivals() + 1))
    }

    /// Returns for each arm the subscription to the statuses of its guards.
    pub fn guards(&self) -> impl Iterator<Item = GuardStatuses> {
        self.arms.iter().map(|arm| arm.guards.clone())
    }
}

/// Returns a function that must be called when the cycle has ended or panicked. If the cycle failed, the returned function sends
/// zeros. Then it passes the outcome to `end`.
pub(super) fn on_end(
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
    use dq_messages::messages::Float64MultiArray;
    use dq_ros::alone::{node, outside};
    use dq_ros::ros::{Node, Subscription};
    use dq_wire::{Contract, ServoKind};
    use std::ops::ControlFlow;
    use std::sync::OnceLock;
    use std::time::Duration;

    async fn received(commands: &Subscription<Float64MultiArray>) -> Vec<f64> {
        let next = tokio::time::timeout(Duration::from_secs(10), commands.next()).await;
        next.expect("a command").data
    }

    const PERIOD: Duration = Duration::from_millis(2);

    fn commands(node: &mut Node, contract: &Contract) -> Commands {
        let arms = [JointOrder::new(vec!["one".to_owned(), "other".to_owned()])];
        let sending = Sending { interface: Interface::Velocity, period: PERIOD, in_time: true };
        let mut setup = NodeSetup { node, kind: ServoKind::OneArm, contract: &contract.servo };
        Commands::new(&mut setup, &arms, sending).unwrap()
    }

    /// A publisher that is slow: each `publish` calls [`Commands::end`] before it sends the command. Records whether the last
    /// message was zeros.
    struct DelayedPublisher {
        commands: Arc<OnceLock<Arc<Commands>>>,
        stands: Arc<AtomicBool>,
    }

    impl CommandPublisher for DelayedPublisher {
        fn publish(&self, _: &[f64]) {
            self.commands.get().unwrap().end();
            self.stands.store(false, Ordering::Relaxed);
        }

        fn stand(&self) {
            self.stands.store(true, Ordering::Relaxed);
        }

        fn publishing(&self) -> &Publishing {
            unreachable!()
        }
    }

    #[tokio::test(flavor = "multi_thread")]
    async fn a_command_that_is_held_up_until_the_end_is_not_the_last() {
        if outside("commands::tests::a_command_that_is_held_up_until_the_end_is_not_the_last") {
            return;
        }
        let (_one, mut node) = node("servo");
        let mut commands = commands(&mut node, &Contract::builtin().unwrap());
        let (ending, stands) = (Arc::new(OnceLock::new()), Arc::new(AtomicBool::new(false)));
        commands.arms[0].publisher =
            Box::new(DelayedPublisher { commands: ending.clone(), stands: stands.clone() });
        let commands = ending.get_or_init(|| Arc::new(commands));
        commands.publish(&[0.5, -0.5]);
        assert!(stands.load(Ordering::Relaxed));
    }

    /// Runs a cycle that sends commands until `end` breaks it. Returns the last command and the outcome.
    async fn ends(end: impl Fn() -> ControlFlow<Outcome> + Send + 'static) -> (Vec<f64>, Outcome) {
        let ((_one, mut node), (_other, mut robot)) = (node("servo"), node("robot"));
        let contract = Contract::builtin().unwrap();
        let commands = Arc::new(commands(&mut node, &contract));
        let heard = robot.subscription(&contract.plant, "forward_velocity_controller/commands").unwrap();
        let (sender, mut outcome) = watch::channel(None);
        let (go, may_end) = (Arc::new(AtomicBool::new(false)), commands.clone());
        let asked = go.clone();
        let tick = move |_| {
            may_end.publish(&[0.5, -0.5]);
            if asked.load(Ordering::Relaxed) { end() } else { ControlFlow::Continue(()) }
        };
        let on_end = on_end(commands.clone(), sender);
        cycle_thread::spawn("servo", Schedule { period: PERIOD, realtime_priority: 0 }, tick, on_end)
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
        if outside("commands::tests::a_cycle_that_panics_in_motion_leaves_zeros_and_the_reason") {
            return;
        }
        let (last, outcome) = ends(|| panic!("by zero")).await;
        assert_eq!(last, [0.0, 0.0]);
        assert_eq!(outcome, Err(ShutdownError::Failed("by zero".to_owned())));
    }

    #[tokio::test(flavor = "multi_thread")]
    async fn a_cycle_that_cannot_go_on_leaves_zeros_and_the_reason() {
        if outside("commands::tests::a_cycle_that_cannot_go_on_leaves_zeros_and_the_reason") {
            return;
        }
        let failed = Err(ShutdownError::Failed("no such joint".to_owned()));
        let why = failed.clone();
        assert_eq!(ends(move || ControlFlow::Break(why.clone())).await, (vec![0.0, 0.0], failed));
    }
}
