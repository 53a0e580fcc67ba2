//! The servo node, for one arm (`dq_servo`) or for two (`dq_dual_servo`).

use super::arm_input::{ArmInput, fastest};
use super::commands::{Commands, last_words};
use super::cycle_thread::{self, Tick};
use super::outputs::Outputs;
use super::requests::{self, Reply};
use super::shutdown::{self, Outcome, Shutdown, ShutdownError, Step};
use super::{NodeError, Prepared};
use crate::config::{CycleParameters, NodeParameters};
use crate::ros::{EndpointNames, Logger, NameWatch, Node, ParameterServer, RosError, Session, Subscription};
use crate::servo::{CycleTiming, Reason, Rejection, Servo, Settings, State, Status};
use crate::wire::GoalFates;
use crate::wire::messages::*;
use crate::wire::{Contract, NodeContract};
use crate::wire::{CycleLabel, Wiring, joint_names};
use std::ops::ControlFlow;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::time::Duration;
use tokio::sync::watch;

/// What the services ask of the cycle.
enum Request<C> {
    Configure(Box<Settings<C>>),
    Pause(bool, Reply),
    Stop(Reply),
    Shutdown,
}

/// A running servo node. It ends by [`shut_down`](Self::shut_down); one that is dropped sends zeros at once.
pub struct ServoNode<T: Wiring> {
    requests: Sender<Request<T::Controller>>,
    commands: Arc<Commands>,
    /// How the cycle ended, once it has.
    outcome: watch::Receiver<Option<Outcome>>,
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
        let names = joint_names::<T>(&joints);
        let servo = Servo::new(task, joints, &goal_frame, settings, period)?;
        let (requests, inbox) = channel();
        let mut cycle = Cycle::new(&mut node, &contract, servo, inbox, names, goal_frame, period)?;
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
        let commands = cycle.outputs.commands.clone();
        let (end, outcome) = watch::channel(None);
        let last_words = last_words(commands.clone(), end);
        cycle_thread::spawn("servo", period, move |tick| cycle.tick(tick), last_words)?;
        Ok(Self { requests, commands, outcome, _node: node })
    }
}

impl<T: Wiring> ServoNode<T> {
    /// Why the cycle has ended by itself, once it has.
    pub fn failure(&self) -> Option<ShutdownError> {
        self.outcome.borrow().clone().and_then(Result::err)
    }

    /// Decelerates the arm, sends zeros until the robot stands, and leaves the graph; each step has a deadline. Where this
    /// future is dropped, zeros are sent at once.
    ///
    /// # Errors
    /// [`ShutdownError`] where the arm or the robot was not brought to rest.
    pub async fn shut_down(mut self) -> Result<(), ShutdownError> {
        let _ = self.requests.send(Request::Shutdown);
        shutdown::ended(&mut self.outcome, shutdown::PATIENCE).await
    }
}

impl<T: Wiring> Drop for ServoNode<T> {
    fn drop(&mut self) {
        if self.outcome.borrow().is_none() {
            self.commands.end();
        }
    }
}

fn serve_requests<C: Send + 'static>(node: &mut Node, requests: &Sender<Request<C>>) -> Result<(), RosError> {
    let (pause, stop) = (requests.clone(), requests.clone());
    node.serve_later::<SetBool, _>("~/pause", move |SetBoolRequest { data: paused }| {
        let done = if paused { "decelerating, then holding" } else { "going on from the measured state" };
        let pause = pause.clone();
        async move {
            requests::ask(&pause, |reply| Request::Pause(paused, reply), done, requests::PATIENCE).await
        }
    })?;
    node.serve_later::<Trigger, _>("~/stop", move |_| {
        let stop = stop.clone();
        async move {
            requests::ask(
                &stop,
                Request::Stop,
                "decelerating; the goal is dropped, a pause stays",
                requests::PATIENCE,
            )
            .await
        }
    })
}

/// Everything that the cycle's thread owns.
struct Cycle<T: Wiring> {
    servo: Servo<T>,
    timing: CycleTiming,
    inbox: Receiver<Request<T::Controller>>,
    goals: Subscription<PoseStamped>,
    fates: GoalFates,
    arms: Vec<ArmInput>,
    /// What the next command is made from.
    label: CycleLabel,
    outputs: Outputs,
    names: EndpointNames,
    period: Duration,
    shutdown: Option<Shutdown>,
    seen: Seen,
    name_watch: NameWatch,
    log: Logger,
}

/// What was last reported, and when.
struct Seen {
    state: State,
    goal_count: u64,
    rejected: u64,
    replaced: u64,
    dropped: u64,
    rivals: Option<String>,
    reason: Option<Reason>,
    limited: bool,
    limit: Duration,
    listeners: Duration,
    namesakes: Option<String>,
    pose: Duration,
    status: Duration,
    diagnostics: Duration,
    warning: Duration,
    replaced_warning: Duration,
}

