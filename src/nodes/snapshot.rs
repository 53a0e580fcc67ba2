//! What a cycle leaves for the report, which formats, publishes and logs it on a thread of its own.

use super::complaint::due;
use super::ros_inputs::{RejectedGoal, RosInputs};
use dq_algebra::UnitDualQuaternion;
use dq_core::servo::{
    Asker, MOTIONS, Motion, RateBound, Reason, Reconfiguration, RejectionCounts, Replaced, Rivals, Servo,
    State, Status,
};
use dq_kinematics::control::Controller;
use dq_messages::messages::Time;
use dq_ros::ros::EndpointId;
use dq_space::space::Scene;
use dq_wire::{CycleTiming, TimingFigures};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};
use std::time::Duration;

/// Poses and errors go out at 100 Hz, the status at 10 Hz, diagnostics at 1 Hz.
const POSE_INTERVAL: Duration = Duration::from_millis(10);
const STATUS_INTERVAL: Duration = Duration::from_millis(100);
const DIAGNOSTICS_INTERVAL: Duration = Duration::from_secs(1);

/// So many snapshots wait at most for a report that gets no processor.
const WAITING: usize = 64;

/// What is to be published.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Due {
    pub pose: bool,
    pub status: bool,
    pub diagnostics: bool,
}

/// Motions and goals that there is something to say of.
#[derive(Debug, Default)]
pub(super) struct News {
    pub motions: Vec<MotionNews>,
    pub rejected: Vec<RejectedGoal<Option<EndpointId>>>,
}

/// A motion that there is something to say of.
#[derive(Debug)]
pub(super) struct MotionNews {
    pub motion: Motion,
    pub asker: Option<EndpointId>,
    /// The frame in which its goal was given.
    pub goal_frame: String,
}

impl News {
    /// Adds the servo's news of its motions.
    fn add(&mut self, servo: &mut Servo, live: &RosInputs) {
        let motions = servo.take_motions();
        self.motions.extend(motions.map(|motion| {
            let goal_frame = live.frame_of(motion.stamp).to_owned();
            MotionNews { asker: live.asker(motion.asker), motion, goal_frame }
        }));
    }

    /// All of it, with the goals that were rejected.
    fn take(&mut self, live: &mut RosInputs) -> Self {
        let Self { motions, mut rejected } = std::mem::take(self);
        let more = live.rejected.take();
        rejected.extend(more.into_iter().map(|RejectedGoal { stamp, by, why }| {
            let by = live.asker(Asker::Goal(by));
            RejectedGoal { stamp, by, why }
        }));
        Self { motions, rejected }
    }

    /// What could not be said: it is said later, of very much the newest.
    fn put_back(&mut self, mut before: Self) {
        before.motions.append(&mut self.motions);
        before.rejected.append(&mut self.rejected);
        before.motions.drain(..before.motions.len().saturating_sub(MOTIONS));
        before.rejected.drain(..before.rejected.len().saturating_sub(MOTIONS));
        *self = before;
    }
}

/// The servo after a cycle. To make one allocates nothing, but for news.
#[derive(Debug)]
pub(super) struct Snapshot {
    /// The cycle's time.
    pub now: Duration,
    pub due: Due,
    /// When the joint states in force were made.
    pub stamp: Time,
    /// The controlled pose; none before every arm was heard.
    pub pose: Option<UnitDualQuaternion>,
    pub status: Status,
    /// What the arm must keep out of.
    pub scene: Option<Arc<Scene>>,
    pub controller: Controller,
    /// What the law asks of the robot, where nobody has looked at it since the settings were changed.
    pub demand: Option<RateBound>,
    /// 0 where no status is due.
    pub smallest_singular_value: f64,
    pub rejections: Arc<RejectionCounts>,
    pub replaced: Replaced,
    pub news: News,
    /// Zeros where neither status nor diagnostics are due.
    pub timing: TimingFigures,
    /// The two publishers that the reason is about, where it is about two.
    pub rivals: [Option<EndpointId>; 2],
    /// Who asked for motion last, by a message.
    pub asker: Option<EndpointId>,
    /// The arm that has been silent longest.
    pub quietest: usize,
}

