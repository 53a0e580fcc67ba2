//! What a cycle leaves for the report, which formats, publishes and logs it on a thread of its own.

use super::cycle_thread::due;
use super::live::Live;
use crate::dq::UnitDualQuaternion;
use crate::ros::EndpointId;
use crate::servo::{
    CycleTiming, Demand, Reason, RejectionCounts, Replaced, Rivals, Servo, State, Status, TimingFigures,
};
use crate::wire::messages::Time;
use crate::wire::{GoalFates, Wiring};
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

/// The servo after a cycle. To make one allocates nothing.
#[derive(Debug)]
pub(super) struct Snapshot<C> {
    /// The cycle's time.
    pub now: Duration,
    pub due: Due,
    /// When the joint states in force were made.
    pub stamp: Time,
    /// The controlled pose; none before every arm was heard.
    pub pose: Option<UnitDualQuaternion>,
    pub status: Status,
    pub controller: C,
    /// What the law asks of the robot, where nobody has looked at it since the settings were changed.
    pub demand: Option<Demand>,
    /// 0 where no status is due.
    pub smallest_singular_value: f64,
    pub rejections: Arc<RejectionCounts>,
    pub replaced: Replaced,
    pub fates: Arc<GoalFates>,
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
pub(super) struct Snapshots<C> {
    queue: SyncSender<Snapshot<C>>,
    last: Option<News>,
    /// For which settings it was left what the law asks for.
    judged: Option<u64>,
    pose: Duration,
    status: Duration,
    diagnostics: Duration,
}

/// A change of it is left for the report at once.
#[derive(Clone, Copy, Debug, PartialEq)]
struct News {
    state: State,
    reason: Option<Reason>,
    goal_count: u64,
    configurations: u64,
}

/// The report has ended, which it does only by a panic.
#[derive(Debug)]
pub(super) struct ReportEnded;

/// A queue of snapshots, which has its room from the start.
pub(super) fn queue<C>() -> (Snapshots<C>, Receiver<Snapshot<C>>) {
    let (queue, snapshots) = sync_channel(WAITING);
    let [pose, status, diagnostics] = [Duration::ZERO; 3];
    (Snapshots { queue, last: None, judged: None, pose, status, diagnostics }, snapshots)
}

impl<C: Clone> Snapshots<C> {
    /// Leaves what is due at `now`, or new. What finds no room is lost, but for news, which the next cycle tries to leave.
    ///
    /// # Errors
    /// [`ReportEnded`].
    pub fn leave<T: Wiring<Controller = C>>(
        &mut self,
        now: Duration,
        servo: &Servo<T>,
        live: &Live<C>,
        timing: &CycleTiming,
    ) -> Result<(), ReportEnded> {
        let status = servo.status();
        let news = News {
            state: status.state,
            reason: status.reason,
            goal_count: status.goal_count,
            configurations: servo.configurations(),
        };
        let is_new = self.last != Some(news);
        let due = Due {
            pose: due(&mut self.pose, now, POSE_INTERVAL),
            status: due(&mut self.status, now, STATUS_INTERVAL) || is_new,
            diagnostics: due(&mut self.diagnostics, now, DIAGNOSTICS_INTERVAL),
        };
        if due == Due::default() {
            return Ok(());
        }
        let demand = if self.judged == Some(news.configurations) { None } else { servo.demand() };
        let judged = demand.is_some();
        let timed = due.status || due.diagnostics;
        let snapshot = Snapshot {
            now,
            due,
            stamp: live.stamp(),
            pose: servo.pose(),
            status: status.clone(),
            controller: servo.settings().controller.clone(),
            demand,
            smallest_singular_value: if due.status { servo.smallest_singular_value() } else { 0.0 },
            rejections: servo.rejections().clone(),
            replaced: servo.replaced().clone(),
            fates: live.fates.clone(),
            timing: if timed { timing.figures() } else { TimingFigures::default() },
            rivals: rivals(status.reason, live),
            asker: status.consent.asked().and_then(|asked| live.asker(asked.by)),
            quietest: servo.quietest_arm(),
        };
        match self.queue.try_send(snapshot) {
            Ok(()) => {
                self.last = Some(news);
                if judged {
                    self.judged = Some(news.configurations);
                }
                Ok(())
            }
            Err(TrySendError::Full(_)) => Ok(()),
            Err(TrySendError::Disconnected(_)) => Err(ReportEnded),
        }
    }
}

/// Who the two publishers are that `reason` is about.
fn rivals<C>(reason: Option<Reason>, live: &Live<C>) -> [Option<EndpointId>; 2] {
    match reason {
        Some(Reason::Rivals(Rivals { of, first, second })) => {
            [first, second].map(|number| live.publisher(of, number))
        }
        _ => [None; 2],
    }
}
