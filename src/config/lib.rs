#![doc = include_str!("README.md")]
#![warn(clippy::unwrap_used, clippy::expect_used)]
// These macros panic if nobody reads the output. Results go through `cli::print`, everything else through `stderr`.
#![warn(clippy::print_stdout, clippy::print_stderr)]

mod arms;
mod common;
mod cycle;
mod described;
mod described_limits;
mod described_text;
mod docs;
mod dual;
mod guard;
mod limits;
mod plant;
mod scene;
mod servo;
mod setup;

pub use arms::{ARMS, arm_file};
pub use common::ArmParameters;
pub use cycle::{ServoParameters, StatesReliability};
pub use described::is_awaited;
pub use docs::table;
pub use dual::DualParameters;
pub use guard::GuardParameters;
pub use plant::{PLANT_NAMES, PlantParameters};
pub use setup::{ForArm, SetupError};

use described::Described;
use described_limits::GivenLimits;
use dq_description::{DescribedArm, FittedBody};
use dq_params::{
    Declaration, Declarer, ParameterError, ParameterOverride, ParameterStore, Parameters, Value,
    parameters_for,
};
use std::sync::LazyLock;

/// The built-in parameter file. Its arm is the PUMA 560 in Sathuluri, *Dual Quaternion Based Control* (2018).
pub const BUILTIN_FILE: &str = include_str!("msg_config/puma560.yaml");

/// The parameters of one kind of node.
pub trait NodeParameters: Parameters + Send + 'static {
    /// The node's default name.
    const NODE_NAME: &'static str;

    /// Returns the declarations of all parameters.
    ///
    /// # Errors
    /// [`ParameterError`] if the built-in arm is invalid, because later declarations would then be missing.
    fn declarations() -> Result<Vec<Declaration>, ParameterError> {
        let mut declarer = Declarer::new(builtin()?.iter().cloned());
        Self::declare(&mut declarer)?;
        Ok(declarer.into_declarations())
    }

    /// Creates a store in which all parameters have their defaults.
    ///
    /// # Errors
    /// The errors of [`declarations`](Self::declarations).
    fn store() -> Result<ParameterStore, ParameterError> {
        Ok(ParameterStore::new(Self::declarations()?, names()?))
    }

    /// Reads the typed parameters from `store`.
    ///
    /// # Errors
    /// [`ParameterError`] if values contradict each other.
    fn from_store(store: &ParameterStore) -> Result<Self, ParameterError> {
        store.read()
    }

    /// Returns the typed parameters of a node that starts with these `values` from `source`. Ignores values for other nodes.
    ///
    /// # Errors
    /// The errors of [`start`](Self::start), and [`ParameterError`] if values contradict each other.
    fn from_values(values: Vec<(String, Value)>, source: &str) -> Result<Self, ParameterError> {
        let given = values.into_iter().map(|(name, value)| ParameterOverride::new(name, value, source));
        let (store, _ignored) = Self::start(&format!("/{}", Self::NODE_NAME), given.collect())?;
        Self::from_store(&store)
    }

    /// Returns the value that the parameter `robot_description` has after a start with the description `text`. This is only the
    /// part of the description that the node uses: the arm.
    fn description_in_force(_text: String, arm: &DescribedArm) -> String {
        arm.urdf()
    }

    /// Creates the parameter store of a node, and sets its parameters to the values `given`. `node` is the full name of the node. If
    /// `given` has several values for a parameter, the last one counts. Returns the store and warnings.
    ///
    /// If no value describes an arm, the node uses the built-in arm. If `joints` or any `arm.*` is given, the node uses no value of the
    /// built-in arm, because a mixture of two arms would move wrongly. A robot description replaces the built-in arm and `arm.*`. It
    /// also provides these values if they are not given: joint names, limits, and the initial positions of the plant.
    ///
    /// # Errors
    /// [`ParameterError::Missing`] for an incomplete arm, [`ParameterError::File`] for a robot description without an arm, and the
    /// errors of [`ParameterStore::take`].
    fn start(
        node: &str,
        given: Vec<ParameterOverride>,
    ) -> Result<(ParameterStore, Vec<String>), ParameterError> {
        let mut store = Self::store()?;
        let mut builtin = builtin()?.to_vec();
        if let Some(described) = Described::find(&given, store.declaration("right_joints").is_some())? {
            builtin.retain(|(name, _)| !store.declaration(name).is_some_and(describes_arm));
            let limits = GivenLimits::find(&given, &described.joint_counts());
            if store.declaration("limits.joint_velocity").is_some_and(|declared| declared.required) {
                described.check_limits(&limits)?;
            }
            for (name, value) in builtin.into_iter().chain(described.defaults(&limits)) {
                store.override_initial(&name, value)?;
            }
            let is_free = |name: &str| {
                store.declaration(name).is_some() && given.iter().all(|value| value.name != name)
            };
            let body = if is_free("body") { Some(("body", described.body()?)) } else { None };
            let right = described.right.as_ref().filter(|_| is_free("right_body"));
            let right = right.map(|right| Ok(("right_body", right.body()?))).transpose()?;
            let bodies: Vec<_> = body.into_iter().chain(right).collect();
            let mut warnings = store.take(node, given)?;
            for (name, FittedBody { texts, warning }) in bodies {
                store.override_initial(name, Value::StringArray(texts))?;
                let is_used = store.get("constraints") == Some(&Value::Bool(true));
                warnings.extend(warning.filter(|_| is_used));
            }
            warnings
                .extend(described.slow_stop(&limits).filter(|_| store.declaration("limits.jerk").is_some()));
            warnings.extend(described.degrees(&limits));
            warnings.extend(described.messages());
            if let Some(right) = &described.right {
                store.override_initial("right_robot_description", Value::String(right.arm.urdf()))?;
            }
            let in_force = Self::description_in_force(described.text, &described.arm);
            store.override_initial("robot_description", Value::String(in_force))?;
            return Ok((store, warnings));
        }
        if given.iter().any(|value| value.name == "joints" || value.name.starts_with("arm.")) {
            check_arm_is_whole(&store, &given)?;
            builtin.retain(|(name, _)| !store.declaration(name).is_some_and(describes_arm));
        }
        for (name, value) in builtin {
            store.override_initial(&name, value)?;
        }
        let warnings = store.take(node, given)?;
        Ok((store, warnings))
    }
}

