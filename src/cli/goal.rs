//! `dq_servo goal`: sends the arm to a pose, or its joints to positions.

use super::error::{Error, failed};
use super::find::{Kind, PATIENCE, there};
use super::joint_positions::JointPositions;
use super::not_arrived::NotArrived;
use super::print;
use super::signals::Signals;
use super::tools::recording::Recording;
use super::watch::{StampedGoal, Watch, of_servo, pose_goal};
use dq_core::servo;
use dq_messages::Direction;
use dq_messages::messages::{Message, PoseStamped, Quaternion, Time, Trigger, TriggerRequest};
use dq_ros::ros::args::Remap;
use dq_ros::ros::names::NodeName;
use dq_ros::ros::{Environment, LogLevel, Logging, Node, Resolver, RosArgs, Session, Subscription};
use dq_ros::stderr;
use dq_wire::{Contract, MotionReport, ServoKind};
use nalgebra::UnitQuaternion;
use std::time::Duration;

/// Send the arm to a pose, or its joints to positions, and wait until it has arrived
#[derive(clap::Args)]
pub(super) struct Goal {
    /// Position [m], then the orientation as a quaternion. Leave out the quaternion with --rpy or --keep-orientation
    #[arg(num_args = 3..=7, required_unless_present = "joints", allow_negative_numbers = true, value_names = ["X", "Y", "Z", "QX", "QY", "QZ", "QW"])]
    pose: Vec<f64>,
    /// Orientation as roll, pitch and yaw about the fixed axes of the frame [rad]
    #[arg(long, num_args = 3, allow_negative_numbers = true, value_names = ["ROLL", "PITCH", "YAW"])]
    rpy: Option<Vec<f64>>,
    /// Positions of all joints in their order [rad, m], or of some: joint2=0.5,joint3=1. Two arms: left/joint2=0.5
    #[arg(
        long, allow_hyphen_values = true, value_name = "POSITIONS",
        conflicts_with_all = ["pose", "rpy", "keep_orientation", "frame"],
    )]
    joints: Option<JointPositions>,
    /// Keep the tool's present orientation
    #[arg(long, conflicts_with_all = ["rpy", "frame"])]
    keep_orientation: bool,
    /// The servo's node, if it has another name or is in another namespace
    #[arg(long, value_name = "NODE")]
    servo: Option<String>,
    /// Two arms: the pose is that of the right tool relative to the left tool
    #[arg(long)]
    dual: bool,
    /// Frame of the pose. Empty: the servo's base frame; with two arms, the frame of the left tool
    #[arg(long, default_value = "")]
    frame: String,
    /// Give up after this many seconds
    #[arg(long, default_value_t = 60.0, value_name = "SECONDS", allow_negative_numbers = true)]
    timeout: f64,
    /// Keep the goal in force if this command gives up or is interrupted; by default the goal is withdrawn, and the arm stops
    #[arg(long)]
    keep_going: bool,
    /// Record the motion into a rosbag2 directory that does not exist yet
    #[arg(long, value_name = "DIR")]
    record: Option<std::path::PathBuf>,
}

/// The topic of joint goals in the contract.
const JOINT_GOAL: &str = "~/joint_goal";

/// The quaternion without rotation.
const UPRIGHT: [f64; 4] = [0.0, 0.0, 0.0, 1.0];

/// The time that a servo may take to withdraw a goal.
const WITHDRAWAL: Duration = Duration::from_secs(2);

