//! What TF says, off the cycle's thread: the cycle asks where a goal is, and finds the answer there when it comes.

use crate::frames::{Answer, FrameTree, FramedGoal, Ignored, WaitingGoals};
use crate::ros::{Logger, Node, RosError, Subscription};
use crate::servo::GoalFrames;
use crate::wire::NodeContract;
use crate::wire::messages::{TFMessage, TransformStamped};
use std::sync::mpsc;
use tokio::sync::mpsc::{UnboundedReceiver, UnboundedSender, unbounded_channel};
use tokio::time::{Instant, sleep_until};

/// What the cycle asks.
enum Ask {
    /// Where this goal is.
    Goal(FramedGoal),
    /// Nothing any more of the goals up to that number.
    Forget(u64),
    Configure(GoalFrames),
}

/// The cycle's side.
pub(super) struct Frames {
    asks: UnboundedSender<Ask>,
    answers: mpsc::Receiver<Answer>,
    /// Goals up to this number are over.
    over: u64,
}

impl Frames {
    /// Subscribes to TF; goals are looked up in the frame `base`.
    pub fn new(
        node: &mut Node,
        contract: &NodeContract,
        base: &str,
        settings: GoalFrames,
    ) -> Result<Self, RosError> {
        let (asks, inbox) = unbounded_channel();
        let (sender, answers) = mpsc::channel();
        let listener = Listener {
            tf: node.subscription(contract, "/tf")?,
            tf_static: node.subscription(contract, "/tf_static")?,
            inbox,
            answers: sender,
            base: base.to_owned(),
            settings,
            tree: FrameTree::default(),
            waiting: WaitingGoals::default(),
            began: Instant::now(),
            ignored: None,
            log: node.log().clone(),
        };
        node.run(listener.run());
        Ok(Self { asks, answers, over: 0 })
    }

    /// Asks where a goal is.
    pub fn ask(&self, goal: FramedGoal) {
        // The other side is gone only when the node is about to go.
        let _ = self.asks.send(Ask::Goal(goal));
    }

    /// Wants no answers any more for the goals up to that number.
    pub fn forget(&mut self, number: u64) {
        self.over = number;
        let _ = self.asks.send(Ask::Forget(number));
    }

    /// Takes these settings for the goals that come from now on.
    pub fn configure(&self, settings: GoalFrames) {
        let _ = self.asks.send(Ask::Configure(settings));
    }

    /// The next answer that has come.
    pub fn answer(&mut self) -> Option<Answer> {
        self.answers.try_iter().find(|answer| answer.goal.number > self.over)
    }
}

/// The side of TF.
struct Listener {
    tf: Subscription<TFMessage>,
    tf_static: Subscription<TFMessage>,
    inbox: UnboundedReceiver<Ask>,
    answers: mpsc::Sender<Answer>,
    base: String,
    settings: GoalFrames,
    tree: FrameTree,
    waiting: WaitingGoals,
    began: Instant,
    /// Why a transform was ignored last, which is logged once.
    ignored: Option<Ignored>,
    log: Logger,
}

impl Listener {
    async fn run(mut self) {
        loop {
            let deadline = self.waiting.deadline(self.settings.transform_timeout);
            tokio::select! {
                message = self.tf.next() => self.take(&message, false),
                message = self.tf_static.next() => self.take(&message, true),
                ask = self.inbox.recv() => match ask {
                    Some(Ask::Goal(goal)) => self.waiting.add(goal, self.began.elapsed()),
                    Some(Ask::Forget(number)) => self.waiting.forget(number),
                    Some(Ask::Configure(settings)) => self.settings = settings,
                    None => return,
                },
                () = sleep_until(self.began + deadline.unwrap_or_default()), if deadline.is_some() => {}
            }
            self.answer();
            // Whoever floods TF holds up nothing else that runs here.
            tokio::task::yield_now().await;
        }
    }

    fn take(&mut self, message: &TFMessage, is_static: bool) {
        for transform in &message.transforms {
            let taken = self.tree.insert(&transform.reading(), is_static);
            if let Err(why) = taken
                && self.ignored.replace(why) != Some(why)
            {
                let TransformStamped { header, child_frame_id, .. } = transform;
                let (parent, child) = (&header.frame_id, child_frame_id);
                self.log.warn(&format!("TF from {parent:?} to {child:?} is ignored: {why}"));
            }
        }
    }

    fn answer(&mut self) {
        let (now, patience) = (self.began.elapsed(), self.settings.transform_timeout);
        for answer in self.waiting.look(&self.tree, &self.base, now, patience) {
            let _ = self.answers.send(answer);
        }
    }
}
