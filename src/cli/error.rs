//! The errors of the command line, and their exit codes.

use super::not_arrived::NotArrived;
use super::print::StdoutError;
use super::recording::RecordingError;
use dq_bags::BagError;
use dq_core::servo::{Rejection, SettingsError};
use dq_figures::DrawError;
use dq_kinematics::arm::ArmError;
use dq_messages::WireError;
use dq_nodes::{NodeError, RealtimeError, ShutdownError};
use dq_params::ParameterError;
use dq_ros::ros::args::ArgsError;
use dq_ros::ros::names::NameError;
use dq_ros::ros::{NetworkEnd, RosError};
use dq_runs::RunError;
use dq_studies::compare::CompareError;
use dq_studies::paper::PaperError;
use dq_view::ViewError;
use std::error::Error as _;
use std::path::PathBuf;
use thiserror::Error;
use tokio::task::JoinError;

pub(super) type Result<T, E = Error> = std::result::Result<T, E>;

/// The error of a command. [`exit_code`](Self::exit_code) gives the exit code of each variant.
#[derive(Debug, Error)]
pub(super) enum Error {
    #[error(transparent)]
    Usage(#[from] Usage),
    #[error(transparent)]
    Incomplete(#[from] Incomplete),
    #[error(transparent)]
    NetworkLost(#[from] NetworkLost),
    #[error(transparent)]
    NotArrived(#[from] NotArrived),
    #[error(transparent)]
    Stdout(#[from] StdoutError),
    #[error(transparent)]
    Arguments(#[from] ArgsError),
    #[error(transparent)]
    Parameter(#[from] ParameterError),
    #[error(transparent)]
    Name(#[from] NameError),
    #[error(transparent)]
    Arm(#[from] ArmError),
    #[error(transparent)]
    Rejected(#[from] Rejection),
    #[error(transparent)]
    Ros(#[from] RosError),
    #[error(transparent)]
    Wire(#[from] WireError),
    #[error(transparent)]
    Node(#[from] NodeError),
    #[error(transparent)]
    Bag(#[from] BagError),
    #[error(transparent)]
    Recording(#[from] RecordingError),
    #[error(transparent)]
    Run(#[from] RunError),
    #[error(transparent)]
    Compare(#[from] CompareError),
    #[error(transparent)]
    Paper(#[from] PaperError),
    #[error(transparent)]
    View(#[from] ViewError),
    #[error(transparent)]
    Settings(#[from] SettingsError),
    #[error(transparent)]
    Draw(#[from] DrawError),
    #[error(transparent)]
    Shutdown(#[from] ShutdownError),
    #[error(transparent)]
    Realtime(#[from] RealtimeError),
    #[error(transparent)]
    Task(#[from] JoinError),
    #[error(transparent)]
    System(#[from] std::io::Error),
    /// A signal ended the command.
    #[error("interrupted")]
    Interrupted,
    /// Any other failure, with the text that the user reads.
    #[error("{0}")]
    Failed(String),
}

/// A command line with an invalid value.
#[derive(Debug, Error)]
#[error("{0}")]
pub(super) struct Usage(pub String);

/// A recording that lacks messages.
#[derive(Debug, Error)]
#[error("{dropped} messages were dropped: {directory:?} lacks them")]
pub(super) struct Incomplete {
    pub dropped: u64,
    pub directory: PathBuf,
}

/// This process has lost the network. A new process can join the graph again.
#[derive(Debug, Error)]
#[error("{0}: start this program again")]
pub(super) struct NetworkLost(pub NetworkEnd);

/// The hint for an enclave that lacks a permission. In most cases, the enclave comes from an earlier version of this program.
const OLD_ENCLAVE: &str = "; launch_scripts/dq_servo_keystore.sh replaces an enclave of an earlier version once its folder is removed";

impl Error {
    /// Returns the exit code: 0 if the reader of stdout closed it, 2 for invalid arguments or environment, 3 for an incomplete
    /// recording, 4 for a lost network, and 1 for any other failure.
    pub fn exit_code(&self) -> u8 {
        let usage = |is_usage| if is_usage { 2 } else { 1 };
        match self {
            Self::Stdout(error) if error.is_closed() => 0,
            Self::Stdout(_)
            | Self::NotArrived(_)
            | Self::Wire(_)
            | Self::Draw(_)
            | Self::Shutdown(_)
            | Self::Realtime(_)
            | Self::Task(_)
            | Self::System(_)
            | Self::Interrupted
            | Self::Failed(_) => 1,
            Self::Usage(_)
            | Self::Arguments(_)
            | Self::Parameter(_)
            | Self::Name(_)
            | Self::Arm(_)
            | Self::Settings(_)
            | Self::Rejected(_) => 2,
            Self::Incomplete(_) => 3,
            Self::NetworkLost(_) => 4,
            Self::Ros(error) => usage(is_ros_usage(error)),
            Self::Node(error) => usage(is_node_usage(error)),
            Self::Bag(error) => usage(is_bag_usage(error)),
            Self::Recording(error) => usage(match error {
                RecordingError::Bag(error) => is_bag_usage(error),
                RecordingError::Ros(error) => is_ros_usage(error),
                RecordingError::Thread(_) | RecordingError::Deaf { .. } => false,
            }),
            Self::Run(RunError::Bag(error)) => usage(is_bag_usage(error)),
            Self::Run(_) => 2,
            // A file that cannot be written, for example because the disk is full, is not a fault of the command line.
            Self::Compare(error) => usage(!matches!(error, CompareError::File { .. })),
            Self::Paper(error) => usage(matches!(error, PaperError::Experiment { .. })),
            Self::View(error) => {
                usage(matches!(error, ViewError::Listen { .. } | ViewError::Token | ViewError::Parameters(_)))
            }
        }
    }

    /// Returns the error's text with those of its causes, in one line.
    pub fn line(&self) -> String {
        let causes = std::iter::successors(self.source(), |cause| (*cause).source());
        let causes = causes.map(|cause| format!(": {cause}"));
        let hint = if matches!(self.ros(), Some(RosError::NotPermitted { .. })) { OLD_ENCLAVE } else { "" };
        (self.to_string() + &causes.collect::<String>() + hint).replace('\n', " ")
    }

    /// Returns the error of the ROS layer that is the cause; `None` if the cause is another error.
    fn ros(&self) -> Option<&RosError> {
        match self {
            Self::Ros(error)
            | Self::Node(NodeError::Ros(error))
            | Self::Recording(RecordingError::Ros(error))
            | Self::View(ViewError::Ros(error)) => Some(error),
            _ => None,
        }
    }
}

/// Returns whether the user's arguments or environment caused the error. Other errors arise while the program carries out a valid
/// command.
fn is_ros_usage(error: &RosError) -> bool {
    matches!(
        error,
        RosError::Environment { .. }
            | RosError::Name(_)
            | RosError::NoFreePort { .. }
            | RosError::Security { .. }
    )
}

/// Returns whether the user's arguments or environment caused the error.
fn is_node_usage(error: &NodeError) -> bool {
    match error {
        NodeError::Config(_) | NodeError::Arm(_) | NodeError::Settings(_) => true,
        NodeError::Ros(error) => is_ros_usage(error),
        _ => false,
    }
}

/// Returns whether the user's arguments or environment caused the error.
fn is_bag_usage(error: &BagError) -> bool {
    !matches!(error, BagError::Write { .. })
}

/// Creates an [`Error::Failed`]. The arguments are those of `format!`.
macro_rules! failed {
    ($($text:tt)*) => { $crate::cli::error::Error::Failed(format!($($text)*)) };
}

/// Returns from the calling function with the error that `failed!` creates from these arguments.
macro_rules! bail {
    ($($text:tt)*) => { return Err($crate::cli::error::failed!($($text)*)) };
}

/// Unless the condition holds, returns from the calling function with the error that `failed!` creates from the other arguments.
macro_rules! ensure {
    ($condition:expr, $($text:tt)*) => { if !$condition { $crate::cli::error::bail!($($text)*); } };
}

pub(super) use {bail, ensure, failed};

#[cfg(test)]
mod tests {
    use super::super::tools::recording::is_complete;
    use super::*;
    use dq_bags::WrittenBag;
    use std::path::Path;

    #[test]
    fn a_recording_that_lacks_messages_has_a_code_of_its_own_and_their_number() {
        let bag = WrittenBag { messages: 100, topics: 2, dropped: 7, files: 1 };
        let lacks = Error::from(is_complete(Path::new("run"), &bag).unwrap_err());
        assert_eq!(
            (lacks.exit_code(), lacks.line().as_str()),
            (3, "7 messages were dropped: \"run\" lacks them")
        );
        assert!(is_complete(Path::new("run"), &WrittenBag { dropped: 0, ..bag }).is_ok());
        assert_eq!(Error::from(Usage(String::new())).exit_code(), 2);
        assert_eq!(failed!("failed").exit_code(), 1);
        let lost = Error::from(NetworkLost(dq_ros::ros::NetworkEnd::Stopped));
        assert_eq!(lost.exit_code(), 4);
        // A supervisor need not try again.
        let full = RosError::NoFreePort { domain: 0, first: 7410, last: 7648 };
        assert_eq!(Error::from(full).exit_code(), 2);
        assert_eq!(lost.line().matches("DDS has ended").count(), 1, "{lost}");
    }

    #[test]
    fn an_error_inside_another_keeps_its_exit_code() {
        let [file, no_space] = ["run", "no space"].map(str::to_owned);
        let missing = || BagError::NotABag { path: "run".into(), why: String::new() };
        let full = || BagError::Write { path: "run".into(), why: no_space.clone() };
        let domain =
            || RosError::Environment { variable: "ROS_DOMAIN_ID", value: file.clone(), expected: "" };
        let codes = |errors: [Error; 4]| errors.map(|error| error.exit_code());
        let run = |error: BagError| Error::from(RunError::from(error));
        let recording = |error: BagError| Error::from(RecordingError::from(error));
        assert_eq!(codes([missing().into(), run(missing()), recording(missing()), domain().into()]), [2; 4]);
        assert_eq!(codes([full().into(), run(full()), recording(full()), Error::Interrupted]), [1; 4]);
        assert_eq!(Error::from(NodeError::from(domain())).exit_code(), 2);
    }

    #[test]
    fn an_enclave_without_a_permission_can_be_replaced() {
        let refused = || RosError::NotPermitted { what: "a topic".to_owned(), why: "not allowed".to_owned() };
        for error in [
            refused().into(),
            Error::from(NodeError::from(refused())),
            Error::from(ViewError::from(refused())),
        ] {
            assert!(error.line().ends_with(OLD_ENCLAVE), "{}", error.line());
        }
    }

    #[test]
    fn the_line_of_an_error_names_the_causes_and_a_closed_stdout_is_not_a_failure() {
        let stdout = |kind: std::io::ErrorKind| Error::from(StdoutError::from(std::io::Error::from(kind)));
        let full = stdout(std::io::ErrorKind::StorageFull);
        assert_eq!(full.line(), "the results cannot be written to stdout: no storage space");
        assert_eq!((full.exit_code(), stdout(std::io::ErrorKind::BrokenPipe).exit_code()), (1, 0));
    }
}
