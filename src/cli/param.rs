//! `dq_servo param`: a running node's parameters.

use super::error::{Error, failed};
use super::find::{Kind, PATIENCE, check_is_node, there};
use super::print::{StdoutError, print_line};
use super::{Usage, parameter_file};
use clap::Subcommand;
use dq_common::text;
use dq_config::{NodeParameters, ServoParameters};
use dq_messages::ParameterDescriptor;
use dq_params::{ParameterOverride, Value, nearest};
use dq_ros::ros::names::NodeName;
use dq_ros::ros::{
    Environment, LogLevel, Logging, Node, ParameterClient, Resolver, RosArgs, RosError, Session,
};

/// List, get, set, describe, dump or load a running node's parameters
#[derive(clap::Args)]
pub(super) struct Param {
    #[command(subcommand)]
    action: Action,
}

#[derive(Subcommand)]
enum Action {
    /// List names and values: [NODE]
    List {
        /// The node; /dq_servo if left out
        #[arg(value_name = "NODE")]
        words: Vec<String>,
    },
    /// Print a value; a text is printed without quotes: [NODE] NAME
    #[command(override_usage = "dq_servo param get [NODE] NAME")]
    Get {
        /// The node (/dq_servo if left out) and the parameter
        #[arg(value_name = "WORDS")]
        words: Vec<String>,
    },
    /// Set a value: [NODE] NAME VALUE
    #[command(override_usage = "dq_servo param set [NODE] NAME VALUE")]
    Set {
        /// The node (/dq_servo if left out), the parameter and its value as YAML
        #[arg(allow_hyphen_values = true, value_name = "WORDS")]
        words: Vec<String>,
    },
    /// Print type, range and meaning: [NODE] NAME
    #[command(override_usage = "dq_servo param describe [NODE] NAME")]
    Describe {
        /// The node (/dq_servo if left out) and the parameter
        #[arg(value_name = "WORDS")]
        words: Vec<String>,
    },
    /// Print all values in the format of a parameter file (--params-file, `param load`): [NODE]
    Dump {
        /// The node; /dq_servo if left out
        #[arg(value_name = "NODE")]
        words: Vec<String>,
    },
    /// Print all parameters of all nodes, with type, range and meaning, as a table in Markdown
    Docs,
    /// Set the parameters of a file, all or none: [NODE] FILE
    #[command(override_usage = "dq_servo param load [NODE] FILE")]
    Load {
        /// The node (/dq_servo if left out) and the file
        #[arg(value_name = "WORDS")]
        words: Vec<String>,
    },
}

impl Action {
    /// Returns the words that the user gave, the number of words that must follow the name of the node, and the usage of the
    /// subcommand.
    fn words(&self) -> (&[String], usize, &'static str) {
        match self {
            Self::Docs => (&[], 0, "param docs"),
            Self::List { words } => (words, 0, "param list [NODE]"),
            Self::Dump { words } => (words, 0, "param dump [NODE]"),
            Self::Get { words } => (words, 1, "param get [NODE] NAME"),
            Self::Describe { words } => (words, 1, "param describe [NODE] NAME"),
            Self::Load { words } => (words, 1, "param load [NODE] FILE"),
            Self::Set { words } => (words, 2, "param set [NODE] NAME VALUE"),
        }
    }
}

impl Param {
    pub(super) async fn run(&self, ros_args: &RosArgs) -> super::Result<()> {
        if let Action::Docs = self.action {
            return Ok(print_line!("{}", dq_config::table()?.trim_end())?);
        }
        let (words, after_node, usage) = self.action.words();
        if !(after_node..=after_node + 1).contains(&words.len()) {
            let verb = usage.split(" [").next().unwrap_or(usage);
            return Err(Usage(format!("expected {usage}, got {words:?} (see dq_servo {verb} --help)")).into());
        }
        let names = Resolver::new("dq_servo_param", ros_args)?;
        let (node, rest) = match words.split_first() {
            Some((node, rest)) if rest.len() == after_node => (node.as_str(), rest),
            _ => (ServoParameters::NODE_NAME, words),
        };
        check_is_node(node, &dq_config::names()?, usage)?;
        let target = names.service(node)?;
        NodeName::parse(&target)?;
        let value = rest.get(1).map(|text| Value::from_yaml(text)).transpose()?;
        let file = match (&self.action, rest) {
            (Action::Load { .. }, [file]) => Some(parameter_file::read(file, &target)?),
            _ => None,
        };
        let session = Session::open(&Environment::from_process(ros_args)?)?;
        let mut node = session.node(names, Logging::new(ros_args, LogLevel::Warn))?;
        let asked = rest.first().map(String::as_str).unwrap_or_default();
        let done = self.act(&mut node, &target, asked, value, file).await;
        done.map_err(|why| explain(why, &node, &target))?;
        super::warn(node.watch_name(&target).warning().as_slice());
        Ok(())
    }

