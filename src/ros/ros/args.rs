//! Parses the ROS 2 part of a command line: `--ros-args … [--]`.

use super::names::check_enclave;
use dq_params::Value;
use std::path::PathBuf;
use std::str::FromStr;
use thiserror::Error;

/// An argument that ROS 2 would reject.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum ArgsError {
    /// The argument is not an option of `--ros-args`.
    #[error(
        "unknown ROS argument {0:?}: expected -r, -p, --params-file, --log-level or another option of --ros-args"
    )]
    Unknown(String),
    /// An option lacks its value.
    #[error("{0} needs a value")]
    NoValue(String),
    /// The value of an option is malformed.
    #[error("{option} {value:?}: expected {expected}")]
    Malformed {
        /// The option.
        option: &'static str,
        /// The given value.
        value: String,
        /// The expected form.
        expected: &'static str,
    },
}

/// The severity of a log line.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum LogLevel {
    /// Details.
    Debug,
    /// Normal events.
    Info,
    /// Problems that an operator should look at.
    Warn,
    /// Failures of one operation.
    Error,
    /// Failures that end the program.
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

/// A remapping rule: `[node:]from:=to`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Remap {
    /// The only node to which the rule applies; `None` for all nodes.
    pub node: Option<String>,
    /// The name to replace: that of a topic or a service, `__ns` or `__node`.
    pub from: String,
    /// The new name.
    pub to: String,
}

/// The log level of one logger: `logger:=level`.
#[derive(Clone, Debug, PartialEq)]
pub struct LoggerLevel {
    /// The logger's name; the rule also applies to the loggers below it.
    pub logger: String,
    /// The least severity that these loggers log.
    pub level: LogLevel,
}

/// A source of parameter values. If several sources set a parameter, the last one wins.
#[derive(Clone, Debug, PartialEq)]
pub enum Override {
    /// A parameter on the command line: `-p [node:]name:=value`.
    Parameter {
        /// The only node to which the value applies; `None` for all nodes.
        node: Option<String>,
        /// The name of the parameter.
        name: String,
        /// The value, as YAML.
        yaml: String,
    },
    /// A parameter file on the command line: `--params-file`.
    File(PathBuf),
    /// A value that this program sets without a command-line argument. Other ROS 2 nodes do not have this source.
    Value {
        /// The only node to which the value applies; `None` for all nodes.
        node: Option<&'static str>,
        /// The name of the parameter.
        name: String,
        /// The value.
        value: Value,
    },
    /// A parameter file that is built into this program. Other ROS 2 nodes do not have this source.
    Builtin {
        /// The file's name.
        name: &'static str,
        /// The file's content.
        text: &'static str,
    },
}

/// The ROS arguments of a command line.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RosArgs {
    /// Remapping rules in order; the first that matches wins.
    pub remaps: Vec<Remap>,
    /// Parameter overrides in order; the last one wins.
    pub overrides: Vec<Override>,
    /// The level of all loggers that have no level of their own.
    pub log_level: Option<LogLevel>,
    /// The log levels of single loggers.
    pub logger_levels: Vec<LoggerLevel>,
    /// Whether to keep log lines off the terminal (`--disable-stdout-logs`).
    pub without_stdout_logs: bool,
    /// Whether to keep log lines off the topic `/rosout` (`--disable-rosout-logs`).
    pub without_rosout_logs: bool,
    /// Whether log lines also go to a file. ROS 2 nodes write a log file by default, this program only on request.
    pub external_lib_logs: bool,
    /// The enclave of a secured run. Runs without security ignore it.
    pub enclave: Option<String>,
}

/// Options of ROS 2's logging library that have no effect here. Launch files may still pass them.
const WITHOUT_EFFECT: [&str; 2] = ["--log-config-file", "--log-file-name"];

/// Splits a command line into the program's own arguments and the ROS arguments.
///
/// # Errors
/// [`ArgsError`] for the first argument that ROS 2 would reject.
pub fn split(args: impl IntoIterator<Item = String>) -> Result<(Vec<String>, RosArgs), ArgsError> {
    let (mut ours, mut ros) = (Vec::new(), RosArgs::default());
    let mut args = args.into_iter();
    while let Some(arg) = args.next() {
        if arg == "--ros-args" {
            take_section(&mut args, &mut ros)?;
        } else {
            ours.push(arg);
        }
    }
    Ok((ours, ros))
}

/// Parses the arguments after `--ros-args`, up to `--` or the end.
fn take_section(args: &mut impl Iterator<Item = String>, ros: &mut RosArgs) -> Result<(), ArgsError> {
    while let Some(option) = args.next() {
        let mut value = || args.next().ok_or_else(|| ArgsError::NoValue(option.clone()));
        match option.as_str() {
            "--" => return Ok(()),
            "--ros-args" => {}
            "-r" | "--remap" => ros.remaps.push(remap(&value()?)?),
            "-p" | "--param" => ros.overrides.push(parameter(&value()?)?),
            "--params-file" => ros.overrides.push(Override::File(value()?.into())),
            "--log-level" => take_log_level(&value()?, ros)?,
            "-e" | "--enclave" => ros.enclave = Some(enclave(value()?)?),
            "--enable-stdout-logs" => ros.without_stdout_logs = false,
            "--disable-stdout-logs" => ros.without_stdout_logs = true,
            "--enable-rosout-logs" => ros.without_rosout_logs = false,
            "--disable-rosout-logs" => ros.without_rosout_logs = true,
            "--enable-external-lib-logs" => ros.external_lib_logs = true,
            "--disable-external-lib-logs" => ros.external_lib_logs = false,
            other if WITHOUT_EFFECT.contains(&other) => drop(value()?),
            _ => return Err(ArgsError::Unknown(option)),
        }
    }
    Ok(())
}

