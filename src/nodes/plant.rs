//! The plant node `puma560`: a kinematic arm that takes the place of the robot.

use super::complaint::WarningOnChange;
use super::cycle_thread::{CycleThread, Schedule, Tick};
use super::guards::{self, Guards};
use super::parameters::CYCLE_ENDED;
use super::requests::{self, Reply};
use super::throttle::Throttle;
use super::{NodeError, Prepared};
use dq_config::{ArmParameters, NodeParameters, PlantParameters};
use dq_core::servo::Interface;
use dq_description::{DescribedArm, DescribedJoint, Description, JointLimits};
use dq_kinematics::arm::{ArmError, Coupling};
use dq_messages::NodeContract;
use dq_messages::messages::*;
use dq_plant::{Measured, Plant, Realism};
use dq_ros::ros::{
    Clock, Logger, NameWatch, Node, ParameterServer, Publisher, RosError, Session, Subscription,
};
use dq_wire::{Command, Contract, command_topic, with_command};
use dq_wire::{KeyValues, rivalry, transform_message};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, channel};
use std::time::Duration;

/// A request to the cycle, from a change of parameters or from a service.
enum Request {
    Configure(Duration, Realism),
    Reset(Reply),
}

/// A running plant node.
pub struct PlantNode {
    cycle: CycleThread,
    _node: Node,
}

impl PlantNode {
    /// Starts the node on `session`.
    ///
    /// # Errors
    /// [`NodeError`] if the network or the operating system fails.
    pub fn start(session: &Session, prepared: Prepared<PlantParameters>) -> Result<Self, NodeError> {
        let Prepared { names, store, parameters, logging, mut warnings } = prepared;
        warnings.extend(parameters.beyond_limits());
        let PlantParameters {
            arm,
            initial_positions,
            limits,
            command_timeout,
            realism,
            interface,
            frame_prefix,
        } = parameters;
        let mut node = session.node(names, logging)?;
        warnings.iter().for_each(|warning| node.log().warn(warning));
        let (requests, inbox) = channel();
        let reset = requests.clone();
        node.serve_later::<Trigger, _>("~/reset", move |_| {
            let reset = reset.clone();
            async move {
                requests::ask(&reset, Request::Reset, "back to initial_positions", requests::PATIENCE).await
            }
        })?;
        ParameterServer::start(
            &mut node,
            &Contract::builtin()?.plant,
            store,
            Box::new(move |store, _| {
                let parameters = PlantParameters::from_store(store).map_err(|why| why.to_string())?;
                let request = Request::Configure(parameters.command_timeout, parameters.realism);
                requests.send(request).map_err(|_| CYCLE_ENDED.to_owned())
            }),
        )?;
        let schedule = Schedule { period: arm.period, realtime_priority: arm.realtime_priority };
        let mut plant = Plant::new(initial_positions, command_timeout);
        plant.set_realism(realism);
        let mut cycle = Cycle::new(&mut node, arm, limits, &frame_prefix, interface, plant, inbox)?;
        let joints = cycle.plant.positions().len();
        node.log().info(&format!("simulating {joints} joint{}", if joints == 1 { "" } else { "s" }));
        let cycle = CycleThread::start("plant", schedule, move |tick| cycle.tick(tick))?;
        Ok(Self { cycle, _node: node })
    }

    /// Returns whether the cycle is running. It runs until this value is dropped, unless it panics.
    pub fn is_running(&self) -> bool {
        self.cycle.is_running()
    }
}

/// The state of the cycle's thread.
struct Cycle {
    plant: Plant,
    /// The moving joints of the robot description, each with its coupling to the plant's joints.
    moving: Vec<(DescribedJoint, Coupling)>,
    joints: Vec<String>,
    inbox: Receiver<Request>,
    commands: Box<dyn Commands>,
    takes_positions: bool,
    guards: Guards,
    clock: Clock,
    /// The source of the measurement noise.
    random: ChaCha8Rng,
    joint_states: Publisher<JointState>,
    tf: Publisher<TFMessage>,
    /// The last messages. The next messages overwrite them.
    state: Arc<JointState>,
    transforms: Arc<TFMessage>,
    diagnostics: Publisher<DiagnosticArray>,
    // Publishers of messages that were sent once. Late joiners get these messages as long as the publishers live.
    _tf_static: Publisher<TFMessage>,
    _description: Publisher<StringMessage>,
    node: String,
    transforms_due: Throttle,
    diagnostics_due: Throttle,
    rejected: u64,
    rivals: WarningOnChange,
    name_watch: NameWatch,
    namesakes: WarningOnChange,
    warning_due: Throttle,
    log: Logger,
}