impl Goal {
    pub(super) async fn run(&self, ros_args: &RosArgs) -> super::Result<()> {
        if let Some(joints) = &self.joints {
            return self.send(ros_args, JOINT_GOAL, async |_, _, _| Ok(joints.goal(Time::now()))).await;
        }
        let (position, orientation) = self.place()?;
        // Report an invalid goal even if no servo is running to reject it.
        servo::Goal::new(position, orientation.unwrap_or(UPRIGHT), &self.frame, &self.frame)?;
        let goal = async |node: &mut Node, servo: &str, watch: &Watch| {
            let (mut stamp, mut orientation) = (Time::now(), orientation);
            if orientation.is_none() || !self.frame.is_empty() {
                watch.find(self.timeout()?).await?;
                let tool = tool_pose(node, self.kind(), servo, watch).await?;
                // Use the servo's time, which may be that of a simulator.
                stamp = tool.header.stamp;
                let Quaternion { x, y, z, w } = tool.pose.orientation;
                orientation = orientation.or(Some([x, y, z, w]));
            }
            let ([x, y, z], [qx, qy, qz, qw]) = (position, orientation.unwrap_or(UPRIGHT));
            Ok(pose_goal([x, y, z, qx, qy, qz, qw], stamp, &self.frame))
        };
        self.send(ros_args, self.kind().goal_topic(), goal).await
    }

    fn kind(&self) -> ServoKind {
        if self.dual { ServoKind::TwoArms } else { ServoKind::OneArm }
    }

    fn timeout(&self) -> super::Result<Duration> {
        Ok(Duration::try_from_secs_f64(self.timeout).map_err(|_| {
            super::Usage(format!("--timeout {:?}: expected seconds, 0 or more", self.timeout))
        })?)
    }

    /// Sends the goal that `goal` creates to the topic that the contract calls `topic`. Then waits for the outcome of the goal, and
    /// prints the outcome.
    async fn send<M: Message + Clone>(
        &self,
        ros_args: &RosArgs,
        topic: &str,
        goal: impl AsyncFnOnce(&mut Node, &str, &Watch<M>) -> super::Result<StampedGoal<M>>,
    ) -> super::Result<()> {
        let (kind, timeout) = (self.kind(), self.timeout()?);
        let environment = Environment::from_process(ros_args)?;
        let session = Session::open(&environment)?;
        let (names, servo) = self.names(kind, ros_args)?;
        let mut node = session.node(names.clone(), Logging::new(ros_args, LogLevel::Warn))?;
        let mut watch = Watch::new(&mut node, kind, &servo, topic, !self.frame.is_empty())?;
        let mut signals = Signals::new()?;
        let recording = self.record.as_deref();
        let recording = recording.map(|bag| Recording::start(bag, &environment, ros_args)).transpose()?;
        let motion = async {
            if let Some(recording) = &recording {
                recording.hears(kind, &servo, &names, &of_servo(topic, &servo)).await?;
            }
            let goal = goal(&mut node, &servo, &watch).await?;
            watch.go(goal, timeout).await
        };
        let mut arrived = tokio::select! {
            arrived = motion => arrived,
            () = signals.next() => Err(Error::Interrupted),
        };
        if let Err(why) = arrived {
            tokio::select! {
                () = self.give_up(&mut node, &watch, &servo) => {}
                () = signals.next() => stderr::line("interrupted twice: the goal may still be in force"),
            }
            arrived = Err(self.explain(why, &node, &names));
        }
        let (arrived, recorded) = Recording::end(recording, arrived).await?;
        print::results(report(&arrived), &mut signals).await?;
        recorded
    }

    /// Returns the position \[m\] and the orientation (a quaternion x y z w) of the goal. The orientation is `None` if the tool
    /// keeps its present one.
    fn place(&self) -> super::Result<([f64; 3], Option<[f64; 4]>)> {
        let orientation = match (&self.pose[3..], self.rpy.as_deref(), self.keep_orientation) {
            (&[qx, qy, qz, qw], None, false) => Some([qx, qy, qz, qw]),
            ([], Some(&[roll, pitch, yaw]), _) => {
                Some(UnitQuaternion::from_euler_angles(roll, pitch, yaw).coords.into())
            }
            ([], None, true) => None,
            _ => {
                let expected =
                    "expected X Y Z, and the orientation once: QX QY QZ QW, --rpy or --keep-orientation";
                return Err(super::Usage(expected.to_owned()).into());
            }
        };
        Ok(([self.pose[0], self.pose[1], self.pose[2]], orientation))
    }

