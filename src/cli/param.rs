//! `dq_servo param`: a running node's parameters.

use super::Usage;
use super::print::{StdoutError, print_line};
use crate::config::{NodeParameters, ServoParameters, Value};
use crate::ros::names::NodeName;
use crate::ros::{
    Environment, LogLevel, ParameterClient, ParameterDescriptor, Resolver, RosArgs, RosError, Session,
};
use clap::Subcommand;
use std::time::Duration;

/// How long to wait for the node and for each answer.
const PATIENCE: Duration = Duration::from_secs(5);

/// List, get, set or describe a running node's parameters
#[derive(clap::Args)]
pub(super) struct Param {
    #[command(subcommand)]
    action: Action,
}

#[derive(Subcommand)]
enum Action {
    /// List the names: [NODE]
    List {
        /// The node; /dq_servo if left out
        #[arg(num_args = 0..=1, value_name = "NODE")]
        words: Vec<String>,
    },
    /// Print a value: [NODE] NAME
    Get {
        /// The node (/dq_servo if left out) and the parameter
        #[arg(num_args = 1..=2, required = true, value_names = ["NODE", "NAME"])]
        words: Vec<String>,
    },
    /// Set a value: [NODE] NAME VALUE
    Set {
        /// The node (/dq_servo if left out), the parameter and its value as YAML
        #[arg(num_args = 2..=3, required = true, allow_hyphen_values = true, value_names = ["NODE", "NAME", "VALUE"])]
        words: Vec<String>,
    },
    /// Print type, range and meaning: [NODE] NAME
    Describe {
        /// The node (/dq_servo if left out) and the parameter
        #[arg(num_args = 1..=2, required = true, value_names = ["NODE", "NAME"])]
        words: Vec<String>,
    },
}

impl Param {
    pub(super) async fn run(&self, ros_args: &RosArgs) -> anyhow::Result<()> {
        let (words, expected) = match &self.action {
            Action::List { words } => (words, 0),
            Action::Get { words } | Action::Describe { words } => (words, 1),
            Action::Set { words } => (words, 2),
        };
        let names = Resolver::new("dq_servo_param", ros_args).map_err(RosError::from)?;
        let (target, rest) = match words.len() > expected {
            true => (names.service(&words[0]).map_err(RosError::from)?, &words[1..]),
            false => (names.service(ServoParameters::NODE_NAME).map_err(RosError::from)?, &words[..]),
        };
        NodeName::parse(&target)?;
        let value = rest.get(1).map(|text| Value::from_yaml(text)).transpose()?;
        let session = Session::open(&Environment::from_process(ros_args)?)?;
        let mut node = session.node(names, ros_args.log_level.unwrap_or(LogLevel::Warn))?;
        let mut parameters = ParameterClient::new(&mut node, &target, PATIENCE);
        let unknown =
            |name: &str| Usage(format!("{target} has no parameter {name:?} (see dq_servo param list)"));
        let name = rest.first().map(String::as_str).unwrap_or_default();
        match (&self.action, value) {
            (Action::List { .. }, _) => {
                for name in parameters.list().await? {
                    print_line!("{name}")?;
                }
            }
            (Action::Get { .. }, _) => {
                print_line!("{}", parameters.get(name).await?.ok_or_else(|| unknown(name))?)?
            }
            (Action::Describe { .. }, _) => {
                describe(&parameters.describe(name).await?.ok_or_else(|| unknown(name))?)?
            }
            (Action::Set { .. }, Some(value)) => parameters.set(name, &value).await?.map_err(Usage)?,
            (Action::Set { .. }, None) => return Err(Usage("set needs a NAME and a VALUE".to_owned()).into()),
        }
        Ok(())
    }
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
