//! The subcommands other than nodes: the demo, bags, figures, the reproduction, the comparison, the page in a browser.

mod background_tasks;
mod compare;
mod demo;
mod enter;
mod figure_width;
mod node_set;
mod plot;
mod progress;
mod race;
mod record;
pub(super) mod recording;
mod rehearsal;
mod replay;
mod reproduce;
mod table;
mod view;

use super::help;
use clap::Subcommand;
use dq_ros::ros::RosArgs;

/// A subcommand other than a node.
#[derive(Subcommand)]
pub(super) enum Command {
    #[command(flatten)]
    Online(Online),
    #[command(flatten)]
    Offline(Offline),
}

impl Default for Command {
    fn default() -> Self {
        Self::Online(Online::Demo(demo::Demo::default()))
    }
}

/// A subcommand that takes part in a graph.
#[derive(Subcommand)]
pub(super) enum Online {
    /// Move a simulated arm to a goal under one law, and back under another (the default on a terminal)
    #[command(after_long_help = help::figures(help::OF_DEMO))]
    Demo(demo::Demo),
    /// Show the servo in a browser: watch it, send it goals, switch its law; or play bags
    View(view::View),
    /// Record the topics of a running graph into a rosbag2 directory, until ctrl-C
    Record(record::Record),
}

impl Online {
    pub async fn run(self, ros_args: &RosArgs) -> crate::cli::Result<()> {
        match self {
            Self::Demo(demo) => demo.run(ros_args).await,
            Self::View(view) => view.run(ros_args).await,
            Self::Record(record) => record.run(ros_args).await,
        }
    }
}

/// A subcommand that needs no graph.
#[derive(Subcommand)]
pub(super) enum Offline {
    /// Draw recorded runs and print the metrics of each motion; several bags are drawn together
    #[command(after_long_help = help::figures(help::OF_PLOT))]
    Plot(plot::Plot),
    /// Replay a bag through the servo cycle and compare its commands with those recorded
    Replay(replay::Replay),
    /// Reproduce the paper's figures and comparison, and two further results
    Reproduce(reproduce::Reproduce),
    /// Compare the laws on several arms, random tasks and plants; resumes an interrupted run
    Compare(compare::Compare),
}

impl Offline {
    pub fn run(self, ros_args: &RosArgs) -> crate::cli::Result<()> {
        match self {
            Self::Plot(plot) => plot.run(ros_args),
            Self::Replay(replay) => replay.run(ros_args),
            Self::Reproduce(reproduce) => reproduce.run(ros_args),
            Self::Compare(compare) => compare.run(),
        }
    }
}
