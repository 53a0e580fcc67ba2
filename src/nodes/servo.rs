//! The servo node, for one arm (`dq_servo`) or for two (`dq_dual_servo`).

use super::arm_input::ArmInput;
use super::cycle_thread::{self, Tick};
use super::outputs::{Outputs, SHORTEST_GOODBYE};
use super::{CycleLabel, NodeError, Prepared, Wiring};
use crate::config::{CycleParameters, NodeParameters};
use crate::ros::messages::*;
use crate::ros::{
    Contract, Logger, Node, NodeContract, ParameterServer, PublisherNames, RosError, Session, Subscription,
};
use crate::servo::{CycleTiming, Reason, Rejection, Rivals, Servo, Settings, State};
use std::ops::ControlFlow;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread::JoinHandle;
use std::time::Duration;

/// What the services ask of the cycle.
enum Request<C> {
    Configure(Box<Settings<C>>),
    Pause(bool),
    Stop,
    Shutdown,
}

/// A running servo node.
pub struct ServoNode<T: Wiring> {
    requests: Sender<Request<T::Controller>>,
    thread: Option<JoinHandle<()>>,
    _node: Node,
}

impl<T: Wiring> ServoNode<T>
where
    CycleParameters<T>: NodeParameters,
{
    /// Starts the node on `session`.
    ///
    /// # Errors
    /// [`NodeError`] where the network or the operating system refuses.
    pub fn start(session: &Session, prepared: Prepared<CycleParameters<T>>) -> Result<Self, NodeError> {
        let Prepared { names, store, parameters, log_level, warnings } = prepared;
        let CycleParameters { task, joints, goal_frame, settings, best_effort_joint_states, period } =
            parameters;
        let mut contract = T::contract(Contract::builtin()?);
        if best_effort_joint_states {
            for arm in T::ARMS {
                contract = contract.with_best_effort(&format!("{arm}joint_states"));
            }
        }
        let mut node = session.node(names, log_level)?;
        warnings.iter().for_each(|warning| node.log().warn(warning));
        let servo = Servo::new(task, joints, &goal_frame, settings, period)?;
        let (requests, inbox) = channel();
        let mut cycle = Cycle::new(&mut node, &contract, servo, inbox, goal_frame, period)?;
        serve_requests(&mut node, &requests)?;
        let configure = requests.clone();
        ParameterServer::start(
            &mut node,
            store,
            Box::new(move |store| {
                let settings = CycleParameters::<T>::from_store(store)?.settings;
                // The cycle is gone only when the node is about to go.
                let _ = configure.send(Request::Configure(Box::new(settings)));
                Ok(())
            }),
        )?;
        node.log().info(&format!("cycle of {} ms, waiting for joint states", period.as_secs_f64() * 1e3));
        let thread = cycle_thread::spawn("servo", period, move |tick| cycle.tick(tick))?;
        Ok(Self { requests, thread: Some(thread), _node: node })
    }
}

impl<T: Wiring> ServoNode<T> {
    /// Whether the cycle runs: it ends by itself only by a panic.
    pub fn is_running(&self) -> bool {
        self.thread.as_ref().is_some_and(|thread| !thread.is_finished())
    }
}

