//! `dq_servo goal`: sends the arm to a pose.

use super::find::{Kind, there};
use super::not_arrived::NotArrived;
use super::print;
use super::signals::Signals;
use super::tools::recording::Recording;
use super::watch::Watch;
use anyhow::anyhow;
use dq_core::servo;
use dq_messages::PoseNumbers;
use dq_messages::messages::{Trigger, TriggerRequest};
use dq_ros::ros::{Environment, LogLevel, Logging, Node, Resolver, RosArgs, Session};
use dq_ros::stderr;
use dq_wire::{MotionReport, ServoKind};
use std::time::Duration;

/// Send the arm to a pose and wait until it has arrived
#[derive(clap::Args)]
pub(super) struct Goal {
    /// Position [m] and orientation quaternion: X Y Z QX QY QZ QW
    #[arg(num_args = 7, required = true, allow_negative_numbers = true, value_names = ["X", "Y", "Z", "QX", "QY", "QZ", "QW"])]
    pose: Vec<f64>,
    /// Two arms: the pose is that of the right tool relative to the left tool
    #[arg(long)]
    dual: bool,
    /// Frame of the pose; empty for the servo's base frame, or the left tool's
    #[arg(long, default_value = "")]
    frame: String,
    /// Give up after this many seconds
    #[arg(long, default_value_t = 60.0, value_name = "SECONDS", allow_negative_numbers = true)]
    timeout: f64,
    /// Keep the goal in force if this command gives up or is interrupted; by default it is withdrawn, and the arm stops
    #[arg(long)]
    keep_going: bool,
    /// Record the motion into a rosbag2 directory that does not exist yet
    #[arg(long, value_name = "DIR")]
    record: Option<std::path::PathBuf>,
}

/// How long a servo may take to withdraw a goal.
const WITHDRAWAL: Duration = Duration::from_secs(2);

impl Goal {
    pub(super) async fn run(&self, ros_args: &RosArgs) -> anyhow::Result<()> {
        let kind = if self.dual { ServoKind::TwoArms } else { ServoKind::OneArm };
        let goal: PoseNumbers = self.pose.as_slice().try_into()?;
        let [x, y, z, orientation @ ..] = goal;
        // The servo would reject it too, but only if one is running.
        servo::Goal::new([x, y, z], orientation, &self.frame, &self.frame)?;
        let timeout = Duration::try_from_secs_f64(self.timeout).map_err(|_| {
            super::Usage(format!("--timeout {:?}: expected seconds, 0 or more", self.timeout))
        })?;
        let environment = Environment::from_process(ros_args)?;
        let session = Session::open(&environment)?;
        let names = Resolver::new("dq_servo_goal", ros_args)?;
        let mut node = session.node(names.clone(), Logging::new(ros_args, LogLevel::Warn))?;
        let mut watch = Watch::new(&mut node, kind, kind.node_name(), &self.frame)?;
        let mut signals = Signals::new()?;
        let recording = self.record.as_deref();
        let recording = recording.map(|bag| Recording::start(bag, &environment, ros_args)).transpose()?;
        let motion = async {
            if let Some(recording) = &recording {
                recording.hears(kind, kind.node_name(), &names).await?;
            }
            watch.go(goal, timeout).await
        };
        let mut arrived = tokio::select! {
            arrived = motion => arrived,
            () = signals.next() => Err(anyhow!("interrupted")),
        };
        if let Err(why) = arrived {
            tokio::select! {
                () = self.give_up(&mut node, &watch, kind.node_name()) => {}
                () = signals.next() => stderr::line("interrupted twice: the goal may still be in force"),
            }
            arrived = Err(self.explain(why, &node, &names));
        }
        let (arrived, recorded) = Recording::end(recording, arrived).await?;
        print::results(report(&arrived), &mut signals).await?;
        recorded
    }

    /// Withdraws the goal if it is still in force, or prints that the arm goes on.
    async fn give_up(&self, node: &mut Node, watch: &Watch, servo: &str) {
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

    /// Names the running servo if the requested one is not running.
    fn explain(&self, why: anyhow::Error, node: &Node, names: &Resolver) -> anyhow::Error {
        if !matches!(why.downcast_ref(), Some(NotArrived::NoServo(_))) {
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
            return anyhow!("there is a servo for {hint}");
        }
        match there(&[Kind::Servo], node) {
            None => why,
            Some(elsewhere) => anyhow!(
                "{why} There is {elsewhere}: --ros-args -r __ns:=NAMESPACE sends a goal to that in NAMESPACE"
            ),
        }
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
