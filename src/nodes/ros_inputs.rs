//! The inputs of a running servo: requests, joint states, goals, twists, and the subscribers to its commands.

use super::arm_input::{ArmInput, fastest, reject_malformed};
use super::arm_speed::ArmSpeed;
use super::commands::Commands;
use super::events::{EventsRecord, ParameterRecord};
use super::frames::Frames;
use super::node_setup::NodeSetup;
use super::requests::Reply;
use super::searcher::Searcher;
use super::senders::{Clocks, Senders};
use super::shutdown::{Shutdown, Step};
use super::wrench_input::WrenchInput;
use dq_algebra::UnitDualQuaternion;
use dq_core::servo::{
    Contended, Event, Goal, GoalMotion, GoalReading, JointGoalReading, JointOrder, Rejection, Requester,
    Sent, Servo, Settings, TwistReading, is_own_frame,
};
use dq_kinematics::arm::JointKind;
use dq_messages::messages::{JointState, PoseStamped, Time, TwistStamped};
use dq_ros::ros::{EndpointId, Origin, RosError, Subscription};
use dq_space::frames::{Answer, FrameMotion, FramedGoal};
use dq_wire::{goal_reading, joint_goal_reading, pose_numbers, twist_reading};
use std::sync::Arc;
use std::sync::mpsc::Receiver;
use std::time::Duration;

/// A request of a service or of the node's owner to the cycle.
pub(super) enum Request {
    /// Apply these settings, and add their parameters to the record for replay.
    Configure(Box<Settings>, ParameterRecord),
    /// Pause (true) or resume (false). The duration is the time since the request was sent.
    Pause(bool, Duration, Reply),
    Stop(Reply),
    /// Use the present wrench as the zero of the wrench sensor, on the assumption that nothing touches the tool.
    Tare(Reply),
    /// Begin (true) or end (false) the identification of the load on the wrench sensor.
    IdentifyTool(bool, Reply),
    /// Go to another configuration. The duration is the time since the request was sent.
    Reconfigure(Duration, Reply),
    Shutdown,
}

/// The largest number of rejected goals that are stored until the next report. Of each publisher, only the last one is stored.
const REJECTED: usize = 16;

/// Rejected goals, each with its stamp and the number of its publisher.
#[derive(Debug, Default)]
pub(super) struct RejectedGoals(Vec<RejectedGoal<u32>>);

/// A rejected goal.
#[derive(Debug)]
pub(super) struct RejectedGoal<Sender> {
    pub stamp: Time,
    pub by: Sender,
    pub why: Rejection,
}

impl RejectedGoals {
    /// Rejects a goal that the node cannot give to the servo. Adds the goal to this list, and gives the servo the reason `why`.
    fn refuse(&mut self, servo: &mut Servo, stamp: &Time, by: u32, why: Rejection) {
        self.add(stamp, by, why.clone());
        let _ = servo.take(Event::Unusable(why));
    }

    /// Returns who sent a goal and how long ago. Rejects the goal and returns `None` if it was sent before this node `began`.
    fn sender(
        &mut self,
        servo: &mut Servo,
        stamp: &Time,
        senders: &mut Senders,
        origin: &Origin,
        (clocks, began): (Clocks, Option<Duration>),
    ) -> Option<Sent> {
        let sent = sender(senders, origin, clocks, began);
        sent.map_err(|why| self.refuse(servo, stamp, senders.number(origin.publisher), why)).ok()
    }

    fn add(&mut self, stamp: &Time, by: u32, why: Rejection) {
        self.0.retain(|other| other.by != by);
        if self.0.len() >= REJECTED {
            self.0.remove(0);
        }
        self.0.push(RejectedGoal { stamp: stamp.clone(), by, why });
    }

    /// Returns the goals that were not reported yet, and clears the list.
    pub fn take(&mut self) -> Vec<RejectedGoal<u32>> {
        std::mem::take(&mut self.0)
    }
}

/// The parts of [`RosInputs`] that the node creates before [`RosInputs::new`].
pub(super) struct Sources {
    pub arms: Vec<ArmInput>,
    /// The kinds of the joints.
    pub kinds: Vec<JointKind>,
    pub inbox: Receiver<Request>,
    pub searcher: Searcher,
    /// The subscription to the wrench at the tool, if there is one.
    pub wrenches: Option<WrenchInput>,
    /// Looks up the frames of goals in TF; `None` if the node takes goals in one frame only.
    pub frames: Option<Frames>,
}