/// Decelerates the arm, sends zeros until they are acknowledged, and leaves the graph.
impl<T: Wiring> Drop for ServoNode<T> {
    fn drop(&mut self) {
        let _ = self.requests.send(Request::Shutdown);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

fn serve_requests<C: Send + 'static>(node: &mut Node, requests: &Sender<Request<C>>) -> Result<(), RosError> {
    let (pause, stop) = (requests.clone(), requests.clone());
    node.serve::<SetBool>("~/pause", move |request: SetBoolRequest| {
        let success = pause.send(Request::Pause(request.data)).is_ok();
        let message =
            if request.data { "decelerating, then holding" } else { "going on from the measured state" };
        SuccessResponse { success, message: message.to_owned() }
    })?;
    node.serve::<Trigger>("~/stop", move |_| SuccessResponse {
        success: stop.send(Request::Stop).is_ok(),
        message: "decelerating; the goal is dropped".to_owned(),
    })
}

/// Everything that the cycle's thread owns.
struct Cycle<T: Wiring> {
    servo: Servo<T>,
    timing: CycleTiming,
    inbox: Receiver<Request<T::Controller>>,
    goals: Subscription<PoseStamped>,
    arms: Vec<ArmInput>,
    /// What the next command is made from.
    label: CycleLabel,
    outputs: Outputs,
    names: PublisherNames,
    period: Duration,
    shutdown: Option<Shutdown>,
    seen: Seen,
    log: Logger,
}

/// What was last told, and when.
struct Seen {
    state: State,
    goal_count: u64,
    rejected: u64,
    rivals: Option<String>,
    reason: Option<Reason>,
    limited: bool,
    listeners: Duration,
    pose: Duration,
    status: Duration,
    diagnostics: Duration,
    warning: Duration,
}

/// The end in progress: since when the command has been zero.
struct Shutdown {
    zero_since: Option<Duration>,
}

/// Poses and errors go out at 100 Hz, the status at 10 Hz, diagnostics and warnings at 1 Hz.
const POSE_INTERVAL: Duration = Duration::from_millis(10);
const LISTENERS_INTERVAL: Duration = Duration::from_millis(50);
const STATUS_INTERVAL: Duration = Duration::from_millis(100);
const SECOND: Duration = Duration::from_secs(1);

/// At the end, zeros are sent at most this long for a robot that does not answer with a standstill.
const LONGEST_GOODBYE: Duration = Duration::from_millis(500);

impl<T: Wiring> Cycle<T> {
    fn new(
        node: &mut Node,
        contract: &NodeContract,
        servo: Servo<T>,
        inbox: Receiver<Request<T::Controller>>,
        goal_frame: String,
        period: Duration,
    ) -> Result<Self, RosError> {
        let mut arms = Vec::new();
        for arm in T::ARMS {
            let joint_states = node.subscription(contract, &format!("{arm}joint_states"))?;
            arms.push(ArmInput::new(arms.len(), joint_states));
        }
        let seen = Seen {
            state: State::WaitingForState,
            goal_count: 0,
            rejected: 0,
            rivals: None,
            reason: None,
            limited: false,
            listeners: Duration::ZERO,
            pose: Duration::ZERO,
            status: Duration::ZERO,
            diagnostics: Duration::ZERO,
            warning: Duration::ZERO,
        };
        Ok(Self {
            outputs: Outputs::new::<T>(node, contract, &servo.joint_counts(), goal_frame)?,
            servo,
            names: node.publisher_names()?,
            timing: CycleTiming::default(),
            inbox,
            goals: node.subscription(contract, T::GOAL)?,
            label: CycleLabel::new(arms.len()),
            arms,
            period,
            shutdown: None,
            seen,
            log: node.log().clone(),
        })
    }

