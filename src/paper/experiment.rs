//! The constants of the experiments: `msg_config/paper.yaml`.

use super::PaperError;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// The file that is built in.
const BUILTIN: &str = include_str!("../../msg_config/paper.yaml");

/// What is simulated and drawn; rad, m, s, gains in 1/s.
#[derive(Clone, Debug, Deserialize, PartialEq, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Experiment {
    /// Joint angles at the start \[rad\].
    pub theta_initial: Vec<f64>,
    /// Joint angles at the goal \[rad\].
    pub theta_desired: Vec<f64>,
    /// diffc as the paper runs it.
    pub diffc: Diffc,
    /// The two-arm experiment.
    pub relative_position: RelativePosition,
    /// logc with the paper's two decay rates.
    pub logc_decay: LogcDecay,
    /// The comparison of the laws.
    pub comparison: Comparison,
    /// The same task from elsewhere.
    pub base_shift: BaseShift,
    /// The other sign.
    pub wrong_sign: WrongSign,
    /// Many tasks.
    pub sweep: Sweep,
}

/// diffc as the paper runs it.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Diffc {
    /// K that settles in the duration [1/s].
    pub gain: f64,
    /// K equal to logc's [1/s].
    pub low_gain: f64,
    /// \[s\]
    pub duration: f64,
}

/// Relative position control of two arms.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Serialize)]
#[serde(deny_unknown_fields)]
pub struct RelativePosition {
    /// K [1/s].
    pub gain: f64,
    /// The goal is this many times the initial relative translation.
    pub target_factor: f64,
    /// \[s\]
    pub duration: f64,
}

/// logc with its two decay rates.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Serialize)]
#[serde(deny_unknown_fields)]
pub struct LogcDecay {
    /// `k_ω` [1/s].
    pub gain_angular: f64,
    /// `k_v` [1/s].
    pub gain_linear: f64,
    /// \[s\]
    pub duration: f64,
}

/// The comparison of the laws.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Comparison {
    /// Gain of logc and double_geodesic [1/s].
    pub gain: f64,
    /// \[s\]
    pub duration: f64,
}

/// The same task with the base elsewhere.
#[derive(Clone, Debug, Deserialize, PartialEq, Serialize)]
#[serde(deny_unknown_fields)]
pub struct BaseShift {
    /// Along x \[m\].
    pub distances: Vec<f64>,
    /// \[s\]
    pub duration: f64,
}

/// The goal's other sign.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Serialize)]
#[serde(deny_unknown_fields)]
pub struct WrongSign {
    /// \[s\]
    pub duration: f64,
}

/// Random starts and goals.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Sweep {
    /// How many pairs.
    pub pairs: u32,
    /// Which pairs.
    pub seed: u64,
    /// \[s\]
    pub duration: f64,
}

impl Experiment {
    /// The built-in constants: the paper's.
    ///
    /// # Errors
    /// [`PaperError::Experiment`].
    pub fn builtin() -> Result<Self, PaperError> {
        Self::parse(BUILTIN, "msg_config/paper.yaml")
    }

    /// The constants in a file.
    ///
    /// # Errors
    /// [`PaperError::Experiment`] for what is no such file, or has numbers that cannot be simulated.
    pub fn from_file(path: &Path) -> Result<Self, PaperError> {
        let file = path.display().to_string();
        let text = std::fs::read_to_string(path)
            .map_err(|why| PaperError::Experiment { file: file.clone(), why: why.to_string() })?;
        Self::parse(&text, &file)
    }

    fn parse(text: &str, file: &str) -> Result<Self, PaperError> {
        let error = |why: String| PaperError::Experiment { file: file.to_owned(), why };
        let experiment: Self =
            serde_saphyr::from_str(text).map_err(|why| error(why.to_string().lines().take(1).collect()))?;
        experiment.check().map_err(error)?;
        Ok(experiment)
    }

    fn check(&self) -> Result<(), String> {
        let numbers = [
            ("diffc.gain", self.diffc.gain),
            ("diffc.low_gain", self.diffc.low_gain),
            ("diffc.duration", self.diffc.duration),
            ("relative_position.gain", self.relative_position.gain),
            ("relative_position.target_factor", self.relative_position.target_factor),
            ("relative_position.duration", self.relative_position.duration),
            ("logc_decay.gain_angular", self.logc_decay.gain_angular),
            ("logc_decay.gain_linear", self.logc_decay.gain_linear),
            ("logc_decay.duration", self.logc_decay.duration),
            ("comparison.gain", self.comparison.gain),
            ("comparison.duration", self.comparison.duration),
            ("base_shift.duration", self.base_shift.duration),
            ("wrong_sign.duration", self.wrong_sign.duration),
            ("sweep.duration", self.sweep.duration),
        ];
        let largest = 1e4;
        match numbers.into_iter().find(|(_, value)| !(*value > 0.0 && *value <= largest)) {
            Some((name, value)) => {
                Err(format!("{name} is {value}: expected a number above 0, up to {largest}"))
            }
            None if self.sweep.pairs == 0 => Err("sweep.pairs is 0: expected at least 1".to_owned()),
            None if self.base_shift.distances.is_empty() => Err("base_shift.distances is empty".to_owned()),
            None => Ok(()),
        }
    }
}
