//! The servo node, for one arm (`dq_servo`) or for two (`dq_dual_servo`).

use super::arm_input::{ArmInput, JointStates};
use super::commands::{Commands, Sending, on_end};
use super::cycle_thread::{self, Schedule, Tick};
use super::events::{EventsRecord, EventsTopic, ParameterRecord};
use super::frames::{Frames, Tree};
use super::in_force::InForce;
use super::node_setup::NodeSetup;
use super::outputs::Outputs;
use super::pictures::MomentSlot;
use super::report::Report;
use super::requests::Reply;
use super::ros_inputs::{Request, RosInputs, Sources};
use super::searcher::Searcher;
use super::senders::{Clocks, Senders};
use super::shutdown::{self, Outcome, ShutdownError, Step};
use super::snapshot::{ReportEnded, Snapshot, Snapshots};
use super::wrench_input::WrenchInput;
use super::{NodeError, Prepared, arm_input, description, keep_outs, pictures, requests, snapshot, two_arms};
use dq_config::ServoParameters;
use dq_core::servo::{GoalFrames, Servo};
use dq_messages::messages::*;
use dq_params::{ParameterStore, Value};
use dq_ros::ros::{Clock, Node, ParameterServer, RosError, Session};
use dq_wire::{Contract, CycleTiming, ServoKind};
use std::ops::ControlFlow;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};
use tokio::sync::watch;

/// A running servo node. End the node with [`shut_down`](Self::shut_down). If this value is dropped, the node sends zeros at once.
pub struct ServoNode {
    requests: Sender<Request>,
    commands: Arc<Commands>,
    /// The outcome of the cycle; `None` until the cycle has ended.
    outcome: watch::Receiver<Option<Outcome>>,
    report: JoinHandle<()>,
    /// The subscriptions to the joint states of each arm.
    joint_states: Vec<JointStates>,
    _node: Node,
}

impl ServoNode {
    /// Starts the node on `session`.
    ///
    /// # Errors
    /// [`NodeError`] if the network or the operating system fails.
    pub fn start(session: &Session, prepared: Prepared<ServoParameters>) -> Result<Self, NodeError> {
        let Assembled { mut node, mut cycle, joint_states, report, snapshots, requests, schedule } =
            Assembled::new(session, prepared)?;
        let commands = cycle.commands.clone();
        let period = schedule.period.as_secs_f64() * 1e3;
        node.log().info(&format!("cycle of {period} ms, waiting for joint states"));
        serve_requests(&mut node, &requests)?;
        if cycle.live.takes_wrenches() {
            serve_contact(&mut node, &requests);
        }
        let report = report.spawn(snapshots)?;
        let (end, outcome) = watch::channel(None);
        let on_end = on_end(commands.clone(), end);
        cycle_thread::spawn("servo", schedule, move |tick| cycle.tick(tick), on_end)?;
        Ok(Self { requests, commands, outcome, report, joint_states, _node: node })
    }
}

/// A node whose threads do not run yet.
pub(super) struct Assembled {
    node: Node,
    pub cycle: Cycle,
    joint_states: Vec<JointStates>,
    pub report: Report,
    pub snapshots: Receiver<Snapshot>,
    requests: Sender<Request>,
    schedule: Schedule,
}

impl Assembled {
    pub fn new(session: &Session, prepared: Prepared<ServoParameters>) -> Result<Self, NodeError> {
        let Prepared { names, store, parameters, logging, warnings } = prepared;
        let servo = parameters.build()?;
        let kind = ServoKind::of(&parameters.arms);
        two_arms::check(&names, kind, &parameters)?;
        let ServoParameters {
            arms: controlled,
            joints,
            goal_frame,
            tool_frame,
            settings,
            idle_keep_outs,
            joint_states,
            period,
            realtime_priority,
            simulated_time,
        } = parameters;
        let contract = kind.contract(Contract::builtin()?);
        let mut node = session.node(names, logging)?;
        warnings.iter().for_each(|warning| node.log().warn(warning));
        let names = kind.joint_names(&joints);
        description::watch(&mut node, &contract, &store)?;
        let (requests, inbox) = channel();
        let sending = Sending { interface: settings.interface, period, in_time: realtime_priority > 0 };
        let setup = &mut NodeSetup { node: &mut node, kind, contract: &contract };
        let commands = Arc::new(Commands::new(setup, &joints, sending)?);
        let kinds = controlled.joint_kinds();
        let topic = EventsTopic::new(setup.node, &contract)?;
        let recorded = ParameterRecord::new(kind, &store, &[], &[]);
        let record = EventsRecord::new(topic.clone(), joints.clone(), recorded);
        let in_force = InForce::new(settings.clone(), idle_keep_outs, store.clone(), requests.clone(), kind);
        let in_force = Arc::new(in_force);
        let searcher = Searcher::spawn(controlled)?;
        let clock = Clock::new(setup.node, &contract, simulated_time)?;
        let arms = arm_input::subscribe(setup, joints, joint_states, &clock)?;
        let joint_states: Vec<_> = arms.iter().map(ArmInput::source).collect();
        let tree = Tree::default();
        let goal_frames = servo.settings().goal_frames;
        let frames = frames(setup, &clock, &goal_frame, &tool_frame, goal_frames, tree.clone());
        let wrenches = if kind == ServoKind::OneArm {
            WrenchInput::new(setup, &clock, [&tool_frame, &goal_frame])
        } else {
            None
        };
        let sources = Sources { arms, kinds, inbox, searcher, wrenches, frames };
        let live = RosInputs::new(setup, sources, commands.clone(), record, &goal_frame)?;
        let slot = slot(setup, &goal_frame);
        obey_keep_outs(setup, tree, &goal_frame, in_force.clone());
        let outputs = Outputs::new(setup, commands.clone(), topic, slot, clock, names, goal_frame)?;
        serve_parameters(setup, store, in_force.clone())?;
        let report = Report::new(&mut node, outputs, joint_states.clone(), in_force, period);
        let (queue, snapshots) = snapshot::queue();
        let cycle = Cycle { servo, live, commands, snapshots: queue, timing: CycleTiming::default() };
        Ok(Self {
            node,
            cycle,
            joint_states,
            report,
            snapshots,
            requests,
            schedule: Schedule { period, realtime_priority },
        })
    }
}

