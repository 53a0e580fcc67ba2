//! Help that is made from what the nodes are made from: the wire contract and the parameters' declarations.

use super::error::Usage;
use clap::error::ErrorKind;
use dq_config::NodeParameters;
use dq_messages::{Direction, NodeContract};
use dq_params::Declaration;
use dq_wire::Contract;

/// How ROS 2 arguments are given.
pub(super) const ROS_ARGS: &str = "\
ROS 2 arguments, after --ros-args:
  -r __ns:=/left                in the namespace /left
  -r __node:=name               under another name
  -r goal_pose:=/target         with another topic or service
  -p controller:=diffc          with another parameter, whose value is YAML
  --params-file arm.yaml        with the parameters of a ROS 2 parameter file
  --log-level debug             also info, warn, error
  --enclave /name               with these keys, where ROS_SECURITY_ENABLE=true
The domain is ROS_DOMAIN_ID.";

/// What `goal` talks to.
pub(super) const GOAL: &str = "\
The goal is a geometry_msgs/msg/PoseStamped on goal_pose (--dual: relative_goal); what becomes of it is read from
dq_servo/status (dq_dual_servo/status). For a servo in another namespace: --ros-args -r __ns:=/left.
Exit code 0: arrived. 1: not, with the reason; the goal is then withdrawn by dq_servo/stop, unless --keep-going.
Gains, limits and tolerances are the servo's parameters: dq_servo param list.";

/// The columns of a table of motions, with these last ones of its own.
pub(super) fn figures(own: &str) -> String {
    format!("{FIGURES}\n{own}")
}

const FIGURES: &str = "\
The table, a row for each motion to a goal:
  settled    when the error of rotation, and of position, was within 2 % of what it was at first, or within the
             goal's tolerance where that is wider, for good
  path       how long the tool's path is, and that by the distance from its start to its end (- where these are one place)
  overshoot  how far the tool went past the goal, along the line from the start, or from where it was when the goal
             last moved
  peak       the fastest joint that was commanded
  effort     the integral of the squares of all joint speeds that were commanded, rad and m alike
  error      the errors of position and rotation at the end";

/// The last columns of `demo`.
pub(super) const OF_DEMO: &str = "\
  at goal    when the tolerances were first met
Below it: how late the servo's cycles woke since a goal came, 99 % of them and the latest, in the worse of the motions";

/// The last column of `plot`, and what it takes of a bag that has not all.
pub(super) const OF_PLOT: &str = "\
  at goal    when the tolerances were first met
Peak and effort are of the commands; without them in the bag, of the measured speeds; - means that it has neither.
A star at a motion's number: it began before the bag, and a line below the table has by how much.";

/// How parameters are named and written.
pub(super) const PARAM: &str = "\
Examples:
  dq_servo param list                              every parameter of /dq_servo with its value
  dq_servo param set controller diffc
  dq_servo param set /left/dq_servo gains.logc '[1.0, 2.0]'
  dq_servo param describe limits.joint_velocity
  dq_servo param docs                              every parameter of every node, as a table
  dq_servo param dump > now.yaml                   for --params-file now.yaml, or:
  dq_servo param load now.yaml
NODE without a slash is in the namespace that --ros-args -r __ns:=/left gives. Values are YAML; an integer
is taken where a double is meant (rclcpp would refuse it), and [] for an empty list of any type.";

/// What a node has on the wire, its parameters, and how both are changed.
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

/// The mistake on one line: what is wrong, what may have been meant, and where the help is. `path` is the program with the
/// subcommands that were recognized, `arguments` what it was given.
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

/// The program with the subcommands that `arguments` begin with.
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
