//! The report of a servo node: everything that the node publishes and logs other than the commands. The report runs on its own
//! thread, and reads the snapshots that the cycle sends.

use super::arm_input::{JointStates, unheard};
use super::complaint::WarningOnChange;
use super::in_force::{InForce, NotObeyed};
use super::outputs::{GUARD_GONE, Outputs};
use super::snapshot::Snapshot;
use super::throttle::Throttle;
use dq_check::GuardState;
use dq_core::servo::{Contended, Reason, Reconfiguration, Rejection, State, Status};
use dq_ros::ros::{EndpointNames, Logger, NameWatch, Node};
use dq_space::space::{LeftOut, Scene};
use dq_wire::{LawNames, pose_numbers};
use std::sync::Arc;
use std::sync::mpsc::Receiver;
use std::thread::JoinHandle;
use std::time::Duration;

/// The interval at which the report counts the subscribers to the commands.
const READERS_INTERVAL: Duration = Duration::from_millis(50);

/// The shortest time between two warnings of one kind.
const SECOND: Duration = Duration::from_secs(1);

/// Publishes and logs the state of the servo from [snapshots](Snapshot). Logs only changes since the previous snapshot.
pub(super) struct Report {
    outputs: Outputs,
    /// The joint states of each arm.
    inputs: Vec<JointStates>,
    in_force: Arc<InForce>,
    names: EndpointNames,
    name_watch: NameWatch,
    log: Logger,
    period: Duration,
    law: Option<LawNames>,
    state: State,
    /// How long the motion had lasted when the arm first arrived at the goal \[s\]; `None` until the arrival has been logged.
    arrival: Option<f64>,
    goal_count: u64,
    rejected: u64,
    replaced: u64,
    dropped: u64,
    rivals: WarningOnChange,
    reason: Option<Reason>,
    scene: Option<Arc<Scene>>,
    not_obeyed: NotObeyed,
    idle: WarningOnChange,
    limited: bool,
    limit_due: Throttle,
    namesakes: WarningOnChange,
    readers_due: Throttle,
    rejected_due: Throttle,
    replaced_due: Throttle,
}

impl Report {
    /// Creates the report of the node. `inputs` are the joint states of its arms, `in_force` are the settings in force, and `period`
    /// is the period of the node's cycle.
    pub fn new(
        node: &mut Node,
        outputs: Outputs,
        inputs: Vec<JointStates>,
        in_force: Arc<InForce>,
        period: Duration,
    ) -> Self {
        Self {
            outputs,
            inputs,
            in_force,
            names: node.endpoint_names().clone(),
            name_watch: node.watch_name(&node.name().fully_qualified()),
            log: node.log().clone(),
            period,
            law: None,
            state: State::WaitingForState,
            arrival: None,
            goal_count: 0,
            rejected: 0,
            replaced: 0,
            dropped: 0,
            rivals: WarningOnChange::default(),
            reason: None,
            scene: None,
            not_obeyed: NotObeyed::default(),
            idle: WarningOnChange::default(),
            limited: false,
            limit_due: Throttle::new(SECOND),
            namesakes: WarningOnChange::default(),
            readers_due: Throttle::new(READERS_INTERVAL),
            rejected_due: Throttle::new(SECOND),
            replaced_due: Throttle::new(SECOND),
        }
    }

    /// Runs on a new thread until the cycle that sends `snapshots` has ended.
    ///
    /// # Errors
    /// The operating system's error if it creates no thread.
    pub fn spawn(mut self, snapshots: Receiver<Snapshot>) -> std::io::Result<JoinHandle<()>> {
        let thread = std::thread::Builder::new().name("report".to_owned());
        thread.spawn(move || snapshots.iter().for_each(|cycle| self.take(&cycle)))
    }

    /// Publishes and logs the data that are due after a cycle.
    fn take(&mut self, cycle: &Snapshot) {
        let now = cycle.now;
        if self.readers_due.is_due(now) {
            self.outputs.update_readers();
        }
        if cycle.due.pose {
            self.outputs.publish_pose(cycle);
        }
        self.log_law(cycle);
        self.log_reason(cycle);
        self.log_change(cycle);
        self.log_demand(cycle);
        self.log_limited_gain(cycle);
        self.log_scene(cycle);
        if cycle.due.status {
            self.watch_guards(now);
            self.log_not_obeyed();
            let reason = self.reason_text(cycle);
            let asker = cycle.asker.map(|asker| self.names.describe(asker));
            self.outputs.publish_status(cycle, reason.as_deref(), asker, &self.not_obeyed);
            self.outputs.publish_updates(cycle, |asker| self.names.describe(asker));
        }
        if cycle.due.diagnostics {
            self.watch_publishers();
            let reason = self.reason_text(cycle);
            self.outputs.publish_diagnostics(cycle, self.period, reason.as_deref());
        }
        let rejections = &cycle.rejections;
        // A count that is lower than before has started again at zero.
        self.rejected = rejections.total().min(self.rejected);
        if rejections.total() > self.rejected && self.rejected_due.is_due(now) {
            let count = rejections.total() - self.rejected;
            self.rejected = rejections.total();
            self.log.warn(&format!(
                "{count} rejected, last: {}",
                rejections.last().map(Rejection::text).unwrap_or_default()
            ));
        }
        self.log_replaced(cycle);
    }

