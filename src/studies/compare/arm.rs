//! The arms of the comparison, and the random tasks that they get.

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

/// The built-in arms that are compared: other sizes of them behave alike.
const COMPARED: [&str; 5] = ["puma560", "ur5e", "panda", "iiwa14", "xarm6"];

/// An arm with the servo's parameters for it.
#[derive(Clone, Debug)]
pub struct Arm {
    /// Its file's name, without folder and ending.
    pub name: String,
    /// Its kinematics, joints, limits, and everything else that the servo has.
    pub parameters: ServoParameters,
    /// What the servo's parameters are made of, and what that is from.
    values: Vec<(String, Value)>,
    source: String,
}

/// From where to where.
#[derive(Clone, Debug, PartialEq)]
pub struct Task {
    /// Joint angles at the start \[rad\].
    pub start: Vec<f64>,
    /// The tool's goal, with the sign that is nearer at the start.
    pub base_from_goal: UnitDualQuaternion,
}

impl Arm {
    /// PUMA 560, UR5e, Panda, iiwa 14 and xArm 6.
    ///
    /// # Errors
    /// [`CompareError::Config`].
    pub fn builtin() -> Result<Vec<Self>, CompareError> {
        let files = COMPARED.into_iter().filter_map(arm_file);
        files.map(|(name, text)| Self::in_box(name, text)).collect()
    }

    /// The built-in arm of that name, else the one that a parameter file describes.
    ///
    /// # Errors
    /// [`CompareError::NoArm`], [`CompareError::Config`].
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
        // Laws are compared, and not what the servo does where they have stalled.
        values.push(("reconfigure".to_owned(), Value::String(Reconfigure::Never.name().to_owned())));
        Self::of(name, values, source)
    }

    fn of(name: &str, values: Vec<(String, Value)>, source: &str) -> Result<Self, CompareError> {
        // Two of the arms have limits on jerk: the laws are compared under limits of the same kinds.
        let parameters = ServoParameters::from_values(values.clone(), source)?
            .with(|settings| settings.limits.joint_jerk.fill(f64::INFINITY));
        Ok(Self { name: name.to_owned(), parameters, values, source: source.to_owned() })
    }

    /// The same with other values of parameters of the servo.
    ///
    /// # Errors
    /// [`CompareError::Config`].
    pub fn with(&self, parameters: impl IntoIterator<Item = (String, Value)>) -> Result<Self, CompareError> {
        Self::of(&self.name, self.values.iter().cloned().chain(parameters).collect(), &self.source)
    }

    /// The task of that number: start and goal are poses of joint angles between the position limits, within half a turn either way.
    /// Each number has a stream of random numbers of its own, so that the order of running does not matter.
    ///
    /// # Errors
    /// None in practice: the angles are as many as the arm has joints.
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

    /// The number of joints.
    pub fn joint_count(&self) -> usize {
        self.parameters.arms.joint_count()
    }
}

/// A number between `low` and `high`, evenly.
pub(super) fn between(low: f64, high: f64, random: &mut ChaCha8Rng) -> f64 {
    // The 53 highest bits make a number in [0, 1).
    let unit = (random.next_u64() >> 11) as f64 / (1_u64 << 53) as f64;
    low + unit * (high - low)
}
