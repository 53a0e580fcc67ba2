//! Looks up frames in TF, on another thread than the cycle. The cycle asks for the pose of a goal, and collects the answer later.

use super::node_setup::NodeSetup;
use super::throttle::Throttle;
use dq_algebra::UnitDualQuaternion;
use dq_core::servo::{GoalFrameMode, GoalFrames};
use dq_messages::messages::{TFMessage, TransformStamped};
use dq_ros::ros::{Clock, Logger, RosError, Subscription};
use dq_space::frames::{
    Answer, Followed, FrameError, FrameMotion, FrameTree, FramedGoal, Ignored, WaitingGoals,
};
use dq_wire::transform_reading;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, mpsc};
use std::time::Duration;
use tokio::sync::mpsc::{UnboundedReceiver, UnboundedSender, unbounded_channel};
use tokio::time::{Instant, sleep_until};

const WARNING_INTERVAL: Duration = Duration::from_secs(1);

/// A request of the cycle to the [`Listener`], which looks frames up.
enum FrameRequest {
    /// Find the pose of this goal.
    Goal(FramedGoal),
    /// Stop following the frames of earlier goals. If goals follow their frames ([`GoalFrameMode::Follow`]), report from now on how this
    /// goal moves with its frame.
    Follow(FramedGoal),
    /// Stop reporting how goals move with their frames.
    Unfollow,
    /// Forget the goals up to this number.
    Forget(u64),
    Configure(GoalFrames),
    /// Find the frame of a sensor that is fixed to the tool or to the base.
    Sensor(String),
}

/// All frames that TF has reported. The listener and the users of the frames share this tree.
#[derive(Clone, Default)]
pub(super) struct Tree(Arc<Mutex<FrameTree>>);

impl Tree {
    pub fn lock(&self) -> MutexGuard<'_, FrameTree> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// The cycle's side of the frame lookup.
pub(super) struct Frames {
    asks: UnboundedSender<FrameRequest>,
    reports: mpsc::Receiver<Report>,
    /// The number of the last goal whose pose the cycle asked for.
    asked: u64,
    /// The answers to requests for goals up to this number are discarded, because these goals have ended.
    over: u64,
    /// Goals up to this number no longer move with their frames.
    unfollowed: u64,
    /// The latest motion of the followed goal with its frame; `None` once the cycle has taken it.
    motion: Option<FrameMotion>,
    /// The last sensor frame that was found; `None` once the cycle has taken it.
    sensor: Option<(String, SensorFrame)>,
}

/// A result that the listener sends to the cycle.
enum Report {
    Answer(Answer),
    /// How the frame of the goal with this number has moved.
    Motion(u64, FrameMotion),
    /// The frame of the sensor with this name.
    Sensor(String, SensorFrame),
}

/// A frame that is fixed to the tool or to the base.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct SensorFrame {
    /// The tool frame or the base frame.
    pub parent: String,
    /// The pose in the parent.
    pub pose: UnitDualQuaternion,
}

impl Frames {
    /// Subscribes to TF, and stores the frames in `tree`. Stamps are compared with `clock`. The poses of goals are converted to the
    /// frame `base`. If goals follow their frames, a goal in a frame that is fixed to the frame `tool` is rejected.
    pub fn new(
        NodeSetup { node, contract, .. }: &mut NodeSetup,
        clock: &Clock,
        base: &str,
        tool: &str,
        settings: GoalFrames,
        tree: Tree,
    ) -> Result<Self, RosError> {
        let (asks, inbox) = unbounded_channel();
        let (sender, reports) = mpsc::channel();
        let listener = Listener {
            tf: node.subscription(contract, "/tf")?,
            tf_static: node.subscription(contract, "/tf_static")?,
            inbox,
            reports: sender,
            base: base.to_owned(),
            tool: tool.to_owned(),
            settings,
            clock: clock.clone(),
            time: 0,
            tree,
            waiting: WaitingGoals::default(),
            followed: None,
            began: Instant::now(),
            warned: Warned::default(),
            log: node.log().clone(),
        };
        node.run(listener.run());
        Ok(Self { asks, reports, asked: 0, over: 0, unfollowed: 0, motion: None, sensor: None })
    }

    /// Asks for the pose of a goal. The goal's number must be larger than the numbers of all earlier goals.
    pub fn ask(&mut self, goal: FramedGoal) {
        self.asked = goal.number;
        // Sending fails only while the node shuts down.
        let _ = self.asks.send(FrameRequest::Goal(goal));
    }

    /// Discards the answers for the goals up to this number.
    pub fn forget(&mut self, number: u64) {
        // If the listener knows no goal, there is no need to wake it.
        let is_one_known = self.asked > self.over;
        (self.over, self.unfollowed, self.motion) = (number, number, None);
        if is_one_known {
            let _ = self.asks.send(FrameRequest::Forget(number));
        }
    }

