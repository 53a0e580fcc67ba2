//! The commands to all arms. Whatever ends the cycle that makes them, a panic or a hang too, the last ones are zeros.

use super::shutdown::{Outcome, SHORTEST_FAREWELL, ShutdownError};
use crate::ros::{Node, Publisher, RosError};
use crate::wire::NodeContract;
use crate::wire::Wiring;
use crate::wire::messages::{Float64MultiArray, MultiArrayDimension, MultiArrayLayout};
use crate::wire::status::rivalry;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use tokio::sync::watch;

/// The publishers of commands. They outlive the cycle.
pub(super) struct Commands {
    /// To each arm, and how many joints it has.
    arms: Vec<(Publisher<Float64MultiArray>, usize)>,
    /// Whether any command was sent: before, even zeros might be a step for a robot that another servo moves.
    begun: AtomicBool,
    ended: AtomicBool,
}

/// At the end so many zeros are sent, over [`SHORTEST_FAREWELL`].
const ZEROS_AT_THE_END: u32 = 10;

impl Commands {
    /// The publishers of the node, for arms of so many joints.
    pub fn new<T: Wiring>(
        node: &mut Node,
        contract: &NodeContract,
        joint_counts: &[usize],
    ) -> Result<Self, RosError> {
        let mut arms = Vec::new();
        for (arm, joint_count) in T::ARMS.iter().zip(joint_counts) {
            let topic = format!("{arm}forward_velocity_controller/commands");
            arms.push((node.publisher(contract, &topic)?, *joint_count));
        }
        Ok(Self { arms, begun: AtomicBool::new(false), ended: AtomicBool::new(false) })
    }

    /// To each arm its part of the command; zeros where it has ended.
    pub fn publish(&self, command: &[f64], label: &str) {
        self.begun.store(true, Ordering::Relaxed);
        let ended = self.has_ended();
        let mut rest = command;
        for (commands, joint_count) in &self.arms {
            let (part, others) = rest.split_at(*joint_count);
            let size = u32::try_from(*joint_count).unwrap_or(u32::MAX);
            let dim = vec![MultiArrayDimension { label: label.to_owned(), size, stride: size }];
            let data = if ended { vec![0.0; *joint_count] } else { part.to_vec() };
            commands.publish(Float64MultiArray { layout: MultiArrayLayout { dim, data_offset: 0 }, data });
            rest = others;
        }
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
        let zeros = vec![0.0; self.arms.iter().map(|(_, count)| count).sum()];
        for _ in 0..ZEROS_AT_THE_END {
            self.publish(&zeros, "");
            std::thread::sleep(SHORTEST_FAREWELL / ZEROS_AT_THE_END);
        }
    }

    /// Of each arm, the full name of its topic and how many subscribe to it.
    pub fn readers(&self) -> impl Iterator<Item = (&str, usize)> {
        self.arms.iter().map(|(commands, _)| (commands.topic(), commands.readers()))
    }

    /// The full name of the commands' topic for the arm number `arm`.
    pub fn topic(&self, arm: usize) -> &str {
        self.arms.get(arm).map_or("", |(commands, _)| commands.topic())
    }

    /// Commands that found no room in a writer.
    pub fn dropped(&self) -> u64 {
        self.arms.iter().map(|(commands, _)| commands.dropped()).sum()
    }

    /// What to say where others publish commands too.
    pub fn rivals(&self) -> Option<String> {
        let (commands, _) = self.arms.iter().find(|(commands, _)| commands.other_publishers() > 0)?;
        Some(rivalry(commands.topic(), commands.other_publishers() + 1))
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
    use super::super::{cycle_thread, shutdown};
    use super::*;
    use crate::ros::{Environment, LogLevel, Logging, Reach, Resolver, RosArgs, Session, Subscription};
    use crate::servo::OneArm;
    use crate::wire::Contract;
    use std::ops::ControlFlow;
    use std::time::Duration;

    /// Runs the test again, alone, in a network namespace that has nothing but loopback: false in there.
    fn outside(test: &str) -> bool {
        const INSIDE: &str = "DQ_SERVO_TEST_IN_A_NAMESPACE";
        if std::env::var_os(INSIDE).is_some() {
            return false;
        }
        let set_up = "ip link set lo up && ip link set lo multicast on && ip route add 224.0.0.0/4 dev lo";
        let mut command = std::process::Command::new("unshare");
        command.args(["--map-root-user", "--net", "sh", "-c", &format!("{set_up} && exec \"$@\"")]);
        command.arg("sh").arg(std::env::current_exe().unwrap()).args(["--exact", test, "--nocapture"]);
        let output = command.env(INSIDE, "yes").output().expect("util-linux's unshare");
        let log = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.success(), "{log}\n{}", String::from_utf8_lossy(&output.stdout));
        assert!(String::from_utf8_lossy(&output.stdout).contains("1 passed"), "the test has another name");
        true
    }

    fn node(name: &str) -> (Session, Node) {
        let environment = Environment { domain_id: 7, reach: Reach::Localhost, enclave: None };
        let session = Session::open(&environment).unwrap();
        let names = Resolver::new(name, &RosArgs::default()).unwrap();
        let node = session.node(names, Logging::new(&RosArgs::default(), LogLevel::Info)).unwrap();
        (session, node)
    }

    async fn received(commands: &Subscription<Float64MultiArray>) -> Vec<f64> {
        let next = tokio::time::timeout(Duration::from_secs(10), commands.next()).await;
        next.expect("a command").data
    }

    /// A cycle that sends `command` until `end`, and what came of it: the last command, and the outcome.
    async fn ends(end: impl Fn() -> ControlFlow<Outcome> + Send + 'static) -> (Vec<f64>, Outcome) {
        let ((_one, mut node), (_other, mut robot)) = (node("servo"), node("robot"));
        let contract = Contract::builtin().unwrap();
        let commands = Arc::new(Commands::new::<OneArm>(&mut node, &contract.servo, &[2]).unwrap());
        let heard = robot.subscription(&contract.plant, "forward_velocity_controller/commands").unwrap();
        let (sender, mut outcome) = watch::channel(None);
        let (go, may_end) = (Arc::new(AtomicBool::new(false)), commands.clone());
        let asked = go.clone();
        let tick = move |_| {
            may_end.publish(&[0.5, -0.5], "");
            if asked.load(Ordering::Relaxed) { end() } else { ControlFlow::Continue(()) }
        };
        let last_words = last_words(commands.clone(), sender);
        cycle_thread::spawn("servo", Duration::from_millis(2), tick, last_words).unwrap();
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
