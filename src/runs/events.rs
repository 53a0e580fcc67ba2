//! What happened to one servo, out of a bag.

use super::Timeline;
use crate::nodes::Wiring;
use crate::ros::ParameterEvent;
use crate::ros::messages::{DiagnosticStatus, Float64MultiArray, JointState, PoseStamped};

/// What happened.
pub(super) enum Event {
    /// From the arm of that number.
    JointState(usize, JointState),
    Goal(PoseStamped),
    /// To the arm of that number.
    Command(usize, Float64MultiArray),
    Parameters(ParameterEvent),
    Status(DiagnosticStatus),
}

impl Event {
    pub fn is_goal(&self) -> bool {
        matches!(self, Self::Goal(_))
    }
}

/// The servo node of that namespace, by the parameters that it told.
pub(super) fn servo_in<'a, T: Wiring>(timeline: &'a Timeline, namespace: &'a str) -> Option<&'a str> {
    timeline.nodes_with(T::OWN_PARAMETER).find(|node| is_child(node, namespace))
}

/// Whether a fully qualified name is in this namespace, not in one below.
fn is_child(name: &str, namespace: &str) -> bool {
    name.strip_prefix(namespace).is_some_and(|rest| !rest.is_empty() && !rest.contains('/'))
}

/// All that happened in `namespace`, which ends with a slash, in order of time \[ns\].
pub(super) fn events<T: Wiring>(
    timeline: &Timeline,
    namespace: &str,
    node: Option<&str>,
) -> Vec<(i64, Event)> {
    let topic = |name: &str| format!("{namespace}{name}");
    let mut events = Vec::new();
    for (arm, prefix) in T::ARMS.iter().enumerate() {
        let states = timeline.of::<JointState>(&topic(&format!("{prefix}joint_states")));
        let stamp = |state: &JointState| state.header.stamp.nanoseconds();
        let same_clock = is_same_clock(states.iter().map(|(logged, state)| (*logged, stamp(state))));
        events.extend(states.into_iter().map(|(logged, state)| {
            let measured = if same_clock { stamp(&state) } else { logged };
            (measured, Event::JointState(arm, state))
        }));
        let commands = timeline.of(&topic(&format!("{prefix}forward_velocity_controller/commands")));
        events.extend(commands.into_iter().map(|(time, command)| (time, Event::Command(arm, command))));
    }
    let goals = timeline.of(&topic(T::GOAL));
    events.extend(goals.into_iter().map(|(time, goal)| (time, Event::Goal(goal))));
    for (status, before) in timeline.ending("status", "diagnostic_msgs/msg/DiagnosticStatus") {
        let of = before.trim_end_matches('/');
        if node.map_or_else(|| is_child(of, namespace), |node| of == node) {
            let statuses = timeline.of(status);
            events.extend(statuses.into_iter().map(|(time, status)| (time, Event::Status(status))));
        }
    }
    let changes = node.and_then(|node| timeline.parameters(node)).map(|told| told.changes.clone());
    let changes = changes.into_iter().flatten();
    events.extend(changes.map(|event| (event.stamp.nanoseconds(), Event::Parameters(event))));
    events.sort_by_key(|(time, _)| *time);
    events
}

/// Whether the clock that stamped the states agrees with the recorder's, by the times \[ns\] at which each was recorded and stamped:
/// then the stamps tell when they were measured. One answer for all of them keeps them in their order: some may come late.
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