    /// Follows the frame of a goal whose pose was found and accepted. Stops following the frames of earlier goals.
    pub fn follow(&mut self, goal: FramedGoal) {
        (self.unfollowed, self.motion) = (goal.number.saturating_sub(1), None);
        let _ = self.asks.send(FrameRequest::Follow(goal));
    }

    /// Stops moving the goals up to this number with their frames. The listener still answers requests for the poses of goals.
    pub fn unfollow(&mut self, number: u64) {
        (self.unfollowed, self.motion) = (number, None);
        if self.asked > self.over {
            let _ = self.asks.send(FrameRequest::Unfollow);
        }
    }

    /// Uses these settings for later goals.
    pub fn configure(&self, settings: GoalFrames) {
        let _ = self.asks.send(FrameRequest::Configure(settings));
    }

    /// Asks for the frame of a sensor.
    pub fn ask_for_sensor(&self, frame: &str) {
        let _ = self.asks.send(FrameRequest::Sensor(frame.to_owned()));
    }

    /// Returns the name and the pose of the last sensor frame that was found; `None` if this method has returned that frame before.
    ///
    /// First call [`answer`](Self::answer) until it returns `None`: `answer` receives all reports of the listener, also the sensor frames.
    pub fn sensor(&mut self) -> Option<(String, SensorFrame)> {
        self.sensor.take()
    }

    /// Returns the next answer about the pose of a goal; `None` if no further answer has arrived. Stores received motions and sensor
    /// frames for [`motion`](Self::motion) and [`sensor`](Self::sensor).
    pub fn answer(&mut self) -> Option<Answer> {
        loop {
            match self.reports.try_recv().ok()? {
                Report::Motion(number, motion) if number > self.unfollowed => {
                    self.motion = Some(motion);
                }
                Report::Sensor(frame, sensor) => self.sensor = Some((frame, sensor)),
                Report::Answer(answer) if answer.goal.number > self.over => return Some(answer),
                _ => {}
            }
        }
    }

    /// Returns the latest motion of the followed goal with its frame; `None` if this method has returned that motion before.
    ///
    /// First call [`answer`](Self::answer) until it returns `None`: `answer` receives all reports of the listener, also the motions.
    pub fn motion(&mut self) -> Option<FrameMotion> {
        self.motion.take()
    }
}

/// Receives TF and looks frames up, in a task outside the cycle's thread.
struct Listener {
    tf: Subscription<TFMessage>,
    tf_static: Subscription<TFMessage>,
    inbox: UnboundedReceiver<FrameRequest>,
    reports: mpsc::Sender<Report>,
    base: String,
    tool: String,
    settings: GoalFrames,
    clock: Clock,
    /// The last time that was read from a simulated clock \[ns\].
    time: i64,
    tree: Tree,
    waiting: WaitingGoals,
    followed: Option<Followed>,
    began: Instant,
    warned: Warned,
    log: Logger,
}

/// The last logged reason for ignoring a transform, and the transform's child frame. A reason is logged only if it differs from the
/// last one, and at most once per second.
struct Warned {
    last: Option<(Ignored, String)>,
    due: Throttle,
}

impl Default for Warned {
    fn default() -> Self {
        Self { last: None, due: Throttle::new(WARNING_INTERVAL) }
    }
}

impl Warned {
    fn is_due(&mut self, why: Ignored, child: &str, now: Duration) -> bool {
        let is_new = self.last.as_ref().is_none_or(|(before, of)| (*before, of.as_str()) != (why, child));
        let is_due = is_new && self.due.is_due(now);
        if is_due {
            self.last = Some((why, child.to_owned()));
        }
        is_due
    }
}

impl Listener {
    async fn run(mut self) {
        loop {
            let patience = self.settings.tf_timeout;
            let followed = self.followed.as_ref().and_then(|followed| followed.deadline(patience));
            let deadline = [self.waiting.deadline(patience), followed].into_iter().flatten().min();
            tokio::select! {
                message = self.tf.next() => self.take(&message, false),
                message = self.tf_static.next() => self.take(&message, true),
                ask = self.inbox.recv() => match ask {
                    Some(FrameRequest::Goal(goal)) => self.waiting.add(goal, self.began.elapsed()),
                    Some(FrameRequest::Follow(goal)) => self.follow(goal),
                    Some(FrameRequest::Unfollow) => self.followed = None,
                    Some(FrameRequest::Forget(number)) => self.forget(number),
                    Some(FrameRequest::Sensor(frame)) => self.find_sensor(frame),
                    Some(FrameRequest::Configure(settings)) => self.settings = settings,
                    None => return,
                },
                () = sleep_until(self.began + deadline.unwrap_or_default()), if deadline.is_some() => {}
            }
            self.answer();
            // A flood of TF messages must not block the other tasks.
            tokio::task::yield_now().await;
        }
    }