/// The stamp \[ns\] and the frame of the last accepted goal. The frame is empty if the goal was in the frame in which the servo
/// takes goals.
#[derive(Default)]
struct TakenFrame {
    stamp: i64,
    frame: String,
}

/// The subscription to joint goals.
struct JointGoals {
    subscription: Subscription<JointState>,
    /// The names of the joints, arm after arm.
    joints: Vec<String>,
    /// The last message. The next message is decoded into it.
    goal: JointState,
    positions: Vec<Option<f64>>,
}

/// The inputs of a running servo.
pub(super) struct RosInputs {
    /// The time at which the present cycle began.
    clocks: Clocks,
    /// The time at which the first cycle began.
    began: Option<Duration>,
    inbox: Receiver<Request>,
    searcher: Searcher,
    goals: Subscription<PoseStamped>,
    /// The input of joint goals; `None` if the keystore does not grant access to the topic.
    joint_goals: Option<JointGoals>,
    frames: Option<Frames>,
    goal_frame: String,
    taken_frame: TakenFrame,
    twists: Subscription<TwistStamped>,
    /// The input of measured wrenches; `None` for two arms, and if the keystore does not grant access to the topic.
    wrenches: Option<WrenchInput>,
    /// The last messages. The next messages are decoded into them.
    goal: PoseStamped,
    twist: TwistStamped,
    goal_senders: Senders,
    twist_senders: Senders,
    pub arms: Vec<ArmInput>,
    commands: Arc<Commands>,
    kinds: Vec<JointKind>,
    /// The rejected goals that were not reported yet.
    pub rejected: RejectedGoals,
    /// The number of goal messages since the start.
    goal_count: u64,
    /// The record for replay. It passes events to the servo and records them.
    pub record: EventsRecord,
    shutdown: Option<Shutdown>,
}

impl RosInputs {
    /// Creates the inputs: takes over `sources`, and subscribes to the goals, the joint goals and the twists.
    pub fn new(
        setup: &mut NodeSetup,
        sources: Sources,
        commands: Arc<Commands>,
        record: EventsRecord,
        goal_frame: &str,
    ) -> Result<Self, RosError> {
        let joint_goals = JointGoals::new(setup, record.joints());
        let NodeSetup { node, kind, contract } = setup;
        let Sources { arms, kinds, inbox, searcher, wrenches, frames } = sources;
        Ok(Self {
            clocks: Clocks::default(),
            began: None,
            inbox,
            searcher,
            goals: node.subscription(contract, kind.goal_topic())?,
            joint_goals,
            frames,
            goal_frame: goal_frame.to_owned(),
            taken_frame: Default::default(),
            wrenches,
            twists: node.adapting_subscription(contract, "~/target_twist")?,
            goal: PoseStamped::default(),
            twist: TwistStamped::default(),
            goal_senders: Senders::default(),
            twist_senders: Senders::default(),
            goal_count: 0,
            record,
            arms,
            kinds,
            commands,
            rejected: RejectedGoals::default(),
            shutdown: None,
        })
    }

    /// Begins the servo's cycle at `now`.
    pub fn begin(&mut self, servo: &mut Servo, now: Duration) {
        self.clocks = Clocks::at(now);
        self.began.get_or_insert(now);
        self.record.begin(servo, now);
    }

    /// Returns whether the node subscribes to the wrench at the tool.
    pub fn takes_wrenches(&self) -> bool {
        self.wrenches.is_some()
    }

    /// Stops following the frames of all earlier goals.
    fn unfollow(&mut self) {
        self.frames.iter_mut().for_each(|frames| frames.unfollow(self.goal_count));
    }

    /// Returns the publisher of the message that requested the motion; `None` if a service call requested it.
    pub fn asker(&self, by: Requester) -> Option<EndpointId> {
        match by {
            Requester::Goal(number) => self.goal_senders.publisher(number),
            Requester::Twist(number) => self.twist_senders.publisher(number),
            Requester::Resume => None,
        }
    }

    /// Returns the frame in which the goal with this stamp \[ns\] was given. Only the frame of the last accepted goal is known. For
    /// any other stamp, returns the frame in which the servo takes goals.
    pub fn frame_of(&self, stamp: i64) -> &str {
        let taken = &self.taken_frame;
        if !taken.frame.is_empty() && taken.stamp == stamp { &taken.frame } else { &self.goal_frame }
    }

