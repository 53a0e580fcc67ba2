//! Help texts that are generated from the wire contract and the parameters' declarations.

use super::error::Usage;
use clap::error::ErrorKind;
use dq_config::NodeParameters;
use dq_messages::{Direction, NodeContract};
use dq_params::Declaration;
use dq_wire::Contract;

/// The syntax of ROS 2 arguments.
pub(super) const ROS_ARGS: &str = "\
ROS 2 arguments, after --ros-args:
  -r __ns:=/left                in the namespace /left
  -r __node:=name               under another name
  -r goal_pose:=/target         with another name of a topic or service
  -p controller:=diffc          with another value of a parameter, as YAML
  --params-file arm.yaml        with the parameters of a ROS 2 parameter file
  --log-level debug             also info, warn, error
  --enclave /name               with the keys of this enclave, if ROS_SECURITY_ENABLE=true
The domain is ROS_DOMAIN_ID.";

/// The help on the interfaces of `goal`.
pub(super) const GOAL: &str = "\
The goal is a geometry_msgs/msg/PoseStamped on goal_pose (--dual: relative_goal), or with --joints a
sensor_msgs/msg/JointState on dq_servo/joint_goal; its outcome is read from dq_servo/status (dq_dual_servo/status). For a servo in another namespace: --ros-args -r __ns:=/left.
Exit code 0: arrived. 1: not arrived, with the reason; dq_servo/stop then withdraws the goal, unless --keep-going.
Gains, limits and tolerances are the servo's parameters: dq_servo param list.";

/// Returns the explanation of a table of motions. `own` explains the last columns, which only the calling command has.
pub(super) fn figures(own: &str) -> String {
    format!("{FIGURES}\n{own}")
}

const FIGURES: &str = "\
The table has a row for each motion to a goal:
  settled    the times after which the errors of rotation and position stayed within 2 % of their initial values, or
             within the goal's tolerance if that is wider
  path       the length of the tool's path, and its ratio to the distance from start to end (- if these coincide)
  overshoot  how far the tool went past the goal, along the line from the start, or from its position when the goal
             last moved
  peak       the largest commanded joint speed
  effort     the integral of the sum of the squares of all commanded joint speeds, rad and m alike
  error      the errors of position and rotation at the end";

/// The explanation of the last columns of `demo`.
pub(super) const OF_DEMO: &str = "\
  at goal    when the tolerances were first met
Below the table: how late the servo's cycles woke (the bound of 99 % of them, and the maximum) in the worse motion";

/// The explanation of the last column of `plot`, and of the columns that a bag without commands leaves empty.
pub(super) const OF_PLOT: &str = "\
  at goal    when the tolerances were first met
Peak and effort are those of the commands, or of the measured speeds if the bag has no commands; - if it has neither.";

/// The help on the names and values of parameters.
pub(super) const PARAM: &str = "\
Examples:
  dq_servo param list                              every parameter of /dq_servo with its value
  dq_servo param set controller diffc
  dq_servo param set /left/dq_servo gains.logc '[1.0, 2.0]'
  dq_servo param describe limits.joint_velocity
  dq_servo param docs                              every parameter of every node, as a table
  dq_servo param dump > now.yaml                   for --params-file now.yaml, or:
  dq_servo param load now.yaml
A NODE without a slash is in the namespace that --ros-args -r __ns:=/left gives. Values are YAML. An integer
is accepted for a double (rclcpp refuses it), and [] for an empty list of any type.";

/// Returns the help on a node: topics, services and parameters, and how to change their names and values.
pub(super) fn node<P: NodeParameters>(
    contract: impl Fn(Contract) -> NodeContract,
    services: &[(&str, &str)],
) -> String {
    let topics = Contract::builtin().map(|all| topics(&contract(all))).unwrap_or_default();
    let services: String = services.iter().map(|(name, what)| format!("  {name:<46}{what}\n")).collect();
    let services = if services.is_empty() { services } else { format!("Services:\n{services}\n") };
    let parameters = P::declarations().map(|all| all.iter().map(parameter).collect());
    let parameters: String = parameters.unwrap_or_else(|why| format!("  {why}\n"));
    format!("Topics:\n{topics}\n{services}Parameters:\n{parameters}\n{ROS_ARGS}")
}

fn topics(contract: &NodeContract) -> String {
    let width = contract.topics().map(|(name, _)| name.len()).max().unwrap_or(0) + 2;
    let line = |(name, topic): (&str, &dq_messages::TopicContract)| {
        let direction = if topic.direction == Direction::In { "in " } else { "out" };
        format!("  {direction} {name:<width$}{}\n", topic.message)
    };
    contract.topics().map(line).collect()
}

fn parameter(declared: &Declaration) -> String {
    let default = declared.default.to_string();
    let unit = if declared.unit.is_empty() { String::new() } else { format!(" [{}]", declared.unit) };
    let when = if declared.read_only { ", fixed at the start" } else { "" };
    let value = if default == "[]" || default == "\"\"" { String::new() } else { format!(" ({default})") };
    format!("  {:<31} {}{unit}{value}{when}\n", declared.name, declared.description)
}

/// Arguments that every ROS 2 node takes after `--ros-args`.
const ROS_SWITCHES: [&str; 8] =
    ["-p", "--param", "-r", "--remap", "-e", "--enclave", "--params-file", "--log-level"];

/// Describes an error in the command line in one line: the error, a suggestion, and how to get help. `path` is the name of the
/// program, followed by the recognized subcommands. `arguments` are all arguments of the program.
pub(super) fn usage(mistake: &clap::Error, path: &str, arguments: &[String]) -> Usage {
    if let Some(switch) = arguments.iter().find(|argument| ROS_SWITCHES.contains(&argument.as_str())) {
        return Usage(format!("ROS arguments come after --ros-args: {path} ... --ros-args {switch} ..."));
    }
    if mistake.kind() == ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand {
        return Usage(format!("a subcommand is missing (see {path} --help)"));
    }
    let text = mistake.to_string();
    let is_ours = |part: &&str| !part.starts_with("Usage:") && !part.starts_with("For more information");
    let parts = text.split("\n\n").map(str::trim).take_while(is_ours);
    let line = |part: &str| part.split_whitespace().collect::<Vec<_>>().join(" ");
    let words = parts.map(line).collect::<Vec<_>>().join("; ");
    Usage(format!("{} (see {path} --help)", words.trim_start_matches("error: ")))
}

/// Returns the program's name followed by the subcommands at the start of `arguments`.
pub(super) fn path(command: &clap::Command, arguments: &[String]) -> String {
    let (mut command, mut path) = (command, command.get_name().to_owned());
    while let Some(next) =
        arguments.get(path.split(' ').count() - 1).and_then(|name| command.find_subcommand(name))
    {
        path = format!("{path} {}", next.get_name());
        command = next;
    }
    path
}