/// Receives the commands to the plant. The controller that the plant simulates determines their message type.
trait Commands: Send {
    /// Passes the newest command to `plant` at `now`. `joints` are the names of the plant's joints. Returns the reasons why
    /// commands were rejected.
    fn give(&self, plant: &mut Plant, takes_positions: bool, joints: &[String], now: Duration)
    -> Vec<String>;
    fn topic(&self) -> &str;
    /// Returns the number of publishers of commands.
    fn publishers(&self) -> usize;
}

impl<M: Command> Commands for Subscription<M> {
    fn give(
        &self,
        plant: &mut Plant,
        takes_positions: bool,
        joints: &[String],
        now: Duration,
    ) -> Vec<String> {
        let newest = self.newest();
        let mut take = |command: M| {
            let (numbers, time) =
                command.target(joints).ok_or("a trajectory without a position for each joint")?;
            let taken = match takes_positions {
                true => plant.take_positions(&numbers, now, time),
                false => plant.take_command(&numbers, now),
            };
            taken.map_err(|why| why.to_string())
        };
        let mut bad = newest.malformed;
        bad.extend(newest.message.and_then(|command| take(command).err()));
        bad
    }

    fn topic(&self) -> &str {
        self.topic()
    }

    fn publishers(&self) -> usize {
        self.publishers()
    }
}

/// Subscribes to the commands for a controller of this kind.
fn subscribe(
    node: &mut Node,
    contract: &NodeContract,
    interface: Interface,
) -> Result<Box<dyn Commands>, RosError> {
    let topic = command_topic(interface);
    Ok(with_command!(interface, M => Box::new(node.subscription::<M>(contract, topic)?)))
}

/// The interval at which transforms are published (50 Hz).
const TRANSFORM_INTERVAL: Duration = Duration::from_millis(20);

/// The interval at which diagnostics are published (1 Hz).
const DIAGNOSTICS_INTERVAL: Duration = Duration::from_secs(1);

impl Cycle {
    fn new(
        node: &mut Node,
        arm: ArmParameters,
        limits: Vec<JointLimits>,
        frame_prefix: &str,
        interface: Interface,
        plant: Plant,
        inbox: Receiver<Request>,
    ) -> Result<Self, NodeError> {
        let contract = Contract::builtin()?.plant;
        let description: Publisher<StringMessage> = node.publisher(&contract, "robot_description")?;
        let robot = node.name().fully_qualified().trim_start_matches('/').replace('/', "_");
        let (described, data) = match &arm.description {
            Some(description) => description.clone(),
            None => describe_rows(&robot, &arm, limits)?,
        };
        description.publish(StringMessage { data });
        let tf_static: Publisher<TFMessage> = node.publisher(&contract, "/tf_static")?;
        let clock = Clock::new(node, &contract, arm.simulated_time)?;
        let at_start = |joint: &DescribedJoint| transform(joint, &clock, frame_prefix);
        let (mut moving, mut standing) = (Vec::new(), Vec::new());
        for joint in described.arm.joints.iter().chain(&described.beside) {
            match described.arm.coupling(joint) {
                Some(coupling) => moving.push((joint.clone(), coupling)),
                None => standing.push(at_start(joint)),
            }
        }
        // Joints that do not move are published once.
        tf_static.publish(TFMessage { transforms: standing });
        let transforms = moving.iter().map(|(joint, _)| at_start(joint)).collect();
        let transforms = Arc::new(TFMessage { transforms });
        Ok(Self {
            plant,
            moving,
            state: Arc::new(JointState { name: arm.joints.clone(), ..JointState::default() }),
            transforms,
            joints: arm.joints,
            inbox,
            commands: subscribe(node, &contract, interface)?,
            takes_positions: interface.takes_positions(),
            guards: Guards::new(guards::subscribe(node, &contract, "")?),
            clock,
            random: ChaCha8Rng::seed_from_u64(0),
            joint_states: node.publisher(&contract, "joint_states")?,
            tf: node.publisher(&contract, "/tf")?,
            diagnostics: node.publisher(&contract, "/diagnostics")?,
            _tf_static: tf_static,
            _description: description,
            node: node.name().name().to_owned(),
            transforms_due: Throttle::new(TRANSFORM_INTERVAL),
            diagnostics_due: Throttle::new(DIAGNOSTICS_INTERVAL),
            rejected: 0,
            rivals: WarningOnChange::default(),
            name_watch: node.watch_name(&node.name().fully_qualified()),
            namesakes: WarningOnChange::default(),
            warning_due: Throttle::new(Duration::from_secs(1)),
            log: node.log().clone(),
        })
    }