    /// Returns publisher number `number` of the input `of`.
    pub fn publisher(&self, of: Contended, number: u32) -> Option<EndpointId> {
        match of {
            Contended::JointStates(arm) => self.arms.get(arm)?.publisher(number),
            Contended::Goals => self.goal_senders.publisher(number),
            Contended::Twists => self.twist_senders.publisher(number),
            Contended::Wrenches => self.wrenches.as_ref()?.publisher(number),
            Contended::Commands(arm) => self.commands.publisher(arm, number),
        }
    }

    /// Returns the time of the joint states in use, which is the stamp of the pose. For two arms, this is the time of the older
    /// joint state.
    pub fn stamp(&self) -> Time {
        let oldest = self.arms.iter().map(|arm| &arm.stamp).min_by_key(|stamp| stamp.nanoseconds());
        oldest.cloned().unwrap_or_default()
    }

    /// Returns the next step of the shutdown. If no shutdown is in progress, returns [`Step::Decelerate`], so that the cycle sends the
    /// servo's command as usual.
    pub fn shutdown_step(&mut self, servo: &Servo) -> Step {
        let Some(shutdown) = &mut self.shutdown else { return Step::Decelerate };
        if servo.output().is_none() {
            // Nothing was sent, so this servo has not caused a motion of the arm.
            return Step::Gone(Ok(()));
        }
        let command = fastest(servo.command()).unwrap_or(0.0);
        // Use the speeds only if all arms reported them. If some arm never sent a joint state, this servo has moved no arm: the
        // speed is 0.
        let reported: Option<Vec<_>> = self.arms.iter().map(|arm| arm.speed.fastest).collect();
        let never_heard = servo.pose().is_none().then_some(0.0);
        let reported = reported.and_then(|speeds| fastest(&speeds)).or(never_heard);
        shutdown.step(self.clocks.now, command, reported)
    }
}

impl JointGoals {
    /// Subscribes to the joint goals of arms with these `joints`. A keystore from before this topic was introduced does not grant
    /// access to it. Then the servo works without joint goals.
    fn new(NodeSetup { node, kind, contract }: &mut NodeSetup, joints: &[JointOrder]) -> Option<Self> {
        let subscription = node.subscription(contract, "~/joint_goal");
        let subscription =
            subscription.inspect_err(|why| node.log().warn(&format!("no ~/joint_goal: {why}"))).ok()?;
        let joints = kind.joint_names(joints);
        Some(Self { subscription, joints, goal: JointState::default(), positions: Vec::new() })
    }
}

/// Converts a goal to the form in which the listener takes it to look up the goal's frame. `number` is the number of the goal, and
/// `came` is the time at which it was sent.
fn framed(goal: &GoalReading, number: u64, came: Duration) -> Result<FramedGoal, Rejection> {
    let GoalReading { position, orientation_xyzw, frame_id, stamp, sent, .. } = *goal;
    let pose = Goal::new(position, orientation_xyzw, "", "")?;
    let frame_from_goal = *pose.base_from_goal();
    Ok(FramedGoal { number, frame: frame_id.to_owned(), stamp, by: sent.by, came, frame_from_goal })
}

/// Returns the reading of a goal with the pose `base_from_goal`. `stamp` \[ns\] is the stamp of the goal's message or of the transform
/// that moved the goal.
fn placed(stamp: i64, base_from_goal: &UnitDualQuaternion) -> GoalReading<'static> {
    let [x, y, z, orientation_xyzw @ ..] = pose_numbers(base_from_goal);
    let (waited, sent) = (Duration::ZERO, Sent::default());
    GoalReading { position: [x, y, z], orientation_xyzw, frame_id: "", stamp, waited, sent }
}

/// Returns who sent a message and how long ago. Returns a rejection if the message was sent before this node started.
fn sender(
    senders: &mut Senders,
    origin: &Origin,
    clocks: Clocks,
    began: Option<Duration>,
) -> Result<Sent, Rejection> {
    let sent = senders.hear(origin, clocks);
    match sent.ago > clocks.now.saturating_sub(began.unwrap_or_default()) {
        true => Err(Rejection::Late(sent.ago)),
        false => Ok(sent),
    }
}

