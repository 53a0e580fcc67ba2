//! What a node is before it joins the graph: its names and its parameters.

use super::NodeError;
use crate::config::{BUILTIN_FILE, ConfigError, NodeParameters, ParameterStore, Value, parameters_for};
use crate::ros::args::{Override, RosArgs};
use crate::ros::{LogLevel, Resolver, RosError};
use std::path::Path;

/// A node's names and checked parameters: nothing of it can fail any more but the network.
pub struct Prepared<P> {
    pub(super) names: Resolver,
    pub(super) store: ParameterStore,
    pub(super) parameters: P,
    pub(super) log_level: LogLevel,
}

impl<P: NodeParameters> Prepared<P> {
    /// The node that the command line asks for.
    ///
    /// # Errors
    /// [`NodeError`] for names and parameters that are not right.
    pub fn new(args: &RosArgs) -> Result<Self, NodeError> {
        let names = Resolver::new(P::NODE_NAME, args).map_err(RosError::from)?;
        let store = load(P::store(), &names, args)?;
        let log_level = args.log_level.unwrap_or(LogLevel::Info);
        Ok(Self { names, parameters: P::from_store(&store)?, store, log_level })
    }

    /// The parameters.
    pub fn parameters(&self) -> &P {
        &self.parameters
    }

    /// The node's fully qualified name.
    pub fn node(&self) -> String {
        self.names.node().fully_qualified()
    }
}

/// `store` with the values that the node gets at its start: the built-in file's, then the command line's in its order.
fn load(mut store: ParameterStore, names: &Resolver, args: &RosArgs) -> Result<ParameterStore, ConfigError> {
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