    fn tick(&mut self, tick: Tick) -> ControlFlow<()> {
        self.timing.add(tick.lateness, tick.missed);
        self.take_requests();
        self.take_joint_states(tick.now);
        self.take_goals(tick.now);
        self.look_for_listeners(tick.now);
        self.label.now = tick.now;
        if let Err(why) = self.servo.step(tick.now) {
            self.log.error(&format!("the cycle ends: {why}"));
            return ControlFlow::Break(());
        }
        for (arm, figures) in self.label.arms.iter_mut().zip(self.servo.arm_figures()) {
            arm.figures = *figures;
        }
        // Before it is known how the robot moves, even zeros might be a step for it.
        if self.servo.status().state != State::WaitingForState {
            self.outputs.publish_commands(self.servo.command(), &self.label.to_string());
        }
        self.tell(tick.now);
        if self.farewell_done(tick.now) { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }

    fn take_requests(&mut self) {
        while let Ok(request) = self.inbox.try_recv() {
            match request {
                Request::Configure(settings) => {
                    let law =
                        |controller| T::law(controller).into_iter().map(|(_, name)| name).collect::<Vec<_>>();
                    let (old, new) = (law(&self.servo.settings().controller), law(&settings.controller));
                    if old != new {
                        self.log.info(&format!("controller {} -> {}", old.join(" "), new.join(" ")));
                        self.seen.status = Duration::ZERO;
                    }
                    self.servo.configure(*settings);
                    self.label.settings += 1;
                }
                Request::Pause(paused) => {
                    self.servo.pause(paused);
                    self.label.pauses += 1;
                    self.label.paused = paused;
                }
                Request::Stop => self.stop(),
                Request::Shutdown => {
                    self.stop();
                    self.shutdown = Some(Shutdown { zero_since: None });
                    self.arms.iter_mut().for_each(|arm| arm.at_rest = false);
                }
            }
        }
    }

    fn stop(&mut self) {
        self.servo.stop();
        self.label.stops += 1;
        self.label.paused = false;
    }

    fn take_joint_states(&mut self, now: Duration) {
        for number in 0..self.arms.len() {
            let malformed = self.arms[number].offer_all(&mut self.servo, &mut self.label, now);
            self.count_malformed(malformed);
        }
    }

    /// Looks who takes the commands.
    fn look_for_listeners(&mut self, now: Duration) {
        if due(&mut self.seen.listeners, now, LISTENERS_INTERVAL) {
            for (arm, listeners) in self.outputs.listeners().enumerate() {
                self.servo.set_listeners(arm, listeners);
            }
        }
    }

    /// Every goal is offered, so that a bad one does not hide the good one before it.
    fn take_goals(&mut self, now: Duration) {
        let Self { goals, servo, label, log, shutdown, .. } = self;
        let malformed = goals.each(|goal| {
            if shutdown.is_some() {
                return;
            }
            label.goals += 1;
            log.debug(&format!("goal {:?} in {:?}", goal.pose, goal.header.frame_id));
            let (position, orientation) = goal.pose.arrays();
            // A rejection is counted by the servo, and reported by `tell`.
            let _ = servo.take_goal(position, orientation, &goal.header.frame_id, now);
        });
        self.count_malformed(malformed);
        if self.servo.status().goal_count != self.seen.goal_count {
            self.timing.restart();
        }
    }

    fn count_malformed(&mut self, reasons: Vec<String>) {
        for reason in reasons {
            self.servo.count_malformed(&Rejection::Malformed(reason));
        }
    }

    /// Publishes and logs what is due.
    fn tell(&mut self, now: Duration) {
        if due(&mut self.seen.pose, now, POSE_INTERVAL) {
            self.outputs.publish_pose(&self.servo);
        }
        let status = self.servo.status();
        let changed = status.state != self.seen.state
            || status.goal_count != self.seen.goal_count
            || status.reason != self.seen.reason;
        if changed {
            self.log_change();
            self.log_reason();
        }
        self.log_limited_gain();
        if due(&mut self.seen.status, now, STATUS_INTERVAL) || changed {
            self.outputs.publish_status(&self.servo, &self.timing, self.reason().as_deref());
        }
        if due(&mut self.seen.diagnostics, now, SECOND) {
            self.watch_publishers();
            let reason = self.reason();
            self.outputs.publish_diagnostics(&self.servo, &self.timing, self.period, reason.as_deref());
        }
        let rejections = self.servo.rejections();
        if rejections.total() > self.seen.rejected && due(&mut self.seen.warning, now, SECOND) {
            let count = rejections.total() - self.seen.rejected;
            self.seen.rejected = rejections.total();
            self.log.warn(&format!("{count} rejected, last: {}", rejections.last().unwrap_or_default()));
        }
    }

    /// Warns once of each other publisher of commands.
    fn watch_publishers(&mut self) {
        let rivals = self.outputs.rivals();
        if let Some(rivalry) = rivals.as_deref().filter(|_| rivals != self.seen.rivals) {
            self.log.warn(rivalry);
        }
        self.seen.rivals = rivals;
    }

    fn log_change(&mut self) {
        let status = self.servo.status();
        if status.state != self.seen.state {
            let figures = &status.figures;
            let detail = match status.state {
                State::Settled => format!(
                    " after {:.2} s and {:.3} m",
                    figures.arrival_time.unwrap_or(figures.elapsed),
                    figures.path_length
                ),
                State::Stalled => format!(
                    ": no nearer to the goal since {} s; another goal, other parameters or ~/pause (false) try again",
                    self.servo.settings().progress_timeout.unwrap_or_default().as_secs_f64()
                ),
                State::JointLimit => status
                    .joint_at_limit
                    .map_or_else(String::new, |joint| format!(": joint {joint} is at its position limit")),
                _ => String::new(),
            };
            let text = format!("{} -> {}{detail}", self.seen.state, status.state);
            if status.state.is_warning() { self.log.warn(&text) } else { self.log.info(&text) }
        }
        if status.goal_count != self.seen.goal_count && status.goal_beyond_reach {
            self.log.warn("the goal is beyond the arm's reach: the arm will only come near");
        }
        (self.seen.state, self.seen.goal_count) = (status.state, status.goal_count);
    }

    /// Warns of a new reason why the arm is not driven.
    fn log_reason(&mut self) {
        let reason = self.servo.status().reason;
        if reason != self.seen.reason {
            if let Some(text) = self.reason() {
                self.log.warn(&text);
            }
            self.seen.reason = reason;
        }
    }

    /// Why the arm is not driven, with the names of the topics and nodes that it is about.
    fn reason(&self) -> Option<String> {
        Some(match self.servo.status().reason? {
            Reason::Rivals(Rivals { arm, first, second }) => {
                let input = &self.arms[arm];
                let name =
                    |number| input.publisher(number).map_or_else(String::new, |it| self.names.describe(it));
                let (topic, first, second) = (input.topic(), name(first), name(second));
                format!(
                    "two publishers on {topic} give joint states of the arm: {first} and {second}; only one may"
                )
            }
            Reason::NobodyListens(arm) => {
                format!(
                    "nobody subscribes to {}: is the robot's controller running?",
                    self.outputs.topic(arm)
                )
            }
            reason => reason.to_string(),
        })
    }

    /// Reports when the delay begins to limit the gain, and when it no longer does.
    fn log_limited_gain(&mut self) {
        let status = self.servo.status();
        let (part, limited) = (status.gain_factor, self.seen.limited);
        // Between the two it stays as it was.
        if !limited && part < 0.9 {
            self.seen.limited = true;
            let latency = 1e3 * status.latency;
            self.log.warn(&format!("gain limited by latency: the law runs at {part:.2} of its gain, as joint states show a command after {latency:.0} ms"));
        } else if limited && part >= 1.0 {
            self.seen.limited = false;
            self.log.info("gain no longer limited by latency");
        }
    }

    /// Whether the end may come: the command is zero, and the robot has acknowledged by standing still.
    fn farewell_done(&mut self, now: Duration) -> bool {
        let Some(shutdown) = &mut self.shutdown else { return false };
        if !self.servo.at_rest() {
            return false;
        }
        let zeros_for = now.saturating_sub(*shutdown.zero_since.get_or_insert(now));
        let nobody = self.servo.pose().is_none();
        let standing = self.arms.iter().all(|arm| arm.at_rest);
        zeros_for >= SHORTEST_GOODBYE && (standing || nobody || zeros_for >= LONGEST_GOODBYE)
    }
}

/// Whether `interval` has passed since `last`, which then becomes `now`.
fn due(last: &mut Duration, now: Duration, interval: Duration) -> bool {
    let due = now.saturating_sub(*last) >= interval;
    if due {
        *last = now;
    }
    due
}
