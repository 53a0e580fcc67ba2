//! Parameter values at the start: the built-in file, then the command line in its order.

use crate::config::{BUILTIN_FILE, ConfigError, ParameterStore, Value, parameters_for};
use crate::ros::Resolver;
use crate::ros::args::{Override, RosArgs};
use std::path::Path;

/// `store` with the values that the node gets at its start.
///
/// # Errors
/// [`ConfigError`] for what does not parse, is unknown, or does not fit.
pub fn load(
    mut store: ParameterStore,
    names: &Resolver,
    args: &RosArgs,
) -> Result<ParameterStore, ConfigError> {
    let node = names.node().fully_qualified();
    let mut values = parameters_for(BUILTIN_FILE, "msg_config/puma560.yaml", &node)?;
    for given in &args.overrides {
        match given {
            Override::File(path) => values.extend(from_file(path, &node)?),
            Override::Parameter { node: only, name, yaml } => {
                if only.as_deref().is_none_or(|only| only == names.node().name()) {
                    values.push((name.clone(), Value::from_yaml(yaml)?));
                }
            }
        }
    }
    for (name, value) in values {
        store.override_initial(&name, value)?;
    }
    Ok(store)
}

fn from_file(path: &Path, node: &str) -> Result<Vec<(String, Value)>, ConfigError> {
    let file = path.display().to_string();
    let text = std::fs::read_to_string(path)
        .map_err(|why| ConfigError::File { file: file.clone(), why: why.to_string() })?;
    parameters_for(&text, &file, node)
}
