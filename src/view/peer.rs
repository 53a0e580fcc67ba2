//! The view's node in the graph: shows what a servo publishes, and forwards requests of browsers.

use super::arm_shape::ArmShape;
use super::known_robot::KnownRobot;
use super::robot::Robot;
use super::servo_monitor::ServoMonitor;
use super::{Answer, Ask, Asked, BackgroundTask, Race, RobotEnd, ViewError, markers};
use dq_config::PLANT_NAMES;
use dq_core::servo;
use dq_messages::ParameterEvent;
use dq_messages::messages::{
    Header, Pose, PoseStamped, ServiceType, SetBool, SetBoolRequest, StringMessage, SuccessResponse, Trigger,
    TriggerRequest, Twist, TwistStamped, Vector3,
};
use dq_messages::visualization::MarkerArray;
use dq_messages::{Direction, PoseNumbers};
use dq_ros::ros::{
    Client, Logger, Logging, Node, ParameterClient, Publisher, Resolver, RosError, Session, Subscription,
};
use dq_wire::{Contract, ServoKind};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};
use tokio::sync::{Notify, OnceCell, mpsc, oneshot, watch};
use tokio::task::JoinSet;

/// The shortest time between two messages to a browser. A screen needs no more than 50 per second.
const FRAME: Duration = Duration::from_millis(20);

/// The time between two messages to a browser while nothing is received from the servo.
const IDLE: Duration = Duration::from_millis(500);

/// The longest time that a service may take.
const PATIENCE: Duration = Duration::from_secs(2);

/// The time between two attempts to read the parameters.
const RETRY: Duration = Duration::from_secs(1);

/// A node that shows the servo of its namespace. The node ends when this value is dropped.
pub struct Peer {
    _tasks: JoinSet<()>,
    log: Logger,
}

/// The state that the tasks share.
struct Shared {
    kind: ServoKind,
    /// The node, which is locked while a client is created on it.
    node: tokio::sync::Mutex<Node>,
    names: Resolver,
    goals: Publisher<PoseStamped>,
    twists: Publisher<TwistStamped>,
    // This client is connected when the servo's first status arrives, so that a stop does not wait for other requests.
    stop: OnceCell<Client<Trigger>>,
    pause: OnceCell<Client<SetBool>>,
    known: Mutex<KnownRobot>,
    motion: Mutex<Option<LastMotion>>,
    /// The channel for background tasks.
    tasks: mpsc::Sender<Asked<BackgroundTask>>,
    /// Notifies the task that reads the parameters when the servo has appeared.
    appeared: Notify,
}

/// The latest motion of the arm. A race repeats this motion with two simulated arms.
#[derive(Clone)]
struct LastMotion {
    /// The joint positions when the motion began.
    start: Vec<f64>,
    /// The goal; in a stream of goals, the last one.
    goal: PoseNumbers,
}

impl Peer {
    /// Starts the node `names`, which shows the servo of this kind in its namespace. The node sends the data to show to `end`, answers
    /// the requests from `end`, and passes requests for background tasks on to `tasks`.
    ///
    /// # Errors
    /// [`RosError`] if the node cannot be created.
    pub fn start(
        kind: ServoKind,
        session: &Session,
        names: Resolver,
        logging: Logging,
        end: RobotEnd,
        tasks: mpsc::Sender<Asked<BackgroundTask>>,
    ) -> Result<Self, RosError> {
        let mut node = session.node(names.clone(), logging)?;
        let log = node.log().clone();
        let servo = kind.node_name();
        let full_name = names.service(servo)?;
        let seen = ServoMonitor::new(&mut node, kind, servo, full_name.clone())?;
        let goal = kind.contract(Contract::builtin()?);
        let goals = node
            .publisher_as(goal.topic::<PoseStamped>(kind.goal_topic(), Direction::In)?, kind.goal_topic())?;
        let twist = goal.topic::<TwistStamped>("~/target_twist", Direction::In)?;
        let twists = node.publisher_as(twist, &format!("{servo}/target_twist"))?;
        let states = goal.topic::<ParameterEvent>("~/parameters", Direction::Out)?;
        let events = node.subscription_as(states, &format!("{servo}/parameters"))?;
        let descriptions = node.subscription::<StringMessage>(&goal, "robot_description")?;
        let pictures = Contract::builtin()?.pictures;
        let drawn = pictures.topic::<MarkerArray>("~/markers", Direction::Out)?;
        let drawn = node.subscription_as(drawn, &format!("{servo}/markers"))?;
        let shared = Arc::new(Shared {
            kind,
            node: tokio::sync::Mutex::new(node),
            names,
            goals,
            twists,
            stop: OnceCell::new(),
            pause: OnceCell::new(),
            known: Mutex::default(),
            motion: Mutex::new(None),
            tasks,
            appeared: Notify::new(),
        });
        let RobotEnd { robot, now, markers, arm_shape, asks, .. } = end;
        let mut tasks = JoinSet::new();
        tasks.spawn(show_arm_shape(shared.clone(), descriptions, robot.subscribe(), arm_shape));
        tasks.spawn(show(shared.clone(), seen, events, full_name.clone(), now, robot.clone()));
        tasks.spawn(read_parameters(shared.clone(), full_name, robot));
        tasks.spawn(show_markers(drawn, markers));
        tasks.spawn(serve(shared, asks));
        Ok(Self { _tasks: tasks, log })
    }

