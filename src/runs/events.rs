//! What happened to one servo, out of a bag.

use super::Timeline;
use super::timeline::AnnouncedParameters;
use crate::record::BagMessage;
use crate::servo::Interface;
use crate::wire::messages::{DiagnosticStatus, Float64MultiArray, JointState, JointTrajectory, PoseStamped};
use crate::wire::{Command, CycleLabel, ParameterEvent, Wiring, command_topic};

/// What happened.
pub(super) enum Event {
    /// From the arm of that number.
    JointState(usize, JointState),
    Goal(PoseStamped),
    /// Velocities to the arm of that number.
    Command(usize, Float64MultiArray),
    /// Positions to the arm of that number, and what they were made from.
    Positions(usize, Vec<f64>, Option<CycleLabel>),
    Parameters(ParameterEvent),
    Status(DiagnosticStatus),
}

/// What happened, decoded when its turn comes: decoded messages take many times the room of their bytes.
#[derive(Clone, Copy)]
pub(super) enum Source<'a> {
    JointState(usize, &'a BagMessage),
    Goal(&'a BagMessage),
    Command(usize, &'a BagMessage),
    Positions(usize, &'a BagMessage),
    Trajectory(usize, &'a BagMessage),
    Parameters(&'a ParameterEvent),
    Status(&'a BagMessage),
}

impl Source<'_> {
    /// The event; none where the message is damaged.
    pub fn event(self) -> Option<Event> {
        Some(match self {
            Self::JointState(arm, message) => Event::JointState(arm, message.decode().ok()?),
            Self::Goal(message) => Event::Goal(message.decode().ok()?),
            Self::Command(arm, message) => Event::Command(arm, message.decode().ok()?),
            Self::Positions(arm, message) => positions::<Float64MultiArray>(arm, message)?,
            Self::Trajectory(arm, message) => positions::<JointTrajectory>(arm, message)?,
            Self::Parameters(event) => Event::Parameters(event.clone()),
            Self::Status(message) => Event::Status(message.decode().ok()?),
        })
    }
}

fn positions<M: Command>(arm: usize, message: &BagMessage) -> Option<Event> {
    let command: M = message.decode().ok()?;
    let label = command.label();
    Some(Event::Positions(arm, command.numbers(), label))
}

/// The servo node of that namespace, by the parameters that it announced.
pub(super) fn servo_in<'a, T: Wiring>(timeline: &'a Timeline, namespace: &'a str) -> Option<&'a str> {
    timeline.nodes_with(T::OWN_PARAMETER).find(|node| is_child(node, namespace))
}

/// Whether a fully qualified name is in this namespace, not in one below.
fn is_child(name: &str, namespace: &str) -> bool {
    name.strip_prefix(namespace).is_some_and(|rest| !rest.is_empty() && !rest.contains('/'))
}

/// What a servo announced from one of its starts on, and what kind of commands its robot took then.
pub(super) type Life<'a> = (&'a AnnouncedParameters, Interface);

/// All that happened in `namespace`, which ends with a slash, in order of time \[ns\]; its arms take commands of the kind `interface`
/// at first, and of that of each of its `lives` from then on.
pub(super) fn events<'a, T: Wiring>(
    timeline: &'a Timeline,
    namespace: &str,
    node: Option<&str>,
    (interface, lives): (Interface, &[Life<'a>]),
) -> Vec<(i64, Source<'a>)> {
    let topic = |name: &str| format!("{namespace}{name}");
    let logged = |message: &BagMessage| message.log_time;
    let interface_at = |time: i64| match lives.partition_point(|(life, _)| life.since <= time) {
        0 => interface,
        count => lives[count - 1].1,
    };
    let mut events = Vec::new();
    for (arm, prefix) in T::ARMS.iter().enumerate() {
        let states = timeline.of(&topic(&format!("{prefix}joint_states")));
        let stamps: Vec<_> = states.iter().map(|state| (state.log_time, stamp(state))).collect();
        let same_clock =
            is_same_clock(stamps.iter().filter_map(|(logged, stamp)| Some((*logged, (*stamp)?))));
        events.extend(states.iter().zip(stamps).filter_map(|(state, (logged, stamp))| {
            let measured = if same_clock { stamp? } else { logged };
            Some((measured, Source::JointState(arm, state)))
        }));
        for kind in [Interface::Velocity, Interface::Position, Interface::Trajectory] {
            let commands = timeline.of(&topic(&format!("{prefix}{}", command_topic(kind))));
            let source = |command| match kind {
                Interface::Velocity => Source::Command(arm, command),
                Interface::Position => Source::Positions(arm, command),
                Interface::Trajectory => Source::Trajectory(arm, command),
            };
            let of_then = commands.iter().filter(|command| interface_at(logged(command)) == kind);
            events.extend(of_then.map(|command| (logged(command), source(command))));
        }
    }
    events.extend(timeline.of(&topic(T::GOAL)).iter().map(|goal| (logged(goal), Source::Goal(goal))));
    for (status, before) in timeline.ending("status", "diagnostic_msgs/msg/DiagnosticStatus") {
        let of = before.trim_end_matches('/');
        if node.map_or_else(|| is_child(of, namespace), |node| of == node) {
            events.extend(timeline.of(status).iter().map(|status| (logged(status), Source::Status(status))));
        }
    }
    let changes = lives.iter().flat_map(|(life, _)| &life.changes);
    events.extend(changes.map(|event| (event.stamp.nanoseconds(), Source::Parameters(event))));
    events.sort_by_key(|(time, _)| *time);
    events
}

/// When the joint state was measured \[ns\], by the clock of who did; none where it is damaged.
fn stamp(state: &BagMessage) -> Option<i64> {
    Some(state.decode::<JointState>().ok()?.header.stamp.nanoseconds())
}

/// Whether the clock that stamped the states agrees with the recorder's, by the times \[ns\] at which each was recorded and stamped:
/// then the stamps say when they were measured. One answer for all of them keeps them in their order: some may come late.
fn is_same_clock(mut logged_and_stamped: impl Iterator<Item = (i64, i64)>) -> bool {
    const SAME_CLOCK: u64 = 100_000_000;
    logged_and_stamped.any(|(logged, stamp)| logged.abs_diff(stamp) < SAME_CLOCK)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nodes_belong_to_the_namespace_that_they_are_in() {
        for (name, namespace, inside) in [
            ("/dq_servo", "/", true),
            ("/left/dq_servo", "/left/", true),
            ("/left/dq_servo", "/", false),
            ("/leftover", "/left/", false),
            ("/", "/", false),
        ] {
            assert_eq!(is_child(name, namespace), inside, "{name} in {namespace}");
        }
    }

    #[test]
    fn stamps_count_where_the_clocks_agree() {
        let same = |pairs: &[(i64, i64)]| is_same_clock(pairs.iter().copied());
        assert!(same(&[(10_000_000_000, 9_999_000_000)]));
        assert!(!same(&[(10_000_000_000, 0)]), "not stamped");
        assert!(!same(&[(10_000_000_000, 13_000_000_000)]), "another clock");
        assert!(same(&[(10_500_000_000, 10_000_000_000), (10_501_000_000, 10_500_000_000)]), "one came late");
    }
}
