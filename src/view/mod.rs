//! The live page: a small web server that shows a servo in a browser and passes on what its user asks.
//!
//! The [`Peer`] is one DDS participant like any other and knows no browser; the [`Server`] knows browsers and no DDS. Between them are
//! two [ends](ends) of a channel: what is shown is replaced, never queued, so that no browser can hold up the others or the robot.

mod answer;
mod ask;
mod assets;
mod complaints;
mod guard;
mod parameters;
mod peer;
mod robot;
mod seen;
mod server;
mod session;
mod words;

pub use answer::Answer;
pub use ask::Ask;
pub use peer::Peer;
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
    /// Its place in the graph.
    #[error(transparent)]
    Ros(#[from] crate::ros::RosError),
}

/// Something that a browser asks of the robot, and where its answer goes.
pub struct Asked {
    /// What is asked.
    pub ask: Ask,
    /// Takes the answer.
    pub answer: oneshot::Sender<Answer>,
}

/// The robot's end: writes what the browsers show, reads what they ask.
pub struct RobotEnd {
    /// What changes seldom, as the frame for a browser: the arm and the parameters.
    pub robot: watch::Sender<Arc<str>>,
    /// What changes all the time, as the frame for a browser.
    pub now: watch::Sender<Arc<str>>,
    /// What browsers ask.
    pub asks: mpsc::Receiver<Asked>,
}

/// The browsers' end.
#[derive(Clone)]
pub struct PageEnd {
    robot: watch::Receiver<Arc<str>>,
    now: watch::Receiver<Arc<str>>,
    asks: mpsc::Sender<Asked>,
}

/// Requests that wait for the robot's end at most; those beyond are refused.
const WAITING: usize = 64;

/// The two ends of a new channel; nothing is shown yet.
pub fn ends() -> (RobotEnd, PageEnd) {
    let (robot_sender, robot) = watch::channel(Arc::from(""));
    let (now_sender, now) = watch::channel(Arc::from(""));
    let (asks_sender, asks) = mpsc::channel(WAITING);
    (RobotEnd { robot: robot_sender, now: now_sender, asks }, PageEnd { robot, now, asks: asks_sender })
}
