//! The counterpart of a servo: a node in the bench's process that receives commands and sends goals.

use dq_core::servo::Interface;
use dq_messages::messages::{Float64MultiArray, Header, PoseStamped};
use dq_messages::{Direction, NodeContract, PoseNumbers};
use dq_ros::ros::{
    Environment, LogLevel, Logging, Node, Publisher, Resolver, RosArgs, Session, Subscription,
};
use dq_wire::{Contract, ServoKind, command_topic};

/// Goals that the arm reaches from each other.
pub const GOALS: [PoseNumbers; 2] = [
    [-0.125, 0.2, 0.2, 0.0, 0.0, 0.0, 1.0],
    [0.1, 0.4, -0.1, 0.0, 0.382_683_432_365_09, 0.0, 0.923_879_532_511_29],
];

/// Joins the domain of the environment with a node of this name.
pub fn join(name: &str) -> (Node, Session) {
    let ros_args = RosArgs::default();
    let session = Session::open(&Environment::from_process(&ros_args).unwrap()).unwrap();
    let names = Resolver::new(name, &ros_args).unwrap();
    (session.node(names, Logging::new(&ros_args, LogLevel::Error)).unwrap(), session)
}

/// Returns the topics of a servo of one arm.
pub fn servo() -> NodeContract {
    ServoKind::OneArm.contract(Contract::builtin().unwrap())
}

/// Creates the publisher of goals for the servo in this namespace, which ends in a slash.
pub fn goals(node: &mut Node, namespace: &str) -> Publisher<PoseStamped> {
    let servo = servo();
    let entry = servo.topic::<PoseStamped>(ServoKind::OneArm.goal_topic(), Direction::In).unwrap();
    node.publisher_as(entry, &format!("{namespace}{}", ServoKind::OneArm.goal_topic())).unwrap()
}

/// Returns a goal in the base frame with the present time.
pub fn goal(pose: PoseNumbers) -> PoseStamped {
    PoseStamped { header: Header::now(""), pose: pose.into() }
}

/// Subscribes to the velocities that the servo commands.
#[allow(dead_code, reason = "the fleet is judged by its statuses")]
pub fn commands(node: &mut Node) -> Subscription<Float64MultiArray> {
    let (servo, topic) = (servo(), command_topic(Interface::Velocity));
    let entry = servo.topic::<Float64MultiArray>(topic, Direction::Out).unwrap();
    node.subscription_as(entry, &format!("/{topic}")).unwrap()
}