impl ServoNode {
    /// Returns whether nobody publishes the joint states of an arm.
    pub fn waits_for_robot(&self) -> bool {
        self.joint_states.iter().any(|joint_states| joint_states.publishers() == 0)
    }

    /// Returns the reason why the cycle has failed; `None` if it has not failed.
    pub fn failure(&self) -> Option<ShutdownError> {
        self.outcome.borrow().clone().and_then(Result::err)
    }

    /// Decelerates the arm, sends zeros until the robot stands still, and leaves the graph. Each step has a deadline. If this
    /// future is dropped, zeros are sent at once.
    ///
    /// # Errors
    /// [`ShutdownError`] if the arm or the robot did not come to rest.
    pub async fn shut_down(mut self) -> Result<(), ShutdownError> {
        let _ = self.requests.send(Request::Shutdown);
        shutdown::ended(&mut self.outcome, shutdown::PATIENCE).await
    }
}

impl Drop for ServoNode {
    fn drop(&mut self) {
        if self.outcome.borrow().is_none() {
            self.commands.end();
        }
        // Wait for the report of the last snapshots, unless the cycle hangs.
        let end = Instant::now() + LAST_REPORT;
        while !self.report.is_finished() && Instant::now() < end {
            std::thread::sleep(Duration::from_millis(1));
        }
    }
}

/// Serves the parameters in force, and passes changes of the parameters to the cycle.
fn serve_parameters(
    NodeSetup { node, kind, contract }: &mut NodeSetup,
    store: ParameterStore,
    in_force: Arc<InForce>,
) -> Result<(), RosError> {
    let kind = *kind;
    let apply = move |store: &ParameterStore, changes: &[(String, Value)]| {
        in_force.set(kind.from_store(store).map_err(|why| why.to_string())?, store, changes)
    };
    ParameterServer::start(node, contract, store, Box::new(apply)).map(drop)
}

/// How long dropping a `ServoNode` waits for its report thread to end.
const LAST_REPORT: Duration = Duration::from_millis(200);

fn serve_requests(node: &mut Node, requests: &Sender<Request>) -> Result<(), RosError> {
    let (pause, round) = (requests.clone(), requests.clone());
    let (mut senders, mut others, began) = (Senders::default(), Senders::default(), Instant::now());
    node.serve_timed::<SetBool, _>("~/pause", move |SetBoolRequest { data: paused }, origin| {
        let ago = senders.hear(origin, Clocks::at(began.elapsed())).ago;
        let done = if paused { "decelerating, then holding" } else { "going on from the measured state" };
        let pause = pause.clone();
        async move {
            requests::ask(&pause, |reply| Request::Pause(paused, ago, reply), done, requests::PATIENCE).await
        }
    })?;
    let reconfigures = node.serve_timed::<Trigger, _>("~/reconfigure", move |_, origin| {
        let ago = others.hear(origin, Clocks::at(began.elapsed())).ago;
        let (round, done) = (round.clone(), "going to the other configuration, then on to the goal");
        async move {
            requests::ask(&round, |reply| Request::Reconfigure(ago, reply), done, requests::PATIENCE).await
        }
    });
    // A keystore from before this service was introduced does not grant access to it. The servo works without the service.
    reconfigures.unwrap_or_else(|why| node.log().warn(&format!("no ~/reconfigure: {why}")));
    serve_trigger(node, "~/stop", requests, Request::Stop, "decelerating; the goal is dropped, a pause stays")
}

