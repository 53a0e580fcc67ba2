//! The runs of a bag: made from joint states, goals and commands alone, so that any bag of such a run will do.

use super::events::{Event, Life, Source, events, servo_in};
use super::follower::Follower;
use super::timeline::AnnouncedParameters;
use super::{RecordedRun, RunError, Timeline};
use crate::config::{CycleParameters, DualParameters, NodeParameters, ServoParameters};
use crate::servo::{OneArm, TwoArms};
use crate::wire::Wiring;

/// Parameters for servos whose own are not in the bag.
#[derive(Clone, Debug)]
pub struct Fallback {
    /// For one arm.
    pub servo: ServoParameters,
    /// For two.
    pub dual: DualParameters,
}

/// The run of every servo of a bag, which is called `bag` in what is reported of them.
///
/// # Errors
/// [`RunError::NoRobot`] where there are no joint states, or not of such an arm; [`RunError::Parameters`].
pub fn recorded(timeline: &Timeline, bag: &str, fallback: &Fallback) -> Result<Vec<RecordedRun>, RunError> {
    let two = timeline.ending(TwoArms::GOAL, "geometry_msgs/msg/PoseStamped").map(|(_, namespace)| namespace);
    let two: Vec<_> = two.take(MOST).collect();
    let of_two: Vec<_> = two
        .iter()
        .flat_map(|namespace| TwoArms::ARMS.iter().map(move |arm| format!("{namespace}{arm}")))
        .collect();
    let states =
        timeline.ending("joint_states", "sensor_msgs/msg/JointState").map(|(_, namespace)| namespace);
    let one: Vec<_> = states.filter(|arm| !of_two.iter().any(|of_two| of_two == arm)).take(MOST).collect();
    let mut runs = Vec::new();
    for namespace in two {
        runs.push(run::<TwoArms>(timeline, bag, namespace, &fallback.dual)?);
    }
    for namespace in one {
        runs.push(run::<OneArm>(timeline, bag, namespace, &fallback.servo)?);
    }
    if runs.is_empty() {
        let instead = timeline.what_else();
        return Err(RunError::NoRobot(format!(
            "{bag} has no joint_states of sensor_msgs/msg/JointState: {instead}"
        )));
    }
    Ok(runs)
}

/// Arms that are explained; figures of more would show nothing.
const MOST: usize = 64;

fn run<T: Wiring>(
    timeline: &Timeline,
    bag: &str,
    namespace: &str,
    fallback: &CycleParameters<T>,
) -> Result<RecordedRun, RunError>
where
    CycleParameters<T>: NodeParameters,
{
    let node = servo_in::<T>(timeline, namespace);
    let lives = lives::<T>(node.map_or(&[], |node| timeline.lives(node)))?;
    let (parameters, announced) = match lives.first() {
        Some((first, _)) => {
            let store = first.initial::<CycleParameters<T>>()?;
            (CycleParameters::from_store(&store)?, Some((store, first.numbers.clone())))
        }
        None => (fallback.clone(), None),
    };
    let events = events::<T>(timeline, namespace, node, (parameters.settings.interface, &lives));
    let first_goal = events.iter().find(|(_, source)| has_goal(*source));
    let zero = first_goal.or(events.first()).map_or(0, |(time, _)| *time);
    let seconds = |time: i64| (i128::from(time) - i128::from(zero)) as f64 * 1e-9;
    let name = if namespace == "/" { bag.to_owned() } else { format!("{bag} {namespace}") };
    let mut follower = Follower::<T>::new(name, parameters, announced);
    let mut restarts = lives.iter().skip(1).map(|(life, _)| *life).peekable();
    for (time, source) in events {
        while let Some(life) = restarts.next_if(|life| life.since <= time) {
            follower.start_again(seconds(life.since), life)?;
        }
        if let Some(event) = source.event() {
            follower.take(seconds(time), event)?;
        }
    }
    follower.finish()
}

/// What a servo announced from each of its starts on, and what kind of commands its robot took. Starts with joints that are not those
/// of the last are of another robot, which the run is not of.
fn lives<T: Wiring>(known: &[AnnouncedParameters]) -> Result<Vec<Life<'_>>, RunError>
where
    CycleParameters<T>: NodeParameters,
{
    let mut joints = None;
    let mut lives = Vec::new();
    for life in known.iter().rev() {
        let parameters = CycleParameters::<T>::from_store(&life.initial::<CycleParameters<T>>()?)?;
        if *joints.get_or_insert_with(|| parameters.joints.clone()) == parameters.joints {
            lives.push((life, parameters.settings.interface));
        }
    }
    lives.reverse();
    Ok(lives)
}

/// Whether it is a goal, or a status that names one.
fn has_goal(source: Source) -> bool {
    match source {
        Source::Goal(_) => true,
        Source::Status(_) => source.event().is_some_and(|event| match event {
            Event::Status(status) => status.values.iter().any(|pair| pair.key == "goal"),
            _ => false,
        }),
        _ => false,
    }
}
