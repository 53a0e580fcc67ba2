//! A node's log: ROS 2's line on stderr, and the topic `/rosout`. Who logs waits for neither.

use crate::stderr;
use crate::wire::messages::Time;
use ros2_client::{NodeLoggingHandle, RosoutRaw};
use std::str::FromStr;
use std::sync::mpsc::{Receiver, SyncSender, sync_channel};
use std::sync::{Arc, LazyLock};

/// How much a line matters.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum LogLevel {
    /// Details.
    Debug,
    /// What happens.
    Info,
    /// What an operator should look at.
    Warn,
    /// What failed.
    Error,
    /// What ends the program.
    Fatal,
}

impl FromStr for LogLevel {
    type Err = ();
    fn from_str(name: &str) -> Result<Self, ()> {
        match name.to_ascii_lowercase().as_str() {
            "debug" => Ok(Self::Debug),
            "info" => Ok(Self::Info),
            "warn" | "warning" => Ok(Self::Warn),
            "error" => Ok(Self::Error),
            "fatal" => Ok(Self::Fatal),
            _ => Err(()),
        }
    }
}

/// Writes lines above a level to stderr and, for a node, to `/rosout`.
#[derive(Clone)]
pub struct Logger {
    name: Arc<str>,
    level: LogLevel,
    rosout: Option<Arc<NodeLoggingHandle>>,
}

impl Logger {
    /// A log on stderr only.
    pub fn new(name: &str, level: LogLevel) -> Self {
        Self { name: name.into(), level, rosout: None }
    }

    pub(super) fn with_rosout(name: &str, level: LogLevel, rosout: NodeLoggingHandle) -> Self {
        Self { name: name.into(), level, rosout: Some(Arc::new(rosout)) }
    }

    /// Logs a detail.
    pub fn debug(&self, text: &str) {
        self.log(LogLevel::Debug, text);
    }

    /// Logs what happens.
    pub fn info(&self, text: &str) {
        self.log(LogLevel::Info, text);
    }

    /// Logs what an operator should look at.
    pub fn warn(&self, text: &str) {
        self.log(LogLevel::Warn, text);
    }

    /// Logs what failed.
    pub fn error(&self, text: &str) {
        self.log(LogLevel::Error, text);
    }

    fn log(&self, level: LogLevel, text: &str) {
        if level < self.level {
            return;
        }
        let now = Time::now();
        let label = format!("{level:?}").to_uppercase();
        stderr::line(format!("[{label}] [{}.{:09}] [{}]: {text}", now.sec, now.nanosec, self.name));
        if let Some(rosout) = &self.rosout {
            let (name, text) = (self.name.clone(), text.to_owned());
            let entry = RosoutEntry { node: rosout.clone(), stamp: now, level, name, text };
            // Where the queue is full, the line is on stderr all the same.
            let _ = ROSOUT.as_ref().map(|queue| queue.try_send(entry));
        }
    }
}

/// A line for `/rosout`.
struct RosoutEntry {
    node: Arc<NodeLoggingHandle>,
    stamp: Time,
    level: LogLevel,
    name: Arc<str>,
    text: String,
}

/// Lines for `/rosout` that wait at most.
const ROSOUT_CAPACITY: usize = 1024;

/// The queue of a thread that publishes: a frozen reader of `/rosout` can hold it up. None where the operating system gives
/// no thread.
static ROSOUT: LazyLock<Option<SyncSender<RosoutEntry>>> = LazyLock::new(|| {
    let (queue, entries) = sync_channel(ROSOUT_CAPACITY);
    let thread = std::thread::Builder::new().name("rosout".to_owned());
    thread.spawn(move || publish(&entries)).ok().map(|_| queue)
});

fn publish(entries: &Receiver<RosoutEntry>) {
    for RosoutEntry { node, stamp, level, name, text } in entries {
        let stamp = ros2_client::builtin_interfaces::Time::from_nanos(stamp.nanoseconds());
        node.rosout_raw(stamp, wire_level(level), &name, &text, file!(), "", line!());
    }
}

fn wire_level(level: LogLevel) -> ros2_client::ros2::LogLevel {
    use ros2_client::ros2::LogLevel as Wire;
    match level {
        LogLevel::Debug => Wire::Debug,
        LogLevel::Info => Wire::Info,
        LogLevel::Warn => Wire::Warn,
        LogLevel::Error => Wire::Error,
        LogLevel::Fatal => Wire::Fatal,
    }
}
