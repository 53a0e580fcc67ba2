//! The command line: one file per subcommand, and one place for exit codes.

mod arm;
mod call;
mod count;
mod error;
mod exit;
mod find;
mod goal;
mod help;
mod joint_positions;
mod not_arrived;
mod own_goal;
#[cfg(test)]
mod pages;
mod param;
mod parameter_file;
mod permissions;
mod pose;
mod print;
mod recording;
mod run;
mod shell;
mod signals;
mod spinner;
mod status;
mod tools;
mod watch;

use call::ServiceCall;
use clap::{CommandFactory, Parser, Subcommand};
use dq_config::{DualParameters, GuardParameters, NodeParameters, PlantParameters, ServoParameters};
use dq_nodes::Prepared;
use dq_ros::ros::args::Override;
use dq_ros::ros::{Resolver, RosArgs, args};
use dq_wire::ServoKind;
use error::{Error, Result, Usage};
use std::ffi::OsString;
use std::io::IsTerminal;
use std::process::ExitCode;

/// Moves a simulated arm with dual-quaternion control laws over ROS 2.
///
/// Every subcommand takes ROS 2 arguments: --ros-args -r from:=to -r __ns:=/left -p name:=value --params-file file.yaml
#[derive(Parser)]
#[command(version, name = "dq_servo", after_long_help = help::ROS_ARGS)]
struct Cli {
    #[command(subcommand)]
    command: Option<Command>,
}

#[derive(Subcommand)]
enum Command {
    /// Run the servo node
    #[command(after_long_help = help::node::<ServoParameters>(|all| all.servo.with(all.pictures), of_servos(ServoKind::OneArm)))]
    Servo(arm::RobotChoice),
    /// Run the servo node for two arms in the namespaces left and right
    #[command(after_long_help = help::node::<DualParameters>(|all| all.dual.with(all.pictures), of_servos(ServoKind::TwoArms)))]
    Dual(arm::ArmChoice),
    /// Run a simulated arm: a built-in one, one from DH rows, or one from a robot description
    #[command(after_long_help = help::node::<PlantParameters>(|all| all.plant, &OF_PLANTS))]
    Arm(arm::RobotChoice),
    /// Run the simulated PUMA 560
    #[command(after_long_help = help::node::<PlantParameters>(|all| all.plant, &OF_PLANTS))]
    Puma560,
    /// Run the guard, which stops a moving arm if the servo's commands cease
    #[command(after_long_help = help::node::<GuardParameters>(|all| all.guard, &[]))]
    Guard(arm::RobotChoice),
    /// Send the arm to a pose and wait until it has arrived
    #[command(after_long_help = help::GOAL)]
    Goal(goal::Goal),
    /// Bring the arm to rest and drop the goal
    Stop(find::Targets),
    /// Bring the arm to rest and keep the goal
    Pause(find::Targets),
    /// Let a paused servo continue
    Resume(find::Targets),
    /// Let a stalled arm go to the configuration that the servo found, from which it can reach the goal
    Reconfigure(find::Targets),
    /// Put the simulated arm back to its start
    Reset(find::Targets),
    /// Print what the servo is doing
    Status(status::Status),
    /// Print the tool pose of joint positions
    Pose(pose::Pose),
    /// List, get, set, describe, dump or load a running node's parameters
    #[command(after_long_help = help::PARAM)]
    Param(param::Param),
    /// Print the permissions of an enclave of a secured graph; launch_scripts/dq_servo_keystore.sh signs them
    #[command(hide = true)]
    Permissions(permissions::Permissions),
    /// Print the completions for a shell: dq_servo completions bash > ~/.local/share/bash-completion/completions/dq_servo
    Completions(shell::Completions),
    /// Print the manual page: dq_servo man > ~/.local/share/man/man1/dq_servo.1
    Man,
    #[command(flatten)]
    Tools(tools::Command),
}

/// The services of a servo, for its help. Only a servo for one arm has the last two.
const OF_SERVOS: [(&str, &str); 6] = [
    ("~/pause", "std_srvs/srv/SetBool: true decelerates and holds, false goes on"),
    ("~/stop", "std_srvs/srv/Trigger: decelerates and drops the goal"),
    (
        "~/reconfigure",
        "std_srvs/srv/Trigger: lets a stalled arm go to another configuration that reaches the goal",
    ),
    (
        "~/goal/get_interactive_markers",
        "visualization_msgs/srv/GetInteractiveMarkers: the goal, to be dragged",
    ),
    ("~/tare", "std_srvs/srv/Trigger: the present wrench counts as no contact"),
    (
        "~/identify_tool",
        "std_srvs/srv/SetBool: true begins, false ends and says the mass on the sensor and its center",
    ),
];

/// Returns the services of a servo of this kind.
fn of_servos(kind: ServoKind) -> &'static [(&'static str, &'static str)] {
    match kind {
        ServoKind::OneArm => &OF_SERVOS,
        ServoKind::TwoArms => &OF_SERVOS[..OF_SERVOS.len() - 2],
    }
}

/// The services of a simulated arm, for its help.
const OF_PLANTS: [(&str, &str); 1] = [("~/reset", "std_srvs/srv/Trigger: back to initial_positions")];

/// Runs the program with these arguments, which do not include the program's name.
pub fn main(arguments: impl Iterator<Item = OsString>) -> ExitCode {
    exit::catch(|| {
        env_logger::Builder::from_env(env_logger::Env::default().default_filter_or("off")).init();
        exit::code(signals::ignore_others().map_err(Error::from).and_then(|()| run(arguments)))
    })
}