    /// Performs the action on the node `target`.
    async fn act(
        &self,
        node: &mut Node,
        target: &str,
        asked: &str,
        value: Option<Value>,
        file: Option<Vec<ParameterOverride>>,
    ) -> super::Result<()> {
        match (&self.action, value) {
            (Action::Load { .. }, _) => {
                parameter_file::load(client(node, target), file.unwrap_or_default()).await?
            }
            (Action::Set { .. }, Some(value)) => {
                set(client(node, target), asked, &value).await?;
                print_line!("{asked}: {value}")?;
            }
            (Action::Dump { .. }, _) => {
                let values = client(node, target).all().await?;
                print_line!("{}", parameter_file::text(target, &values))?;
            }
            (Action::Describe { .. }, _) => match client(node, target).describe(asked).await? {
                Some(descriptor) => describe(&descriptor)?,
                None => return Err(unknown(client(node, target), target, asked).await),
            },
            (Action::Get { .. }, _) => match client(node, target).get(asked).await? {
                // Print a text without quotes, so that a robot description can be redirected to a file.
                Some(Value::String(text)) => print_line!("{}", text::shown_lines(&text))?,
                Some(value) => print_line!("{value}")?,
                None => return Err(unknown(client(node, target), target, asked).await),
            },
            (Action::List { .. } | Action::Set { .. } | Action::Docs, _) => {
                for (name, value) in client(node, target).all().await? {
                    print_line!("{name}: {value}")?;
                }
            }
        }
        Ok(())
    }
}

/// Returns the error `why`. If `why` is the failure of a service call and the node `target` is not running, adds the names of the
/// servos and simulated arms that are running.
fn explain(why: Error, node: &Node, target: &str) -> Error {
    let is_there = node.services().contains(&format!("{target}/list_parameters"));
    if is_there || !matches!(why, Error::Ros(RosError::Service { .. })) {
        return why;
    }
    match there(&[Kind::Servo, Kind::Plant], node) {
        None => why,
        Some(there) => failed!("{why} There is {there}"),
    }
}

fn client<'a>(node: &'a mut Node, target: &str) -> ParameterClient<'a> {
    ParameterClient::new(node, target, PATIENCE)
}

async fn set(mut parameters: ParameterClient<'_>, name: &str, value: &Value) -> super::Result<()> {
    Ok(parameters.set(name, value).await?.map_err(Usage)?)
}

/// Returns the error for a parameter that the node does not have.
async fn unknown(mut parameters: ParameterClient<'_>, target: &str, name: &str) -> Error {
    let known = parameters.list().await.unwrap_or_default();
    let hint = match nearest(name, known.iter().map(String::as_str)) {
        Some(near) => format!(": did you mean {near:?}?"),
        None => " (see dq_servo param list)".to_owned(),
    };
    Usage(format!("{target} has no parameter {name:?}{hint}")).into()
}

fn describe(descriptor: &ParameterDescriptor) -> Result<(), StdoutError> {
    let read_only = if descriptor.read_only { " (read-only)" } else { "" };
    print_line!("{}: {}{read_only}", descriptor.name, descriptor.type_name())?;
    print_line!("  {}", descriptor.description)?;
    if !descriptor.additional_constraints.is_empty() {
        print_line!("  {}", descriptor.additional_constraints)?;
    }
    Ok(())
}
