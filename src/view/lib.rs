#![doc = include_str!("README.md")]
#![warn(clippy::unwrap_used, clippy::expect_used)]
// These macros panic if nobody reads the output. Results go through `cli::print`, everything else through `stderr`.
#![warn(clippy::print_stdout, clippy::print_stderr)]

mod answer;
mod arm_shape;
mod ask;
mod assets;
mod explain;
mod guard;
mod known_robot;
mod markers;
mod parameters;
mod peer;
mod race;
mod recorded_runs;
mod robot;
mod server;
mod servo_monitor;
mod session;
mod surface;
mod warning_log;

pub use answer::Answer;
pub use ask::Ask;
pub use peer::Peer;
pub use race::{Race, RaceWatch};
pub use recorded_runs::recorded_runs;
pub use server::{Server, Settings};

use std::sync::Arc;
use thiserror::Error;
use tokio::sync::{mpsc, oneshot, watch};

/// The reason why the page cannot be opened.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum ViewError {
    /// The address is invalid, or does not belong to this host.
    #[error("cannot listen on {address}: {why}")]
    Listen {
        /// The requested address.
        address: String,
        /// The reason.
        why: String,
    },
    /// Another program listens at the address.
    #[error("{0} is taken by another program: --listen ADDRESS:0 takes any free port")]
    Taken(String),
    /// The chosen token is invalid.
    #[error("a token has {} characters or more, of A-Z, a-z, 0-9, - and _", guard::SHORTEST_TOKEN)]
    Token,
    /// The page cannot take part in the graph.
    #[error(transparent)]
    Ros(#[from] dq_ros::ros::RosError),
    /// The servo's parameters do not describe an arm.
    #[error(transparent)]
    Parameters(#[from] dq_params::ParameterError),
}

/// A request of a browser to the program that serves the page, not to the robot.
#[derive(Clone, Debug)]
pub enum BackgroundTask {
    /// Run a race, and show it: two simulated arms repeat the same motion, each under one law.
    Race(Race),
    /// Begin a recording.
    Record,
    /// End the recording.
    EndRecording,
}

/// The requested background tasks.
pub type BackgroundTasks = mpsc::Receiver<Asked<BackgroundTask>>;

/// A request of a browser, and the channel for its answer.
pub struct Asked<A> {
    /// The request.
    pub ask: A,
    /// The channel for the answer.
    pub answer: oneshot::Sender<Answer>,
}

/// The robot's end of the channel: sends the data that browsers show, and receives the browsers' requests.
pub struct RobotEnd {
    /// The JSON message that shows the arm and the parameters, which seldom change.
    pub robot: watch::Sender<Arc<str>>,
    /// The JSON message that shows the present state of the servo and its arms.
    pub now: watch::Sender<Arc<str>>,
    /// The JSON message that shows a race: two simulated arms that repeat the same motion, each under one law.
    pub race: watch::Sender<Arc<str>>,
    /// The JSON message that shows the markers that the servo publishes for viewers.
    pub markers: watch::Sender<Arc<str>>,
    /// The shape of the arm in the page's format; empty if there is no description.
    pub arm_shape: watch::Sender<Arc<[u8]>>,
    /// The requests of browsers.
    pub asks: mpsc::Receiver<Asked<Ask>>,
}

/// The browsers' end of the channel.
#[derive(Clone)]
pub struct PageEnd {
    robot: watch::Receiver<Arc<str>>,
    now: watch::Receiver<Arc<str>>,
    race: watch::Receiver<Arc<str>>,
    markers: watch::Receiver<Arc<str>>,
    arm_shape: watch::Receiver<Arc<[u8]>>,
    asks: mpsc::Sender<Asked<Ask>>,
}

/// The largest number of requests that wait for the robot's end. Further requests are refused.
const WAITING: usize = 64;

/// Returns the two ends of a new channel. At first the channel has no data to show.
pub fn ends() -> (RobotEnd, PageEnd) {
    let nothing = || watch::Sender::new(Arc::from(""));
    let (robot, now, race, markers) = (nothing(), nothing(), nothing(), nothing());
    let (arm_shape, (asker, asks)) = (watch::Sender::new(Arc::from([])), mpsc::channel(WAITING));
    let page = PageEnd {
        robot: robot.subscribe(),
        now: now.subscribe(),
        race: race.subscribe(),
        markers: markers.subscribe(),
        arm_shape: arm_shape.subscribe(),
        asks: asker,
    };
    (RobotEnd { robot, now, race, markers, arm_shape, asks }, page)
}
