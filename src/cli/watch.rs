//! Sends goals to a servo and watches its progress.

use super::not_arrived::NotArrived;
use super::own_goal::OwnGoal;
use super::spinner::Spinner;
use dq_messages::messages::{DiagnosticStatus, Header, Message, PoseStamped, Time};
use dq_messages::{Direction, PoseNumbers};
use dq_ros::ros::{Node, Publisher, RosError, Subscription};
use dq_ros::stderr;
use dq_wire::distance;
use dq_wire::{Contract, MotionReport, ServoKind, StatusReport};
use std::time::{Duration, Instant};

/// The time to wait for the servo.
pub(super) const DISCOVERY: Duration = Duration::from_secs(10);

/// If the servo has not appeared after this time, a message says that the command is waiting for the servo.
const UNUSUAL_DISCOVERY: Duration = Duration::from_millis(2500);

/// The shortest time to wait for the servo, even if the timeout of the motion is shorter.
const SHORTEST_DISCOVERY: Duration = Duration::from_secs(2);

/// The longest time to wait for the servo's next report. The servo reports ten times per second.
const REPORT: Duration = Duration::from_millis(500);

/// The client of a servo, which sends goals as messages of type `M`.
pub(super) struct Watch<M: Message = PoseStamped> {
    goals: Publisher<M>,
    statuses: Subscription<DiagnosticStatus>,
    motions: Subscription<DiagnosticStatus>,
    /// Whether goals are in a frame that the servo must look up in TF.
    in_frame: bool,
    /// The last goal that was sent.
    own: Option<OwnGoal>,
}

/// A goal message, and its stamp.
pub(super) type StampedGoal<M> = (M, Time);

/// Returns the message for the goal pose `goal` with this stamp in `frame` (empty: the base frame).
pub(super) fn pose_goal(goal: PoseNumbers, stamp: Time, frame: &str) -> StampedGoal<PoseStamped> {
    let header = Header { stamp: stamp.clone(), frame_id: frame.to_owned() };
    (PoseStamped { header, pose: goal.into() }, stamp)
}

impl<M: Message + Clone> Watch<M> {
    /// Creates the client of the servo `servo`, which is of this kind, on `node`. The client sends goals to the topic that the
    /// contract calls `topic`. `in_frame` is true if goals are in a frame that the servo must look up in TF.
    pub fn new(
        node: &mut Node,
        kind: ServoKind,
        servo: &str,
        topic: &str,
        in_frame: bool,
    ) -> Result<Self, RosError> {
        let contract = kind.contract(Contract::builtin()?);
        let status = contract.topic::<DiagnosticStatus>("~/status", Direction::Out)?;
        let motions = contract.topic::<DiagnosticStatus>("~/motions", Direction::Out)?;
        let goal = contract.topic::<M>(topic, Direction::In)?;
        Ok(Self {
            statuses: node.subscription_as(status, &format!("{servo}/status"))?,
            motions: node.subscription_as(motions, &format!("{servo}/motions"))?,
            goals: node.publisher_as(goal, &of_servo(topic, servo))?,
            in_frame,
            own: None,
        })
    }

    /// Waits for the servo's first report, for at most `timeout`. A `timeout` below `SHORTEST_DISCOVERY` or above `DISCOVERY` is
    /// replaced by that bound.
    pub async fn find(&self, timeout: Duration) -> Result<(), NotArrived> {
        let patience = DISCOVERY.min(timeout.max(SHORTEST_DISCOVERY));
        let first = async {
            if tokio::time::timeout(UNUSUAL_DISCOVERY, self.next_report()).await.is_err() {
                stderr::line(format!(
                    "no servo found so far; waiting for up to {} s",
                    patience.as_secs_f64()
                ));
                self.next_report().await;
            }
        };
        let silent = |_| NotArrived::NoServo(patience.as_secs_f64());
        tokio::time::timeout(patience, first).await.map_err(silent)
    }

    /// Sends a goal, and returns the motion to the goal once the arm has arrived. Returns an error once it is certain that the arm
    /// will not arrive.
    pub async fn go(
        &mut self,
        (message, stamp): StampedGoal<M>,
        timeout: Duration,
    ) -> super::Result<MotionReport> {
        self.find(timeout).await?;
        self.goals.wait_for_readers(DISCOVERY).await?;
        let Self { goals, statuses, motions, in_frame, own } = self;
        let own = own.insert(OwnGoal::sent(&stamp, *in_frame));
        goals.publish(message.clone());
        let mut progress = ProgressLines::new();
        loop {
            let report = tokio::select! {
                motion = motions.next() => {
                    let motion = MotionReport::from_message(&motion);
                    let waits = motion.iter().filter(|it| own.is_of(it) && it.may_be_reconfigured());
                    waits.for_each(|motion| stderr::line(motion.sentence()));
                    if let Some(end) = motion.and_then(|motion| own.hear(motion).transpose()) {
                        return Ok(end?);
                    }
                    continue;
                }
                report = tokio::time::timeout(StatusReport::SILENCE, next_report(statuses)) => report,
            };
            let Ok(report) = report else {
                return Err(NotArrived::Silent(StatusReport::SILENCE.as_secs_f64()).into());
            };
            own.watch(&report, timeout)?;
            if own.send_again() {
                goals.publish(message.clone());
            }
            if own.is_left(&report) == Some(true) {
                progress.show(&report);
            }
        }
    }

    /// Returns whether the goal that this client sent last is in force, or may still come into force. Returns `None` if the servo's
    /// reports do not show this in time.
    pub async fn has_own_goal(&self) -> Option<bool> {
        let Some(own) = &self.own else { return Some(false) };
        let is_left = async {
            loop {
                if let Some(is_left) = own.is_left(&self.next_report().await) {
                    return is_left;
                }
            }
        };
        tokio::time::timeout(own.open_for() + REPORT, is_left).await.ok()
    }

    pub(super) async fn next_report(&self) -> StatusReport {
        next_report(&self.statuses).await
    }
}

/// Replaces the `~` in the topic name `name` by the name of the node `servo`.
pub(super) fn of_servo(name: &str, servo: &str) -> String {
    name.replacen('~', servo, 1)
}

async fn next_report(statuses: &Subscription<DiagnosticStatus>) -> StatusReport {
    loop {
        if let Some(report) = StatusReport::from_message(&statuses.next().await) {
            return report;
        }
    }
}

/// Shows the progress on stderr: on a terminal a line that is updated, otherwise a new line per second.
struct ProgressLines {
    spinner: Option<Spinner>,
    logged: Option<Instant>,
}

impl ProgressLines {
    fn new() -> Self {
        Self { spinner: Spinner::on_terminal(), logged: None }
    }

    fn show(&mut self, report: &StatusReport) {
        let way = report.figures.map_or_else(String::new, |figures| {
            format!("  {:5.1} s  {}", figures.elapsed, distance(&figures))
        });
        let text = format!("{:<15} {:<8}{way}", report.law_and_aim(), report.state.name());
        match &self.spinner {
            Some(spinner) => spinner.show(text),
            None if self.logged.is_none_or(|last| last.elapsed() >= Duration::from_secs(1)) => {
                self.logged = Some(Instant::now());
                stderr::line(text);
            }
            None => {}
        }
    }
}
