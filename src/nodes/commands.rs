//! The commands to all arms. Whatever ends the cycle that makes them, a panic or a hang too, the last velocities are zeros; of positions
//! the last ones stay, which is to stand too.

use super::guards::{self, GuardStatuses};
use super::rivals::Rival;
use super::shutdown::{Outcome, SHORTEST_FINAL_ZEROS, ShutdownError};
use super::wiring::Wiring;
use dq_core::servo::{Interface, JointOrder};
use dq_messages::messages::Message;
use dq_ros::ros::{EndpointId, Publisher, Publishing, RosError};
use dq_wire::rivalry;
use dq_wire::{Command, Rewrite, command_array, command_topic, command_trajectory};
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
    outlet: Box<dyn Outlet>,
    joint_count: usize,
    guards: GuardStatuses,
    /// Whether anybody subscribed that is no guard, when it was last looked.
    heard: AtomicBool,
    /// Who else sends commands to it.
    rival: Arc<Rival>,
}

/// A publisher of commands of whatever type the arm's controller takes.
trait Outlet: Send + Sync {
    /// Sends these numbers.
    fn publish(&self, numbers: &[f64]);
    /// Lets the arm stand, also where the cycle hangs while it publishes.
    fn stand(&self);
    fn publishing(&self) -> &Publishing;
}

/// A publisher of commands of one type, and the message that each of them is written into.
struct Sent<M: Message> {
    publisher: Publisher<M>,
    /// Nobody but the cycle holds it.
    message: Mutex<Arc<M>>,
    /// What an arm stands by that would else move on; one that takes positions stands where it was sent last.
    standstill: Option<Arc<M>>,
}

impl<M: Message + Rewrite> Outlet for Sent<M> {
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

/// How commands are sent.
#[derive(Clone, Copy)]
pub(super) struct Sending {
    pub interface: Interface,
    /// One a period.
    pub period: Duration,
    /// Whether those that would wait behind others are dropped, as of a cycle that may run ahead of DDS's threads.
    pub in_time: bool,
}

impl ArmCommands {
    /// Of an arm with these `joints` whose topics begin with `prefix`.
    fn new(
        wiring: &mut Wiring,
        prefix: &str,
        joints: &JointOrder,
        sending: Sending,
    ) -> Result<Self, RosError> {
        let topic = format!("{prefix}{}", command_topic(sending.interface));
        let joint_count = joints.names().len();
        let zeros = vec![0.0; joint_count];
        let guards = guards::subscribe(wiring.node, wiring.contract, prefix)?;
        let (outlet, rival): (Box<dyn Outlet>, _) = match sending.interface {
            Interface::Velocity | Interface::Position => {
                let moves_on = !sending.interface.takes_positions();
                let standstill = moves_on.then(|| command_array(zeros.clone()));
                Self::outlet(wiring, &topic, sending, &guards, command_array(zeros), standstill)?
            }
            Interface::Trajectory => {
                let message = command_trajectory(joints.names().to_vec(), zeros, sending.period);
                Self::outlet(wiring, &topic, sending, &guards, message, None)?
            }
        };
        Ok(Self { outlet, joint_count, guards, heard: AtomicBool::new(false), rival })
    }

    /// The publisher that writes into `message`, and who else may send such commands.
    fn outlet<M: Command + Rewrite>(
        Wiring { node, contract, .. }: &mut Wiring,
        topic: &str,
        sending: Sending,
        guards: &GuardStatuses,
        message: M,
        standstill: Option<M>,
    ) -> Result<(Box<dyn Outlet>, Arc<Rival>), RosError> {
        let publisher = match sending.in_time {
            true => node.publisher_in_time(contract, topic)?,
            false => node.publisher(contract, topic)?,
        };
        let rival = Rival::watch(node, contract, &publisher, topic, guards.clone())?;
        let (message, standstill) = (Mutex::new(Arc::new(message)), standstill.map(Arc::new));
        Ok((Box::new(Sent { publisher, message, standstill }), rival))
    }

    fn publishing(&self) -> &Publishing {
        self.outlet.publishing()
    }

    /// How many subscribe that are no guards.
    fn readers(&self) -> usize {
        self.publishing().readers().saturating_sub(self.guards.publishers())
    }

