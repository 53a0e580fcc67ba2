//! The guard node: watches the commands to one arm, and stops the arm if the commands cease while the arm moves.

use super::cycle_thread::{CycleThread, Schedule, Tick};
use super::parameters::CYCLE_ENDED;
use super::throttle::Throttle;
use super::{NodeError, Prepared, shutdown};
use dq_check::Guard;
use dq_config::{GuardParameters, NodeParameters};
use dq_core::servo::JointOrder;
use dq_messages::messages::*;
use dq_messages::{Direction, NodeContract};
use dq_ros::ros::{Logger, Node, ParameterServer, Publisher, RosError, Session, Subscription};
use dq_wire::{Command, Contract, KeyValues, command_topic, with_command};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, channel};
use std::time::Duration;
use tokio::sync::watch;

/// The interval of the guard's checks. It is short compared with the time within which the guard must stop an arm.
const PERIOD: Duration = Duration::from_millis(5);

/// How often the guard publishes its status.
const STATUS_INTERVAL: Duration = Duration::from_millis(100);

/// The shortest time between two warnings of missing joint states.
const WARNING_INTERVAL: Duration = Duration::from_secs(10);

/// The duration of the trajectory that stops the arm.
const STAND: Duration = Duration::from_millis(20);

/// How long the guard waits after it is asked to end, before it logs that it still watches a moving arm. At the end of a launch, the
/// servo and the guard are asked to end together, and the servo still sends a few commands. These commands are normal, so the guard
/// does not log during this time.
const SERVO_ENDS: Duration = Duration::from_millis(500);

/// A running guard node.
pub struct GuardNode {
    cycle: CycleThread,
    /// Whether the arm would move on without the guard: the last command moves the arm, and the guard has not finished a stop
    /// since.
    needed: watch::Receiver<bool>,
    joint_states: Arc<Subscription<JointState>>,
    node: Node,
}

impl GuardNode {
    /// Starts the node on `session`.
    ///
    /// # Errors
    /// [`NodeError`] if the network or the operating system fails.
    pub fn start(session: &Session, prepared: Prepared<GuardParameters>) -> Result<Self, NodeError> {
        let Prepared { names, store, parameters, logging, warnings } = prepared;
        let contract = Contract::builtin()?.guard;
        let mut node = session.node(names, logging)?;
        warnings.iter().for_each(|warning| node.log().warn(warning));
        let (timeouts, inbox) = channel();
        ParameterServer::start(
            &mut node,
            &contract,
            store,
            Box::new(move |store, _| {
                let parameters = GuardParameters::from_store(store).map_err(|why| why.to_string())?;
                timeouts.send(parameters.command_timeout).map_err(|_| CYCLE_ENDED.to_owned())
            }),
        )?;
        let schedule = Schedule { period: PERIOD, realtime_priority: parameters.realtime_priority };
        let (needed, is_needed) = watch::channel(false);
        let mut watch = Watch::new(&mut node, &contract, parameters, inbox, needed)?;
        node.log().info(&format!("watching {}", watch.commands.topic()));
        let joint_states = watch.joint_states.clone();
        let cycle = CycleThread::start("guard", schedule, move |tick| watch.tick(tick))?;
        Ok(Self { cycle, needed: is_needed, joint_states, node })
    }

    /// Waits until the arm no longer needs the guard, and then ends the node. If the servo was killed just before, for example at the
    /// end of a launch, the guard still stops the arm.
    ///
    /// Returns false if the arm still needs the guard after the longest time that the shutdown of a servo takes.
    pub async fn shut_down(mut self) -> bool {
        if tokio::time::timeout(SERVO_ENDS, self.needed.wait_for(|needed| !needed)).await.is_err() {
            self.node
                .log()
                .info("asked to end while the arm is commanded to move: it is watched until it stands");
        }
        let stands = self.needed.wait_for(|needed| !needed);
        let stands = tokio::time::timeout(shutdown::PATIENCE, stands).await;
        matches!(stands, Ok(Ok(_)))
    }

    /// Returns whether nobody publishes the arm's joint states, so that the guard still waits for the robot.
    pub fn waits_for_robot(&self) -> bool {
        self.joint_states.publishers() == 0
    }

    /// Returns whether the guard is running. It runs until this value is dropped, unless it panics.
    pub fn is_running(&self) -> bool {
        self.cycle.is_running()
    }
}

/// The commands to the arm. Their message type depends on the arm's controller.
trait Commands: Send {
    fn topic(&self) -> &str;
    /// Gives `guard` the commands of all publishers other than guards.
    fn hear(&self, guard: &mut Guard, joints: &[String], now: Duration);
    /// Sends a command that stops the arm.
    fn send(&self, numbers: &[f64], joints: &[String]);
}