impl RosInputs {
    /// Gives the servo everything that has arrived since the previous cycle, in this order: requests, the result of a search, joint
    /// states, wrenches, goals whose frames were found, new goals, joint goals, the motions of goals' frames, and twists.
    pub fn feed(&mut self, servo: &mut Servo) {
        self.requests(servo);
        let record = &mut self.record;
        self.searcher.feed(servo, record);
        for (arm, input) in self.arms.iter_mut().enumerate() {
            input.feed(arm, record, servo);
            let _ = record.take(servo, Event::Listeners(arm, self.commands.are_heard(arm)));
            let _ = record.take(servo, Event::Rival(arm, self.commands.are_contended(arm)));
        }
        if let Some(wrenches) = &mut self.wrenches {
            wrenches.feed(servo, record, self.frames.as_mut(), self.clocks);
        }
        self.located_goals(servo);
        self.goals(servo);
        self.joint_goals(servo);
        self.goal_motions(servo);
        self.twists(servo);
    }

    fn requests(&mut self, servo: &mut Servo) {
        while let Ok(request) = self.inbox.try_recv() {
            match request {
                Request::Configure(settings, parameters) => {
                    let goal_frames = settings.goal_frames;
                    // The servo counts a refusal, and the report logs it. The settings in force do not change.
                    if servo.take(Event::Configure(settings)).is_ok() {
                        self.frames.iter().for_each(|frames| frames.configure(goal_frames));
                        self.record.change(parameters);
                    }
                }
                // A request that was already answered with a failure must not start a motion. Pausing is still safe.
                Request::Pause(false, _, reply) | Request::Reconfigure(_, reply) if !reply.is_awaited() => {}
                Request::Pause(paused, ago, reply) => {
                    reply.answer(self.record.take(servo, Event::Pause { paused, ago }));
                }
                Request::Reconfigure(ago, reply) => {
                    reply.answer(self.record.take(servo, Event::Reconfigure { ago }));
                }
                Request::Tare(reply) => reply.answer(self.record.take(servo, Event::Tare)),
                Request::IdentifyTool(true, reply) => {
                    reply.answer(self.record.take(servo, Event::IdentifyTool));
                }
                Request::IdentifyTool(false, reply) => {
                    reply.say(servo.identified_tool().map(|load| load.to_string()))
                }
                Request::Stop(reply) => {
                    self.stop(servo);
                    reply.taken();
                }
                Request::Shutdown => {
                    self.stop(servo);
                    self.shutdown = Some(Shutdown::new(self.clocks.now, &self.kinds));
                    self.arms.iter_mut().for_each(|arm| arm.speed = ArmSpeed::default());
                }
            }
        }
    }

    fn stop(&mut self, servo: &mut Servo) {
        let _ = self.record.take(servo, Event::Stop);
        self.unfollow();
    }

    /// Gives the servo the goals whose lookup in TF succeeded, and rejects the goals whose lookup failed.
    fn located_goals(&mut self, servo: &mut Servo) {
        let Self {
            clocks: Clocks { now, .. },
            frames,
            goal_frame,
            record,
            rejected,
            shutdown,
            taken_frame,
            ..
        } = self;
        let Some(frames) = frames.as_mut().filter(|_| shutdown.is_none()) else { return };
        while let Some(Answer { goal, base_from_goal }) = frames.answer() {
            let (stamp, by) = (Time::from_nanoseconds(goal.stamp), goal.by);
            let taken = match base_from_goal {
                Ok(pose) => {
                    let waited = now.saturating_sub(goal.came);
                    let sent = Sent { by: goal.by, ago: Duration::ZERO };
                    let reading = GoalReading { waited, sent, ..placed(goal.stamp, &pose) };
                    let taken = record.take(servo, Event::Goal(reading));
                    if taken.is_ok() {
                        *taken_frame = TakenFrame { stamp: goal.stamp, frame: goal.frame.clone() };
                        frames.follow(goal);
                    }
                    taken
                }
                Err(why) => {
                    let (got, expected) = (goal.frame, goal_frame.clone());
                    servo.take(Event::Unusable(Rejection::NoTransform { got, expected, why }))
                }
            };
            if let Err(why) = taken {
                rejected.add(&stamp, by, why);
            }
        }
    }