fn run(arguments: impl Iterator<Item = OsString>) -> Result<()> {
    let arguments = arguments.map(|argument| {
        argument.into_string().map_err(|other| Usage(format!("the argument {other:?} is not UTF-8")))
    });
    let (ours, ros_args) = args::split(arguments.collect::<Result<Vec<_>, _>>()?)?;
    let ours: Vec<_> = ours.into_iter().map(plain_number).collect();
    match Cli::try_parse_from(std::iter::once("dq_servo".to_owned()).chain(ours.iter().cloned())) {
        Ok(Cli { command: Some(command) }) => execute(command, &ros_args),
        // A user at a terminal sees at once that the arm of the demo moves. But a script without a subcommand must not move
        // anything.
        Ok(Cli { command: None }) if std::io::stdout().is_terminal() => {
            execute(Command::Tools(tools::Command::default()), &ros_args)
        }
        Ok(Cli { command: None }) => Ok(Cli::command().print_help().map_err(print::StdoutError::from)?),
        // Help and version are not failures: clap prints them to stdout.
        Err(help) if !help.use_stderr() => Ok(help.print().map_err(print::StdoutError::from)?),
        Err(mistake) => Err(help::usage(&mistake, &help::path(&Cli::command(), &ours), &ours).into()),
    }
}

/// Rewrites a negative number that clap would take for an option, such as `-6.1e-17` or `-.5`. The rewritten number has no
/// exponent, and has a digit before the point. Returns other arguments unchanged.
fn plain_number(argument: String) -> String {
    let is_misread =
        argument.starts_with("-.") || ["e-", "e+", "E-", "E+"].iter().any(|sign| argument.contains(sign));
    let is_negative = is_misread && argument.starts_with('-');
    match argument.parse().ok().filter(|number: &f64| is_negative && number.is_finite()) {
        Some(whole) if whole.fract() == 0.0 => format!("{whole}.0"),
        Some(number) => number.to_string(),
        None => argument,
    }
}

/// Prepares the servo's parameters from ROS arguments, for a command that is not a node. Prints warnings. A parameter without a
/// node's name applies to this command.
fn offline(mut ros_args: RosArgs) -> Result<Prepared<ServoParameters>> {
    let name = Resolver::new(ServoParameters::NODE_NAME, &ros_args)?.node().name().to_owned();
    for given in &mut ros_args.overrides {
        if let Override::Parameter { node, .. } = given {
            node.get_or_insert_with(|| name.clone());
        }
    }
    let prepared = Prepared::new(&ros_args)?;
    warn(prepared.warnings());
    Ok(prepared)
}

/// Prints the warnings of a command that has no log.
fn warn(warnings: &[String]) {
    warnings.iter().for_each(|warning| dq_ros::stderr::line(format!("warning: {warning}")));
}

fn execute(command: Command, ros_args: &RosArgs) -> Result<()> {
    let command = match command {
        Command::Pose(pose) => return pose.run(ros_args),
        Command::Permissions(permissions) => return permissions.run(ros_args),
        Command::Completions(completions) => return completions.run(),
        Command::Man => return shell::man(),
        Command::Tools(tools::Command::Offline(tool)) => return tool.run(ros_args),
        online => online,
    };
    // One worker thread is enough for everything except the cycles, which have their own threads.
    let runtime = tokio::runtime::Builder::new_multi_thread().worker_threads(1).enable_all().build()?;
    let result = runtime.block_on(async {
        match command {
            Command::Servo(arm) => run::servo::<ServoParameters>(&arm.and(ros_args)).await,
            Command::Dual(arm) => run::servo::<DualParameters>(&arm.and(ros_args)).await,
            Command::Arm(arm) => run::plant(&arm.of_plant(ros_args)).await,
            Command::Puma560 => run::plant(ros_args).await,
            Command::Guard(arm) => run::guard(&arm.and(ros_args)).await,
            Command::Goal(goal) => goal.run(ros_args).await,
            Command::Stop(targets) => call::call(ServiceCall::Stop, &targets, ros_args).await,
            Command::Pause(targets) => call::call(ServiceCall::Pause, &targets, ros_args).await,
            Command::Resume(targets) => call::call(ServiceCall::Resume, &targets, ros_args).await,
            Command::Reconfigure(targets) => call::call(ServiceCall::Reconfigure, &targets, ros_args).await,
            Command::Reset(targets) => call::call(ServiceCall::Reset, &targets, ros_args).await,
            Command::Status(status) => status.run(ros_args).await,
            Command::Param(param) => param.run(ros_args).await,
            Command::Tools(tools::Command::Online(tool)) => tool.run(ros_args).await,
            Command::Tools(tools::Command::Offline(_)) => Ok(()),
            Command::Pose(_) | Command::Permissions(_) | Command::Completions(_) | Command::Man => Ok(()),
        }
    });
    // A blocked task, such as a write to a stopped terminal, must not keep the program alive.
    runtime.shutdown_background();
    result
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_numbers_that_clap_takes_for_options_are_written_otherwise() {
        for (given, plain) in [
            ("-6.1e-17", "-0.000000000000000061"),
            ("-.5", "-0.5"),
            ("-.5e1", "-5.0"),
            ("-2E+0", "-2.0"),
            ("-9007199254740993", "-9007199254740993"),
            ("-1e5", "-1e5"),
            ("-1.", "-1."),
            ("-1.50", "-1.50"),
            ("0.5", "0.5"),
            ("-x", "-x"),
        ] {
            assert_eq!(plain_number(given.to_owned()), plain, "{given}");
        }
    }
}