/// The commands of one type: the subscription to the servo's commands, and the publisher of the guard's own commands.
struct Channel<M: Message> {
    watched: Subscription<M>,
    sent: Publisher<M>,
}

impl<M: Command> Channel<M> {
    fn new(node: &mut Node, contract: &NodeContract, topic: &str) -> Result<Self, RosError> {
        let entry = contract.topic::<M>(topic, Direction::Out)?.clone();
        Ok(Self { watched: node.subscription_as(&entry, topic)?, sent: node.publisher_as(&entry, topic)? })
    }
}

impl<M: Command> Commands for Channel<M> {
    fn topic(&self) -> &str {
        self.sent.topic()
    }

    fn hear(&self, guard: &mut Guard, joints: &[String], now: Duration) {
        self.watched.each(|command, _| {
            if !command.is_of_guard() {
                let numbers = command.target(joints).map(|(numbers, _)| numbers);
                guard.hear(&numbers.unwrap_or_default(), now);
            }
        });
    }

    fn send(&self, numbers: &[f64], joints: &[String]) {
        self.sent.publish(M::create(numbers.to_vec(), joints, STAND).of_guard());
    }
}

/// The state of the guard's thread.
struct Watch {
    guard: Guard,
    joints: JointOrder,
    /// Receives the new command timeout when its parameter is changed.
    inbox: Receiver<Duration>,
    joint_states: Arc<Subscription<JointState>>,
    commands: Box<dyn Commands>,
    status: Publisher<DiagnosticStatus>,
    status_due: Throttle,
    node: String,
    stops: u64,
    warning_due: Throttle,
    needed: watch::Sender<bool>,
    log: Logger,
}

impl Watch {
    fn new(
        node: &mut Node,
        contract: &NodeContract,
        parameters: GuardParameters,
        inbox: Receiver<Duration>,
        needed: watch::Sender<bool>,
    ) -> Result<Self, RosError> {
        let GuardParameters { joints, interface, command_timeout, .. } = parameters;
        // Create this publisher first, so that the servo knows the guard before the servo discovers the guard's command publisher.
        let status = node.publisher(contract, "command_guard")?;
        let topic = command_topic(interface);
        let commands: Box<dyn Commands> =
            with_command!(interface, M => Box::new(Channel::<M>::new(node, contract, topic)?));
        Ok(Self {
            guard: Guard::new(interface, joints.names().len(), command_timeout),
            joints,
            inbox,
            joint_states: Arc::new(node.adapting_subscription(contract, "joint_states")?),
            commands,
            status,
            status_due: Throttle::new(STATUS_INTERVAL),
            node: node.name().fully_qualified(),
            stops: 0,
            warning_due: Throttle::new(WARNING_INTERVAL),
            needed,
            log: node.log().clone(),
        })
    }

    fn tick(&mut self, tick: Tick) {
        self.inbox.try_iter().for_each(|timeout| self.guard.set_timeout(timeout));
        let Self { guard, joints, joint_states, .. } = self;
        // Ignore joint states without positions for the arm's joints, and damaged messages.
        joint_states.each(|state, _| {
            let mut positions = vec![0.0; joints.names().len()];
            if joints.positions(&state.name, &state.position, &mut positions).is_ok() {
                guard.measure(&positions, tick.now);
            }
        });
        self.commands.hear(guard, joints.names(), tick.now);
        if let Some(command) = guard.step(tick.now) {
            self.commands.send(command, joints.names());
        }
        if guard.stops() > self.stops {
            self.stops = guard.stops();
            self.log.warn(&format!(
                "commands on {} ended during a motion: the guard stops the arm",
                self.commands.topic()
            ));
        }
        let is_needed = self.guard.is_needed();
        self.needed.send_if_modified(|needed| std::mem::replace(needed, is_needed) != is_needed);
        if self.guard.hears(tick.now) {
            // A guard that receives no joint states must not report that it is watching.
            if self.status_due.is_due(tick.now) {
                self.publish_status();
            }
        } else if is_needed && self.warning_due.is_due(tick.now) {
            self.log.warn(&format!(
                "no {} for half of command_timeout: the guard cannot tell whether commands have ended, and sends nothing",
                self.joint_states.topic()
            ));
        }
    }

    fn publish_status(&self) {
        let mut values = KeyValues::default();
        values.add("commands", self.commands.topic());
        values.add("stops", self.guard.stops());
        let stopping = self.guard.is_stopping();
        let message = if stopping { "stopping" } else { "watching" };
        self.status.publish(values.status(stopping, &self.node, message.to_owned()));
    }
}
