//! The input from one arm: the joint states, their publishers, and the speed scaling.

use super::arm_speed::ArmSpeed;
use super::events::EventsRecord;
use super::node_setup::NodeSetup;
use super::senders::Senders;
use dq_config::StatesReliability;
use dq_core::servo::{Event, JointOrder, Rejection, Servo};
use dq_messages::messages::{Float64, JointState, Time};
use dq_ros::ros::{Clock, EndpointId, RosError, Subscription};
use dq_wire::joint_reading;
use std::sync::Arc;
use std::time::Instant;

/// The subscription to an arm's joint states.
pub(super) type JointStates = Arc<Subscription<JointState>>;

/// The input from one arm.
pub(super) struct ArmInput {
    joints: JointOrder,
    /// The joints of the other arm, if the joint states of both arms come on one topic.
    others: Option<JointOrder>,
    joint_states: JointStates,
    /// The speed scaling that the robot reports; `None` if the node may not subscribe to it.
    speed_scaling: Option<Subscription<Float64>>,
    /// The last joint state. The next joint state is decoded into it.
    state: JointState,
    publishers: Senders,
    clock: Clock,
    /// The stamp of the last accepted joint state. If that joint state had no stamp, the time at which it arrived.
    pub stamp: Time,
    /// The arm's speed according to the joint states.
    pub speed: ArmSpeed,
}

/// Subscribes to the inputs of the arms with these joints. The subscriptions to joint states have this `reliability`.
pub(super) fn subscribe(
    setup: &mut NodeSetup,
    joints: Vec<JointOrder>,
    reliability: StatesReliability,
    clock: &Clock,
) -> Result<Vec<ArmInput>, RosError> {
    let NodeSetup { node, kind, contract } = setup;
    let subscribe = |(arm, joints): (&&str, JointOrder)| {
        let topic = format!("{arm}joint_states");
        let joint_states = match reliability {
            StatesReliability::Auto => node.adapting_subscription(contract, &topic),
            StatesReliability::Reliable => node.subscription(contract, &topic),
            StatesReliability::BestEffort => {
                node.subscription(&contract.clone().with_best_effort(&topic), &topic)
            }
        };
        let speed_scaling =
            node.subscription(contract, &format!("{arm}speed_scaling_state_broadcaster/speed_scaling"));
        // A keystore from before this topic was introduced does not grant access to the topic. The servo can do without the topic,
        // because it also measures the robot's speed.
        let speed_scaling =
            speed_scaling.inspect_err(|why| node.log().warn(&format!("no speed scaling: {why}")));
        Ok(ArmInput {
            joints,
            others: None,
            joint_states: Arc::new(joint_states?),
            speed_scaling: speed_scaling.ok(),
            state: JointState::default(),
            publishers: Senders::default(),
            clock: clock.clone(),
            stamp: Time::default(),
            speed: ArmSpeed::default(),
        })
    };
    let mut arms = kind.arms().iter().zip(joints).map(subscribe).collect::<Result<Vec<_>, RosError>>()?;
    if let [left, right] = arms.as_mut_slice()
        && left.joint_states.topic() == right.joint_states.topic()
    {
        (left.others, right.others) = (Some(right.joints.clone()), Some(left.joints.clone()));
    }
    Ok(arms)
}

impl ArmInput {
    /// Gives the servo every joint state that has arrived on the topic of arm number `arm`, and the newest speed scaling. The
    /// newest joint state alone is not enough, because it may be that of a gripper.
    pub fn feed(&mut self, arm: usize, record: &mut EventsRecord, servo: &mut Servo) {
        let Self { joints, others, joint_states, speed_scaling, state, publishers, clock, stamp, speed } =
            self;
        // A simulated clock advances in steps and may be slow, so its stamps do not show how late a state is.
        let real = (!clock.is_simulated()).then(|| Time::now().nanoseconds());
        let mut malformed = joint_states.each_over(state, |state, origin| {
            // Publishers of other joints, such as those of grippers, get no number, so that they do not displace the arm's
            // publisher.
            let is_arm = joints.has_any_of(&state.name);
            if !is_arm && others.as_ref().is_some_and(|others| others.has_any_of(&state.name)) {
                return;
            }
            let source = if is_arm { publishers.number(origin.publisher) } else { 0 };
            // The servo counts a rejection, and the report logs it.
            let taken = record.take(servo, Event::JointState(arm, joint_reading(state, source, real)));
            if taken.unwrap_or(false) {
                speed.hear(joints, state, Instant::now());
                *stamp = if state.header.stamp.is_zero() { clock.now() } else { state.header.stamp.clone() };
            }
        });
        if let Some(told) = speed_scaling.as_ref().map(Subscription::newest) {
            malformed.extend(told.malformed);
            if let Some(Float64 { data }) = told.message {
                let _ = record.take(servo, Event::SpeedScaling(arm, part(data)));
            }
        }
        reject_malformed(servo, malformed);
    }

    /// Returns the publisher of joint states with this number.
    pub fn publisher(&self, number: u32) -> Option<EndpointId> {
        self.publishers.publisher(number)
    }

    /// Returns the subscription to the arm's joint states.
    pub fn source(&self) -> JointStates {
        self.joint_states.clone()
    }
}

/// Returns a text for the user: why the node cannot receive from a publisher of joint states, and how to mend this. Returns `None` if
/// the node can receive from all publishers.
pub(super) fn unheard(joint_states: &JointStates) -> Option<String> {
    let why = joint_states.unheard()?;
    Some(format!("{why}, or set reliability to auto"))
}

/// Converts a published speed scaling, a percentage or a fraction, to a fraction from 0 to 1.
///
/// `ur_robot_driver` publishes a percentage (`speed_scaling_state_broadcaster.cpp` multiplies by 100), although its documentation
/// says 0 to 1. Values up to 1 count as fractions. So percentages up to 1 % are misread. They do not matter, because the servo treats
/// a robot at 1 % of its speed as one that does not follow.
fn part(published: f64) -> f64 {
    if published > 1.0 { published / 100.0 } else { published }
}

/// Makes the servo count the messages that could not be decoded as rejected. `reasons` has the decoder's reason for each of them.
pub(super) fn reject_malformed(servo: &mut Servo, reasons: Vec<String>) {
    for why in reasons {
        let _ = servo.take(Event::Unusable(Rejection::Malformed(why)));
    }
}

/// Returns the largest absolute value of `speeds`; `None` if `speeds` is empty.
pub(super) fn fastest(speeds: &[f64]) -> Option<f64> {
    speeds.iter().map(|speed| speed.abs()).reduce(f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_part_of_the_speed_is_a_percentage_too() {
        for (told, expected) in [(100.0, 1.0), (20.0, 0.2), (2.0, 0.02), (1.0, 1.0), (0.2, 0.2), (0.0, 0.0)] {
            assert_eq!(part(told), expected);
        }
    }
}
