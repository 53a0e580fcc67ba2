//! What comes to a running servo: requests, joint states, goals, and who subscribes to its commands.

use super::arm_input::{ArmInput, fastest};
use super::commands::Commands;
use super::events::{EventsRecord, ParameterRecord};
use super::frames::Frames;
use super::requests::Reply;
use super::searcher::Searcher;
use super::senders::{Clocks, Senders};
use super::shutdown::{Shutdown, Step};
use super::wiring::Wiring;
use dq_algebra::UnitDualQuaternion;
use dq_core::servo::{
    Asker, Contended, Event, Goal, GoalMotion, GoalReading, Rejection, Sent, Servo, Settings, TwistReading,
    is_own_frame,
};
use dq_kinematics::arm::JointKind;
use dq_messages::messages::{PoseStamped, Time, TwistStamped};
use dq_ros::ros::{EndpointId, Origin, RosError, Subscription};
use dq_space::frames::{Answer, FrameMotion, FramedGoal};
use dq_wire::{goal_reading, pose_numbers, twist_reading};
use std::sync::Arc;
use std::sync::mpsc::Receiver;
use std::time::Duration;

/// What the services and the node's owner ask of the cycle.
pub(super) enum Request {
    /// These settings, and the parameters as the record has them.
    Configure(Box<Settings>, ParameterRecord),
    /// Whether to pause; how long the request was under way.
    Pause(bool, Duration, Reply),
    Stop(Reply),
    /// How long the request to go to another configuration was under way.
    Reconfigure(Duration, Reply),
    Shutdown,
}

/// So many goals that were rejected are kept until the next report, the last of each publisher.
const REJECTED: usize = 16;

/// Goals that were rejected, each by its stamp and the number of its publisher.
#[derive(Debug, Default)]
pub(super) struct RejectedGoals(Vec<RejectedGoal<u32>>);

/// A goal that was rejected.
#[derive(Debug)]
pub(super) struct RejectedGoal<Sender> {
    pub stamp: Time,
    pub by: Sender,
    pub why: Rejection,
}

impl RejectedGoals {
    fn add(&mut self, stamp: &Time, by: u32, why: Rejection) {
        self.0.retain(|other| other.by != by);
        if self.0.len() >= REJECTED {
            self.0.remove(0);
        }
        self.0.push(RejectedGoal { stamp: stamp.clone(), by, why });
    }

    /// Those of which nobody has taken note yet.
    pub fn take(&mut self) -> Vec<RejectedGoal<u32>> {
        std::mem::take(&mut self.0)
    }
}

/// What comes to a servo besides the topics of the node itself.
pub(super) struct Sources {
    pub arms: Vec<ArmInput>,
    /// What the joints do.
    pub kinds: Vec<JointKind>,
    pub inbox: Receiver<Request>,
    pub searcher: Searcher,
    /// Who knows where goals in other frames are, if anyone does.
    pub frames: Option<Frames>,
}

/// The last goal in another frame that was taken: its stamp \[ns\], and that frame.
#[derive(Default)]
struct TakenFrame {
    stamp: i64,
    frame: String,
}

/// What comes to a running servo, and what the next command is made from.
pub(super) struct RosInputs {
    /// When the cycle began, and the first one.
    clocks: Clocks,
    began: Option<Duration>,
    inbox: Receiver<Request>,
    searcher: Searcher,
    goals: Subscription<PoseStamped>,
    frames: Option<Frames>,
    goal_frame: String,
    taken_frame: TakenFrame,
    twists: Subscription<TwistStamped>,
    /// The last ones, over which the next are decoded.
    goal: PoseStamped,
    twist: TwistStamped,
    goal_senders: Senders,
    twist_senders: Senders,
    pub arms: Vec<ArmInput>,
    commands: Arc<Commands>,
    kinds: Vec<JointKind>,
    /// The goals that were rejected and of which nobody has taken note yet.
    pub rejected: RejectedGoals,
    /// Goal messages seen.
    goal_count: u64,
    /// Through which the servo takes all that comes to it.
    pub record: EventsRecord,
    shutdown: Option<Shutdown>,
}