/// The cycle's end of the queue.
pub(super) struct Snapshots {
    queue: SyncSender<Snapshot>,
    last: Option<Changes>,
    /// What is to be said with the next status.
    news: News,
    /// For which settings it was left what the law asks for.
    judged: Option<u64>,
    pose: Duration,
    status: Duration,
    diagnostics: Duration,
}

/// A change of it is left for the report at once.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Changes {
    state: State,
    reason: Option<Reason>,
    reconfiguration: Reconfiguration,
    goal_count: u64,
    configurations: u64,
}

/// The report has ended, which it does only by a panic.
#[derive(Debug)]
pub(super) struct ReportEnded;

/// A queue of snapshots, which has its room from the start.
pub(super) fn queue() -> (Snapshots, Receiver<Snapshot>) {
    let (queue, snapshots) = sync_channel(WAITING);
    let [pose, status, diagnostics] = [Duration::ZERO; 3];
    (
        Snapshots { queue, last: None, news: News::default(), judged: None, pose, status, diagnostics },
        snapshots,
    )
}

impl Snapshots {
    /// Leaves what is due at `now`, or new. What finds no room is lost, but for news, which the next cycle tries to leave.
    ///
    /// # Errors
    /// [`ReportEnded`].
    pub fn leave(
        &mut self,
        now: Duration,
        servo: &mut Servo,
        live: &mut RosInputs,
        timing: &CycleTiming,
    ) -> Result<(), ReportEnded> {
        self.news.add(servo, live);
        let status = servo.status();
        let changes = Changes {
            state: status.state,
            reason: status.reason,
            reconfiguration: status.reconfiguration,
            goal_count: status.goal_count,
            configurations: servo.configurations(),
        };
        let is_new = self.last != Some(changes) || !self.news.motions.is_empty();
        let due = Due {
            pose: due(&mut self.pose, now, POSE_INTERVAL),
            status: due(&mut self.status, now, STATUS_INTERVAL) || is_new,
            diagnostics: due(&mut self.diagnostics, now, DIAGNOSTICS_INTERVAL),
        };
        if due == Due::default() {
            return Ok(());
        }
        let demand = if self.judged == Some(changes.configurations) { None } else { servo.demand() };
        let judged = demand.is_some();
        let timed = due.status || due.diagnostics;
        let snapshot = Snapshot {
            now,
            due,
            stamp: live.stamp(),
            pose: servo.pose(),
            status: status.clone(),
            scene: servo.settings().scene.clone(),
            controller: servo.settings().controller,
            demand,
            smallest_singular_value: if due.status { servo.smallest_singular_value() } else { 0.0 },
            rejections: servo.rejections().clone(),
            replaced: servo.replaced().clone(),
            news: if due.status { self.news.take(live) } else { News::default() },
            timing: if timed { timing.figures() } else { TimingFigures::default() },
            rivals: rivals(status.reason, live),
            asker: status.consent.ask().and_then(|ask| live.asker(ask.by)),
            quietest: servo.quietest_arm(),
        };
        match self.queue.try_send(snapshot) {
            Ok(()) => {
                self.last = Some(changes);
                if judged {
                    self.judged = Some(changes.configurations);
                }
                Ok(())
            }
            Err(TrySendError::Full(snapshot)) => {
                self.news.put_back(snapshot.news);
                Ok(())
            }
            Err(TrySendError::Disconnected(_)) => Err(ReportEnded),
        }
    }
}

/// Who the two publishers are that `reason` is about.
fn rivals(reason: Option<Reason>, live: &RosInputs) -> [Option<EndpointId>; 2] {
    match reason {
        Some(Reason::Rivals(Rivals { of, first, second })) => {
            [first, second].map(|number| live.publisher(of, number))
        }
        _ => [None; 2],
    }
}
