//! The live page: a small web server that shows a servo in a browser and passes on what its user asks.
//!
//! The [`Peer`] is one DDS participant like any other and knows no browser; the [`Server`] knows browsers and no DDS. Between them are
//! two [`ends`] of a channel: what is shown is replaced, never queued, so that no browser can hold up the others or the robot.
#![warn(clippy::unwrap_used, clippy::expect_used)]
// Both panic where nobody reads: results go through cli::print, all else through stderr.
#![warn(clippy::print_stdout, clippy::print_stderr)]

mod answer;
mod ask;
mod assets;
mod complaints;
mod explain;
mod guard;
mod known;
mod looks;
mod markers;
mod parameters;
mod peer;
mod race;
mod robot;
mod seen;
mod server;
mod session;
mod surface;

pub use answer::Answer;
pub use ask::Ask;
pub use peer::Peer;
pub use race::{Race, RaceWatch};
pub use server::{Server, Settings};

use std::sync::Arc;
use thiserror::Error;
use tokio::sync::{mpsc, oneshot, watch};

/// Why there is no page.
#[derive(Debug, Error)]
pub enum ViewError {
    /// The address is none, or not one of this host.
    #[error("cannot listen on {address}: {why}")]
    Listen {
        /// What was asked for.
        address: String,
        /// What is wrong with it.
        why: String,
    },
    /// Another program listens there.
    #[error("{0} is taken by another program: --listen ADDRESS:0 takes any free port")]
    Taken(String),
    /// What was given as a token is none.
    #[error("a token has {} characters or more, of A-Z, a-z, 0-9, - and _", guard::SHORTEST_TOKEN)]
    Token,
    /// Its place in the graph.
    #[error(transparent)]
    Ros(#[from] dq_ros::ros::RosError),
}

/// What browsers ask of the program that serves them, rather than of the robot.
#[derive(Clone, Debug)]
pub enum BackgroundTask {
    /// To run a race and show it.
    Race(Race),
    /// To begin a recording.
    Record,
    /// To end the recording.
    EndRecording,
}

/// Background tasks that were asked for.
pub type BackgroundTasks = mpsc::Receiver<Asked<BackgroundTask>>;

/// Something that a browser asks, and where its answer goes.
pub struct Asked<A> {
    /// What is asked.
    pub ask: A,
    /// Takes the answer.
    pub answer: oneshot::Sender<Answer>,
}

/// The robot's end: writes what the browsers show, reads what they ask.
pub struct RobotEnd {
    /// What changes seldom, as the frame for a browser: the arm and the parameters.
    pub robot: watch::Sender<Arc<str>>,
    /// What changes all the time, as the frame for a browser.
    pub now: watch::Sender<Arc<str>>,
    /// A race, as the frame for a browser.
    pub race: watch::Sender<Arc<str>>,
    /// What the servo draws besides, as the frame for a browser.
    pub markers: watch::Sender<Arc<str>>,
    /// What the arm looks like, as the page reads it; empty where no description says so.
    pub looks: watch::Sender<Arc<[u8]>>,
    /// What browsers ask.
    pub asks: mpsc::Receiver<Asked<Ask>>,
}

/// The browsers' end.
#[derive(Clone)]
pub struct PageEnd {
    robot: watch::Receiver<Arc<str>>,
    now: watch::Receiver<Arc<str>>,
    race: watch::Receiver<Arc<str>>,
    markers: watch::Receiver<Arc<str>>,
    looks: watch::Receiver<Arc<[u8]>>,
    asks: mpsc::Sender<Asked<Ask>>,
}

/// Requests that wait for the robot's end at most; those beyond are refused.
const WAITING: usize = 64;

/// The two ends of a new channel; nothing is shown yet.
pub fn ends() -> (RobotEnd, PageEnd) {
    let nothing = || watch::Sender::new(Arc::from(""));
    let (robot, now, race, markers) = (nothing(), nothing(), nothing(), nothing());
    let (looks, (asker, asks)) = (watch::Sender::new(Arc::from([])), mpsc::channel(WAITING));
    let page = PageEnd {
        robot: robot.subscribe(),
        now: now.subscribe(),
        race: race.subscribe(),
        markers: markers.subscribe(),
        looks: looks.subscribe(),
        asks: asker,
    };
    (RobotEnd { robot, now, race, markers, looks, asks }, page)
}
