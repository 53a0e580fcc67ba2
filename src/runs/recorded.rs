//! Reads the runs of a bag as curves, from the reports of its servos and from the joint states. Reads the bag twice, first for the
//! announced parameters, then for everything else. Never keeps the whole bag in memory.

use super::announced::{Announced, AnnouncedParameters};
use super::given_goals::GivenGoals;
use super::reader::{Reader, RunReader};

use super::{RecordedRun, RunError};
use dq_bags::{Bag, BagMessage, UnreadableParts};
use dq_common::text::{NAME, shown};
use dq_config::ServoParameters;
use dq_wire::ServoKind;
use std::collections::HashMap;
use std::path::Path;
use std::sync::Arc;

/// The types of messages from which the curves are made.
const TYPES: [&str; 7] = [
    "sensor_msgs/msg/JointState",
    "std_msgs/msg/Float64MultiArray",
    "std_msgs/msg/UInt8MultiArray",
    "trajectory_msgs/msg/JointTrajectory",
    "geometry_msgs/msg/TwistStamped",
    GOAL,
    "diagnostic_msgs/msg/DiagnosticStatus",
];

/// The message type of goals that are recorded on a topic ([`GivenGoals::Topic`]).
const GOAL: &str = "geometry_msgs/msg/PoseStamped";

/// The largest number of servos of each kind whose runs are read. For arms without a known servo, this is also the largest number of
/// `joint_states` topics that are considered.
const MOST: usize = 64;

/// The runs of a bag, and the parts that could not be read.
#[derive(Debug)]
pub struct Recorded {
    /// The runs: one for each servo, and one for each arm whose servo is unknown.
    pub runs: Vec<RecordedRun>,
    /// The reasons why something is not drawn, one line each.
    pub warnings: Vec<String>,
    /// The damaged parts of the bag.
    pub losses: UnreadableParts,
}

/// Reads the runs of the bag at `path`. Error messages call the bag `name`. If the bag lacks the parameters of an arm's servo, the
/// arm gets the parameters `fallback`.
///
/// # Errors
/// [`RunError::Bag`]; [`RunError::NoRobot`] if nothing can be drawn; [`RunError::Parameters`].
pub fn recorded(path: &Path, name: &str, fallback: &ServoParameters) -> Result<Recorded, RunError> {
    recorded_toward(path, name, fallback, None)
}

/// Reads the runs like [`recorded`], and measures the motions of arms without a known servo toward the goals `given`.
///
/// # Errors
/// The errors of [`recorded`]; [`RunError::NoGoals`] if no message on the topic of the goals is a goal.
pub fn recorded_toward(
    path: &Path,
    name: &str,
    fallback: &ServoParameters,
    given: Option<&GivenGoals>,
) -> Result<Recorded, RunError> {
    let announced = Announced::read(Bag::open(path)?);
    let mut readers = readers(&announced, name, fallback, given)?;
    let mut bag = Bag::open(path)?.only(&TYPES);
    let mut targets = HashMap::<Arc<str>, Vec<usize>>::new();
    let (mut first, mut time) = (None, f64::NEG_INFINITY);
    for message in bag.by_ref() {
        let origin = *first.get_or_insert(message.log_time);
        let hearers = targets.entry(message.topic.clone()).or_insert_with(|| {
            (0..readers.len()).filter(|number| readers[*number].hears(&message.topic)).collect()
        });
        // The time never decreases, whatever a damaged bag contains.
        time = seconds(&message, origin).max(time);
        for number in hearers {
            readers[*number].take(time, origin, &message);
        }
    }
    let losses = bag.losses().clone();
    let (mut runs, mut warnings) = (Vec::new(), Vec::new());
    for reader in readers {
        match reader.finish() {
            Ok(run) => {
                let lacks_goals = !run.parameters_known && run.goals.is_empty();
                if let Some(topic) = given.and_then(GivenGoals::topic).filter(|_| lacks_goals) {
                    return Err(no_goals(&run.name, topic, &announced));
                }
                warnings.extend(run.notes.iter().cloned());
                runs.push(run);
            }
            Err(why) => warnings.push(why),
        }
    }
    if runs.is_empty() {
        if warnings.is_empty() {
            let instead = announced.what_else();
            warnings.push(format!("{name} has no joint_states of sensor_msgs/msg/JointState: {instead}"));
        }
        warnings.extend(losses.lines());
        return Err(RunError::NoRobot(warnings.join("; ")));
    }
    Ok(Recorded { runs, warnings, losses })
}