impl RosInputs {
    /// What comes from `sources`, and to the node.
    pub fn new(
        Wiring { node, kind, contract }: &mut Wiring,
        sources: Sources,
        commands: Arc<Commands>,
        record: EventsRecord,
        goal_frame: &str,
    ) -> Result<Self, RosError> {
        let Sources { arms, kinds, inbox, searcher, frames } = sources;
        Ok(Self {
            clocks: Clocks::default(),
            began: None,
            inbox,
            searcher,
            goals: node.subscription(contract, kind.goal_topic())?,
            frames,
            goal_frame: goal_frame.to_owned(),
            taken_frame: Default::default(),
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

    /// No goal that came so far moves with its frame any more.
    fn unfollow(&mut self) {
        self.frames.iter_mut().for_each(|frames| frames.unfollow(self.goal_count));
    }

    /// Who asked.
    pub fn asker(&self, by: Asker) -> Option<EndpointId> {
        match by {
            Asker::Goal(number) => self.goal_senders.publisher(number),
            Asker::Twist(number) => self.twist_senders.publisher(number),
            Asker::Resume => None,
        }
    }

    /// The frame in which the goal with that stamp \[ns\] was given, which is the servo's own unless it was the last one in another.
    pub fn frame_of(&self, stamp: i64) -> &str {
        let taken = &self.taken_frame;
        if !taken.frame.is_empty() && taken.stamp == stamp { &taken.frame } else { &self.goal_frame }
    }

    /// The publisher of that number.
    pub fn publisher(&self, of: Contended, number: u32) -> Option<EndpointId> {
        match of {
            Contended::JointStates(arm) => self.arms.get(arm)?.publisher(number),
            Contended::Goals => self.goal_senders.publisher(number),
            Contended::Twists => self.twist_senders.publisher(number),
            Contended::Commands(arm) => self.commands.publisher(arm, number),
        }
    }

    /// When the joint states in force were made: of two arms the older one, as nothing of the pose is older than its stamp.
    pub fn stamp(&self) -> Time {
        let oldest = self.arms.iter().map(|arm| &arm.stamp).min_by_key(|stamp| stamp.nanoseconds());
        oldest.cloned().unwrap_or_default()
    }

    /// What the end in progress asks for, if there is one.
    pub fn shutdown_step(&mut self, servo: &Servo) -> Step {
        let Some(shutdown) = &mut self.shutdown else { return Step::Decelerate };
        if servo.output().is_none() {
            // What moves there, if anything does, was not sent by this servo.
            return Step::Gone(Ok(()));
        }
        let command = fastest(servo.command()).unwrap_or(0.0);
        // Of all arms, or none; who was never heard stands as far as anybody knows.
        let reported: Option<Vec<_>> = self.arms.iter().map(|arm| arm.speed).collect();
        let never_heard = servo.pose().is_none().then_some(0.0);
        let reported = reported.and_then(|speeds| fastest(&speeds)).or(never_heard);
        shutdown.step(self.clocks.now, command, reported)
    }
}

/// The goal of that number, which was sent at `came`, to be looked up.
fn framed(goal: &GoalReading, number: u64, came: Duration) -> Result<FramedGoal, Rejection> {
    let GoalReading { position, orientation_xyzw, frame_id, stamp, sent, .. } = *goal;
    let pose = Goal::new(position, orientation_xyzw, "", "")?;
    let frame_from_goal = *pose.base_from_goal();
    Ok(FramedGoal { number, frame: frame_id.to_owned(), stamp, by: sent.by, came, frame_from_goal })
}

/// The goal in the base frame, with the stamp \[ns\] of its message, or of its transform.
fn placed(stamp: i64, base_from_goal: &UnitDualQuaternion) -> GoalReading<'static> {
    let [x, y, z, orientation_xyzw @ ..] = pose_numbers(base_from_goal);
    let (waited, sent) = (Duration::ZERO, Sent::default());
    GoalReading { position: [x, y, z], orientation_xyzw, frame_id: "", stamp, waited, sent }
}

/// Who sent a message, and how long before it came; a rejection where that was before the node was there.
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
    /// Gives the servo all that has come since the cycle before: requests first, then what a search has come to, joint states, goals, their motions and twists.
    pub fn feed(&mut self, servo: &mut Servo) {
        self.requests(servo);
        let record = &mut self.record;
        self.searcher.feed(servo, record);
        for (arm, input) in self.arms.iter_mut().enumerate() {
            input.feed(arm, record, servo);
            let _ = record.take(servo, Event::Listeners(arm, self.commands.are_heard(arm)));
            let _ = record.take(servo, Event::Rival(arm, self.commands.are_contended(arm)));
        }
        self.framed_goals(servo);
        self.goals(servo);
        self.goal_motions(servo);
        self.twists(servo);
    }

    fn requests(&mut self, servo: &mut Servo) {
        while let Ok(request) = self.inbox.try_recv() {
            match request {
                Request::Configure(settings, parameters) => {
                    let goal_frames = settings.goal_frames;
                    // What is not taken is counted by the servo, and logged by the report; what was in force stays.
                    if servo.take(Event::Configure(settings)).is_ok() {
                        self.frames.iter().for_each(|frames| frames.configure(goal_frames));
                        self.record.change(parameters);
                    }
                }
                // Nothing moves for a request that was answered with a failure; to stand is right all the same.
                Request::Pause(false, _, reply) | Request::Reconfigure(_, reply) if !reply.is_awaited() => {}
                Request::Pause(paused, ago, reply) => {
                    reply.answer(self.record.take(servo, Event::Pause { paused, ago }));
                }
                Request::Reconfigure(ago, reply) => {
                    reply.answer(self.record.take(servo, Event::Reconfigure { ago }));
                }
                Request::Stop(reply) => {
                    self.stop(servo);
                    reply.taken();
                }
                Request::Shutdown => {
                    self.stop(servo);
                    self.shutdown = Some(Shutdown::new(self.clocks.now, &self.kinds));
                    self.arms.iter_mut().for_each(|arm| arm.speed = None);
                }
            }
        }
    }

    fn stop(&mut self, servo: &mut Servo) {
        let _ = self.record.take(servo, Event::Stop);
        self.unfollow();
    }

    /// Offers the goals whose frames were found, and rejects those whose were not.
    fn framed_goals(&mut self, servo: &mut Servo) {
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

    /// Every goal is offered, so that a bad one does not hide the good one before it.
    fn goals(&mut self, servo: &mut Servo) {
        let Self { clocks, began, goals, goal, goal_senders, .. } = self;
        let Self { frames, goal_frame, taken_frame, goal_count, record, shutdown, rejected, .. } = self;
        let malformed = goals.each_over(goal, |goal, origin| {
            if shutdown.is_some() {
                return;
            }
            let stamp = &goal.header.stamp;
            let sent = match sender(goal_senders, origin, *clocks, *began) {
                Ok(sent) => sent,
                Err(why) => {
                    rejected.add(stamp, goal_senders.number(origin.publisher), why.clone());
                    let _ = servo.take(Event::Unusable(why));
                    return;
                }
            };
            *goal_count += 1;
            let reading = GoalReading { sent, ..goal_reading(goal) };
            let elsewhere = frames.as_mut().filter(|_| !is_own_frame(&goal.header.frame_id, goal_frame));
            let taken = match elsewhere {
                None => record.take(servo, Event::Goal(reading)),
                Some(_) if sent.ago > servo.settings().rearm_timeout => {
                    servo.take(Event::Unusable(Rejection::Late(sent.ago)))
                }
                Some(frames) => match framed(&reading, *goal_count, clocks.now.saturating_sub(sent.ago)) {
                    Ok(goal) => return frames.ask(goal),
                    Err(why) => servo.take(Event::Unusable(why)),
                },
            };
            // A rejection is counted by the servo, and logged by the report.
            match taken {
                Ok(_) => {
                    *taken_frame = TakenFrame::default();
                    // Those before it that still wait for their frames come too late.
                    frames.iter_mut().for_each(|frames| frames.forget(*goal_count));
                }
                Err(why) => rejected.add(stamp, sent.by, why),
            }
        });
        for why in malformed {
            let _ = servo.take(Event::Unusable(Rejection::Malformed(why)));
        }
    }

    fn goal_motions(&mut self, servo: &mut Servo) {
        let Self { frames, record, shutdown, .. } = self;
        let Some(frames) = frames.as_mut().filter(|_| shutdown.is_none()) else { return };
        let motion = match frames.motion() {
            Some(FrameMotion::To { stamp, base_from_goal }) => GoalMotion::To(placed(stamp, &base_from_goal)),
            Some(FrameMotion::Lost) => GoalMotion::Lost,
            None => return,
        };
        // A motion that is rejected is counted.
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
        for why in malformed {
            let _ = servo.take(Event::Unusable(Rejection::Malformed(why)));
        }
    }
}
