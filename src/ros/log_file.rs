//! Writes lines to a log file in ROS 2's log folder, where C++ and Python nodes also write theirs.

use crate::stderr::{self, Queue};
use std::ffi::{OsStr, OsString};
use std::fs::{File, create_dir_all};
use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use std::time::{Duration, SystemTime, UNIX_EPOCH};

/// The queue of lines for the log file. The first line creates queue and file. `None` if the file cannot be created.
static QUEUE: OnceLock<Option<Queue>> = OnceLock::new();

/// Queues a line for the file. Never blocks. If the file cannot be created, one warning appears on stderr.
pub fn line(text: String) {
    let queue =
        QUEUE.get_or_init(|| open().map_err(|why| stderr::line(format!("warning: no log file: {why}"))).ok());
    if let Some(queue) = queue {
        queue.line(text);
    }
}

/// Waits up to `patience` until all queued lines are written.
pub fn flush(patience: Duration) {
    if let Some(Some(queue)) = QUEUE.get() {
        queue.flush(patience);
    }
}

fn open() -> std::io::Result<Queue> {
    let folder = folder(|variable| std::env::var(variable).ok());
    create_dir_all(&folder)?;
    let path = folder.join(file_name(std::env::args_os().next()));
    let named = |why: std::io::Error| std::io::Error::new(why.kind(), format!("{}: {why}", path.display()));
    Queue::start("log file", File::create_new(&path).map_err(named)?)
}

/// Returns the folder that rcl_logging would choose.
fn folder(get: impl Fn(&str) -> Option<String>) -> PathBuf {
    let get = |variable| get(variable).filter(|value| !value.is_empty());
    let of_ros = || get("ROS_HOME").map(PathBuf::from);
    let home = || Path::new(&get("HOME").unwrap_or_default()).join(".ros");
    get("ROS_LOG_DIR").map(PathBuf::from).unwrap_or_else(|| of_ros().unwrap_or_else(home).join("log"))
}

/// Returns the file name in the style of rcl_logging_spdlog. It consists of the name by which the program was called, the process id,
/// and the milliseconds since the Unix epoch.
fn file_name(program: Option<OsString>) -> String {
    let program = program.map(PathBuf::from);
    let program = program.as_deref().and_then(Path::file_name).map(OsStr::to_string_lossy);
    let now = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    format!("{}_{}_{}.log", program.as_deref().unwrap_or("node"), std::process::id(), now.as_millis())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_folder_is_that_of_ros_2() {
        let folder = |variables: &[(&str, &str)]| {
            folder(|name| variables.iter().find(|(n, _)| *n == name).map(|(_, v)| (*v).to_owned()))
        };
        assert_eq!(folder(&[("HOME", "/h")]), Path::new("/h/.ros/log"));
        assert_eq!(folder(&[("HOME", "/h"), ("ROS_HOME", "/r")]), Path::new("/r/log"));
        assert_eq!(folder(&[("ROS_HOME", "/r"), ("ROS_LOG_DIR", "/l")]), Path::new("/l"));
    }

    #[test]
    fn the_file_has_the_name_of_the_program() {
        let begin = |program: Option<&str>, name: &str| {
            let file = file_name(program.map(OsString::from));
            assert!(
                file.starts_with(&format!("{name}_{}_", std::process::id())) && file.ends_with(".log"),
                "{file}"
            );
        };
        begin(Some("/opt/robot/counter"), "counter");
        begin(Some("counter"), "counter");
        begin(None, "node");
    }
}
