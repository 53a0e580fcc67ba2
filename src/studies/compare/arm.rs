//! The arms of the comparison, and their random tasks.

use super::CompareError;
use dq_algebra::UnitDualQuaternion;
use dq_config::{NodeParameters, ServoParameters, arm_file};
use dq_core::servo::Reconfigure;
use dq_kinematics::control::nearer_goal;
use dq_params::{Value, parameters_for};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use std::f64::consts::PI;
use std::path::Path;

/// The built-in arms that are compared. Other sizes of these arms behave similarly.
const COMPARED: [&str; 5] = ["puma560", "ur5e", "panda", "iiwa14", "xarm6"];

/// An arm with its servo parameters.
#[derive(Clone, Debug)]
pub struct Arm {
    /// The name of the arm: the name of its file, without folder and extension.
    pub name: String,
    /// The kinematics, joint names, limits, and all other servo parameters of the arm.
    pub parameters: ServoParameters,
    /// The values from which the parameters were built.
    values: Vec<(String, Value)>,
    /// The name of the arm or of the parameter file from which `values` come. Errors name it.
    source: String,
}

/// The start and the goal of a motion.
#[derive(Clone, Debug, PartialEq)]
pub struct Task {
    /// Joint angles at the start \[rad\].
    pub start: Vec<f64>,
    /// The goal of the tool. Of the two quaternions q and −q for this pose, it is the one that is nearer to the start pose.
    pub base_from_goal: UnitDualQuaternion,
}

impl Arm {
    /// Returns the PUMA 560, UR5e, Panda, iiwa 14 and xArm 6.
    ///
    /// # Errors
    /// [`CompareError::Config`] if a parameter file is invalid.
    pub fn builtin() -> Result<Vec<Self>, CompareError> {
        let files = COMPARED.into_iter().filter_map(arm_file);
        files.map(|(name, text)| Self::in_box(name, text)).collect()
    }

    /// Returns the built-in arm with this name; if there is none, the arm of the parameter file at this path.
    ///
    /// # Errors
    /// [`CompareError::NoArm`] or [`CompareError::Config`].
    pub fn named(path: &Path) -> Result<Self, CompareError> {
        if let Some((name, text)) = path.to_str().and_then(arm_file) {
            return Self::in_box(name, text);
        }
        let no_arm = |why| CompareError::NoArm { name: path.display().to_string(), why };
        let text = std::fs::read_to_string(path).map_err(no_arm)?;
        let name = path.file_stem().unwrap_or(path.as_os_str()).to_string_lossy();
        Self::parse(&name, &text, &path.display().to_string())
    }

    fn in_box(name: &str, text: &str) -> Result<Self, CompareError> {
        Self::parse(name, text, &format!("{name}.yaml"))
    }

    fn parse(name: &str, text: &str, source: &str) -> Result<Self, CompareError> {
        let mut values = parameters_for(text, source, "/dq_servo")?;
        // The comparison is about the laws, not about the servo's reconfigurations after a stall.
        values.push(("reconfigure".to_owned(), Value::String(Reconfigure::Never.name().to_owned())));
        // An arm with more joints than its task needs does not return to a posture either: that is not a property of the law.
        values.push(("posture.gain".to_owned(), Value::Double(0.0)));
        Self::of(name, values, source)
    }

    fn of(name: &str, values: Vec<(String, Value)>, source: &str) -> Result<Self, CompareError> {
        // Two of the arms have jerk limits. The comparison removes them, so that all arms have the same kinds of limits.
        let parameters = ServoParameters::from_values(values.clone(), source)?
            .with(|settings| settings.limits.joint_jerk.fill(f64::INFINITY));
        Ok(Self { name: name.to_owned(), parameters, values, source: source.to_owned() })
    }

    /// Returns the arm with other values of servo parameters.
    ///
    /// # Errors
    /// [`CompareError::Config`] if a value is invalid.
    pub fn with(&self, parameters: impl IntoIterator<Item = (String, Value)>) -> Result<Self, CompareError> {
        Self::of(&self.name, self.values.iter().cloned().chain(parameters).collect(), &self.source)
    }

    /// Returns the task `number`. Its start and its goal are the tool poses at random joint positions within the position limits
    /// and within ±π. Each task has its own stream of random numbers, so the order of runs does not matter.
    ///
    /// # Errors
    /// [`CompareError::Arm`]. This does not happen in practice, because there is one position per joint.
    pub fn task(&self, seed: u64, number: u32) -> Result<Task, CompareError> {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        random.set_stream(u64::from(number));
        let limits = &self.parameters.settings.limits.position;
        let mut angles = || {
            let ranges = limits.lower.iter().zip(&limits.upper);
            ranges.map(|(low, high)| between(low.max(-PI), high.min(PI), &mut random)).collect::<Vec<_>>()
        };
        let (start, theta_goal) = (angles(), angles());
        let chain = self.parameters.arms.chain();
        let (goal, tool) = (chain.forward_kinematics(&theta_goal)?, chain.forward_kinematics(&start)?);
        Ok(Task { start, base_from_goal: nearer_goal(&goal, &tool) })
    }

    /// Returns the number of joints.
    pub fn joint_count(&self) -> usize {
        self.parameters.arms.joint_count()
    }
}

/// Returns a uniformly distributed number between `low` and `high`.
pub(super) fn between(low: f64, high: f64, random: &mut ChaCha8Rng) -> f64 {
    // The 53 highest bits are a number in [0, 1).
    let unit = (random.next_u64() >> 11) as f64 / (1_u64 << 53) as f64;
    low + unit * (high - low)
}