    /// Returns the node's log.
    pub fn log(&self) -> &Logger {
        &self.log
    }
}

/// Writes a message for browsers whenever the servo or its arm sends something, and at least twice per second.
async fn show(
    shared: Arc<Shared>,
    mut seen: ServoMonitor,
    events: Subscription<ParameterEvent>,
    servo: String,
    now: watch::Sender<Arc<str>>,
    robot_frame: watch::Sender<Arc<str>>,
) {
    let mut tick = tokio::time::interval(FRAME);
    tick.set_missed_tick_behavior(tokio::time::MissedTickBehavior::Delay);
    let (mut shown, mut alive, mut goals) = (Instant::now(), false, 0);
    loop {
        tick.tick().await;
        let mut known = shared.known();
        let before = seen.positions();
        let has_new = seen.take(known.robot());
        if let Some(report) = seen.report() {
            let mut motion = locked(&shared.motion);
            if report.goal_count != goals {
                goals = report.goal_count;
                *motion = before.zip(report.goal).map(|(start, goal)| LastMotion { start, goal });
            } else if let (Some(motion), Some(goal)) = (motion.as_mut(), report.goal) {
                // A stream moves the goal of its motion, for example while a user drags the goal.
                motion.goal = goal;
            }
        }
        let mut restarted = false;
        events.each(|event, _| {
            if event.node != servo {
                return;
            }
            // A message on `~/parameters` without changes announces that the servo has started.
            restarted |= event.changed_parameters.is_empty();
            known.take(event);
            if let Some(robot) = known.robot() {
                robot_frame.send_replace(robot.frame().into());
            }
        });
        if has_new || shown.elapsed() >= IDLE {
            if !seen.heard() {
                seen.two_arms = shared.has_two_arms();
            }
            shown = Instant::now();
            now.send_replace(seen.frame(known.robot()).into());
        }
        if restarted || seen.alive() && !alive {
            shared.appeared.notify_one();
        }
        alive = seen.alive();
    }
}

/// Writes the message with the servo's markers whenever the markers change.
async fn show_markers(drawn: Subscription<MarkerArray>, shown: watch::Sender<Arc<str>>) {
    loop {
        let frame: Arc<str> = markers::frame(&drawn.next().await).into();
        shown.send_if_modified(|before| {
            let is_new = *before != frame;
            *before = frame;
            is_new
        });
    }
}

/// Writes the shape of the arm from the servo's robot description. Does nothing for two arms, because for two arms the page draws
/// simple shapes instead.
async fn show_arm_shape(
    shared: Arc<Shared>,
    descriptions: Subscription<StringMessage>,
    mut robots: watch::Receiver<Arc<str>>,
    arm_shape: watch::Sender<Arc<[u8]>>,
) {
    if shared.kind == ServoKind::TwoArms {
        return;
    }
    let (mut text, mut shown) = (String::new(), None);
    loop {
        tokio::select! {
            came = descriptions.next() => text = came.data,
            changed = robots.changed() => if changed.is_err() { return },
        }
        let Some(model) = shared.known().robot().and_then(|robot| robot.model(&text)) else { continue };
        if shown.as_ref() == Some(&model) {
            continue;
        }
        let read = tokio::task::spawn_blocking(move || (ArmShape::of(&model), model));
        let Ok((read, model)) = read.await else { continue };
        shown = Some(model);
        let missing = read.iter().flat_map(|arm_shape| &arm_shape.missing);
        let node = shared.node.lock().await;
        missing
            .for_each(|why| node.log().warn(&format!("a mesh is missing in the picture of the arm: {why}")));
        drop(node);
        arm_shape.send_replace(read.map_or_else(|| Arc::from([]), |arm_shape| arm_shape.bytes().into()));
    }
}

