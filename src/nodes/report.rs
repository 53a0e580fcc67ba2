//! What a servo node makes known of its cycles: what it publishes and logs besides the commands.

use super::arm_input::ArmInput;
use super::cycle_thread::due;
use super::live::Live;
use super::outputs::{GUARD_GONE, Outputs};
use crate::ros::{EndpointNames, Logger, NameWatch, Node};
use crate::servo::{CycleTiming, GuardState, Reason, Servo, State, Status};
use crate::wire::Wiring;
use std::marker::PhantomData;
use std::time::Duration;

/// Poses and errors go out at 100 Hz, the status at 10 Hz, diagnostics and warnings at 1 Hz.
const POSE_INTERVAL: Duration = Duration::from_millis(10);
const STATUS_INTERVAL: Duration = Duration::from_millis(100);
const SECOND: Duration = Duration::from_secs(1);

/// Publishes and logs; knows what was last reported, and when.
pub(super) struct Report<T> {
    outputs: Outputs,
    names: EndpointNames,
    name_watch: NameWatch,
    log: Logger,
    period: Duration,
    law: Option<Vec<&'static str>>,
    state: State,
    goal_count: u64,
    rejected: u64,
    replaced: u64,
    dropped: u64,
    rivals: Option<String>,
    reason: Option<Reason>,
    /// For which settings it was said whether the law asks for too much.
    judged: Option<u64>,
    limited: bool,
    limit: Duration,
    namesakes: Option<String>,
    pose: Duration,
    status: Duration,
    diagnostics: Duration,
    warning: Duration,
    replaced_warning: Duration,
    task: PhantomData<T>,
}

impl<T: Wiring> Report<T> {
    /// Nothing reported yet by the node, whose cycle takes `period`.
    pub fn new(node: &mut Node, outputs: Outputs, period: Duration) -> Self {
        Self {
            outputs,
            names: node.endpoint_names().clone(),
            name_watch: node.watch_name(&node.name().fully_qualified()),
            log: node.log().clone(),
            period,
            law: None,
            state: State::WaitingForState,
            goal_count: 0,
            rejected: 0,
            replaced: 0,
            dropped: 0,
            rivals: None,
            reason: None,
            judged: None,
            limited: false,
            limit: Duration::ZERO,
            namesakes: None,
            pose: Duration::ZERO,
            status: Duration::ZERO,
            diagnostics: Duration::ZERO,
            warning: Duration::ZERO,
            replaced_warning: Duration::ZERO,
            task: PhantomData,
        }
    }

    /// Publishes and logs what is due.
    pub fn cycle(
        &mut self,
        now: Duration,
        servo: &Servo<T>,
        live: &Live<T::Controller>,
        timing: &CycleTiming,
    ) {
        if due(&mut self.pose, now, POSE_INTERVAL) {
            self.outputs.publish_pose(servo, live.stamp());
        }
        let status = servo.status();
        let changed = self.log_law(servo)
            || status.state != self.state
            || status.goal_count != self.goal_count
            || status.reason != self.reason;
        if changed {
            self.log_reason(servo, live);
            self.log_change(servo, live);
        }
        self.log_demand(servo);
        self.log_limited_gain(now, servo);
        if due(&mut self.status, now, STATUS_INTERVAL) || changed {
            self.watch_guards(now);
            let reason = self.reason_text(servo, live);
            self.outputs.publish_status(servo, &live.fates, timing, reason.as_deref());
        }
        if due(&mut self.diagnostics, now, SECOND) {
            self.watch_publishers();
            let reason = self.reason_text(servo, live);
            self.outputs.publish_diagnostics(servo, timing, self.period, reason.as_deref());
        }
        let rejections = servo.rejections();
        if rejections.total() > self.rejected && due(&mut self.warning, now, SECOND) {
            let count = rejections.total() - self.rejected;
            self.rejected = rejections.total();
            self.log.warn(&format!("{count} rejected, last: {}", rejections.last().unwrap_or_default()));
        }
        self.log_replaced(now, servo);
    }

    /// Logs that a guard has come, or gone.
    fn watch_guards(&mut self, now: Duration) {
        match self.outputs.look_at_guards(now) {
            Some(GuardState::Gone) => self.log.warn(GUARD_GONE),
            Some(GuardState::Watching) => self.log.info("the arm has a guard"),
            Some(GuardState::None) | None => {}
        }
    }

    /// Logs another law; whether there is one.
    fn log_law(&mut self, servo: &Servo<T>) -> bool {
        let law: Vec<_> = T::law(&servo.settings().controller).into_iter().map(|(_, name)| name).collect();
        let before = self.law.replace(law.clone()).filter(|before| *before != law);
        if let Some(before) = &before {
            self.log.info(&format!("controller {} -> {}", before.join(" "), law.join(" ")));
        }
        before.is_some()
    }

