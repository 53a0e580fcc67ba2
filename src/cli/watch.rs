//! Sends goals to a servo and watches it pursue them.

use crate::nodes::{StatusReport, Wiring};
use crate::ros::messages::{DiagnosticStatus, Header, Point, Pose, PoseStamped, Quaternion};
use crate::ros::{Contract, Node, Publisher, RosError, Subscription};
use crate::servo::State;
use crate::stderr;
use indicatif::{ProgressBar, ProgressStyle};
use std::io::IsTerminal;
use std::time::{Duration, Instant};
use thiserror::Error;

/// A goal: x y z [m], then qx qy qz qw.
pub(super) type GoalNumbers = [f64; 7];

/// How long to wait for the servo to be there.
pub(super) const DISCOVERY: Duration = Duration::from_secs(10);

/// A servo that stands this long will not move by itself.
const PATIENCE: Duration = Duration::from_secs(5);

/// A goal gets this long to be taken, or to be rejected.
const GRACE: Duration = Duration::from_millis(500);

/// Why the arm did not arrive.
#[derive(Debug, Error)]
pub(super) enum NotArrived {
    #[error(
        "no status from a servo within {0} s: is `dq_servo servo` running, in this domain and namespace?"
    )]
    NoServo(f64),
    #[error("the servo rejected the goal: {0}")]
    Rejected(String),
    #[error("the goal is beyond the arm's reach; the arm stays {0}")]
    BeyondReach(Remaining),
    #[error("not arrived after {seconds:.0} s: state {state}, {remaining}")]
    TimedOut { seconds: f64, state: State, remaining: Remaining },
    #[error(
        "the servo has no joint states (state {0}): is the robot running, for example `dq_servo puma560`?"
    )]
    NoRobot(State),
    #[error("the arm gets no nearer: state {state}, {remaining}")]
    Stalled { state: State, remaining: Remaining },
    #[error("the servo has another goal: somebody else publishes goals too")]
    OtherGoal,
}

/// How far the arm is from its goal.
#[derive(Clone, Copy, Debug)]
pub(super) struct Remaining {
    position: f64,
    rotation: f64,
}

impl std::fmt::Display for Remaining {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{:.1} mm and {:.2}° from the goal", self.position * 1e3, self.rotation.to_degrees())
    }
}

impl From<&StatusReport> for Remaining {
    fn from(report: &StatusReport) -> Self {
        Self { position: report.figures.position_error, rotation: report.figures.rotation_error }
    }
}

/// The client side of a servo.
pub(super) struct Watch {
    goals: Publisher<PoseStamped>,
    statuses: Subscription<DiagnosticStatus>,
    frame: String,
    readers: usize,
}

impl Watch {
    /// On `node`, for the servo called `servo`; goals are in `frame` (empty: the base frame).
    pub fn new<T: Wiring>(node: &mut Node, servo: &str, frame: &str) -> Result<Self, RosError> {
        let contract = T::contract(Contract::builtin()?);
        let status = contract.topic::<DiagnosticStatus>("~/status", crate::ros::Direction::Out)?;
        let goal = contract.topic::<PoseStamped>(T::GOAL, crate::ros::Direction::In)?;
        Ok(Self {
            statuses: node.subscription_as(status, &format!("{servo}/status"))?,
            goals: node.publisher_as(goal, T::GOAL)?,
            frame: frame.to_owned(),
            readers: 1,
        })
    }

    /// Goals wait for a recorder too.
    pub fn expect_recorder(&mut self) {
        self.readers = 2;
    }

    /// Waits until the servo has its first joint state.
    pub async fn servo_ready(&self) -> Result<StatusReport, NotArrived> {
        let ready = async {
            loop {
                let report = self.next_report().await;
                if report.state != State::WaitingForState {
                    return report;
                }
            }
        };
        tokio::time::timeout(DISCOVERY, ready).await.map_err(|_| NotArrived::NoServo(DISCOVERY.as_secs_f64()))
    }

