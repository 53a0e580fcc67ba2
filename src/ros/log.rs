//! A node's log: ROS 2's line on stderr, and the topic `/rosout`.

use ros2_client::{NodeLoggingHandle, RosoutRaw};
use std::str::FromStr;
use std::sync::Arc;

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
    name: String,
    level: LogLevel,
    rosout: Option<Arc<NodeLoggingHandle>>,
}

impl Logger {
    /// A log on stderr only.
    pub fn new(name: &str, level: LogLevel) -> Self {
        Self { name: name.to_owned(), level, rosout: None }
    }

    pub(super) fn with_rosout(name: &str, level: LogLevel, rosout: NodeLoggingHandle) -> Self {
        Self { name: name.to_owned(), level, rosout: Some(Arc::new(rosout)) }
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
        let now = super::messages::Time::now();
        let label = format!("{level:?}").to_uppercase();
        eprintln!("[{label}] [{}.{:09}] [{}]: {text}", now.sec, now.nanosec, self.name);
        if let Some(rosout) = &self.rosout {
            let stamp = ros2_client::builtin_interfaces::Time::from_nanos(now.nanoseconds());
            rosout.rosout_raw(stamp, wire_level(level), &self.name, text, file!(), "", line!());
        }
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
