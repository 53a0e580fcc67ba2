//! A node before it joins the graph: its names and its parameters.

use super::NodeError;
use dq_common::text::cut;
use dq_config::{DualParameters, NodeParameters, ServoParameters};
use dq_params::{FileParameters, ParameterError, ParameterOverride, ParameterStore, Value, is_misspelt};
use dq_ros::ros::args::{Override, RosArgs};
use dq_ros::ros::{LogLevel, Logging, Resolver, RosError};

/// A node's names and checked parameters. From here on only the network can fail.
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
        Self::with(args, None)
    }

    /// Prepares the node from the command line and a `robot_description` that arrived on a topic.
    ///
    /// # Errors
    /// [`NodeError`] if a name or a parameter is invalid, or if the description gives no arm.
    pub(super) fn described(args: &RosArgs, text: String) -> Result<Self, NodeError> {
        let name = "robot_description";
        Self::with(args, Some(ParameterOverride::new(name, Value::String(text), name)))
    }

    /// Prepares the node from the command line. Returns `None` if the command line names the frames of an arm but leaves the description
    /// between them to a topic.
    ///
    /// # Errors
    /// [`NodeError`] if a name or a parameter is invalid.
    pub fn unless_awaited(args: &RosArgs) -> Result<Option<Self>, NodeError> {
        let names = Resolver::new(P::NODE_NAME, args).map_err(RosError::from)?;
        let (given, _) = given::<P>(&names, &names.node().fully_qualified(), args)?;
        if dq_config::is_awaited(&given) { Ok(None) } else { Self::new(args).map(Some) }
    }

    /// Returns the `realtime_priority` from the command line, before it is checked with the other parameters; 0 if there is none.
    ///
    /// # Errors
    /// [`NodeError`] if a name or a parameter is invalid.
    pub fn realtime_priority(args: &RosArgs) -> Result<u8, NodeError> {
        let names = Resolver::new(P::NODE_NAME, args).map_err(RosError::from)?;
        let (given, _) = given::<P>(&names, &names.node().fully_qualified(), args)?;
        let priority =
            given.iter().rfind(|given| given.name == "realtime_priority").map(|given| &given.value);
        Ok(match priority {
            Some(Value::Integer(priority)) => u8::try_from(*priority).unwrap_or(0),
            _ => 0,
        })
    }

    fn with(args: &RosArgs, description: Option<ParameterOverride>) -> Result<Self, NodeError> {
        let names = Resolver::new(P::NODE_NAME, args).map_err(RosError::from)?;
        let node = names.node().fully_qualified();
        let (mut given, mut warnings) = given::<P>(&names, &node, args)?;
        given.extend(description);
        let (store, ignored) = P::start(&node, given)?;
        warnings.extend(ignored);
        let logging = Logging::new(args, LogLevel::Info);
        Ok(Self { names, parameters: P::from_store(&store)?, store, logging, warnings })
    }

    /// Returns the parameters.
    pub fn parameters(&self) -> &P {
        &self.parameters
    }

    /// Returns the warnings about the command line, one line each. A node logs them when it starts.
    pub fn warnings(&self) -> &[String] {
        &self.warnings
    }

    /// Returns the node's fully qualified name.
    pub fn node(&self) -> String {
        self.names.node().fully_qualified()
    }
}

/// The reason why a node that is shutting down takes no parameters.
pub(super) const CYCLE_ENDED: &str = "the node's cycle has ended";

/// Returns the parameters from the command line in their order, and the warnings about them.
fn given<P: NodeParameters>(
    names: &Resolver,
    node: &str,
    args: &RosArgs,
) -> Result<(Vec<ParameterOverride>, Vec<String>), ParameterError> {
    let (mut values, mut warnings) = (Vec::new(), Vec::new());
    for given in &args.overrides {
        match given {
            Override::File(path) => {
                let file = path.display().to_string();
                let found = FileParameters::open(path, node)?;
                warnings.extend(passes_by::<P>(&found, &file, node));
                values.extend(found.given);
            }
            Override::Builtin { name, text } => {
                values.extend(FileParameters::read(text, name, node)?.given);
            }
            Override::Parameter { node: only, name, yaml } => {
                if only.as_deref().is_none_or(|only| only == names.node().name()) {
                    // A description such as `-p robot_description:="$(xacro robot.urdf.xacro)"` is passed unquoted and is not YAML.
                    let is_xml = name == "robot_description" && yaml.trim_start().starts_with('<');
                    values.push(ParameterOverride {
                        name: name.clone(),
                        value: if is_xml { Value::String(yaml.clone()) } else { Value::from_yaml(yaml)? },
                        source: format!("-p {name}:={}", cut(yaml)),
                        // A parameter meant for another node is not a misspelling of one of ours.
                        by_name: only.is_some() || is_misspelt(name, dq_config::names()?),
                    });
                }
            }
        }
    }
    Ok((values, warnings))
}

/// Returns a warning about a file that has parameters neither for this node nor for another kind of our nodes, with which it may be shared.
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