    /// Returns the names for a node of this command in the servo's namespace, and the name of the servo in this namespace.
    fn names(&self, kind: ServoKind, ros_args: &RosArgs) -> super::Result<(Resolver, String)> {
        const NAME: &str = "dq_servo_goal";
        let names = Resolver::new(NAME, ros_args)?;
        let Some(servo) = &self.servo else { return Ok((names, kind.node_name().to_owned())) };
        let servo = NodeName::parse(&names.service(servo)?)?;
        let to = servo.namespace().to_owned();
        let mut there = ros_args.clone();
        there.remaps.insert(0, Remap { node: None, from: "__ns".to_owned(), to });
        Ok((Resolver::new(NAME, &there)?, servo.name().to_owned()))
    }

    /// Withdraws the goal if it is still in force. With `--keep-going`, only prints that the arm continues.
    async fn give_up<M: Message + Clone>(&self, node: &mut Node, watch: &Watch<M>, servo: &str) {
        match watch.has_own_goal().await {
            Some(true) => {}
            Some(false) => return,
            None => {
                return stderr::line("the servo does not say whether it has the goal: the arm may go there");
            }
        }
        if self.keep_going {
            return stderr::line("the goal stays in force: the arm goes on (--keep-going)");
        }
        let withdrawal = async {
            let stop = node.client::<Trigger>(&format!("{servo}/stop"), WITHDRAWAL).await?;
            stop.call(TriggerRequest::default()).await
        };
        match withdrawal.await {
            Ok(answer) if answer.success => stderr::line("the goal is withdrawn: the arm decelerates"),
            Ok(answer) => stderr::line(format!("the goal could not be withdrawn: {}", answer.message)),
            Err(why) => stderr::line(format!("the goal could not be withdrawn, the arm may go on: {why}")),
        }
    }

    /// Returns the error `why`. If the requested servo is not running, the error names the servos that are running.
    fn explain(&self, why: Error, node: &Node, names: &Resolver) -> Error {
        if !matches!(why, Error::NotArrived(NotArrived::NoServo(_))) {
            return why;
        }
        let (other, hint) = match self.dual {
            true => (ServoKind::OneArm.node_name(), "one arm: leave --dual out"),
            false => {
                (ServoKind::TwoArms.node_name(), "two arms: --dual gives the right tool seen from the left")
            }
        };
        let status = names.topic(&format!("{other}/status")).unwrap_or_default();
        if node.graph().contains_key(&status) {
            return failed!("there is a servo for {hint}");
        }
        match there(&[Kind::Servo], node) {
            None => why,
            Some(elsewhere) => failed!("{why} There is {elsewhere}: name it by --servo"),
        }
    }
}

/// Returns the next pose of the tool that the servo publishes.
///
/// # Errors
/// [`NotArrived::NoRobot`] if the servo publishes no pose within [`PATIENCE`].
async fn tool_pose(
    node: &mut Node,
    kind: ServoKind,
    servo: &str,
    watch: &Watch,
) -> super::Result<PoseStamped> {
    let contract = kind.contract(Contract::builtin()?);
    let topic = contract.topic::<PoseStamped>("~/current_pose", Direction::Out)?;
    let poses: Subscription<PoseStamped> = node.subscription_as(topic, &format!("{servo}/current_pose"))?;
    match tokio::time::timeout(PATIENCE, poses.next()).await {
        Ok(pose) => Ok(pose),
        Err(_) => Err(NotArrived::NoRobot(watch.next_report().await.sentence()).into()),
    }
}

fn report(arrived: &MotionReport) -> String {
    let figures = arrived.figures;
    format!(
        "arrived with {} {}after {:.2} s: path {:.4} m, {:.2} mm and {:.3}° from the goal",
        arrived.law_and_aim(),
        if arrived.reconfigured { "in another configuration " } else { "" },
        figures.arrival_time.unwrap_or(figures.elapsed),
        figures.path_length,
        figures.position_error * 1e3,
        figures.rotation_error.to_degrees()
    )
}