    fn take(&mut self, message: &TFMessage, is_static: bool) {
        // If a simulation has restarted, earlier transforms are no longer valid; tf2 also discards them.
        if self.clock.is_simulated() {
            let time = self.clock.now().nanoseconds();
            if time < std::mem::replace(&mut self.time, time) {
                self.tree.lock().forget_moving();
            }
        }
        for transform in &message.transforms {
            let taken = self.tree.lock().insert(&transform_reading(transform), is_static);
            let TransformStamped { header, child_frame_id: child, .. } = transform;
            if let Err(why) = taken
                && self.warned.is_due(why, child, self.began.elapsed())
            {
                let parent = &header.frame_id;
                self.log.warn(&format!("TF from {parent:?} to {child:?} is ignored: {why}"));
            }
        }
    }

    fn forget(&mut self, number: u64) {
        self.waiting.forget(number);
        self.followed = self.followed.take().filter(|followed| followed.number() > number);
    }

    /// Stops following the frames of other goals. If goals follow their frames ([`GoalFrameMode::Follow`]), follows the frame of `goal`,
    /// unless that frame is fixed to the tool.
    fn follow(&mut self, goal: FramedGoal) {
        let follows = self.settings.mode == GoalFrameMode::Follow && !self.is_on_tool(&goal);
        self.followed = follows.then(|| Followed::new(goal, self.began.elapsed()));
    }

    fn is_on_tool(&self, goal: &FramedGoal) -> bool {
        self.tree.lock().are_rigid(&self.tool, &goal.frame)
    }

    /// Reports the pose of the sensor frame `frame`, if this frame is fixed to the tool or to the base according to TF.
    fn find_sensor(&self, frame: String) {
        let tree = self.tree.lock();
        let parent = [&self.tool, &self.base].into_iter().find(|parent| tree.are_rigid(parent, &frame));
        let Some(parent) = parent else { return };
        if let Ok(pose) = tree.lookup(parent, &frame, 0) {
            let _ = self.reports.send(Report::Sensor(frame, SensorFrame { parent: parent.clone(), pose }));
        }
    }

    fn answer(&mut self) {
        let (now, patience) = (self.began.elapsed(), self.settings.tf_timeout);
        let answers = self.waiting.look(&self.tree.lock(), &self.base, now, patience);
        for mut answer in answers {
            if self.settings.mode == GoalFrameMode::Follow && self.is_on_tool(&answer.goal) {
                answer.base_from_goal = Err(FrameError::OnTool(answer.goal.frame.clone()));
            }
            let _ = self.reports.send(Report::Answer(answer));
        }
        let Some(followed) = &mut self.followed else { return };
        if let Some(motion) = followed.look(&self.tree.lock(), &self.base, now, patience) {
            let _ = self.reports.send(Report::Motion(followed.number(), motion));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn transforms_that_are_ignored_for_reasons_in_turn_are_warned_of_once_a_second() {
        let mut warned = Warned::default();
        let mut lines = |reasons: &[(Ignored, &str)], from: u64| {
            let times = (from..from + 5000).zip(reasons.iter().cycle());
            times.filter(|(ms, (why, of))| warned.is_due(*why, of, Duration::from_millis(*ms))).count()
        };
        assert_eq!(lines(&[(Ignored::Names, "a")], 0), 1);
        assert_eq!(lines(&[(Ignored::Numbers, "a"), (Ignored::Names, "a")], 5000), 5);
        assert_eq!(lines(&[(Ignored::Numbers, "b")], 10_000), 1, "another frame's");
    }

    #[test]
    fn the_listener_receives_only_the_end_of_requested_goals() {
        let (asks, mut inbox) = unbounded_channel();
        let mut frames = Frames {
            asks,
            reports: mpsc::channel().1,
            asked: 0,
            over: 0,
            unfollowed: 0,
            motion: None,
            sensor: None,
        };
        let goal = |number| FramedGoal {
            number,
            frame: "table".to_owned(),
            stamp: 0,
            by: 0,
            came: Duration::ZERO,
            frame_from_goal: UnitDualQuaternion::identity(),
        };
        let mut forgotten = |frames: &mut Frames, number| {
            frames.forget(number);
            let asks = std::iter::from_fn(|| inbox.try_recv().ok());
            asks.filter(|ask| matches!(ask, FrameRequest::Forget(up_to) if *up_to == number)).count()
        };
        // Goals in the base frame need no lookup.
        assert_eq!((1..=1000).map(|number| forgotten(&mut frames, number)).sum::<usize>(), 0);
        frames.ask(goal(1001));
        frames.ask(goal(1003));
        // The goal after the forgotten ones is still looked up.
        assert_eq!(
            [1001, 1002, 1003, 1003, 1004].map(|number| forgotten(&mut frames, number)),
            [1, 1, 1, 0, 0]
        );
    }
}