    /// Logs how many commands the servo's last gate has replaced, which is a defect of the program.
    fn log_replaced(&mut self, now: Duration, servo: &Servo<T>) {
        let replaced = servo.replaced();
        let Some(last) = replaced.last.as_ref().filter(|_| replaced.count > self.replaced) else {
            return;
        };
        if due(&mut self.replaced_warning, now, SECOND) {
            let count = replaced.count - self.replaced;
            self.log.error(&format!("{count} commands replaced by braking, last: {last}"));
            self.replaced = replaced.count;
        }
    }

    /// Warns once of each other publisher of commands, and of each other node of this name.
    fn watch_publishers(&mut self) {
        let dropped = self.outputs.commands_dropped();
        if dropped > self.dropped {
            let count = dropped - self.dropped;
            self.log.error(&format!("{count} commands dropped, for the robot too: a subscriber of the commands has acknowledged none for long; end it"));
        }
        self.dropped = dropped;
        let rivals = self.outputs.rivals();
        if let Some(rivalry) = rivals.as_deref().filter(|_| rivals != self.rivals) {
            self.log.warn(rivalry);
        }
        self.rivals = rivals;
        let namesakes = self.name_watch.warning();
        if let Some(warning) = namesakes.as_deref().filter(|_| namesakes != self.namesakes) {
            self.log.warn(warning);
        }
        self.namesakes = namesakes;
    }

    fn log_change(&mut self, servo: &Servo<T>, live: &Live<T::Controller>) {
        let status = servo.status();
        if status.state != self.state {
            let figures = &status.figures;
            let detail = match status.state {
                State::Settled => format!(
                    " after {:.2} s and {:.3} m",
                    figures.arrival_time.unwrap_or(figures.elapsed),
                    figures.path_length
                ),
                _ => self.reason_text(servo, live).map_or_else(String::new, |reason| format!(": {reason}")),
            };
            let text = format!("{} -> {}{detail}", self.state, status.state);
            if status.state.is_warning() || status.reason.is_some() {
                self.log.warn(&text)
            } else {
                self.log.info(&text)
            }
        }
        if status.goal_count != self.goal_count && status.goal_beyond_reach {
            self.log.warn("the goal is beyond the arm's reach: the arm will only come near");
        }
        (self.state, self.goal_count) = (status.state, status.goal_count);
    }

    /// Warns of a new reason why the arm is not driven, where the state has stayed the same.
    fn log_reason(&mut self, servo: &Servo<T>, live: &Live<T::Controller>) {
        let reason = servo.status().reason;
        let logged = servo.status().state != self.state;
        if reason != self.reason
            && !logged
            && let Some(text) = reason.and_then(|_| self.reason_text(servo, live))
        {
            self.log.warn(&text);
        }
        self.reason = reason;
    }

    /// Why the arm is not driven or does not arrive, with the names of the topics, nodes and joints that it is about.
    fn reason_text(&self, servo: &Servo<T>, live: &Live<T::Controller>) -> Option<String> {
        let status = servo.status();
        let Some(reason) = status.reason else {
            let unheard = || live.arms.iter().find_map(ArmInput::unheard);
            let waiting = status.state == State::WaitingForState;
            return self.outputs.reason(status).or_else(|| waiting.then(unheard).flatten());
        };
        let publisher = |arm: usize, number| {
            let input = &live.arms[arm];
            let name = input.publisher(number).map_or_else(String::new, |it| self.names.describe(it));
            format!("{name} on {}", input.topic())
        };
        let topic = |arm| self.outputs.commands.topic(arm).to_owned();
        Some(reason.explain(|joint| self.outputs.joint(joint), publisher, topic))
    }

    /// Warns once of settings with which the law would swing by itself, as soon as the robot is heard.
    fn log_demand(&mut self, servo: &Servo<T>) {
        if self.judged == Some(servo.configurations()) {
            return;
        }
        let Some(demand) = servo.demand() else { return };
        self.judged = Some(servo.configurations());
        if demand.is_too_much() {
            self.log.warn(&format!(
                "the law's rate of {:.0} 1/s is beyond {:.0} 1/s, the largest that is stable with a latency of {:.1} ms and a period of \
                 {:.1} ms: it is slowed; try lower gains",
                demand.rate,
                demand.largest,
                1e3 * demand.latency,
                1e3 * demand.period
            ));
        }
    }

    /// Reports when the delay begins to limit the gain, and when it no longer does; once a second at most.
    fn log_limited_gain(&mut self, now: Duration, servo: &Servo<T>) {
        let Status { gain_factor: part, latency, .. } = *servo.status();
        // Between the two it stays as it was.
        let limited = if self.limited { part < 1.0 } else { part < 0.9 };
        if limited == self.limited || !due(&mut self.limit, now, SECOND) {
            return;
        }
        self.limited = limited;
        match limited {
            true => self.log.warn(&format!(
                "gain limited by latency: the law runs at {part:.2} of its gain, as it takes {:.0} ms until a command shows",
                1e3 * latency
            )),
            false => self.log.info("gain no longer limited by latency"),
        }
    }
}
