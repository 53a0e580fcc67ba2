//! What comes from one arm: its joint states, and who publishes them.

use crate::ros::{EndpointId, Subscription};
use crate::servo::{JointReading, Servo, stamp_age};
use crate::wire::CycleLabel;
use crate::wire::Wiring;
use crate::wire::messages::{JointState, Time};
use std::time::Duration;

/// The publishers that are remembered; the oldest goes first.
const PUBLISHERS: usize = 16;

/// The joint state as the servo takes it, from the publisher of number `source`, at the time `clock` \[ns\] of this host's clock.
pub fn reading(state: &JointState, source: u32, clock: Option<i64>) -> JointReading<'_> {
    JointReading {
        names: &state.name,
        positions: &state.position,
        velocities: &state.velocity,
        source,
        stamp_age: clock.and_then(|clock| stamp_age(clock, state.header.stamp.nanoseconds())),
    }
}

/// The joint states of one arm.
pub(super) struct ArmInput {
    number: usize,
    joint_states: Subscription<JointState>,
    publishers: Publishers,
    /// When the last joint state that was taken was made; when it came, if it does not say.
    pub stamp: Time,
    /// The fastest joint's speed [rad/s] in the last joint state, if it has speeds.
    pub speed: Option<f64>,
}

/// Numbers for publishers, in the order in which they were heard first.
#[derive(Default)]
struct Publishers {
    known: Vec<(u32, EndpointId)>,
    count: u32,
}

impl Publishers {
    fn number(&mut self, publisher: EndpointId) -> u32 {
        if let Some((number, _)) = self.known.iter().find(|(_, known)| *known == publisher) {
            return *number;
        }
        if self.known.len() >= PUBLISHERS {
            self.known.remove(0);
        }
        let number = self.count;
        self.known.push((number, publisher));
        self.count = self.count.wrapping_add(1);
        number
    }
}

impl ArmInput {
    pub fn new(number: usize, joint_states: Subscription<JointState>) -> Self {
        Self { number, joint_states, publishers: Publishers::default(), stamp: Time::default(), speed: None }
    }

    /// Offers every joint state that came to the servo, which keeps the last that fits: on one topic there may be those of a
    /// gripper too. Why others could not be decoded.
    pub fn offer_all<T: Wiring>(
        &mut self,
        servo: &mut Servo<T>,
        label: &mut CycleLabel,
        now: Duration,
    ) -> Vec<String> {
        let Self { number, joint_states, publishers, stamp, speed } = self;
        let label = &mut label.arms[*number];
        label.sources.clear();
        let clock = Time::now().nanoseconds();
        joint_states.each_from(|state, publisher| {
            let source = publishers.number(publisher);
            // A rejection is counted by the servo, and reported by the node.
            let Ok(believed) = servo.take_joint_state(*number, &reading(&state, source, Some(clock)), now)
            else {
                return;
            };
            label.hear(source);
            if believed {
                (label.count, label.stamp) = (label.count + 1, state.header.stamp.nanoseconds());
                *speed = fastest(&state.velocity);
                *stamp = if state.header.stamp.is_zero() { Time::now() } else { state.header.stamp };
            }
        })
    }

    /// The publisher of that number.
    pub fn publisher(&self, number: u32) -> Option<EndpointId> {
        self.publishers.known.iter().find(|(known, _)| *known == number).map(|(_, publisher)| *publisher)
    }

    /// The topic's full name.
    pub fn topic(&self) -> &str {
        self.joint_states.topic()
    }
}

/// The largest amount among the speeds; none for no speeds.
pub(super) fn fastest(speeds: &[f64]) -> Option<f64> {
    speeds.iter().map(|speed| speed.abs()).reduce(f64::max)
}