    /// Sends `goal` and waits until the arm has settled there, or can be said not to.
    pub async fn go(&self, goal: GoalNumbers, timeout: Duration) -> anyhow::Result<StatusReport> {
        let first = tokio::time::timeout(DISCOVERY, self.next_report())
            .await
            .map_err(|_| NotArrived::NoServo(DISCOVERY.as_secs_f64()))?;
        self.goals.wait_for_readers(self.readers, DISCOVERY).await?;
        self.goals.publish(self.message(goal));
        let mut progress = Progress::new();
        let started = Instant::now();
        let mut driven = started;
        loop {
            let report = match tokio::time::timeout(Duration::from_secs(2), self.next_report()).await {
                Ok(report) => report,
                Err(_) => return Err(NotArrived::NoServo(2.0).into()),
            };
            // Other messages may be rejected too, so a goal gets a moment to be taken.
            let refused =
                report.rejected > first.rejected && report.goal.is_none_or(|given| !same(&given, &goal));
            if refused && started.elapsed() > GRACE {
                return Err(NotArrived::Rejected(report.last_rejection.unwrap_or_default()).into());
            }
            if let Some(end) = judge(&report, &goal, started.elapsed(), timeout, &mut driven)? {
                progress.finish();
                return Ok(end);
            }
            progress.show(&report);
        }
    }

    async fn next_report(&self) -> StatusReport {
        loop {
            if let Some(report) = StatusReport::from_message(&self.statuses.next().await) {
                return report;
            }
        }
    }

    fn message(&self, [x, y, z, qx, qy, qz, qw]: GoalNumbers) -> PoseStamped {
        PoseStamped {
            header: Header::now(&self.frame),
            pose: Pose {
                position: Point { x, y, z },
                orientation: Quaternion { x: qx, y: qy, z: qz, w: qw },
            },
        }
    }
}

/// Whether the pursuit is over at this report, one way or the other. `driven` is when the servo last drove the arm.
fn judge(
    report: &StatusReport,
    goal: &GoalNumbers,
    elapsed: Duration,
    timeout: Duration,
    driven: &mut Instant,
) -> Result<Option<StatusReport>, NotArrived> {
    let (remaining, state) = (Remaining::from(report), report.state);
    let pursued = report.goal.is_some_and(|given| same(&given, goal));
    if pursued && state == State::Settled {
        return Ok(Some(report.clone()));
    }
    if elapsed > timeout && report.goal_beyond_reach {
        return Err(NotArrived::BeyondReach(remaining));
    }
    if elapsed > timeout {
        return Err(NotArrived::TimedOut { seconds: timeout.as_secs_f64(), state, remaining });
    }
    if !pursued {
        // The goal is on its way; one that never comes to be pursued was replaced.
        let lost = elapsed > Duration::from_secs(2) && report.goal.is_some();
        return if lost { Err(NotArrived::OtherGoal) } else { Ok(None) };
    }
    if matches!(state, State::Tracking | State::JointLimit) {
        *driven = Instant::now();
    }
    // The servo has been patient already before it says that it stalled.
    let patience = if state == State::Stalled { GRACE } else { PATIENCE };
    match driven.elapsed() > patience {
        true if matches!(state, State::WaitingForState | State::StaleState) => {
            Err(NotArrived::NoRobot(state))
        }
        true if report.goal_beyond_reach => Err(NotArrived::BeyondReach(remaining)),
        true => Err(NotArrived::Stalled { state, remaining }),
        false => Ok(None),
    }
}

/// Whether two goals are the same pose: the servo normalises, and q and −q are one.
fn same(a: &GoalNumbers, b: &GoalNumbers) -> bool {
    let position = (0..3).all(|i| (a[i] - b[i]).abs() < 1e-9);
    let norm = |q: &GoalNumbers| (3..7).map(|i| q[i] * q[i]).sum::<f64>().sqrt();
    let dot: f64 = (3..7).map(|i| a[i] * b[i]).sum();
    position && (dot.abs() / (norm(a) * norm(b)) - 1.0).abs() < 1e-9
}

/// Shows the way to the goal on stderr: a line that moves on a terminal, a line each second elsewhere.
struct Progress {
    bar: ProgressBar,
    told: Option<Instant>,
}

impl Progress {
    fn new() -> Self {
        let bar =
            if std::io::stderr().is_terminal() { ProgressBar::new_spinner() } else { ProgressBar::hidden() };
        // The template is a constant; without it the default one serves.
        if let Ok(style) = ProgressStyle::with_template("{spinner} {msg}") {
            bar.set_style(style);
        }
        Self { bar, told: None }
    }

    fn show(&mut self, report: &StatusReport) {
        let text = format!(
            "{:<15} {:<8} {:5.1} s  {}",
            report.law_and_primitive(),
            report.state.name(),
            report.figures.elapsed,
            Remaining::from(report)
        );
        if self.bar.is_hidden() && self.told.is_none_or(|last| last.elapsed() >= Duration::from_secs(1)) {
            self.told = Some(Instant::now());
            stderr::line(text.clone());
        }
        self.bar.set_message(text);
        self.bar.tick();
    }

    fn finish(&self) {
        self.bar.finish_and_clear();
    }
}
