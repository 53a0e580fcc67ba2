//! Pictures of a servo node for viewers: markers, the tool's path, and a goal that a user can drag.
//!
//! The cycle only stores the data to draw ([`Moment`]). It never waits: if another thread is reading the stored data, the cycle
//! drops the new data.

mod goal_marker;
mod keep_outs;
mod markers;
mod trace;

pub(super) use markers::Moment;

use super::node_setup::NodeSetup;
use super::senders::{Clocks, Senders};
use dq_messages::messages::{Header, PoseStamped};
use dq_messages::visualization::{
    GetInteractiveMarkers, InteractiveMarkerFeedback, InteractiveMarkerUpdate, MarkerArray, Path,
};
use dq_ros::ros::{Logger, OwnTopic, Publisher, RosError, Subscription};
use dq_wire::Contract;
use goal_marker::GoalMarker;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};
use tokio::time::{MissedTickBehavior, interval};
use trace::Trace;

/// The interval between pictures. Ten per second look continuous.
const INTERVAL: Duration = Duration::from_millis(100);

/// The interval between pictures of an arm at rest, for viewers that join late.
const REST: Duration = Duration::from_secs(1);

/// The data that the next picture shows. The cycle writes them, and the thread that draws reads them.
#[derive(Clone, Default)]
pub(super) struct MomentSlot(Arc<Mutex<Moment>>);

impl MomentSlot {
    /// Stores `moment`, which the next picture shows. Drops `moment` if another thread is reading the slot.
    pub fn leave(&self, moment: Moment) {
        if let Ok(mut place) = self.0.try_lock() {
            *place = moment;
        }
    }

    fn look(&self) -> Moment {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }
}

/// The publishers of the pictures, with the data of the latest pictures.
struct Pictures {
    slot: MomentSlot,
    markers: Publisher<MarkerArray>,
    path: Publisher<Path>,
    updates: Publisher<InteractiveMarkerUpdate>,
    feedback: Subscription<InteractiveMarkerFeedback>,
    goal_topic: OwnTopic<PoseStamped>,
    /// The publisher of goals. It is created when a viewer first shows the handles of the goal, and is `None` until then: otherwise
    /// every servo would appear in the graph as a publisher of goals.
    goals: Option<Publisher<PoseStamped>>,
    goal: Arc<Mutex<GoalMarker>>,
    trace: Trace,
    /// The number of keep-out markers and the number of keep-in markers in the latest message.
    solids: [usize; 2],
    last: Moment,
    sent: Instant,
    started: Instant,
    /// Computes the age of users' actions, so that drags from before the start of this node are ignored.
    senders: Senders,
    log: Logger,
}

/// Publishes pictures of the data that the cycle stores in the returned slot, until the node is dropped. If a user drags the goal,
/// publishes the new goal like any other publisher of goals. `frame` is the frame of the goal.
///
/// # Errors
/// [`RosError`].
pub(super) fn serve(setup: &mut NodeSetup, frame: &str) -> Result<MomentSlot, RosError> {
    let NodeSetup { node, kind, contract } = setup;
    let goal_topic = kind.goal_topic();
    let pictures = Contract::builtin()?.pictures;
    let goal = Arc::new(Mutex::new(GoalMarker::new(&node.name().fully_qualified(), frame)));
    let asked = goal.clone();
    node.serve::<GetInteractiveMarkers>("~/goal/get_interactive_markers", move |_| locked(&asked).all())?;
    let slot = MomentSlot::default();
    let mut pictures = Pictures {
        slot: slot.clone(),
        markers: node.publisher(&pictures, "~/markers")?,
        path: node.publisher(&pictures, "~/path")?,
        updates: node.publisher(&pictures, "~/goal/update")?,
        feedback: node.subscription(&pictures, "~/goal/feedback")?,
        goal_topic: node.own_input(contract, goal_topic)?,
        goals: None,
        goal,
        trace: Trace::default(),
        solids: [0; 2],
        last: Moment::default(),
        sent: Instant::now(),
        started: Instant::now(),
        senders: Senders::default(),
        log: node.log().clone(),
    };
    node.run(async move {
        let mut ticks = interval(INTERVAL);
        ticks.set_missed_tick_behavior(MissedTickBehavior::Delay);
        loop {
            ticks.tick().await;
            pictures.publish();
        }
    });
    Ok(slot)
}

impl Pictures {
    fn publish(&mut self) {
        let moment = self.slot.look();
        let Some(tool) = &moment.tool else { return };
        let mut news = self.trace.take(tool, moment.motion);
        news |= moment.goal != self.last.goal || moment.law != self.last.law || moment.tool != self.last.tool;
        if news || self.sent.elapsed() >= REST {
            self.sent = Instant::now();
            self.publish_pictures(&moment);
        }
        self.publish_goal(&moment);
        self.last = moment;
    }

    fn publish_pictures(&mut self, moment: &Moment) {
        self.markers.publish_if_heard(|| {
            let mut all = markers::markers(moment, &self.trace);
            let scene = moment.scene.as_deref();
            all.markers.extend(keep_outs::solids(&moment.header, scene, &mut self.solids));
            all
        });
        self.path.publish_if_heard(|| {
            let posed = |pose: &dq_messages::messages::Pose| PoseStamped {
                header: moment.header.clone(),
                pose: pose.clone(),
            };
            let poses = self.trace.poses().iter().map(posed).collect();
            Path { header: moment.header.clone(), poses }
        });
    }

    fn publish_goal(&mut self, moment: &Moment) {
        if self.goals.is_none() && self.feedback.publishers() > 0 {
            let failed =
                |why: &RosError| self.log.error(&format!("a goal that is dragged is not sent: {why}"));
            self.goals = self.goal_topic.publisher().inspect_err(failed).ok();
        }
        let now = self.started.elapsed();
        let mut marker = locked(&self.goal);
        let senders = &mut self.senders;
        self.feedback.each(|feedback, origin| {
            if senders.hear(origin, Clocks::at(now)).ago > now {
                // It was sent before this node started.
                return;
            }
            let client = feedback.client_id.clone();
            let dragged = marker.take(feedback, now);
            if let (Some((Header { frame_id, .. }, pose)), Some(goals)) = (dragged, &self.goals) {
                self.log.info(&format!("a goal was dragged by {client}"));
                goals.publish(PoseStamped { header: Header::now(&frame_id), pose });
            }
        });
        let update = moment.goal.as_ref().or(moment.tool.as_ref()).and_then(|pose| marker.follow(pose, now));
        if let Some(update) = update {
            self.updates.publish(update);
        }
    }
}

fn locked(marker: &Mutex<GoalMarker>) -> MutexGuard<'_, GoalMarker> {
    // No code panics while it holds the lock.
    marker.lock().unwrap_or_else(PoisonError::into_inner)
}
