//! Performs the requests of the live page that concern this program rather than the robot: races and recordings. In a race, two
//! simulated arms repeat the same motion, each under one law.

use super::race::RaceNodes;
use super::recording::Recording;
use dq_common::text::cut;
use dq_ros::ros::{Environment, RosArgs};
use dq_view::{Answer, Asked, BackgroundTask, BackgroundTasks, Race};
use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, SystemTime, UNIX_EPOCH};
use tokio::sync::watch;
use tokio::task::{JoinSet, spawn_blocking};

/// Performs the requests of one live page until the page is closed.
pub(super) struct Runner {
    environment: Environment,
    ros_args: RosArgs,
    show: watch::Sender<Arc<str>>,
    /// The number of the last race. The first number is the time at which this program started [ms since 1970]. So no number occurs
    /// again after a restart, and a page that stays open does not take a new race for an old one.
    races: u64,
    /// The race that is running, if any.
    race: JoinSet<()>,
    recording: Option<(Recording, PathBuf)>,
}

impl Runner {
    /// Creates the runner, which sends the pictures of races to the channel `show`.
    pub fn new(environment: &Environment, ros_args: &RosArgs, show: watch::Sender<Arc<str>>) -> Self {
        let (environment, ros_args) = (environment.clone(), ros_args.clone());
        let races = u64::try_from(since_1970().as_millis()).unwrap_or_default();
        Self { environment, ros_args, show, races, race: JoinSet::new(), recording: None }
    }

    /// Performs the requests. When nobody can send requests any more, ends the running tasks.
    pub async fn run(mut self, mut tasks: BackgroundTasks) {
        loop {
            let failed = async {
                match &self.recording {
                    Some((recording, _)) => recording.failed().await,
                    None => std::future::pending().await,
                }
            };
            let asked = tokio::select! {
                asked = tasks.recv() => asked,
                () = failed => {
                    let told = self.end_recording().await.unwrap_or_else(|why| refused(&why));
                    self.show.send_replace(told.broadcast().into());
                    continue;
                }
            };
            let Some(Asked { ask, answer }) = asked else { break };
            let given = match ask {
                BackgroundTask::Race(race) => self.race(race).await,
                BackgroundTask::Record => self.record(),
                BackgroundTask::EndRecording => self.end_recording().await,
            };
            // The requester may have gone.
            let _ = answer.send(given.unwrap_or_else(|why| refused(&why)));
        }
        if self.recording.is_some() {
            let _ = self.end_recording().await;
        }
    }

    async fn race(&mut self, race: Race) -> crate::cli::Result<Answer> {
        self.race.try_join_next();
        if !self.race.is_empty() {
            return Ok(Answer::refused("one comparison at a time"));
        }
        let [one, other] = &race.laws;
        let done = Answer::done(format!("{one} and {other} from where the last motion began"));
        // Four nodes take seconds to start. They start on another thread, so that a stop need not wait for them.
        let (environment, goal) = (self.environment.clone(), race.goal);
        let nodes = spawn_blocking(move || RaceNodes::start(&environment, &race)).await??;
        self.races += 1;
        self.race.spawn(nodes.run(goal, self.races, self.show.clone()));
        Ok(done)
    }

    /// Records into a directory that is named after the present time.
    fn record(&mut self) -> crate::cli::Result<Answer> {
        if let Some((_, directory)) = &self.recording {
            return Ok(Answer::refused(format!("a recording is going on already: {}", directory.display())));
        }
        let now = since_1970().as_secs();
        let directory = std::env::current_dir()?.join(format!("run_{now}"));
        let recording = Recording::start(&directory, &self.environment, &self.ros_args)?;
        let text = format!("recording into {}", directory.display());
        self.recording = Some((recording, directory));
        Ok(Answer::done(text))
    }

    async fn end_recording(&mut self) -> crate::cli::Result<Answer> {
        let Some((recording, directory)) = self.recording.take() else {
            return Ok(Answer::refused("there is no recording"));
        };
        recording.finish().await?;
        Ok(Answer::done(format!("recorded: dq_servo plot {}", directory.display())))
    }
}

fn refused(why: &crate::cli::Error) -> Answer {
    Answer::refused(cut(&why.line()))
}

fn since_1970() -> Duration {
    SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default()
}