/// The default names of the nodes.
pub const NODE_NAMES: [&str; 4] = [
    ServoParameters::NODE_NAME,
    DualParameters::NODE_NAME,
    PlantParameters::NODE_NAME,
    GuardParameters::NODE_NAME,
];

/// Returns the default name of each node, and its declarations.
///
/// # Errors
/// The errors of [`NodeParameters::declarations`].
pub fn nodes() -> Result<[(&'static str, Vec<Declaration>); 4], ParameterError> {
    let [servo, dual, plant, guard] = NODE_NAMES;
    Ok([
        (servo, ServoParameters::declarations()?),
        (dual, DualParameters::declarations()?),
        (plant, PlantParameters::declarations()?),
        (guard, GuardParameters::declarations()?),
    ])
}

/// Returns the names of the parameters of all nodes.
///
/// # Errors
/// The errors of [`NodeParameters::declarations`].
pub fn names() -> Result<Vec<&'static str>, ParameterError> {
    Ok(nodes()?.iter().flat_map(|(_, declared)| declared).map(|declared| declared.name).collect())
}

/// Returns the values in the built-in file that apply to every node.
fn builtin() -> Result<&'static [(String, Value)], ParameterError> {
    static VALUES: LazyLock<Result<Vec<(String, Value)>, ParameterError>> =
        LazyLock::new(|| parameters_for(BUILTIN_FILE, "msg_config/puma560.yaml", "/"));
    VALUES.as_deref().map_err(Clone::clone)
}

fn describes_arm(declared: &Declaration) -> bool {
    declared.required || ["arm.", "limits.joint_"].iter().any(|start| declared.name.starts_with(start))
}

fn check_arm_is_whole(store: &ParameterStore, given: &[ParameterOverride]) -> Result<(), ParameterError> {
    let required = store.iter().filter(|(declared, _)| declared.required).map(|(declared, _)| declared.name);
    let missing: Vec<_> = required.filter(|name| given.iter().all(|value| value.name != *name)).collect();
    match missing.is_empty() {
        true => Ok(()),
        false => Err(ParameterError::Missing {
            what: "an arm",
            missing,
            why: "once `joints` or any `arm.*` is given, nothing of the built-in arm is used",
        }),
    }
}
