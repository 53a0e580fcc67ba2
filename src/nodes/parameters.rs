//! What a node is before it joins the graph: its names and its parameters.

use super::NodeError;
use dq_common::text::cut;
use dq_config::{DualParameters, NodeParameters, ServoParameters};
use dq_params::{FileParameters, Given, ParameterError, ParameterStore, Value, is_misspelt};
use dq_ros::ros::args::{Override, RosArgs};
use dq_ros::ros::{LogLevel, Logging, Resolver, RosError};

/// A node's names and checked parameters: nothing of it can fail any more but the network.
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
    /// The node that the command line asks for.
    ///
    /// # Errors
    /// [`NodeError`] for names and parameters that are not right.
    pub fn new(args: &RosArgs) -> Result<Self, NodeError> {
        Self::with(args, None)
    }

    /// The node that the command line asks for, with a `robot_description` that came by topic.
    ///
    /// # Errors
    /// [`NodeError`] for names and parameters that are not right, and a description that gives no arm.
    pub(super) fn described(args: &RosArgs, text: String) -> Result<Self, NodeError> {
        let name = "robot_description";
        Self::with(args, Some(Given::new(name, Value::String(text), name)))
    }

    /// The node that the command line asks for, as far as it says so: none where it names the frames of an arm, and leaves it to a topic to
    /// describe what is between them.
    ///
    /// # Errors
    /// [`NodeError`] for names and parameters that are not right.
    pub fn unless_awaited(args: &RosArgs) -> Result<Option<Self>, NodeError> {
        let names = Resolver::new(P::NODE_NAME, args).map_err(RosError::from)?;
        let (given, _) = given::<P>(&names, &names.node().fully_qualified(), args)?;
        if dq_config::is_awaited(&given) { Ok(None) } else { Self::new(args).map(Some) }
    }

    /// The `realtime_priority` that the command line gives the node, before it is checked with the rest; 0 where it gives none.
    ///
    /// # Errors
    /// [`NodeError`] for names and parameters that are not right.
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

    fn with(args: &RosArgs, description: Option<Given>) -> Result<Self, NodeError> {
        let names = Resolver::new(P::NODE_NAME, args).map_err(RosError::from)?;
        let node = names.node().fully_qualified();
        let (mut given, mut warnings) = given::<P>(&names, &node, args)?;
        given.extend(description);
        let (store, ignored) = P::start(&node, given)?;
        warnings.extend(ignored);
        let logging = Logging::new(args, LogLevel::Info);
        Ok(Self { names, parameters: P::from_store(&store)?, store, logging, warnings })
    }

    /// The parameters.
    pub fn parameters(&self) -> &P {
        &self.parameters
    }

    /// What is odd about what the command line gives, a line each; a node that starts logs it.
    pub fn warnings(&self) -> &[String] {
        &self.warnings
    }

    /// The node's fully qualified name.
    pub fn node(&self) -> String {
        self.names.node().fully_qualified()
    }
}

/// Why parameters are not taken by a node that is about to go.
pub(super) const CYCLE_ENDED: &str = "the node's cycle has ended";

/// What the command line gives the node, in its order, and what to warn of.
fn given<P: NodeParameters>(
    names: &Resolver,
    node: &str,
    args: &RosArgs,
) -> Result<(Vec<Given>, Vec<String>), ParameterError> {
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
                    // A description is given as it is, `-p robot_description:="$(xacro robot.urdf.xacro)"`, and is no YAML.
                    let is_xml = name == "robot_description" && yaml.trim_start().starts_with('<');
                    values.push(Given {
                        name: name.clone(),
                        value: if is_xml { Value::String(yaml.clone()) } else { Value::from_yaml(yaml)? },
                        source: format!("-p {name}:={}", cut(yaml)),
                        // Whoever meant another node's parameter does not write one of ours with a mistake.
                        by_name: only.is_some() || is_misspelt(name, dq_config::names()?),
                    });
                }
            }
        }
    }
    Ok((values, warnings))
}

/// What to say of a file that has nothing for this node, nor for one of another kind of ours that it may be shared with.
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