    fn tick(&mut self, tick: Tick) {
        while let Ok(request) = self.inbox.try_recv() {
            match request {
                Request::Configure(timeout, realism) => {
                    self.plant.set_command_timeout(timeout);
                    self.plant.set_realism(realism);
                }
                Request::Reset(reply) => {
                    self.plant.reset();
                    self.log.info("reset: back to initial_positions");
                    reply.taken();
                }
            }
        }
        for why in self.commands.give(&mut self.plant, self.takes_positions, &self.joints, tick.now) {
            self.reject(tick.now, &why);
        }
        self.plant.step(tick.now);
        self.publish(tick.now);
    }

    /// Counts a rejected command, and logs a warning at most once per second.
    fn reject(&mut self, now: Duration, why: &str) {
        self.rejected += 1;
        if self.warning_due.is_due(now) {
            self.log.warn(&format!("command rejected: {why}"));
        }
    }

    fn publish(&mut self, now: Duration) {
        let random = &mut self.random;
        let noise = || 2.0 * f64::from(random.next_u32()) / f64::from(u32::MAX) - 1.0;
        if let Some(Measured { at, positions, velocities }) = self.plant.measure(now, noise) {
            let state = Arc::make_mut(&mut self.state);
            state.header.stamp = self.clock.now().before(now.saturating_sub(at));
            (state.position, state.velocity) = (positions, velocities);
            self.joint_states.publish(self.state.clone());
        }
        if self.diagnostics_due.is_due(now) {
            self.namesakes.warn(&self.log, self.name_watch.warning());
            self.publish_diagnostics(now);
        }
        if self.transforms_due.is_due(now) {
            let stamp = self.clock.now();
            let transforms = &mut Arc::make_mut(&mut self.transforms).transforms;
            let positions = self.plant.positions();
            for (message, (joint, coupling)) in transforms.iter_mut().zip(&self.moving) {
                let position = coupling.at(positions[coupling.driver]);
                message.header.stamp = stamp.clone();
                message.transform = transform_message(&joint.parent_from_child(position));
            }
            self.tf.publish(self.transforms.clone());
        }
    }

    /// Publishes the number of publishers and of rejected commands, with a warning if there is more than one publisher.
    fn publish_diagnostics(&mut self, now: Duration) {
        let guard = self.guards.look(now);
        // Guards also publish commands, and cause no warning.
        let publishers = self.commands.publishers().saturating_sub(self.guards.count());
        let rivals = (publishers > 1).then(|| rivalry(self.commands.topic(), publishers));
        self.rivals.warn(&self.log, rivals.clone());
        let mut values = KeyValues::default();
        values.add("publishers", publishers);
        values.add("guard", guard);
        values.add("rejected", self.rejected);
        let (warns, name) = (rivals.is_some(), format!("{}: commands", self.node));
        let status = values.status(warns, &name, rivals.unwrap_or_else(|| "ok".to_owned()));
        self.diagnostics.publish(DiagnosticArray { header: self.clock.header(""), status: vec![status] });
    }
}

/// Returns the robot description of an arm that is defined by DH rows, in two forms: parsed, and as URDF text.
fn describe_rows(
    robot: &str,
    arm: &ArmParameters,
    limits: Vec<JointLimits>,
) -> Result<(Description, String), ArmError> {
    let links: Vec<_> = (1..=arm.joints.len()).map(|i| format!("link{i}")).collect();
    let frames = [arm.base_frame.as_str(), arm.tool_frame.as_str()];
    let arm = DescribedArm::of_chain(&arm.chain, robot, &arm.joints, frames, &links)?.with_limits(limits);
    let text = arm.drawn_urdf();
    Ok((Description { arm, beside: Vec::new() }, text))
}

/// Returns the transform from a joint's parent link to its child link at the start position. Both link names get `frame_prefix`. In
/// the published robot description, the link names have no prefix: programs that read the description add the prefix themselves.
fn transform(joint: &DescribedJoint, clock: &Clock, frame_prefix: &str) -> TransformStamped {
    TransformStamped {
        header: clock.header(&format!("{frame_prefix}{}", joint.parent)),
        child_frame_id: format!("{frame_prefix}{}", joint.child),
        transform: transform_message(&joint.parent_from_child(joint.limits.start())),
    }
}
