//! `dq_servo goal`: sends the arm to a pose.

use super::print::print_line;
use super::recording::Recording;
use super::watch::{GoalNumbers, Watch};
use crate::config::{NodeParameters, ServoParameters};
use crate::ros::{Environment, LogLevel, Resolver, RosArgs, RosError, Session};
use crate::servo::{self, OneArm};
use std::path::PathBuf;
use std::time::Duration;

/// Send the arm to a pose and wait until it has arrived
#[derive(clap::Args)]
pub(super) struct Goal {
    /// Position [m] and orientation quaternion: X Y Z QX QY QZ QW
    #[arg(num_args = 7, required = true, allow_negative_numbers = true, value_names = ["X", "Y", "Z", "QX", "QY", "QZ", "QW"])]
    pose: Vec<f64>,
    /// Frame of the pose; empty for the servo's base frame
    #[arg(long, default_value = "")]
    frame: String,
    /// Give up after this many seconds
    #[arg(long, default_value_t = 60.0, value_name = "SECONDS")]
    timeout: f64,
    /// Record the motion into a rosbag2 directory that does not exist yet
    #[arg(long, value_name = "DIR")]
    record: Option<PathBuf>,
}

impl Goal {
    pub(super) async fn run(&self, ros_args: &RosArgs) -> anyhow::Result<()> {
        let goal: GoalNumbers = self.pose.as_slice().try_into()?;
        let [x, y, z, orientation @ ..] = goal;
        // The servo would reject it as well, but only if there is one.
        servo::Goal::new([x, y, z], orientation, &self.frame, &self.frame)?;
        let timeout = Duration::try_from_secs_f64(self.timeout)
            .map_err(|_| super::Usage(format!("--timeout {}: expected seconds, 0 or more", self.timeout)))?;
        let environment = Environment::from_process(ros_args)?;
        let session = Session::open(&environment)?;
        let names = Resolver::new("dq_servo_goal", ros_args).map_err(RosError::from)?;
        let mut node = session.node(names.clone(), ros_args.log_level.unwrap_or(LogLevel::Warn))?;
        let mut watch = Watch::new::<OneArm>(&mut node, ServoParameters::NODE_NAME, &self.frame)?;
        let recording = match &self.record {
            Some(directory) => {
                watch.expect_recorder();
                let recording = Recording::start(directory, &environment, ros_args)?;
                recording.hears::<OneArm>(&names).await?;
                Some(recording)
            }
            None => None,
        };
        let arrived = watch.go(goal, timeout).await;
        if let Some(recording) = recording {
            recording.finish().await?;
        }
        let report = arrived?;
        let figures = report.figures;
        print_line!(
            "arrived with {} after {:.2} s: path {:.4} m, {:.2} mm and {:.3}° from the goal",
            report.law,
            figures.arrival_time.unwrap_or(figures.elapsed),
            figures.path_length,
            figures.position_error * 1e3,
            figures.rotation_error.to_degrees()
        )?;
        Ok(())
    }
}