/// Serves the trigger `service`. Each call passes the request from `make` to the cycle, and replies with the text `done` once the
/// cycle has taken the request.
fn serve_trigger(
    node: &mut Node,
    service: &str,
    requests: &Sender<Request>,
    make: fn(Reply) -> Request,
    done: &'static str,
) -> Result<(), RosError> {
    let requests = requests.clone();
    node.serve_later::<Trigger, _>(service, move |_| {
        let requests = requests.clone();
        async move { requests::ask(&requests, make, done, requests::PATIENCE).await }
    })
}

/// Serves the services of the wrench sensor. A keystore from before these services were introduced does not grant access to them.
/// In that case, the servo works without them.
fn serve_contact(node: &mut Node, requests: &Sender<Request>) {
    let identify = requests.clone();
    let served =
        serve_trigger(node, "~/tare", requests, Request::Tare, "the present wrench counts as no contact");
    let served = served.and_then(|()| {
        node.serve_later::<SetBool, _>("~/identify_tool", move |SetBoolRequest { data: begins }| {
            let (identify, done) =
                (identify.clone(), "turn the tool slowly about two horizontal axes, without contact");
            let request = move |reply| Request::IdentifyTool(begins, reply);
            async move { requests::ask(&identify, request, done, requests::PATIENCE).await }
        })
    });
    served.unwrap_or_else(|why| node.log().warn(&format!("no ~/tare and ~/identify_tool: {why}")));
}

/// Subscribes to TF for goals in other frames. Returns `None` if the servo takes goals in one frame only, or may not subscribe to TF.
fn frames(
    setup: &mut NodeSetup,
    clock: &Clock,
    base: &str,
    tool: &str,
    settings: GoalFrames,
    tree: Tree,
) -> Option<Frames> {
    if !setup.kind.takes_frames() {
        return None;
    }
    let frames = Frames::new(setup, clock, base, tool, settings, tree);
    frames.inspect_err(|why| setup.node.log().warn(&format!("goals in {base:?} only: {why}"))).ok()
}

/// Publishes pictures for viewers. If a keystore does not grant access to a topic, the servo works without pictures.
fn slot(setup: &mut NodeSetup, goal_frame: &str) -> MomentSlot {
    pictures::serve(setup, goal_frame).unwrap_or_else(|why| {
        setup.node.log().warn(&format!("no pictures: {why}"));
        MomentSlot::default()
    })
}

/// Obeys `~/keep_out` if goals may be in frames of TF. A keystore from before this topic was introduced does not grant access to it.
/// In that case, the node works without the topic.
fn obey_keep_outs(setup: &mut NodeSetup, tree: Tree, base: &str, in_force: Arc<InForce>) {
    if setup.kind.takes_frames() {
        let obeyed = keep_outs::obey(setup, tree, base, in_force);
        obeyed.unwrap_or_else(|why| setup.node.log().warn(&format!("no ~/keep_out: {why}")));
    }
}

/// The state of the cycle's thread.
pub(super) struct Cycle {
    pub servo: Servo,
    live: RosInputs,
    commands: Arc<Commands>,
    snapshots: Snapshots,
    timing: CycleTiming,
}

impl Cycle {
    pub fn tick(&mut self, tick: Tick) -> ControlFlow<Outcome> {
        if self.commands.has_ended() {
            return ControlFlow::Break(Err(ShutdownError::CutShort));
        }
        self.timing.add(tick.lateness, tick.missed);
        tick.worked.into_iter().for_each(|time| self.timing.add_work(time));
        let goal_count = self.servo.status().goal_count;
        self.live.begin(&mut self.servo, tick.now);
        self.live.feed(&mut self.servo);
        self.servo.step(tick.now);
        self.live.record.end(tick.now, self.servo.output());
        if self.servo.status().goal_count != goal_count {
            self.timing.restart();
        }
        let step = self.live.shutdown_step(&self.servo);
        self.publish(&step);
        let left = self.snapshots.leave(tick.now, &mut self.servo, &mut self.live, &self.timing);
        if let Err(ReportEnded) = left {
            return ControlFlow::Break(Err(ShutdownError::Failed("the report has ended".to_owned())));
        }
        match step {
            Step::Gone(outcome) => ControlFlow::Break(outcome),
            Step::Decelerate | Step::FinalZeros => ControlFlow::Continue(()),
        }
    }

    fn publish(&mut self, step: &Step) {
        let Some(output) = self.servo.output() else { return };
        if *step == Step::Decelerate || self.servo.at_rest() {
            self.commands.publish(output);
        } else {
            self.commands.stand();
        }
    }
}
