//! Records the motions of a command into a bag: the option `--record DIR`.

use super::super::recording::{Recorder, Selection};
use crate::cli::error::Incomplete;
use crate::cli::error::ensure;
use dq_bags::{Bag, WriterOptions, WrittenBag};
use dq_core::servo::Interface;
use dq_ros::ros::names::NameError;
use dq_ros::ros::{Environment, LogLevel, Logging, Resolver, RosArgs, Session};
use dq_ros::stderr;
use dq_runs::replayable_from;
use dq_wire::{ServoKind, command_topic};
use std::path::{Path, PathBuf};
use std::time::Duration;
use tokio::task::JoinSet;

/// A recording in progress. It has its own participant, so that it also records topics of this process.
pub(in crate::cli) struct Recording {
    recorder: Recorder,
    directory: PathBuf,
    /// A task that prints a warning as soon as writing fails.
    watch: JoinSet<()>,
    _session: Session,
}

/// The longest time that the recorder may take to discover the publishers.
const DISCOVERY: Duration = Duration::from_secs(10);

impl Recording {
    /// Begins to record every topic of the wire contract. Must be called within a tokio runtime.
    pub fn start(
        directory: &Path,
        environment: &Environment,
        ros_args: &RosArgs,
    ) -> crate::cli::Result<Self> {
        let session = Session::open(environment)?;
        let names = Resolver::new("dq_servo_recorder", ros_args)?;
        let node = session.node(names, Logging::new(ros_args, LogLevel::Warn))?;
        let options = WriterOptions::default();
        let recorder = Recorder::start(node, directory, Selection::contract(ros_args)?, options)?;
        let failure = recorder.write_failure();
        let mut watch = JoinSet::new();
        watch.spawn(async { stderr::line(format!("warning: the recording has ended: {}", failure.await)) });
        Ok(Self { recorder, directory: directory.to_owned(), watch, _session: session })
    }

    /// Waits until the recorder cannot miss a goal for `servo`, or a command to an arm.
    ///
    /// 1. Waits for joint states of every arm.
    /// 2. Waits until the recorder has subscribed to the topic `goal`, and to the commands to all arms.
    /// 3. Waits for the next message on `~/events` of the servo. From this message on, the bag can be replayed. If none arrives, prints
    ///    a warning.
    ///
    /// # Errors
    /// An error if step 1 or 2 takes longer than [`DISCOVERY`].
    pub async fn hears(
        &self,
        kind: ServoKind,
        servo: &str,
        names: &Resolver,
        goal: &str,
    ) -> crate::cli::Result<()> {
        let of_arms = kind.arms().iter().map(|arm| names.topic(&format!("{arm}joint_states")));
        let of_arms = of_arms.collect::<Result<Vec<_>, NameError>>()?;
        let of_arms: Vec<_> = of_arms.iter().map(String::as_str).collect();
        let goal = names.topic(goal)?;
        let events = names.topic(&format!("{servo}/events"))?;
        let heard = self.recorder.wait_for_messages(&of_arms, DISCOVERY).await;
        ensure!(heard, "not all of {of_arms:?} had messages within {} s", DISCOVERY.as_secs());
        let found = self.recorder.wait_for(&[&goal], DISCOVERY).await;
        ensure!(found, "nobody publishes {goal} (waited {} s)", DISCOVERY.as_secs());
        let commands = |interface: &&str| {
            let topic = command_topic(interface.parse().ok()?);
            kind.arms()
                .iter()
                .map(|arm| names.topic(&format!("{arm}{topic}")).ok())
                .collect::<Option<Vec<_>>>()
        };
        let kinds: Vec<_> = Interface::NAMES.iter().filter_map(commands).collect();
        let heard = kinds.iter().map(|topics| {
            let topics: Vec<_> = topics.iter().map(String::as_str).collect();
            Box::pin(async move { self.recorder.wait_for(&topics, DISCOVERY).await.then_some(()).ok_or(()) })
        });
        let heard = futures::future::select_ok(heard).await;
        ensure!(
            heard.is_ok(),
            "nobody publishes commands to all of the arms (waited {} s)",
            DISCOVERY.as_secs()
        );
        if !self.recorder.wait_for_next_messages(&[&events], DISCOVERY).await {
            let waited = DISCOVERY.as_secs();
            stderr::line(format!(
                "warning: no messages on {events} within {waited} s: the bag can be plotted, but replayed only from their beginning on"
            ));
        }
        Ok(())
    }

    /// Ends the recording of a command, if there is one. If the command's `result` is a success, returns it together with the
    /// result of the recording. Otherwise returns the command's error, and only logs a failure of the recording.
    pub async fn end<T>(
        recording: Option<Self>,
        result: crate::cli::Result<T>,
    ) -> crate::cli::Result<(T, crate::cli::Result<()>)> {
        let recorded = match recording {
            Some(recording) => recording.finish().await,
            None => Ok(()),
        };
        match (result, recorded) {
            (Ok(result), recorded) => Ok((result, recorded)),
            (Err(why), recorded) => {
                recorded.unwrap_or_else(|too| stderr::line(too.line()));
                Err(why)
            }
        }
    }

    /// Waits until writing has failed.
    pub async fn failed(&self) {
        self.recorder.write_failure().await;
    }

    /// Ends the recording, and prints what was recorded.
    pub async fn finish(self) -> crate::cli::Result<()> {
        let Self { recorder, directory, mut watch, _session } = self;
        // The recording is ended on purpose, so no warning is needed.
        watch.shutdown().await;
        let summary = recorder.finish().await?;
        stderr::line(recording_summary(&directory, &summary));
        Ok(is_complete(&directory, &summary)?)
    }
}

/// Checks that the bag has all messages.
///
/// # Errors
/// [`Incomplete`] if messages were dropped.
pub(in crate::cli) fn is_complete(directory: &Path, summary: &WrittenBag) -> Result<(), Incomplete> {
    match summary.dropped {
        0 => Ok(()),
        dropped => Err(Incomplete { dropped, directory: directory.to_owned() }),
    }
}

/// Returns a line with the numbers of recorded and dropped messages. For each servo in the bag, prints to stderr the time from
/// which its run can be replayed.
pub(super) fn recording_summary(directory: &Path, summary: &WrittenBag) -> String {
    let servos = Bag::open(directory).map(replayable_from).unwrap_or_default();
    for (servo, since) in servos {
        stderr::line(match since {
            Some(since) => format!("{servo} can be replayed from {since:.1} s on"),
            None => format!(
                "warning: {servo} cannot be replayed: no message on {servo}/events has the servo's state, which is recorded every 5 s"
            ),
        });
    }
    let WrittenBag { messages, topics, dropped, files } = summary;
    let directory = directory.display();
    format!(
        "recorded {messages} messages of {topics} topics in {directory} (files: {files}, dropped: {dropped})"
    )
}