    /// Gives the servo every received goal, not only the newest: if the newest goal is invalid, an earlier one may be valid.
    fn goals(&mut self, servo: &mut Servo) {
        let Self { clocks, began, goals, goal, goal_senders, .. } = self;
        let Self { frames, goal_frame, taken_frame, goal_count, record, shutdown, rejected, .. } = self;
        let malformed = goals.each_over(goal, |goal, origin| {
            if shutdown.is_some() {
                return;
            }
            let stamp = &goal.header.stamp;
            let Some(sent) = rejected.sender(servo, stamp, goal_senders, origin, (*clocks, *began)) else {
                return;
            };
            *goal_count += 1;
            let reading = GoalReading { sent, ..goal_reading(goal) };
            let foreign = frames.as_mut().filter(|_| !is_own_frame(&goal.header.frame_id, goal_frame));
            if foreign.is_some() {
                let _ = record.take(servo, Event::Waits(sent));
            }
            let taken = match foreign {
                None => record.take(servo, Event::Goal(reading)),
                Some(_) if sent.ago > servo.settings().rearm_timeout => {
                    servo.take(Event::Unusable(Rejection::Late(sent.ago)))
                }
                Some(frames) => match framed(&reading, *goal_count, clocks.now.saturating_sub(sent.ago)) {
                    Ok(goal) => return frames.ask(goal),
                    Err(why) => servo.take(Event::Unusable(why)),
                },
            };
            // The servo counts a rejection, and the report logs it.
            match taken {
                Ok(_) => {
                    *taken_frame = TakenFrame::default();
                    // The new goal replaces earlier goals that still wait for their frames.
                    frames.iter_mut().for_each(|frames| frames.forget(*goal_count));
                }
                Err(why) => rejected.add(stamp, sent.by, why),
            }
        });
        reject_malformed(servo, malformed);
    }

    /// Gives the servo every received joint goal, not only the newest.
    fn joint_goals(&mut self, servo: &mut Servo) {
        let Self { clocks, began, joint_goals, goal_senders, shutdown, .. } = self;
        let Self { frames, taken_frame, goal_count, record, rejected, .. } = self;
        let Some(JointGoals { subscription, joints, goal, positions }) = joint_goals else { return };
        let malformed = subscription.each_over(goal, |goal, origin| {
            if shutdown.is_some() {
                return;
            }
            let stamp = &goal.header.stamp;
            let Some(sent) = rejected.sender(servo, stamp, goal_senders, origin, (*clocks, *began)) else {
                return;
            };
            let reading = match joint_goal_reading(goal, joints, positions) {
                Ok(reading) => JointGoalReading { sent, ..reading },
                Err(why) => {
                    // Count the publisher as a publisher of goals, although its goal is rejected.
                    let _ = record.take(servo, Event::Waits(sent));
                    return rejected.refuse(servo, stamp, sent.by, why);
                }
            };
            *goal_count += 1;
            match record.take(servo, Event::JointGoal(reading)) {
                Ok(_) => {
                    *taken_frame = TakenFrame::default();
                    // The joint goal replaces earlier goals that still wait for their frames.
                    frames.iter_mut().for_each(|frames| frames.forget(*goal_count));
                }
                Err(why) => rejected.add(stamp, sent.by, why),
            }
        });
        reject_malformed(servo, malformed);
    }

    fn goal_motions(&mut self, servo: &mut Servo) {
        let Self { frames, record, shutdown, .. } = self;
        let Some(frames) = frames.as_mut().filter(|_| shutdown.is_none()) else { return };
        let motion = match frames.motion() {
            Some(FrameMotion::To { stamp, base_from_goal }) => GoalMotion::To(placed(stamp, &base_from_goal)),
            Some(FrameMotion::Lost) => GoalMotion::Lost,
            None => return,
        };
        // The servo counts a rejected motion.
        let _ = record.take(servo, Event::GoalMotion(motion));
    }

    fn twists(&mut self, servo: &mut Servo) {
        let Self { clocks, began, twists, twist, twist_senders, record, shutdown, .. } = self;
        let malformed = twists.each_over(twist, |twist, origin| {
            if shutdown.is_some() {
                return;
            }
            let _ = match sender(twist_senders, origin, *clocks, *began) {
                Ok(sent) => record.take(servo, Event::Twist(TwistReading { sent, ..twist_reading(twist) })),
                Err(why) => servo.take(Event::Unusable(why)),
            };
        });
        reject_malformed(servo, malformed);
    }
}