    /// How many others publish that are no guards.
    fn rivals(&self) -> usize {
        self.publishing().other_publishers().saturating_sub(self.guards.publishers())
    }
}

/// At the end so many zeros are sent, over [`SHORTEST_FINAL_ZEROS`].
const ZEROS_AT_THE_END: u32 = 10;

impl Commands {
    /// The publishers of the node, for arms with these joints.
    pub fn new(wiring: &mut Wiring, arms: &[JointOrder], sending: Sending) -> Result<Self, RosError> {
        let each = wiring.kind.arms().iter().zip(arms);
        let arms = each.map(|(prefix, joints)| ArmCommands::new(wiring, prefix, joints, sending));
        let arms = arms.collect::<Result<_, RosError>>()?;
        Ok(Self { arms, begun: AtomicBool::new(false), ended: AtomicBool::new(false) })
    }

    /// To each arm its part of the command; where it has ended, arms are to stand. It may end while this publishes: the last word is to
    /// stand then too.
    pub fn publish(&self, command: &[f64]) {
        self.begun.store(true, Ordering::SeqCst);
        if !self.has_ended() {
            let mut rest = command;
            for arm in &self.arms {
                let (part, others) = rest.split_at(arm.joint_count);
                arm.outlet.publish(part);
                rest = others;
            }
        }
        if self.has_ended() {
            self.stand();
        }
    }

    /// Lets the arms stand at once.
    pub fn stand(&self) {
        self.arms.iter().for_each(|arm| arm.outlet.stand());
    }

    /// Whether nothing but zeros is sent any more.
    pub fn has_ended(&self) -> bool {
        self.ended.load(Ordering::SeqCst)
    }

    /// Sends zeros, now and for a moment, whatever the cycle does meanwhile; nothing else is sent any more.
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

    /// Of each arm, the full name of its topic and how many subscribe to it.
    pub fn readers(&self) -> impl Iterator<Item = (&str, usize)> {
        self.arms.iter().map(|arm| (arm.publishing().topic(), arm.readers()))
    }

    /// Looks who subscribes to them. That takes a lock which discovery holds too, so it is not the cycle's to do.
    pub fn look_for_readers(&self) {
        self.arms.iter().for_each(|arm| arm.heard.store(arm.readers() > 0, Ordering::Relaxed));
    }

    /// Whether anybody subscribed to the commands for the arm number `arm` when it was last looked.
    pub fn are_heard(&self, arm: usize) -> bool {
        self.arms.get(arm).is_some_and(|arm| arm.heard.load(Ordering::Relaxed))
    }

    /// Whether anyone else sends commands to the arm number `arm`.
    pub fn are_contended(&self, arm: usize) -> bool {
        self.arms.get(arm).is_some_and(|arm| arm.rival.is_there())
    }

    /// Who sends commands to the arm number `arm`: 0 is this node, 1 its rival.
    pub fn publisher(&self, arm: usize, number: u32) -> Option<EndpointId> {
        let arm = self.arms.get(arm)?;
        if number == 0 { Some(arm.publishing().id()) } else { arm.rival.publisher() }
    }

    /// The full name of the commands' topic for the arm number `arm`.
    pub fn topic(&self, arm: usize) -> &str {
        self.arms.get(arm).map_or("", |arm| arm.publishing().topic())
    }

    /// Commands that found no room in a writer, or would have waited in it.
    pub fn dropped(&self) -> u64 {
        self.arms.iter().map(|arm| arm.publishing().dropped()).sum()
    }

    /// What to say where others publish commands too.
    pub fn rivals(&self) -> Option<String> {
        let arm = self.arms.iter().find(|arm| arm.rivals() > 0)?;
        Some(rivalry(arm.publishing().topic(), arm.rivals() + 1))
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
        let mut wiring = Wiring { node, kind: ServoKind::OneArm, contract: &contract.servo };
        Commands::new(&mut wiring, &arms, sending).unwrap()
    }

    /// A publisher that is held up: all has ended before its first command is sent. It keeps whether it sent zeros last.
    struct HeldUp {
        commands: Arc<OnceLock<Arc<Commands>>>,
        stands: Arc<AtomicBool>,
    }

    impl Outlet for HeldUp {
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
        commands.arms[0].outlet = Box::new(HeldUp { commands: ending.clone(), stands: stands.clone() });
        let commands = ending.get_or_init(|| Arc::new(commands));
        commands.publish(&[0.5, -0.5]);
        assert!(stands.load(Ordering::Relaxed));
    }

    /// A cycle that sends `command` until `end`, and what came of it: the last command, and the outcome.
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