    /// Logs that a guard appeared, or is gone.
    fn watch_guards(&mut self, now: Duration) {
        match self.outputs.update_guards(now) {
            Some(GuardState::Gone) => self.log.warn(GUARD_GONE),
            Some(GuardState::Watching) => self.log.info("the arm has a guard"),
            Some(GuardState::None) | None => {}
        }
    }

    /// Warns of keep-outs that are not checked. A refused keep-out is logged when it is refused.
    fn log_not_obeyed(&mut self) {
        self.not_obeyed = self.in_force.not_obeyed();
        self.idle.warn(&self.log, self.not_obeyed.idle.clone());
    }

    /// Logs a change of the law.
    fn log_law(&mut self, cycle: &Snapshot) {
        let law = self.outputs.kind.law(&cycle.controller);
        if let Some(before) = self.law.replace(law).filter(|before| *before != law) {
            self.log.info(&format!("controller {before} -> {law}"));
        }
    }

    /// Logs how many commands the servo's final check has replaced. Only a defect of the program makes a replacement necessary.
    fn log_replaced(&mut self, cycle: &Snapshot) {
        let replaced = &cycle.replaced;
        self.replaced = replaced.count.min(self.replaced);
        let Some(last) = replaced.last.as_ref().filter(|_| replaced.count > self.replaced) else {
            return;
        };
        if self.replaced_due.is_due(cycle.now) {
            let count = replaced.count - self.replaced;
            self.log.error(&format!("{count} commands replaced by braking, last: {last}"));
            self.replaced = replaced.count;
        }
    }

    /// Warns if commands were dropped since the last call. Also warns if other nodes publish commands, and if other nodes have this
    /// node's name. These two warnings are logged only when they change.
    fn watch_publishers(&mut self) {
        let dropped = self.outputs.commands.dropped();
        if dropped > self.dropped {
            let count = dropped - self.dropped;
            self.log.warn(&format!("{count} commands dropped, so the robot did not get them: DDS had no time to send earlier ones (try realtime_priority), or a subscriber to the commands has not acknowledged any for long (end it)"));
        }
        self.dropped = dropped;
        self.rivals.warn(&self.log, self.outputs.commands.rivals());
        self.namesakes.warn(&self.log, self.name_watch.warning());
    }

    fn log_change(&mut self, cycle: &Snapshot) {
        let status = &cycle.status;
        if matches!(status.reconfiguration, Reconfiguration::Searching(_)) {
            // Wait for the result of the search, because the text about the stall depends on it.
            return;
        }
        if status.state != self.state {
            let figures = &status.figures;
            let detail = match status.state {
                State::Settled => figures
                    .arrival_time
                    .filter(|time| self.arrival != Some(*time))
                    .map_or_else(String::new, |time| {
                        format!(" after {time:.2} s and {:.3} m", figures.path_length)
                    }),
                _ => self.reason_text(cycle).map_or_else(String::new, |reason| format!(": {reason}")),
            };
            let text = format!("{} -> {}{detail}", self.state, status.state);
            if status.state.is_warning() || status.reason.is_some() {
                self.log.warn(&text)
            } else {
                self.log.info(&text)
            }
        }
        if status.goal_count != self.goal_count {
            if let Some(goal) = &status.goal {
                self.log.debug(&format!("goal {:?}", pose_numbers(goal.base_from_goal())));
            }
            if status.goal_beyond_reach {
                self.log.warn("the goal is beyond the arm's reach: the arm cannot arrive");
            }
        }
        (self.state, self.goal_count) = (status.state, status.goal_count);
        // Once the arm has arrived, do not log another arrival after a change of the law, or when the goal moves with its frame.
        self.arrival =
            status.figures.arrival_time.filter(|_| self.arrival.is_some() || status.state == State::Settled);
    }

    /// Logs a warning if the arm is not driven for a new reason, although the state is the same. Another method logs each change of the
    /// state, with its reason.
    fn log_reason(&mut self, cycle: &Snapshot) {
        let reason = cycle.status.reason;
        let logged = cycle.status.state != self.state;
        if reason != self.reason
            && !logged
            && let Some(text) = reason.and_then(|_| self.reason_text(cycle))
        {
            self.log.warn(&text);
        }
        self.reason = reason;
    }

