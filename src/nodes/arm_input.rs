//! What comes from one arm: its joint states, and who publishes them.

use crate::config::StatesReliability;
use crate::ros::{Clock, EndpointId, Node, RosError, Subscription};
use crate::servo::{JointReading, Rejection};
use crate::wire::messages::{JointState, Time};
use crate::wire::{ArmLabel, NodeContract, Wiring};
use std::sync::Arc;

/// The publishers that are remembered; the oldest goes first.
const PUBLISHERS: usize = 16;

/// Where an arm's joint states come from.
pub(super) type JointStates = Arc<Subscription<JointState>>;

/// The joint states of one arm.
pub(super) struct ArmInput {
    joint_states: JointStates,
    /// The last one, over which the next is decoded.
    state: JointState,
    publishers: Publishers,
    clock: Clock,
    /// When the last joint state that was taken was made; when it came, if it does not say.
    pub stamp: Time,
    /// The fastest joint's speed [rad/s] in the last joint state, if it has speeds.
    pub speed: Option<f64>,
}

/// What comes from the arms, subscribed to with that reliability.
pub(super) fn subscribe<T: Wiring>(
    node: &mut Node,
    contract: &NodeContract,
    (reliability, clock): (StatesReliability, &Clock),
) -> Result<Vec<ArmInput>, RosError> {
    let subscribe = |arm: &&str| {
        let topic = format!("{arm}joint_states");
        let joint_states = match reliability {
            StatesReliability::Auto => node.adapting_subscription(contract, &topic),
            StatesReliability::Reliable => node.subscription(contract, &topic),
            StatesReliability::BestEffort => {
                node.subscription(&contract.clone().with_best_effort(&topic), &topic)
            }
        };
        Ok(ArmInput::new(joint_states?, clock.clone()))
    };
    T::ARMS.iter().map(subscribe).collect()
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
    pub fn new(joint_states: Subscription<JointState>, clock: Clock) -> Self {
        Self {
            joint_states: Arc::new(joint_states),
            state: JointState::default(),
            publishers: Publishers::default(),
            clock,
            stamp: Time::default(),
            speed: None,
        }
    }

    /// Offers every joint state that came to `take`, which keeps the last that fits: on one topic there may be those of a
    /// gripper too.
    pub fn offer_all(
        &mut self,
        label: &mut ArmLabel,
        mut take: impl FnMut(Result<&JointReading, Rejection>) -> Result<bool, Rejection>,
    ) {
        let Self { joint_states, state, publishers, clock, stamp, speed } = self;
        label.sources.clear();
        // A simulated clock comes in steps, and may be slow: stamps of it say nothing of how late a state is.
        let real = (!clock.is_simulated()).then(|| Time::now().nanoseconds());
        let malformed = joint_states.each_over(state, |state, publisher| {
            let source = publishers.number(publisher);
            // A rejection is counted by the servo, and logged by the report.
            let Ok(believed) = take(Ok(&state.reading(source, real))) else { return };
            label.hear(source);
            if believed {
                label.take(state);
                *speed = fastest(&state.velocity);
                *stamp = if state.header.stamp.is_zero() { clock.now() } else { state.header.stamp.clone() };
            }
        });
        for why in malformed {
            let _ = take(Err(Rejection::Malformed(why)));
        }
    }

    /// The publisher of that number.
    pub fn publisher(&self, number: u32) -> Option<EndpointId> {
        self.publishers.known.iter().find(|(known, _)| *known == number).map(|(_, publisher)| *publisher)
    }

    /// Where they come from.
    pub fn source(&self) -> JointStates {
        self.joint_states.clone()
    }
}

/// Why a publisher of joint states is not heard, and what to do about it.
pub(super) fn unheard(joint_states: &JointStates) -> Option<String> {
    let why = joint_states.unheard()?;
    Some(format!("{why}, or set joint_states_reliability to auto"))
}

/// The largest amount among the speeds; none for no speeds.
pub(super) fn fastest(speeds: &[f64]) -> Option<f64> {
    speeds.iter().map(|speed| speed.abs()).reduce(f64::max)
}
