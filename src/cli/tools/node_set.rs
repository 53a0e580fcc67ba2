//! The nodes of a demo, in one process.

use super::recording::Recording;
use crate::cli::error::{Error, bail};
use crate::cli::not_arrived::NotArrived;
use crate::cli::signals::Signals;
use crate::cli::watch::{DISCOVERY, Watch, pose_goal};
use dq_config::{PlantParameters, ServoParameters};
use dq_core::servo::State;
use dq_messages::PoseNumbers;
use dq_messages::messages::Time;
use dq_nodes::{PlantNode, Prepared, ServoNode};
use dq_params::Value;
use dq_ros::ros::{Environment, LogLevel, Logging, Node, ParameterClient, Resolver, RosArgs, Session};
use dq_wire::{MotionReport, ServoKind};
use std::time::Duration;

/// The longest time for one motion. `diffc` with the paper's gain takes about 20 s until the tolerances are met.
const MOTION_TIMEOUT: Duration = Duration::from_secs(90);

/// The longest time that a parameter service may take.
const SERVICE: Duration = Duration::from_secs(10);

/// The environment of a demo.
pub(super) struct Setting<'a> {
    pub environment: Environment,
    pub ros_args: &'a RosArgs,
    pub recording: Option<&'a Recording>,
}

/// The nodes of a demo. Each has its own participant, so that they communicate over DDS.
pub(super) struct NodeSet<'a> {
    watch: Watch,
    recording: Option<&'a Recording>,
    names: Resolver,
    kind: ServoKind,
    servo_name: String,
    // These fields are dropped in this order: the servo sends its final zeros while the robots are still there.
    node: Node,
    servo: ServoNode,
    _plants: Vec<PlantNode>,
    _sessions: Vec<Session>,
    ready: bool,
}

impl<'a> NodeSet<'a> {
    /// Starts the simulated arms `plants`, the servo, and the node that sends the goals.
    pub fn set(
        setting: &Setting<'a>,
        servo: Prepared<ServoParameters>,
        plants: Vec<Prepared<PlantParameters>>,
    ) -> crate::cli::Result<Self> {
        let Setting { environment, ros_args, recording } = setting;
        let mut sessions = Vec::new();
        let mut nodes = Vec::new();
        for plant in plants {
            let session = Session::open(environment)?;
            nodes.push(PlantNode::start(&session, plant)?);
            sessions.push(session);
        }
        let (servo_name, kind) = (servo.node(), ServoKind::of(&servo.parameters().arms));
        let (of_servo, of_demo) = (Session::open(environment)?, Session::open(environment)?);
        let servo = ServoNode::start(&of_servo, servo)?;
        let names = Resolver::new("dq_servo_demo", ros_args)?;
        let mut node = of_demo.node(names.clone(), Logging::new(ros_args, LogLevel::Warn))?;
        let watch = Watch::new(&mut node, kind, &servo_name, kind.goal_topic(), false)?;
        sessions.extend([of_servo, of_demo]);
        Ok(Self {
            watch,
            recording: *recording,
            names,
            kind,
            servo_name,
            node,
            servo,
            _plants: nodes,
            _sessions: sessions,
            ready: false,
        })
    }

    /// Returns the kind of the servo.
    pub fn kind(&self) -> ServoKind {
        self.kind
    }

    /// Runs `play`, and then brings the arms to rest, even if a signal ended `play`. A second signal skips this stop.
    pub async fn perform<R>(
        mut self,
        play: impl AsyncFnOnce(&mut Self) -> crate::cli::Result<R>,
        signals: &mut Signals,
    ) -> crate::cli::Result<R> {
        let played = tokio::select! {
            played = play(&mut self) => played,
            () = signals.next() => Err(Error::Interrupted),
        };
        tokio::select! {
            ended = self.servo.shut_down() => ended?,
            () = signals.next() => bail!("interrupted twice: zeros were sent before the arms were seen at rest"),
        }
        played
    }

    /// Moves the arm to `goal`, and waits until the arm has arrived.
    pub async fn go(&mut self, goal: PoseNumbers) -> crate::cli::Result<MotionReport> {
        if !self.ready {
            self.servo_ready().await?;
            if let Some(recording) = self.recording {
                recording.hears(self.kind, &self.servo_name, &self.names, self.kind.goal_topic()).await?;
            }
            self.ready = true;
        }
        self.watch.go(pose_goal(goal, Time::now(), ""), MOTION_TIMEOUT).await
    }

    /// Waits until the servo has its first joint state.
    async fn servo_ready(&self) -> Result<(), NotArrived> {
        let ready = async { while self.watch.next_report().await.state == State::WaitingForState {} };
        tokio::time::timeout(DISCOVERY, ready).await.map_err(|_| NotArrived::NoServo(DISCOVERY.as_secs_f64()))
    }

    /// Sets a parameter of the servo.
    pub async fn set_parameter(&mut self, name: &str, value: &str) -> crate::cli::Result<()> {
        let mut parameters = ParameterClient::new(&mut self.node, &self.servo_name, SERVICE);
        parameters.set(name, &Value::String(value.to_owned())).await?.map_err(Error::Failed)
    }
}
