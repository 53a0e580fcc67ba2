//! A node's log: lines on stderr in ROS 2's format, on the topic `/rosout`, and in a file. Logging never blocks.

use super::args::{LogLevel, RosArgs};
use super::log_format;
use crate::dds::peer_recovery::Warn;
use crate::{log_file, stderr};
use dq_messages::messages::{Log, Time};
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::sync::{Arc, LazyLock};

/// The settings of a log: which lines are logged, and where.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Logging {
    /// The least severity that is logged.
    pub level: LogLevel,
    /// Whether lines go to stderr. ROS 2 writes them there too, but calls them "stdout logs".
    pub stderr: bool,
    /// Whether lines go to `/rosout`.
    pub rosout: bool,
    /// Whether lines go to a file in ROS 2's log folder.
    pub file: bool,
}

impl Logging {
    /// Creates the settings from the command line; `level` is the default level.
    pub fn new(args: &RosArgs, level: LogLevel) -> Self {
        Self {
            level: args.log_level.unwrap_or(level),
            stderr: !args.without_stdout_logs,
            rosout: !args.without_rosout_logs,
            file: args.external_lib_logs,
        }
    }
}

/// A node's log. Drops lines below its level, and writes all others to its destinations.
#[derive(Clone)]
pub struct Logger {
    name: Arc<str>,
    logging: Logging,
    rosout: Option<Publish>,
}

impl Logger {
    /// Creates a log that does not publish on `/rosout`.
    pub(super) fn new(name: &str, logging: Logging) -> Self {
        Self { name: name.into(), logging, rosout: None }
    }

    /// Adds `/rosout` to the log: `publish` publishes each line there.
    pub(super) fn with_rosout(self, publish: impl Fn(Log) + Send + Sync + 'static) -> Self {
        Self { rosout: Some(Arc::new(publish)), ..self }
    }

    /// Returns a function that logs warnings, for modules that do not know this type.
    pub(super) fn warner(&self) -> Warn {
        let log = self.clone();
        Arc::new(move |text| log.warn(text))
    }

    /// Logs a detail.
    pub fn debug(&self, text: &str) {
        self.log(LogLevel::Debug, text);
    }

    /// Logs a normal event.
    pub fn info(&self, text: &str) {
        self.log(LogLevel::Info, text);
    }

    /// Logs a problem that an operator should look at.
    pub fn warn(&self, text: &str) {
        self.log(LogLevel::Warn, text);
    }

    /// Logs a failure.
    pub fn error(&self, text: &str) {
        self.log(LogLevel::Error, text);
    }

    fn log(&self, level: LogLevel, text: &str) {
        if level < self.logging.level {
            return;
        }
        let stamp = Time::now();
        let line = || log_format::line(level, &stamp, &self.name, text);
        if self.logging.stderr {
            stderr::line(line());
        }
        if self.logging.file {
            log_file::line(line());
        }
        if let Some(rosout) = &self.rosout {
            let message = Log {
                stamp: stamp.clone(),
                level: wire_level(level),
                name: self.name.to_string(),
                msg: text.to_owned(),
                ..Log::default()
            };
            // If the queue is full, the line is missing on `/rosout` only.
            let _ = ROSOUT.as_ref().is_some_and(|queue| queue.try_send((rosout.clone(), message)).is_ok());
        }
    }
}

/// Publishes a line of a node on `/rosout`.
type Publish = Arc<dyn Fn(Log) + Send + Sync>;

/// A line for `/rosout`, and the function that publishes it.
type RosoutEntry = (Publish, Log);

/// The largest number of lines that wait for `/rosout`.
const ROSOUT_CAPACITY: usize = 1024;

/// The queue of the thread that publishes on `/rosout`. A frozen reader of `/rosout` may block that thread. `None` if the operating
/// system creates no thread.
static ROSOUT: LazyLock<Option<SyncSender<RosoutEntry>>> = LazyLock::new(|| {
    let (queue, entries) = sync_channel(ROSOUT_CAPACITY);
    let thread = std::thread::Builder::new().name("rosout".to_owned());
    thread.spawn(move || publish(&entries)).ok().map(|_| queue)
});

fn publish(entries: &Receiver<RosoutEntry>) {
    for (publish, message) in entries {
        publish(message);
    }
}

/// Returns the level's number in `rcl_interfaces/msg/Log`.
fn wire_level(level: LogLevel) -> u8 {
    match level {
        LogLevel::Debug => 10,
        LogLevel::Info => 20,
        LogLevel::Warn => 30,
        LogLevel::Error => 40,
        LogLevel::Fatal => 50,
    }
}
