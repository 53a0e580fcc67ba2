//! The snapshots that the cycle sends to the [`Report`](super::report::Report). The report formats, publishes and logs them on its
//! own thread.

use super::ros_inputs::{RejectedGoal, RosInputs};
use super::throttle::Throttle;
use dq_algebra::UnitDualQuaternion;
use dq_core::servo::{
    MOTIONS, Motion, RateBound, Reason, Reconfiguration, RejectionCounts, Replaced, Requester, Rivals, Servo,
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

/// The interval at which poses and pose errors are published (100 Hz). The next constants are the intervals of the status (10 Hz)
/// and of diagnostics (1 Hz).
const POSE_INTERVAL: Duration = Duration::from_millis(10);
const STATUS_INTERVAL: Duration = Duration::from_millis(100);
const DIAGNOSTICS_INTERVAL: Duration = Duration::from_secs(1);

/// The largest number of snapshots in the queue to the report's thread.
const WAITING: usize = 64;

/// The messages that are due to be published.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Due {
    pub pose: bool,
    pub status: bool,
    pub diagnostics: bool,
}

/// Updates of motions and goals that are still to be published.
#[derive(Debug, Default)]
pub(super) struct MotionUpdates {
    pub motions: Vec<MotionUpdate>,
    pub rejected: Vec<RejectedGoal<Option<EndpointId>>>,
}

/// An update of a motion.
#[derive(Debug)]
pub(super) struct MotionUpdate {
    pub motion: Motion,
    pub asker: Option<EndpointId>,
    /// The frame of the motion's goal.
    pub goal_frame: String,
}

impl MotionUpdates {
    /// Adds the servo's updates of its motions.
    fn add(&mut self, servo: &mut Servo, live: &RosInputs) {
        let motions = servo.take_motions();
        self.motions.extend(motions.map(|motion| {
            let goal_frame = live.frame_of(motion.stamp).to_owned();
            MotionUpdate { asker: live.asker(motion.asker), motion, goal_frame }
        }));
    }

    /// Returns all updates of motions and the rejected goals, and clears them.
    fn take(&mut self, live: &mut RosInputs) -> Self {
        let Self { motions, mut rejected } = std::mem::take(self);
        let more = live.rejected.take();
        rejected.extend(more.into_iter().map(|RejectedGoal { stamp, by, why }| {
            let by = live.asker(Requester::Goal(by));
            RejectedGoal { stamp, by, why }
        }));
        Self { motions, rejected }
    }

    /// Puts back updates that could not be published, so that they are published later. If there are too many updates, keeps only
    /// the newest.
    fn put_back(&mut self, mut before: Self) {
        before.motions.append(&mut self.motions);
        before.rejected.append(&mut self.rejected);
        before.motions.drain(..before.motions.len().saturating_sub(MOTIONS));
        before.rejected.drain(..before.rejected.len().saturating_sub(MOTIONS));
        *self = before;
    }
}

/// The state of the servo after a cycle. Creating a snapshot allocates only for updates of motions.
#[derive(Debug)]
pub(super) struct Snapshot {
    /// The time of the cycle.
    pub now: Duration,
    pub due: Due,
    /// The time of the joint states in use.
    pub stamp: Time,
    /// The controlled pose; `None` until every arm has sent a joint state.
    pub pose: Option<UnitDualQuaternion>,
    pub status: Status,
    /// The keep-outs and keep-ins.
    pub scene: Option<Arc<Scene>>,
    pub controller: Controller,
    /// The law's rate and the largest stable rate, in one snapshot after each change of the settings; `None` in all other snapshots.
    pub demand: Option<RateBound>,
    /// The smallest singular value of the controlled Jacobian; 0 if no status is due.
    pub smallest_singular_value: f64,
    pub rejections: Arc<RejectionCounts>,
    pub replaced: Replaced,
    pub updates: MotionUpdates,
    /// The timing of the cycle; zeros if neither status nor diagnostics are due.
    pub timing: TimingFigures,
    /// The two publishers in conflict, if a conflict is the reason for the state.
    pub rivals: [Option<EndpointId>; 2],
    /// The publisher of the message that made the last request; `None` if a service call made it.
    pub asker: Option<EndpointId>,
    /// The index of the arm whose last joint state is the oldest.
    pub quietest: usize,
}

/// The sending end of the queue of snapshots, which the cycle owns.
pub(super) struct Snapshots {
    queue: SyncSender<Snapshot>,
    last: Option<Changes>,
    /// The updates of motions to send with the next status.
    updates: MotionUpdates,
    /// The number of changes of the settings when the law's rate was last sent; `None` if the rate was never sent. The rate is sent once
    /// per change of the settings.
    judged: Option<u64>,
    pose: Throttle,
    status: Throttle,
    diagnostics: Throttle,
}

/// The part of the status whose changes are reported at once.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Changes {
    state: State,
    reason: Option<Reason>,
    reconfiguration: Reconfiguration,
    goal_count: u64,
    configurations: u64,
}

/// The error that the report's thread has ended. The thread ends early only if it panics.
#[derive(Debug)]
pub(super) struct ReportEnded;

/// Returns both ends of a queue of snapshots. The memory of the queue is allocated once.
pub(super) fn queue() -> (Snapshots, Receiver<Snapshot>) {
    let (queue, snapshots) = sync_channel(WAITING);
    let [pose, status, diagnostics] =
        [POSE_INTERVAL, STATUS_INTERVAL, DIAGNOSTICS_INTERVAL].map(Throttle::new);
    (
        Snapshots {
            queue,
            last: None,
            updates: MotionUpdates::default(),
            judged: None,
            pose,
            status,
            diagnostics,
        },
        snapshots,
    )
}

impl Snapshots {
    /// Sends a snapshot if one is due at `now` or something has changed. If the queue is full, the snapshot is lost, except that
    /// its updates are sent with a later snapshot.
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
        self.updates.add(servo, live);
        let status = servo.status();
        let changes = Changes {
            state: status.state,
            reason: status.reason,
            reconfiguration: status.reconfiguration,
            goal_count: status.goal_count,
            configurations: servo.configurations(),
        };
        let is_new = self.last != Some(changes) || !self.updates.motions.is_empty();
        let due = Due {
            pose: self.pose.is_due(now),
            status: self.status.is_due(now) || is_new,
            diagnostics: self.diagnostics.is_due(now),
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
            updates: if due.status { self.updates.take(live) } else { MotionUpdates::default() },
            timing: if timed { timing.figures() } else { TimingFigures::default() },
            rivals: rivals(status.reason, live),
            asker: status.consent.request().and_then(|request| live.asker(request.by)),
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
                self.updates.put_back(snapshot.updates);
                Ok(())
            }
            Err(TrySendError::Disconnected(_)) => Err(ReportEnded),
        }
    }
}

/// Returns the two publishers in conflict, if `reason` is such a conflict. An unknown publisher is `None`.
fn rivals(reason: Option<Reason>, live: &RosInputs) -> [Option<EndpointId>; 2] {
    match reason {
        Some(Reason::Rivals(Rivals { of, first, second })) => {
            [first, second].map(|number| live.publisher(of, number))
        }
        _ => [None; 2],
    }
}
