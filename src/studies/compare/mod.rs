//! Compares the laws on many arms, tasks and plants, with gains that make them comparable.
//!
//! The command `dq_servo compare` runs this module. The page [`what_the_laws_do`] shows the results of the command's latest long run.

mod arm;
mod closed_loop;
mod conditions;
mod estimate;
mod figures;
mod file;
mod findings;
mod latency;
mod matching;
mod numbers;
mod page;
mod paired;
mod pairs;
mod part;
mod peers;
mod record;
mod study;
mod summary;
mod switch;
mod tables;
mod templates;
mod timing;
mod unmatched;
mod values;

pub use arm::{Arm, Task};
pub use closed_loop::{ClosedLoop, HORIZON, Outcome};
pub use conditions::{PERIOD, PLANTS, Plant};
pub use figures::figures;
pub use findings::Findings;
pub use latency::Ageing;
pub use matching::{Gain, Matched, REFERENCE, settling_gain};
pub use page::{latex, page};
pub use paired::{Counts, End, Paired};
pub use pairs::{Comparison, Quantity, holm, sign_test};
pub use part::Part;
pub use peers::{Peer, Peers};
pub use record::Record;
pub use study::Study;
pub use summary::{ALL_ARMS, Cell, Interval, Key, Row, Summary};
pub use switch::{Switch, SwitchFindings};
pub use tables::Table;
pub use timing::{StepTime, step_times};
pub use unmatched::Unmatched;

// Units in brackets are not links.
#[allow(rustdoc::broken_intra_doc_links)]
#[doc = include_str!("what_the_laws_do.md")]
pub mod what_the_laws_do {}

use dq_config::ARMS;
use dq_core::servo::{Rejection, SettingsError};
use dq_kinematics::arm::ArmError;
use dq_params::ParameterError;
use std::path::Path;
use thiserror::Error;

/// The reason why a comparison fails.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum CompareError {
    /// The parameters of an arm are invalid.
    #[error(transparent)]
    Config(#[from] ParameterError),
    /// The number of joints does not match an arm.
    #[error(transparent)]
    Arm(#[from] ArmError),
    /// Settings do not match an arm.
    #[error(transparent)]
    Settings(#[from] SettingsError),
    /// The servo rejects a task.
    #[error("the servo rejected a task: {0}")]
    Rejected(#[from] Rejection),
    /// Two arms have the same name.
    #[error("two arms are called {0:?}: expected files with different names")]
    SameName(String),
    /// There is no built-in arm with this name, and no parameter file with this path.
    #[error("{name} is neither a built-in arm ({}) nor a parameter file: {why}", ARMS.map(|(name, _)| name).join(", "))]
    NoArm {
        /// The name.
        name: String,
        /// The reason why the file cannot be read.
        why: std::io::Error,
    },
    /// The study has only this law, so there is no law to compare it with.
    #[error(
        "{0} alone has nothing to be compared with: name another law, or use --part, --reconfigure, --constraints or --posture"
    )]
    OneLaw(String),
    /// A file cannot be read or written.
    #[error("{file}: {why}")]
    File {
        /// The name of the file.
        file: String,
        /// The error of the operating system.
        why: std::io::Error,
    },
    /// The file has gains of other arms or laws, or of another version of this program.
    #[error(
        "{file} has gains of other arms or laws, or of another version of this program: delete it to choose the gains again"
    )]
    OtherGains {
        /// The name of the file.
        file: String,
    },
    /// A line of the file has another run than the study has at this place.
    #[error(
        "{file}: line {line} is of another run than expected: join each part once and in order; for other arms, tasks or seeds, use a new folder"
    )]
    OtherRuns {
        /// The name of the file.
        file: String,
        /// The number of the line, counted from 1.
        line: u64,
    },
    /// The runs of other programs in the file do not match the tasks of the study.
    #[error("{file} does not have runs of the first tasks of each of these arms: run compare_peers.py again")]
    OtherPeers {
        /// The name of the file.
        file: String,
    },
    /// A line of the file is not a valid run.
    #[error(
        "{file}: line {line} is damaged: delete it and all later lines, then repeat the command, which continues from there"
    )]
    Damaged {
        /// The name of the file.
        file: String,
        /// The number of the line, counted from 1.
        line: u64,
    },
    /// A file has too few runs.
    #[error("{file}: {count} runs, expected {expected}")]
    Count {
        /// The name of the file.
        file: String,
        /// The number of runs in the file.
        count: u64,
        /// The expected number of runs.
        expected: u64,
    },
    /// The law settles in less than half of the tasks, whatever its gain is.
    #[error(
        "{law} does not settle in half of the tasks of {arm} at any gain, so no gain makes it comparable"
    )]
    NeverSettles {
        /// The name of the law.
        law: String,
        /// The name of the arm.
        arm: String,
    },
    /// A run cannot be written as a line.
    #[error("a run cannot be written: {0}")]
    Unwritable(#[from] serde_json::Error),
}

impl CompareError {
    fn file(file: &Path, why: std::io::Error) -> Self {
        Self::File { file: file.display().to_string(), why }
    }

    /// Creates the error for a line of `file` that is preceded by `before` lines.
    fn other_runs(file: &Path, before: u64) -> Self {
        Self::OtherRuns { file: file.display().to_string(), line: before + 1 }
    }

    /// Creates the error for a line of `file` that is preceded by `before` lines.
    fn damaged(file: &Path, before: u64) -> Self {
        Self::Damaged { file: file.display().to_string(), line: before + 1 }
    }
}