/// Poses and errors go out at 100 Hz, the status at 10 Hz, diagnostics and warnings at 1 Hz.
const POSE_INTERVAL: Duration = Duration::from_millis(10);
const LISTENERS_INTERVAL: Duration = Duration::from_millis(50);
const STATUS_INTERVAL: Duration = Duration::from_millis(100);
const SECOND: Duration = Duration::from_secs(1);

impl<T: Wiring> Cycle<T> {
    fn new(
        node: &mut Node,
        contract: &NodeContract,
        servo: Servo<T>,
        inbox: Receiver<Request<T::Controller>>,
        joints: Vec<String>,
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
            replaced: 0,
            dropped: 0,
            rivals: None,
            reason: None,
            limited: false,
            limit: Duration::ZERO,
            listeners: Duration::ZERO,
            namesakes: None,
            pose: Duration::ZERO,
            status: Duration::ZERO,
            diagnostics: Duration::ZERO,
            warning: Duration::ZERO,
            replaced_warning: Duration::ZERO,
        };
        Ok(Self {
            outputs: Outputs::new::<T>(node, contract, &servo.joint_counts(), joints, goal_frame)?,
            servo,
            names: node.endpoint_names().clone(),
            timing: CycleTiming::default(),
            inbox,
            goals: node.subscription(contract, T::GOAL)?,
            fates: GoalFates::default(),
            label: CycleLabel::new(arms.len()),
            arms,
            period,
            shutdown: None,
            seen,
            name_watch: node.watch_name(&node.name().fully_qualified()),
            log: node.log().clone(),
        })
    }

    fn tick(&mut self, tick: Tick) -> ControlFlow<Outcome> {
        if self.outputs.commands.has_ended() {
            return ControlFlow::Break(Err(ShutdownError::CutShort));
        }
        self.timing.add(tick.lateness, tick.missed);
        self.take_requests(tick.now);
        self.take_joint_states(tick.now);
        self.take_goals(tick.now);
        self.look_for_listeners(tick.now);
        self.label.now = tick.now;
        if let Err(why) = self.servo.step(tick.now) {
            return ControlFlow::Break(Err(ShutdownError::Failed(why.to_string())));
        }
        for (arm, figures) in self.label.arms.iter_mut().zip(self.servo.arm_figures()) {
            arm.figures = *figures;
        }
        let step = self.shutdown_step(tick.now);
        let command = self.servo.command();
        if self.servo.status().state == State::WaitingForState {
            // Before it is known how the robot moves, even zeros might be a step for it.
        } else if step == Step::Decelerate || self.servo.at_rest() {
            self.outputs.commands.publish(command, &self.label.to_string());
        } else {
            self.outputs.commands.publish(&vec![0.0; command.len()], "");
        }
        self.tell(tick.now);
        match step {
            Step::Gone(outcome) => ControlFlow::Break(outcome),
            Step::Decelerate | Step::Farewell => ControlFlow::Continue(()),
        }
    }

    fn take_requests(&mut self, now: Duration) {
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
                // Nothing moves for a request that was answered with a failure; to stand is right all the same.
                Request::Pause(false, reply) if !reply.is_awaited() => {}
                Request::Pause(paused, reply) => {
                    self.servo.pause(paused);
                    self.label.pauses += 1;
                    self.label.paused = paused;
                    reply.taken();
                }
                Request::Stop(reply) => {
                    self.stop();
                    reply.taken();
                }
                Request::Shutdown => {
                    self.stop();
                    self.shutdown = Some(Shutdown::new(now));
                    self.arms.iter_mut().for_each(|arm| arm.speed = None);
                }
            }
        }
    }

    fn stop(&mut self) {
        self.servo.stop();
        self.label.stops += 1;
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
            for (arm, (_, readers)) in self.outputs.commands.readers().enumerate() {
                self.servo.set_listeners(arm, readers > 0);
            }
        }
    }

    /// Every goal is offered, so that a bad one does not hide the good one before it.
    fn take_goals(&mut self, now: Duration) {
        let Self { goals, servo, label, log, shutdown, fates, .. } = self;
        let malformed = goals.each(|goal| {
            if shutdown.is_some() {
                return;
            }
            label.goals += 1;
            log.debug(&format!("goal {:?} in {:?}", goal.pose, goal.header.frame_id));
            let (position, orientation) = goal.pose.arrays();
            // A rejection is counted by the servo, and reported by `tell`.
            match servo.take_goal(position, orientation, &goal.header.frame_id, now) {
                Ok(()) => fates.take(&goal.header.stamp),
                Err(why) => fates.reject(&goal.header.stamp, &why.to_string()),
            }
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
            // Of two arms the older state counts: nothing of the pose is older than its stamp.
            let oldest = self.arms.iter().map(|arm| &arm.stamp).min_by_key(|stamp| stamp.nanoseconds());
            self.outputs.publish_pose(&self.servo, oldest.cloned().unwrap_or_default());
        }
        let status = self.servo.status();
        let changed = status.state != self.seen.state
            || status.goal_count != self.seen.goal_count
            || status.reason != self.seen.reason;
        if changed {
            self.log_reason();
            self.log_change();
        }
        self.log_limited_gain(now);
        if due(&mut self.seen.status, now, STATUS_INTERVAL) || changed {
            let reason = self.reason();
            self.outputs.publish_status(&self.servo, &self.fates, &self.timing, reason.as_deref());
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
        self.tell_replaced(now);
    }

    /// Says how many commands the servo's last gate has replaced, which is a defect of the program.
    fn tell_replaced(&mut self, now: Duration) {
        let replaced = self.servo.replaced();
        let Some(last) = replaced.last.as_ref().filter(|_| replaced.count > self.seen.replaced) else {
            return;
        };
        if due(&mut self.seen.replaced_warning, now, SECOND) {
            let count = replaced.count - self.seen.replaced;
            self.log.error(&format!("{count} commands replaced by braking, last: {last}"));
            self.seen.replaced = replaced.count;
        }
    }

    /// Warns once of each other publisher of commands, and of each other node of this name.
    fn watch_publishers(&mut self) {
        let dropped = self.outputs.commands_dropped();
        if dropped > self.seen.dropped {
            let count = dropped - self.seen.dropped;
            self.log.error(&format!("{count} commands dropped, for the robot too: a subscriber of the commands has acknowledged none for long; end it"));
        }
        self.seen.dropped = dropped;
        let rivals = self.outputs.rivals();
        if let Some(rivalry) = rivals.as_deref().filter(|_| rivals != self.seen.rivals) {
            self.log.warn(rivalry);
        }
        self.seen.rivals = rivals;
        let namesakes = self.name_watch.warning();
        if let Some(warning) = namesakes.as_deref().filter(|_| namesakes != self.seen.namesakes) {
            self.log.warn(warning);
        }
        self.seen.namesakes = namesakes;
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
                _ => self.reason().map_or_else(String::new, |reason| format!(": {reason}")),
            };
            let text = format!("{} -> {}{detail}", self.seen.state, status.state);
            if status.state.is_warning() || status.reason.is_some() {
                self.log.warn(&text)
            } else {
                self.log.info(&text)
            }
        }
        if status.goal_count != self.seen.goal_count && status.goal_beyond_reach {
            self.log.warn("the goal is beyond the arm's reach: the arm will only come near");
        }
        (self.seen.state, self.seen.goal_count) = (status.state, status.goal_count);
    }

    /// Warns of a new reason why the arm is not driven, where the state has stayed the same.
    fn log_reason(&mut self) {
        let reason = self.servo.status().reason;
        let told = self.servo.status().state != self.seen.state;
        if reason != self.seen.reason
            && !told
            && let Some(text) = reason.and_then(|_| self.reason())
        {
            self.log.warn(&text);
        }
        self.seen.reason = reason;
    }

    /// Why the arm is not driven or does not arrive, with the names of the topics, nodes and joints that it is about.
    fn reason(&self) -> Option<String> {
        let status = self.servo.status();
        let Some(reason) = status.reason else { return self.outputs.reason(status) };
        let publisher = |arm: usize, number| {
            let input = &self.arms[arm];
            let name = input.publisher(number).map_or_else(String::new, |it| self.names.describe(it));
            format!("{name} on {}", input.topic())
        };
        let topic = |arm| self.outputs.commands.topic(arm).to_owned();
        Some(reason.explain(|joint| self.outputs.joint(joint), publisher, topic))
    }

    /// Reports when the delay begins to limit the gain, and when it no longer does; once a second at most.
    fn log_limited_gain(&mut self, now: Duration) {
        let Status { gain_factor: part, latency, .. } = *self.servo.status();
        // Between the two it stays as it was.
        let limited = if self.seen.limited { part < 1.0 } else { part < 0.9 };
        if limited == self.seen.limited || !due(&mut self.seen.limit, now, SECOND) {
            return;
        }
        self.seen.limited = limited;
        match limited {
            true => self.log.warn(&format!(
                "gain limited by latency: the law runs at {part:.2} of its gain, as it takes {:.0} ms until a command shows",
                1e3 * latency
            )),
            false => self.log.info("gain no longer limited by latency"),
        }
    }

    /// What the end in progress asks for, if there is one.
    fn shutdown_step(&mut self, now: Duration) -> Step {
        let Some(shutdown) = &mut self.shutdown else { return Step::Decelerate };
        let command = fastest(self.servo.command()).unwrap_or(0.0);
        // Of all arms, or none; who was never heard stands as far as anybody knows.
        let reported: Option<Vec<_>> = self.arms.iter().map(|arm| arm.speed).collect();
        let never_heard = self.servo.pose().is_none().then_some(0.0);
        let reported = reported.and_then(|speeds| fastest(&speeds)).or(never_heard);
        shutdown.step(now, command, reported)
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