    /// Returns the reason why the arm is not driven or does not arrive, with the names of topics, nodes and joints.
    fn reason_text(&self, cycle: &Snapshot) -> Option<String> {
        let status = &cycle.status;
        let Some(reason) = status.reason else {
            let waiting = status.state == State::WaitingForState;
            let rejected = || {
                cycle.rejections.last().map(|why| format!("the last message was rejected: {}", why.text()))
            };
            let waits_for = || self.inputs.iter().find_map(unheard).or_else(rejected);
            let waits_for = || waiting.then(waits_for).flatten().or_else(|| self.silent_arm(cycle));
            return status.explain(&self.outputs.joints).or_else(waits_for);
        };
        let publisher = |of, number| {
            let is_first = matches!(reason, Reason::Rivals(rivals) if rivals.first == number);
            let rival = cycle.rivals[usize::from(!is_first)];
            let name = rival.map_or_else(String::new, |it| self.names.describe(it));
            let topic = match of {
                Contended::JointStates(arm) => self.inputs.get(arm).map_or("", |input| input.topic()),
                // One may send poses, and the other joint goals.
                Contended::Goals => return name,
                Contended::Twists => "~/target_twist",
                Contended::Wrenches => "wrench",
                Contended::Commands(arm) => self.outputs.commands.topic(arm),
            };
            format!("{name} on {topic}")
        };
        let topic = |arm| self.outputs.commands.topic(arm).to_owned();
        Some(reason.explain(|joint| self.outputs.joint(joint), publisher, topic))
    }

    /// Returns a text that names the topic of the silent arm, if there are several arms and one is silent.
    fn silent_arm(&self, cycle: &Snapshot) -> Option<String> {
        let is_silent = matches!(cycle.status.state, State::WaitingForState | State::StaleState);
        let arm = self.inputs.get(cycle.quietest).filter(|_| is_silent && self.inputs.len() > 1)?;
        Some(format!("no joint states on {}", arm.topic()))
    }

    /// Warns if the law would oscillate with the present settings. Checks this once after each change of the settings.
    fn log_demand(&mut self, cycle: &Snapshot) {
        let Some(demand) = cycle.demand else { return };
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

    /// Logs which pairs of parts and keep-outs are not checked, if these pairs have changed.
    fn log_scene(&mut self, cycle: &Snapshot) {
        let is_same = match (&self.scene, &cycle.scene) {
            (Some(before), Some(now)) => Arc::ptr_eq(before, now),
            (before, now) => before.is_none() && now.is_none(),
        };
        if is_same {
            return;
        }
        let left_out = |scene: &Option<Arc<Scene>>| scene.as_ref().map(|it| it.left_out().to_vec());
        if let Some(scene) = cycle.scene.as_ref().filter(|_| left_out(&self.scene) != left_out(&cycle.scene))
        {
            let pair = |(pair, why): &LeftOut| {
                format!("{} ({})", pair.explain(|joint| self.outputs.joint(joint)), why.explain())
            };
            let pairs: Vec<_> = scene.left_out().iter().map(pair).collect();
            let (looked_at, left_out) = (scene.pair_count(), pairs.join(", "));
            self.log.info(&format!("{looked_at} pairs are kept apart; not looked at: {left_out}"));
        }
        self.scene.clone_from(&cycle.scene);
    }

    /// Logs when the latency begins to limit the gain and when it ceases to, at most once per second.
    fn log_limited_gain(&mut self, cycle: &Snapshot) {
        let Status { gain_factor: part, latency, .. } = cycle.status;
        // Hysteresis: between the two thresholds the state does not change.
        let limited = if self.limited { part < 1.0 } else { part < 0.9 };
        if limited == self.limited || !self.limit_due.is_due(cycle.now) {
            return;
        }
        self.limited = limited;
        match limited {
            true => self.log.warn(&format!(
                "gain limited by latency: the law's fastest direction has {} of its gain, as it takes {:.0} ms until a command shows",
                two_digits(part),
                1e3 * latency
            )),
            false => self.log.info("gain no longer limited by latency"),
        }
    }
}

/// Formats a number from 0 to 1 with two significant digits.
fn two_digits(part: f64) -> String {
    if part < 1e-3 {
        format!("{part:.1e}")
    } else {
        format!("{part:.*}", (1.0 - part.log10().floor()) as usize)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_small_part_is_not_zero() {
        let parts = [0.899, 0.45, 0.0123, 0.0021, 0.001, 2.34e-5].map(two_digits);
        assert_eq!(parts, ["0.90", "0.45", "0.012", "0.0021", "0.0010", "2.3e-5"]);
    }
}