fn remap(text: &str) -> Result<Remap, ArgsError> {
    let malformed = || ArgsError::Malformed {
        option: "-r",
        value: text.to_owned(),
        expected: "[node:]from:=to, __ns:=/namespace or __node:=name",
    };
    let (left, to) = text.split_once(":=").ok_or_else(malformed)?;
    let (node, from) = split_node(left);
    if from.is_empty() || to.is_empty() {
        return Err(malformed());
    }
    // `__name` is the older spelling of `__node`.
    let from = if from == "__name" { "__node".to_owned() } else { from };
    Ok(Remap { node, from, to: to.to_owned() })
}

fn parameter(text: &str) -> Result<Override, ArgsError> {
    let malformed =
        || ArgsError::Malformed { option: "-p", value: text.to_owned(), expected: "[node:]name:=value" };
    let (left, yaml) = text.split_once(":=").ok_or_else(malformed)?;
    let (node, name) = split_node(left);
    match name.is_empty() {
        true => Err(malformed()),
        false => Ok(Override::Parameter { node, name, yaml: yaml.to_owned() }),
    }
}

/// Splits `node:rest`. The colon of `rostopic://` and `rosservice://` does not separate a node.
fn split_node(left: &str) -> (Option<String>, String) {
    match left.split_once(':') {
        Some((node, rest)) if !rest.starts_with("//") => (Some(node.to_owned()), rest.to_owned()),
        _ => (None, left.to_owned()),
    }
}

fn enclave(name: String) -> Result<String, ArgsError> {
    match check_enclave(&name) {
        Ok(()) => Ok(name),
        Err(bad) => Err(ArgsError::Malformed {
            option: "--enclave",
            value: bad.name,
            expected: "a name as /dq_servo",
        }),
    }
}

/// Parses `[logger:=]level`, the value of `--log-level`, into `ros`.
fn take_log_level(text: &str, ros: &mut RosArgs) -> Result<(), ArgsError> {
    let (logger, level) =
        text.rsplit_once(":=").map_or((None, text), |(logger, level)| (Some(logger), level));
    let level = level.parse().map_err(|()| ArgsError::Malformed {
        option: "--log-level",
        value: text.to_owned(),
        expected: "debug, info, warn, error or fatal",
    })?;
    match logger {
        Some(logger) => ros.logger_levels.push(LoggerLevel { logger: logger.to_owned(), level }),
        None => ros.log_level = Some(level),
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn parse(line: &str) -> Result<(Vec<String>, RosArgs), ArgsError> {
        split(line.split_whitespace().map(str::to_owned))
    }

    #[test]
    fn a_launch_command_line_is_understood() {
        let line = "servo --x --ros-args -r __node:=a -r __ns:=/left -r servo:goal_pose:=/g --params-file f.yaml \
                    -p gains.diffc:=2.0 --log-level dq_servo:=DEBUG --disable-stdout-logs -e /x -- rest";
        let (ours, ros) = parse(line).unwrap();
        assert_eq!(ours, ["servo", "--x", "rest"]);
        assert_eq!(ros.remaps.len(), 3);
        assert_eq!(ros.remaps[2].node.as_deref(), Some("servo"));
        assert_eq!(ros.overrides[0], Override::File("f.yaml".into()));
        assert!(
            matches!(&ros.overrides[1], Override::Parameter { name, yaml, .. } if name == "gains.diffc" && yaml == "2.0")
        );
        assert_eq!((ros.log_level, ros.logger_levels.len()), (None, 1));
        assert_eq!(ros.enclave.as_deref(), Some("/x"));
        assert!(ros.without_stdout_logs && !ros.without_rosout_logs && !ros.external_lib_logs);
    }

    #[test]
    fn the_last_of_a_switch_and_its_opposite_counts() {
        let (_, ros) = parse(
            "--ros-args --disable-rosout-logs --enable-rosout-logs --enable-stdout-logs --disable-stdout-logs \
             --disable-external-lib-logs --enable-external-lib-logs",
        )
        .unwrap();
        assert_eq!(
            [ros.without_rosout_logs, ros.without_stdout_logs, ros.external_lib_logs],
            [false, true, true]
        );
    }

    #[test]
    fn schemes_are_no_node_names() {
        let (_, ros) = parse("--ros-args -r rostopic://a:=b").unwrap();
        assert_eq!(ros.remaps[0].node, None);
        assert_eq!(ros.remaps[0].from, "rostopic://a");
    }

    #[test]
    fn mistakes_get_one_line_with_what_would_be_right() {
        for line in [
            "--bogus",
            "-r",
            "-r a=b",
            "-r :=b",
            "-p x=1",
            "-p :=1",
            "--log-level loud",
            "--params-file",
            "--enclave x",
        ] {
            let message = parse(&format!("--ros-args {line}")).unwrap_err().to_string();
            assert!(
                !message.contains('\n') && message.contains(line.split(' ').next().unwrap()),
                "{message}"
            );
        }
    }

    proptest! {
        #[test]
        fn no_command_line_panics(args in proptest::collection::vec("(-r|-p|--ros-args|--|[a-z:=/_]{0,12})", 0..8)) {
            let _ = split(args);
        }
    }
}
