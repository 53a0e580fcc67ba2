//! What comes from one arm: its joint states, who publishes them, and how fast it says that it moves.

use super::events::EventsRecord;
use super::senders::Senders;
use super::wiring::Wiring;
use dq_config::StatesReliability;
use dq_core::servo::{Event, JointOrder, Rejection, Servo};
use dq_messages::messages::{Float64, JointState, Time};
use dq_ros::ros::{Clock, EndpointId, RosError, Subscription};
use dq_wire::joint_reading;
use std::sync::Arc;

/// Where an arm's joint states come from.
pub(super) type JointStates = Arc<Subscription<JointState>>;

/// What comes from one arm.
pub(super) struct ArmInput {
    joints: JointOrder,
    joint_states: JointStates,
    /// At which part of its speed the robot moves; none where the node may not hear it.
    speed_scaling: Option<Subscription<Float64>>,
    /// The last one, over which the next is decoded.
    state: JointState,
    publishers: Senders,
    clock: Clock,
    /// When the last joint state that was taken was made; when it came, if it does not say.
    pub stamp: Time,
    /// The speed [rad/s] of the arm's fastest joint in the last joint state, if it has all of their speeds.
    pub speed: Option<f64>,
}

/// What comes from the arms with these joints, whose joint states are subscribed to with that reliability.
pub(super) fn subscribe(
    wiring: &mut Wiring,
    joints: Vec<JointOrder>,
    reliability: StatesReliability,
    clock: &Clock,
) -> Result<Vec<ArmInput>, RosError> {
    let Wiring { node, kind, contract } = wiring;
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
        // A keystore from before there was the topic lacks the right to it; the robot's speed is measured too.
        let speed_scaling =
            speed_scaling.inspect_err(|why| node.log().warn(&format!("no speed scaling: {why}")));
        Ok(ArmInput {
            joints,
            joint_states: Arc::new(joint_states?),
            speed_scaling: speed_scaling.ok(),
            state: JointState::default(),
            publishers: Senders::default(),
            clock: clock.clone(),
            stamp: Time::default(),
            speed: None,
        })
    };
    kind.arms().iter().zip(joints).map(subscribe).collect()
}

impl ArmInput {
    /// Gives the servo every joint state that came of the arm of that number, of which the last that fits counts: on one topic there may be
    /// those of a gripper too. And the last that it says of its speed.
    pub fn feed(&mut self, arm: usize, record: &mut EventsRecord, servo: &mut Servo) {
        let Self { joints, joint_states, speed_scaling, state, publishers, clock, stamp, speed } = self;
        // A simulated clock comes in steps, and may be slow: stamps of it say nothing of how late a state is.
        let real = (!clock.is_simulated()).then(|| Time::now().nanoseconds());
        let mut malformed = joint_states.each_over(state, |state, origin| {
            // Whoever gives no state of this arm, as one of many grippers, takes no number from whoever does.
            let is_arm = joints.has_any_of(&state.name);
            let source = if is_arm { publishers.number(origin.publisher) } else { 0 };
            // A rejection is counted by the servo, and logged by the report.
            let taken = record.take(servo, Event::JointState(arm, joint_reading(state, source, real)));
            if taken.unwrap_or(false) {
                *speed = fastest_of(joints, state);
                *stamp = if state.header.stamp.is_zero() { clock.now() } else { state.header.stamp.clone() };
            }
        });
        if let Some(told) = speed_scaling.as_ref().map(Subscription::newest) {
            malformed.extend(told.malformed);
            if let Some(Float64 { data }) = told.message {
                let _ = record.take(servo, Event::SpeedScaling(arm, part(data)));
            }
        }
        for why in malformed {
            let _ = servo.take(Event::Unusable(Rejection::Malformed(why)));
        }
    }

    /// The publisher of that number.
    pub fn publisher(&self, number: u32) -> Option<EndpointId> {
        self.publishers.publisher(number)
    }

    /// Where they come from.
    pub fn source(&self) -> JointStates {
        self.joint_states.clone()
    }
}

/// Why a publisher of joint states is not heard, and what to do about it.
pub(super) fn unheard(joint_states: &JointStates) -> Option<String> {
    let why = joint_states.unheard()?;
    Some(format!("{why}, or set reliability to auto"))
}

/// The part of its speed, 0 to 1, at which a robot moves, from what it publishes: a percentage, or that part itself. ur_robot_driver publishes percent
/// (`speed_scaling_state_broadcaster.cpp`: times 100), where its pages say 0 to 1. What is not above 1 is no percentage that matters: a
/// robot as slow as that counts as one that obeys no command.
fn part(published: f64) -> f64 {
    if published > 1.0 { published / 100.0 } else { published }
}

/// The speed of the fastest of these joints [rad/s], whatever else moves, as a gripper or wheels; none where one of them has no speed.
fn fastest_of(joints: &JointOrder, state: &JointState) -> Option<f64> {
    let JointState { name, velocity, .. } = state;
    let speed = |joint| {
        let place = name.iter().position(|name| name == joint)?;
        velocity.get(place).map(|speed| speed.abs()).filter(|speed| speed.is_finite())
    };
    let mut speeds = joints.names().iter().map(speed);
    let fastest = speeds.try_fold(0.0, |fastest, speed| Some(f64::max(fastest, speed?)));
    fastest.filter(|_| velocity.len() == name.len())
}

/// The largest amount among the speeds; none for no speeds.
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

    #[test]
    fn only_the_arm_s_own_joints_say_whether_it_stands() {
        let names = |names: &[&str]| names.iter().map(|name| (*name).to_owned()).collect::<Vec<_>>();
        let joints = JointOrder::new(names(&["shoulder", "elbow"]));
        let speed = |name: &[&str], velocity: &[f64]| {
            let state =
                JointState { name: names(name), velocity: velocity.to_vec(), ..JointState::default() };
            fastest_of(&joints, &state)
        };
        let mobile = ["wheel", "elbow", "shoulder"];
        assert_eq!(speed(&mobile, &[9.0, 0.1, -0.2]), Some(0.2));
        assert_eq!(speed(&mobile, &[9.0, 0.0, 0.0]), Some(0.0));
        assert_eq!(speed(&mobile, &[0.0, f64::NAN, 0.0]), None);
        assert_eq!(speed(&["wheel", "elbow"], &[0.0, 0.0]), None);
        assert_eq!((speed(&mobile, &[]), speed(&mobile, &[0.0, 0.0])), (None, None));
    }
}
