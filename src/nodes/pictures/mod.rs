//! What a servo node publishes for people who look on: markers, the tool's way, and the goal to be dragged.
//!
//! None of it is the cycle's work: the cycle leaves a [`Moment`] where it is drawn from, and finds the place taken rather than waiting.

mod goal_marker;
mod keep_outs;
mod markers;
mod trace;

pub(super) use markers::Moment;

use super::senders::{Clocks, Senders};
use super::wiring::Wiring;
use dq_messages::messages::{Header, PoseStamped};
use dq_messages::visualization::{
    GetInteractiveMarkers, InteractiveMarkerFeedback, InteractiveMarkerUpdate, MarkerArray, Path,
};
use dq_ros::ros::{Logger, Publisher, RosError, Subscription};
use dq_wire::Contract;
use goal_marker::GoalMarker;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};
use tokio::time::{MissedTickBehavior, interval};
use trace::Trace;

/// Ten pictures a second are a film.
const INTERVAL: Duration = Duration::from_millis(100);

/// Who comes late has a picture of an arm at rest after this time.
const REST: Duration = Duration::from_secs(1);

/// Where the cycle leaves what is drawn.
#[derive(Clone, Default)]
pub(super) struct Easel(Arc<Mutex<Moment>>);

impl Easel {
    /// Leaves `moment` to be drawn, unless one is being looked at.
    pub fn leave(&self, moment: Moment) {
        if let Ok(mut place) = self.0.try_lock() {
            *place = moment;
        }
    }

    fn look(&self) -> Moment {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }
}

/// The publishers and what is published last.
struct Pictures {
    easel: Easel,
    markers: Publisher<MarkerArray>,
    path: Publisher<Path>,
    updates: Publisher<InteractiveMarkerUpdate>,
    feedback: Subscription<InteractiveMarkerFeedback>,
    goals: Publisher<PoseStamped>,
    goal: Arc<Mutex<GoalMarker>>,
    trace: Trace,
    /// How many markers there are of what the arm must keep out of.
    solids: [usize; 2],
    last: Moment,
    sent: Instant,
    started: Instant,
    /// What was dragged before is not for this servo.
    senders: Senders,
    log: Logger,
}

/// Serves pictures of what is left on the easel until the node is dropped. A goal that is dragged in `frame` goes where all goals do.
///
/// # Errors
/// [`RosError`].
pub(super) fn serve(wiring: &mut Wiring, frame: &str) -> Result<Easel, RosError> {
    let Wiring { node, kind, contract } = wiring;
    let goal_topic = kind.goal_topic();
    let pictures = Contract::builtin()?.pictures;
    let goal = Arc::new(Mutex::new(GoalMarker::new(&node.name().fully_qualified(), frame)));
    let asked = goal.clone();
    node.serve::<GetInteractiveMarkers>("~/goal/get_interactive_markers", move |_| locked(&asked).all())?;
    let easel = Easel::default();
    let mut pictures = Pictures {
        easel: easel.clone(),
        markers: node.publisher(&pictures, "~/markers")?,
        path: node.publisher(&pictures, "~/path")?,
        updates: node.publisher(&pictures, "~/goal/update")?,
        feedback: node.subscription(&pictures, "~/goal/feedback")?,
        goals: node.publisher_to_input(contract, goal_topic)?,
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
    Ok(easel)
}

impl Pictures {
    fn publish(&mut self) {
        let moment = self.easel.look();
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
        let now = self.started.elapsed();
        let mut marker = locked(&self.goal);
        let senders = &mut self.senders;
        self.feedback.each(|feedback, origin| {
            if senders.hear(origin, Clocks::at(now)).ago > now {
                // It was sent before this node was there.
                return;
            }
            let client = feedback.client_id.clone();
            if let Some((Header { frame_id, .. }, pose)) = marker.take(feedback, now) {
                self.log.info(&format!("a goal was dragged by {client}"));
                self.goals.publish(PoseStamped { header: Header::now(&frame_id), pose });
            }
        });
        let update = moment.goal.as_ref().or(moment.tool.as_ref()).and_then(|pose| marker.follow(pose, now));
        if let Some(update) = update {
            self.updates.publish(update);
        }
    }
}

fn locked(marker: &Mutex<GoalMarker>) -> MutexGuard<'_, GoalMarker> {
    // Nothing panics while it holds the lock.
    marker.lock().unwrap_or_else(PoisonError::into_inner)
}