/// Reads the servo's parameters whenever the servo has appeared. Tries again until this succeeds.
async fn read_parameters(shared: Arc<Shared>, servo: String, frame: watch::Sender<Arc<str>>) {
    loop {
        shared.appeared.notified().await;
        while let Err(why) = shared.read_parameters(&servo, &frame).await {
            shared.node.lock().await.log().debug(&format!("the parameters of {servo}: {why}"));
            tokio::time::sleep(RETRY).await;
        }
    }
}

/// Answers the requests of browsers. A request does not wait for earlier requests.
async fn serve(shared: Arc<Shared>, mut asks: mpsc::Receiver<Asked<Ask>>) {
    while let Some(Asked { ask, answer }) = asks.recv().await {
        let shared = shared.clone();
        tokio::spawn(async move {
            let given = shared.answer(ask).await.unwrap_or_else(Answer::refused);
            // The browser may have gone.
            let _ = answer.send(given);
        });
    }
}

impl Shared {
    fn known(&self) -> MutexGuard<'_, KnownRobot> {
        locked(&self.known)
    }

    /// Returns whether the namespace has a servo for two arms, although this page is for one arm. Returns false if discovery has
    /// not found that servo yet.
    fn has_two_arms(&self) -> bool {
        if self.kind == ServoKind::TwoArms {
            return false;
        }
        let status =
            self.names.topic(&format!("{}/status", ServoKind::TwoArms.node_name())).unwrap_or_default();
        self.node.try_lock().is_ok_and(|node| node.graph().contains_key(&status))
    }

    async fn read_parameters(&self, servo: &str, frame: &watch::Sender<Arc<str>>) -> Result<(), ViewError> {
        self.stop().await?;
        self.pause().await?;
        let mut node = self.node.lock().await;
        self.known().begin();
        let mut client = ParameterClient::new(&mut node, servo, PATIENCE);
        let values = client.all().await?;
        let names: Vec<_> = values.iter().map(|(name, _)| name.clone()).collect();
        let descriptors = client.describe_all(&names).await?;
        let mut known = self.known();
        frame.send_replace(known.end(Robot::new(self.kind, values, descriptors)?).frame().into());
        Ok(())
    }

    async fn answer(&self, ask: Ask) -> Result<Answer, RosError> {
        let trigger = TriggerRequest::default;
        let done = match ask {
            Ask::Goal { position, orientation } => return Ok(self.send_goal(position, orientation)),
            Ask::Jog { linear, angular } => return Ok(self.jog(linear, angular)),
            Ask::Set { name, value } => return self.set(&name, &value).await,
            Ask::Race { laws } => return Ok(self.race(laws).await),
            Ask::Record => return Ok(self.task(BackgroundTask::Record).await),
            Ask::EndRecording => return Ok(self.task(BackgroundTask::EndRecording).await),
            Ask::Pause => self.pause().await?.call(SetBoolRequest { data: true }).await?,
            Ask::Resume => self.pause().await?.call(SetBoolRequest { data: false }).await?,
            Ask::Stop => self.stop().await?.call(trigger()).await?,
            Ask::Reset => return self.reset().await,
        };
        let SuccessResponse { success, message } = done;
        Ok(Answer { ok: success, text: message })
    }

    /// Repeats the latest motion with two simulated arms, each under one of these laws.
    async fn race(&self, laws: [String; 2]) -> Answer {
        if self.kind == ServoKind::TwoArms {
            return Answer::refused("laws are compared with one arm");
        }
        let Some(LastMotion { start, goal }) = locked(&self.motion).clone() else {
            return Answer::refused("there is no motion to repeat yet: send the arm to a goal first");
        };
        let Some(parameters) = self.known().robot().map(|robot| robot.values().to_vec()) else {
            return Answer::refused("the servo's parameters are not known yet");
        };
        self.task(BackgroundTask::Race(Race { laws, start, goal, parameters })).await
    }

    async fn task(&self, task: BackgroundTask) -> Answer {
        let (answer, answered) = oneshot::channel();
        let ended = || Answer::refused("the view ends");
        match self.tasks.send(Asked { ask: task, answer }).await {
            Ok(()) => answered.await.unwrap_or_else(|_| ended()),
            Err(_) => ended(),
        }
    }

    fn send_goal(&self, position: [f64; 3], orientation: [f64; 4]) -> Answer {
        // The servo would also reject an invalid goal, but would not report this to the browser that sent it.
        if let Err(why) = servo::Goal::new(position, orientation, "", "") {
            return Answer::refused(why);
        }
        if self.goals.readers() == 0 {
            return Answer::refused(format!("no servo subscribes to {}", self.goals.topic()));
        }
        let ([x, y, z], [i, j, k, w]) = (position, orientation);
        let pose = Pose::from([x, y, z, i, j, k, w]);
        self.goals.publish(PoseStamped { header: Header::now(""), pose });
        Answer::done("goal sent")
    }

    /// Publishes a twist in the goal frame. The servo's status shows whether the twist moves the arm.
    fn jog(&self, linear: [f64; 3], angular: [f64; 3]) -> Answer {
        if self.twists.readers() == 0 {
            return Answer::refused(format!("no servo subscribes to {}", self.twists.topic()));
        }
        let vector = |[x, y, z]: [f64; 3]| Vector3 { x, y, z };
        let twist = Twist { linear: vector(linear), angular: vector(angular) };
        self.twists.publish(TwistStamped { header: Header::now(""), twist });
        Answer::done("jogging")
    }

    async fn set(&self, name: &str, sent: &serde_json::Value) -> Result<Answer, RosError> {
        let value = match self.known().robot().map(|robot| robot.entry(name)) {
            Some(Some(entry)) => entry.value_from(sent),
            Some(None) => Err("the servo has no such parameter".to_owned()),
            None => Err("the servo's parameters are not known yet".to_owned()),
        };
        let value = match value {
            Ok(value) => value,
            Err(why) => return Ok(Answer::refused(why)),
        };
        let servo = self.names.service(self.kind.node_name())?;
        let mut node = self.node.lock().await;
        let set = ParameterClient::new(&mut node, &servo, PATIENCE).set(name, &value).await?;
        Ok(set.map_or_else(Answer::refused, |()| Answer::done(format!("{name} is {value}"))))
    }

    async fn stop(&self) -> Result<&Client<Trigger>, RosError> {
        self.client(&self.stop, self.kind.node_name(), "stop").await
    }

    async fn pause(&self) -> Result<&Client<SetBool>, RosError> {
        self.client(&self.pause, self.kind.node_name(), "pause").await
    }

    /// Resets the simulated arms one by one. Stops at the first reset that fails, and returns its reason.
    async fn reset(&self) -> Result<Answer, RosError> {
        let mut answer = Answer::refused("there is no arm");
        for arm in self.kind.arms() {
            let mut node = self.node.lock().await;
            let there = node.services();
            let services = PLANT_NAMES.map(|name| format!("{arm}{name}/reset"));
            let is_there =
                |service: &&String| self.names.service(service).is_ok_and(|name| there.contains(&name));
            let service = services.iter().find(is_there).unwrap_or(&services[0]);
            let client = node.client::<Trigger>(service, PATIENCE).await?;
            drop(node);
            let SuccessResponse { success, message } = client.call(TriggerRequest::default()).await?;
            answer = Answer { ok: success, text: message };
            if !answer.ok {
                break;
            }
        }
        Ok(answer)
    }

    /// Returns the client in `cell`. At the first call, connects the client.
    async fn client<'a, S: ServiceType>(
        &self,
        cell: &'a OnceCell<Client<S>>,
        node: &str,
        service: &str,
    ) -> Result<&'a Client<S>, RosError> {
        let service = format!("{node}/{service}");
        cell.get_or_try_init(async || self.node.lock().await.client(&service, PATIENCE).await).await
    }
}

fn locked<T>(shared: &Mutex<T>) -> MutexGuard<'_, T> {
    // No code panics while it holds the lock.
    shared.lock().unwrap_or_else(PoisonError::into_inner)
}