/// Creates the error for a run without any goal on `topic`. The error suggests the other topics of the bag whose message type is
/// [`GOAL`].
fn no_goals(run: &str, topic: &str, announced: &Announced) -> RunError {
    let with_goals = announced.topics().iter().filter(|topic| topic.message == GOAL);
    let others: Vec<_> =
        with_goals.map(|topic| shown(&topic.name, NAME)).filter(|name| name != topic).collect();
    let instead =
        if others.is_empty() { String::new() } else { format!("; the bag has {}", others.join(", ")) };
    RunError::NoGoals { run: run.to_owned(), topic: shown(topic, NAME), instead }
}

fn seconds(message: &BagMessage, origin: i64) -> f64 {
    (i128::from(message.log_time) - i128::from(origin)) as f64 * 1e-9
}

/// Creates a reader for each servo that announced its parameters. Also creates a reader for each other arm that has a topic of joint
/// states.
fn readers(
    announced: &Announced,
    name: &str,
    fallback: &ServoParameters,
    given: Option<&GivenGoals>,
) -> Result<Vec<Box<dyn Reader>>, RunError> {
    let (mut readers, mut known) = (Vec::new(), Vec::new());
    for kind in [ServoKind::TwoArms, ServoKind::OneArm] {
        for node in announced.nodes_with(kind.own_parameter()).take(MOST) {
            readers.push(of_servo(kind, node, announced.lives(node), name, &mut known)?);
        }
    }
    let states = announced.topics().iter().filter(|topic| topic.message == "sensor_msgs/msg/JointState");
    for namespace in states.filter_map(|topic| topic.name.strip_suffix("joint_states")).take(MOST) {
        if namespace.ends_with('/') && !known.iter().any(|known| known == namespace) {
            let mut reader = RunReader::new(called(name, namespace), namespace, None, fallback.clone());
            if let Some(given) = given {
                reader.measure_toward(given);
            }
            readers.push(Box::new(reader));
        }
    }
    Ok(readers)
}

/// Creates the reader of a servo. Adds the namespaces of the servo's joint states to `known`.
fn of_servo(
    kind: ServoKind,
    node: &str,
    lives: &[AnnouncedParameters],
    name: &str,
    known: &mut Vec<String>,
) -> Result<Box<dyn Reader>, RunError> {
    let (before, _) = node.rsplit_once('/').unwrap_or_default();
    let namespace = format!("{before}/");
    known.extend(kind.arms().iter().map(|arm| format!("{namespace}{arm}")));
    let lives = of_last_robot(kind, lives)?;
    let parameters = match lives.first() {
        Some(first) => kind.from_store(&first.initial(kind)?)?,
        None => return Err(RunError::NoRobot(format!("{node} announced no parameters"))),
    };
    let name = called(name, &namespace);
    let mut reader = RunReader::new(name, &namespace, Some(node.to_owned()), parameters);
    if reader.shares_topic() {
        known.push(namespace);
    }
    reader.announce(&lives)?;
    Ok(Box::new(reader))
}

/// Returns the entries of `lives` that have the same joints as the last entry. Each entry has the parameters of one start of the
/// servo. Entries with other joints are left out, because they belong to another robot.
fn of_last_robot(
    kind: ServoKind,
    lives: &[AnnouncedParameters],
) -> Result<Vec<AnnouncedParameters>, RunError> {
    let (mut joints, mut same) = (None, Vec::new());
    for life in lives.iter().rev() {
        let parameters = kind.from_store(&life.initial(kind)?)?;
        if *joints.get_or_insert_with(|| parameters.joints.clone()) == parameters.joints {
            same.push(life.clone());
        }
    }
    same.reverse();
    Ok(same)
}

fn called(bag: &str, namespace: &str) -> String {
    let name = if namespace == "/" { bag.to_owned() } else { format!("{bag} {namespace}") };
    shown(&name, NAME)
}
