//! The constants of the experiments: `msg_config/paper.yaml`.

use super::PaperError;
use dq_params::one_line;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// The file that is built into the program.
const BUILTIN: &str = include_str!("../msg_config/paper.yaml");

/// The constants of all experiments; rad, m, s, gains in 1/s.
#[derive(Clone, Debug, Deserialize, PartialEq, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Experiment {
    /// Joint angles at the start \[rad\].
    pub theta_initial: Vec<f64>,
    /// Joint angles at the goal \[rad\].
    pub theta_desired: Vec<f64>,
    /// The constants of diffc in the paper.
    pub diffc: Diffc,
    /// The constants of the experiment with two arms.
    pub relative_position: RelativePosition,
    /// The constants of logc's motion in task space. The paper integrates logc there, without an arm.
    pub task_space_logc: TaskSpaceGains,
    /// The constants of the comparison of the laws.
    pub comparison: Comparison,
    /// The constants of the task with a shifted base.
    pub base_shift: BaseShift,
    /// The constants of the task whose goal has the opposite quaternion sign.
    pub wrong_sign: WrongSign,
}

/// The constants of diffc in the paper.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Diffc {
    /// The gain K with which the motion settles within its duration [1/s].
    pub gain: f64,
    /// The gain K that equals logc's gain [1/s].
    pub low_gain: f64,
    /// The duration of the motion \[s\].
    pub duration: f64,
    /// The duration of the motion in figure 7, in which K equals logc's gain \[s\].
    pub low_gain_duration: f64,
}

/// The constants of relative position control of two arms.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Serialize)]
#[serde(deny_unknown_fields)]
pub struct RelativePosition {
    /// The gain K [1/s].
    pub gain: f64,
    /// The goal as a multiple of the initial relative translation.
    pub target_factor: f64,
    /// The duration of the motion \[s\].
    pub duration: f64,
}

/// The constants of logc on the half-log pair in task space. The rotation decays with `k_ω`, the translation with `k_ω + k_v`.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Serialize)]
#[serde(deny_unknown_fields)]
pub struct TaskSpaceGains {
    /// The gain `k_ω` [1/s].
    pub gain_angular: f64,
    /// The gain `k_v` [1/s].
    pub gain_linear: f64,
    /// The duration of the motion \[s\].
    pub duration: f64,
}

/// The constants of the comparison of the laws.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Comparison {
    /// The gain of logc and double_geodesic [1/s].
    pub gain: f64,
    /// The duration of the motion \[s\].
    pub duration: f64,
}

/// The constants of the task with a shifted base.
#[derive(Clone, Debug, Deserialize, PartialEq, Serialize)]
#[serde(deny_unknown_fields)]
pub struct BaseShift {
    /// The shifts of the base along x \[m\]. The motions with later shifts are compared with the motion with the first shift.
    pub distances: Vec<f64>,
    /// The duration of the motion \[s\].
    pub duration: f64,
}

/// The constants of the task with the goal's other sign.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Serialize)]
#[serde(deny_unknown_fields)]
pub struct WrongSign {
    /// The duration of the motion \[s\].
    pub duration: f64,
}

impl Experiment {
    /// Returns the built-in constants, which are the paper's.
    ///
    /// # Errors
    /// [`PaperError::Experiment`] if they are invalid.
    pub fn builtin() -> Result<Self, PaperError> {
        Self::parse(BUILTIN, "msg_config/paper.yaml")
    }

    /// Reads the constants from a file.
    ///
    /// # Errors
    /// [`PaperError::Experiment`] for an invalid file, or for numbers that cannot be simulated.
    pub fn from_file(path: &Path) -> Result<Self, PaperError> {
        let file = path.display().to_string();
        let text = std::fs::read_to_string(path)
            .map_err(|why| PaperError::Experiment { file: file.clone(), why: why.to_string() })?;
        Self::parse(&text, &file)
    }

    fn parse(text: &str, file: &str) -> Result<Self, PaperError> {
        let error = |why: String| PaperError::Experiment { file: file.to_owned(), why };
        let experiment: Self = serde_saphyr::from_str(text).map_err(|why| error(one_line(&why)))?;
        experiment.check().map_err(error)?;
        Ok(experiment)
    }

    fn check(&self) -> Result<(), String> {
        let numbers = [
            ("diffc.gain", self.diffc.gain),
            ("diffc.low_gain", self.diffc.low_gain),
            ("diffc.duration", self.diffc.duration),
            ("diffc.low_gain_duration", self.diffc.low_gain_duration),
            ("relative_position.gain", self.relative_position.gain),
            ("relative_position.target_factor", self.relative_position.target_factor),
            ("relative_position.duration", self.relative_position.duration),
            ("task_space_logc.gain_angular", self.task_space_logc.gain_angular),
            ("task_space_logc.gain_linear", self.task_space_logc.gain_linear),
            ("task_space_logc.duration", self.task_space_logc.duration),
            ("comparison.gain", self.comparison.gain),
            ("comparison.duration", self.comparison.duration),
            ("base_shift.duration", self.base_shift.duration),
            ("wrong_sign.duration", self.wrong_sign.duration),
        ];
        /// The largest allowed number. A larger number is probably a typing error.
        const LARGEST: f64 = 1e4;
        /// The longest allowed duration \[s\]. A longer motion would fill the memory with samples.
        const LONGEST: f64 = 600.0;
        if !self.theta_initial.iter().chain(&self.theta_desired).all(|angle| angle.abs() <= LARGEST) {
            return Err(format!("theta_initial and theta_desired: expected angles within ±{LARGEST} rad"));
        }
        if self.theta_initial == self.theta_desired {
            return Err("theta_initial and theta_desired are equal: there is no motion to repeat".to_owned());
        }
        if !self.base_shift.distances.iter().all(|distance| distance.abs() <= LARGEST) {
            return Err(format!("base_shift.distances: expected numbers within ±{LARGEST} m"));
        }
        let largest = |name: &str| if name.ends_with("duration") { LONGEST } else { LARGEST };
        match numbers.into_iter().find(|(name, value)| !(*value > 0.0 && *value <= largest(name))) {
            Some((name, value)) => {
                Err(format!("{name} is {value}: expected a number above 0, up to {}", largest(name)))
            }
            None if self.base_shift.distances.is_empty() => Err("base_shift.distances is empty".to_owned()),
            None => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn invalid_values_are_refused_by_name() {
        for (good, bad, needle) in [
            ("gain: 185.0", "gain: -1.0", "diffc.gain is -1"),
            ("gain: 185.0", "gain: .nan", "diffc.gain"),
            ("duration: 15.0", "duration: 1.0e9", "duration is 1000000000"),
            ("[0.0, 1.0, 3.0]", "[.inf]", "base_shift.distances"),
            ("theta_initial: [0.7853981633974483", "theta_initial: [.inf", "theta_initial"),
        ] {
            let error =
                Experiment::parse(&BUILTIN.replacen(good, bad, 1), "my.yaml").unwrap_err().to_string();
            assert!(error.starts_with("my.yaml: ") && error.contains(needle), "{error}");
            assert_eq!(error.lines().count(), 1);
        }
        let standing = Experiment::builtin().unwrap();
        let standing = Experiment { theta_desired: standing.theta_initial.clone(), ..standing };
        assert!(standing.check().unwrap_err().contains("no motion"));
    }
}
