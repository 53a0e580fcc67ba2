//! The names and parameters of a node, before the node joins the graph.

use super::NodeError;
use dq_common::text::cut;
use dq_config::{DualParameters, NodeParameters, ServoParameters};
use dq_params::{FileParameters, ParameterError, ParameterOverride, ParameterStore, Value, is_misspelt};
use dq_ros::ros::args::{Override, RosArgs};
use dq_ros::ros::{LogLevel, Logging, Resolver, RosError};
use std::marker::PhantomData;

/// A node's names and checked parameters, from which the node can start.
pub struct Prepared<P> {
    pub(super) names: Resolver,
    pub(super) store: ParameterStore,
    pub(super) parameters: P,
    pub(super) logging: Logging,
    pub(super) warnings: Vec<String>,
}

impl From<Prepared<DualParameters>> for Prepared<ServoParameters> {
    fn from(two_arms: Prepared<DualParameters>) -> Self {
        let Prepared { names, store, parameters: DualParameters(parameters), logging, warnings } = two_arms;
        Self { names, store, parameters, logging, warnings }
    }
}

impl<P: NodeParameters> Prepared<P> {
    /// Prepares the node from the command line.
    ///
    /// # Errors
    /// [`NodeError`] if a name or a parameter is invalid.
    pub fn new(args: &RosArgs) -> Result<Self, NodeError> {
        NodeArguments::new(args)?.prepare()
    }

    /// Returns the parameters.
    pub fn parameters(&self) -> &P {
        &self.parameters
    }

    /// Returns the warnings about the command line, one line each. A node logs them at its start.
    pub fn warnings(&self) -> &[String] {
        &self.warnings
    }

    /// Returns the node's fully qualified name.
    pub fn node(&self) -> String {
        self.names.node().fully_qualified()
    }
}

/// The reason why a node that is shutting down refuses parameters.
pub(super) const CYCLE_ENDED: &str = "the node's cycle has ended";

/// The names and parameters of a node from the command line and its parameter files. The parameters are not checked yet.
pub struct NodeArguments<P> {
    names: Resolver,
    values: Vec<ParameterOverride>,
    logging: Logging,
    warnings: Vec<String>,
    kind: PhantomData<P>,
}

impl<P: NodeParameters> NodeArguments<P> {
    /// Reads the command line and its parameter files.
    ///
    /// # Errors
    /// [`NodeError`] if a name is invalid, or if a parameter cannot be read.
    pub fn new(args: &RosArgs) -> Result<Self, NodeError> {
        let names = Resolver::new(P::NODE_NAME, args).map_err(RosError::from)?;
        let (logging, kind) = (Logging::new(args, LogLevel::Info), PhantomData);
        let mut given = Self { names, values: Vec::new(), logging, warnings: Vec::new(), kind };
        args.overrides.iter().try_for_each(|from| given.take(from))?;
        Ok(given)
    }

    fn take(&mut self, from: &Override) -> Result<(), ParameterError> {
        let node = self.names.node();
        let is_for = |only: Option<&str>| only.is_none_or(|only| only == node.name());
        match from {
            Override::File(path) => {
                let (file, node) = (path.display().to_string(), node.fully_qualified());
                let found = FileParameters::open(path, &node)?;
                self.warnings.extend(passes_by::<P>(&found, &file, &node));
                self.values.extend(found.given);
            }
            Override::Builtin { name, text } => {
                self.values.extend(FileParameters::read(text, name, &node.fully_qualified())?.given);
            }
            Override::Value { node: only, name, value } if is_for(*only) => {
                self.values.push(ParameterOverride::new(name, value.clone(), "this command"));
            }
            Override::Parameter { node: only, name, yaml } if is_for(only.as_deref()) => {
                // A description such as `-p robot_description:="$(xacro robot.urdf.xacro)"` is passed unquoted and is not YAML.
                let is_xml = name == "robot_description" && yaml.trim_start().starts_with('<');
                self.values.push(ParameterOverride {
                    name: name.clone(),
                    value: if is_xml { Value::String(yaml.clone()) } else { Value::from_yaml(yaml)? },
                    source: format!("-p {name}:={}", cut(yaml)),
                    // A value without a node's name may be for a node of another program, and is then ignored. But a name that resembles
                    // a parameter of this program is probably misspelt, so it must be known.
                    by_name: only.is_some() || is_misspelt(name, dq_config::names()?),
                });
            }
            Override::Value { .. } | Override::Parameter { .. } => {}
        }
        Ok(())
    }

    /// Returns whether the node must wait for a robot description on a topic: the parameters name the frames of an arm, but contain no
    /// description.
    pub fn is_awaited(&self) -> bool {
        dq_config::is_awaited(&self.values)
    }

    /// Returns the value of `realtime_priority`, which is needed before the other parameters are checked; 0 if there is none.
    pub fn realtime_priority(&self) -> u8 {
        match self.values.iter().rfind(|given| given.name == "realtime_priority").map(|given| &given.value) {
            Some(Value::Integer(priority)) => u8::try_from(*priority).unwrap_or(0),
            _ => 0,
        }
    }

    /// Checks the parameters.
    ///
    /// # Errors
    /// [`NodeError`] if a parameter is invalid.
    pub fn prepare(self) -> Result<Prepared<P>, NodeError> {
        let Self { names, values, logging, mut warnings, .. } = self;
        let (store, ignored) = P::start(&names.node().fully_qualified(), values)?;
        warnings.extend(ignored);
        Ok(Prepared { parameters: P::from_store(&store)?, names, store, logging, warnings })
    }

    /// Checks the parameters together with a `robot_description` that arrived on a topic.
    ///
    /// # Errors
    /// [`NodeError`] if a parameter is invalid, or if the description does not contain the arm that the parameters name.
    pub(super) fn describe(mut self, text: String) -> Result<Prepared<P>, NodeError> {
        let name = "robot_description";
        self.values.push(ParameterOverride::new(name, Value::String(text), name));
        self.prepare()
    }

    /// Returns the names and the logging of the node.
    pub(super) fn node(&self) -> (Resolver, Logging) {
        (self.names.clone(), self.logging)
    }
}

/// Returns a warning about a file that has no parameters for this node. Returns `None` if the file has parameters for another kind
/// of node of this program, because nodes may share a file.
fn passes_by<P: NodeParameters>(found: &FileParameters, file: &str, node: &str) -> Option<String> {
    let is_for = |name: &str| dq_config::NODE_NAMES.contains(&name) && name != P::NODE_NAME;
    let others = found.sections.iter().any(|section| section.rsplit('/').next().is_some_and(is_for));
    let sections = found.sections.iter().map(|section| section.trim_start_matches('/')).collect::<Vec<_>>();
    (!found.has_section_of(node) && !sections.is_empty() && !others).then(|| {
        format!(
            "{file}: none of its sections ({}) is for {node}: nothing is taken from it (did you mean {}?)",
            sections.join(", "),
            node.trim_start_matches('/')
        )
    })
}
