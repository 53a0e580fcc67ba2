//! `dq_servo record`: records a running graph into a bag.

use super::super::recording::{Progress, Recorder, Selection};
use super::recording::{is_complete, recording_summary};
use crate::cli::Usage;
use crate::cli::count::count;
use crate::cli::error::bail;
use crate::cli::print;
use crate::cli::signals::Signals;
use crate::cli::spinner::Spinner;
use dq_bags::WriterOptions;
use dq_ros::ros::{Environment, LogLevel, Logging, Resolver, RosArgs, Session};
use dq_ros::stderr;
use std::path::PathBuf;
use std::time::Duration;

/// Record the topics of a running graph into a rosbag2 directory, until ctrl-C
#[derive(clap::Args)]
pub(in crate::cli) struct Record {
    /// The bag: a directory that does not exist yet
    #[arg(short, long, value_name = "DIR")]
    out: PathBuf,
    /// Record these topics; by default those of msg_config/topics.yaml in every namespace, /parameter_events and /rosout
    #[arg(long, num_args = 1.., value_name = "NAME")]
    topics: Vec<String>,
    /// Begin a new file when the current file has this many bytes, 1 MiB or more
    #[arg(long, value_name = "BYTES", allow_negative_numbers = true, value_parser = count::<u64>(1 << 20..=u64::MAX))]
    max_size: Option<u64>,
    /// Begin a new file when the current file spans this many seconds, 0.1 or more
    #[arg(long, value_name = "SECONDS", allow_negative_numbers = true)]
    max_duration: Option<f64>,
}

/// The shortest duration of a file. A shorter file would have only one or two messages.
const SHORTEST: Duration = Duration::from_millis(100);

/// The interval at which progress is shown on a terminal.
const PROGRESS: Duration = Duration::from_millis(200);

impl Record {
    pub(super) async fn run(&self, ros_args: &RosArgs) -> crate::cli::Result<()> {
        let mut signals = Signals::new()?;
        let names = Resolver::new("dq_servo_recorder", ros_args)?;
        let named = self.topics.iter().map(|name| names.topic(name)).collect::<Result<Vec<_>, _>>()?;
        let selection = match named.as_slice() {
            [] => Selection::contract(ros_args)?,
            named => Selection::names(named.iter().cloned()),
        };
        let options = WriterOptions { max_size: self.max_size, max_duration: self.max_duration()? };
        let session = Session::open(&Environment::from_process(ros_args)?)?;
        let node = session.node(names, Logging::new(ros_args, LogLevel::Warn))?;
        let recorder = Recorder::start(node, &self.out, selection, options)?;
        tokio::select! {
            () = signals.next() => {}
            () = recorder.failed() => {}
            () = show_progress(&recorder) => {}
        }
        let found = recorder.topics();
        for missing in named.iter().filter(|name| !found.contains(*name)) {
            stderr::line(format!(
                "warning: {missing} is not in the bag: nobody published it, or its type is unknown"
            ));
        }
        let summary = tokio::select! {
            summary = recorder.finish() => summary?,
            () = signals.next() => bail!("a second signal: {} is incomplete", self.out.display()),
        };
        print::results(recording_summary(&self.out, &summary), &mut signals).await?;
        Ok(is_complete(&self.out, &summary)?)
    }

    fn max_duration(&self) -> Result<Option<Duration>, Usage> {
        let Some(seconds) = self.max_duration else { return Ok(None) };
        let duration = Duration::try_from_secs_f64(seconds).ok().filter(|duration| *duration >= SHORTEST);
        let wrong = || Usage(format!("--max-duration {seconds:?}: expected seconds, 0.1 or more"));
        duration.map(Some).ok_or_else(wrong)
    }
}

/// Shows the progress forever, on a terminal only.
async fn show_progress(recorder: &Recorder) {
    let Some(spinner) = Spinner::on_terminal() else { return std::future::pending().await };
    let mut tick = tokio::time::interval(PROGRESS);
    loop {
        tick.tick().await;
        let (Progress { written, dropped }, topics) = (recorder.progress(), recorder.topics().len());
        spinner
            .show(format!("recording {topics} topics: {written} messages, {dropped} dropped; ctrl-C ends"));
    }
}
