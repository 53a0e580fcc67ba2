//! Tests that the cycle's thread allocates only the memory that RustDDS allocates to write a message.

use super::cycle_thread::Tick;
use super::servo::{Assembled, Cycle};
use super::{NodeError, Prepared};
use allocation_counter::measure;
use dq_config::ServoParameters;
use dq_core::servo::State;
use dq_messages::messages::*;
use dq_messages::{Direction, NodeContract};
use dq_ros::alone::{node, outside, session};
use dq_ros::ros::{Node, Publisher, RosArgs, RosError, Subscription};
use dq_wire::{Command, Contract};
use std::time::{Duration, Instant};

const PERIOD: Duration = Duration::from_millis(2);

/// The robot, and the publishers of goals and twists.
struct Robot {
    joint_states: Publisher<JointState>,
    commands: Subscription<Float64MultiArray>,
    goals: Publisher<PoseStamped>,
    twists: Publisher<TwistStamped>,
    state: JointState,
}

impl Robot {
    fn new(node: &mut Node, joints: &[String]) -> Result<Self, NodeError> {
        let contract = Contract::builtin()?;
        let goal = contract.servo.topic::<PoseStamped>("goal_pose", Direction::In)?;
        let twist = contract.servo.topic::<TwistStamped>("~/target_twist", Direction::In)?;
        let zeros = vec![0.0; joints.len()];
        // Joint positions at which the paper's arm is away from singularities.
        let position = [0.3, -1.0, 0.0, 0.4, 1.4, 0.1].to_vec();
        Ok(Self {
            joint_states: node.publisher(&contract.plant, "joint_states")?,
            commands: node.subscription(&contract.plant, "forward_velocity_controller/commands")?,
            goals: node.publisher_as(goal, "goal_pose")?,
            twists: node.publisher_as(twist, "/dq_servo/target_twist")?,
            state: JointState { name: joints.to_vec(), position, velocity: zeros, ..JointState::default() },
        })
    }

    /// Moves the robot by the newest command for one period, and publishes its state.
    fn move_on(&mut self) {
        if let Some(command) = self.commands.newest().message {
            for (position, speed) in self.state.position.iter_mut().zip(&command.data) {
                *position += PERIOD.as_secs_f64() * speed;
            }
            self.state.velocity = command.data;
        }
        self.state.header.stamp = Time::now();
        self.joint_states.publish(self.state.clone());
    }
}

/// A servo whose cycles the test runs, and the robot that it moves.
struct Cycles {
    cycle: Cycle,
    robot: Robot,
    /// The time of the servo and the robot. The time advances by one period per cycle, so that late wake-ups of this thread do not
    /// matter.
    now: Duration,
    /// The upward speed of the twist that is sent in each cycle [m/s]; `None` if no twists are sent.
    twist: Option<f64>,
}

impl Cycles {
    fn state(&self) -> State {
        self.cycle.servo.status().state
    }

    /// Runs one cycle, and returns the number of allocations in it.
    fn run_one(&mut self) -> u64 {
        self.robot.move_on();
        if let Some(up) = self.twist {
            let linear = Vector3 { z: up, ..Vector3::default() };
            let twist = Twist { linear, ..Twist::default() };
            self.robot.twists.publish(TwistStamped { header: Header::now("base_link"), twist });
        }
        std::thread::sleep(PERIOD);
        self.now += PERIOD;
        let tick = Tick { now: self.now, lateness: Duration::ZERO, missed: 0, worked: None };
        let cycle = || assert!(self.cycle.tick(tick).is_continue());
        measure(cycle).count_total
    }

    /// Runs cycles until the servo is in `state`, and then [`COUNT`] warm-up cycles. After that, runs [`COUNT`] more cycles and
    /// returns their numbers of allocations, sorted.
    fn count(&mut self, state: State) -> Vec<u64> {
        let end = Instant::now() + Duration::from_secs(20);
        while self.state() != state {
            assert!(Instant::now() < end, "{} instead of {state}", self.state());
            self.run_one();
        }
        (0..COUNT).for_each(|_| {
            self.run_one();
        });
        let mut allocations: Vec<_> = (0..COUNT).map(|_| self.run_one()).collect();
        assert_eq!(self.state(), state);
        allocations.sort_unstable();
        allocations
    }
}

/// The number of cycles that are counted in each state. These cycles take half a second, in which each topic at 10 Hz is due five
/// times.
const COUNT: usize = 250;

/// Publishes the same message [`COUNT`] times. Returns the number of allocations of each publication, sorted.
fn writing_allocations<M: Message>(
    topic: &str,
    message: M,
    publisher: fn(&mut Node, &NodeContract, &str) -> Result<Publisher<M>, RosError>,
) -> Vec<u64> {
    let ((_one, mut servo), (_other, mut robot)) = (node("servo"), node("robot"));
    let contract = Contract::builtin().unwrap().servo;
    let publisher = publisher(&mut servo, &contract, topic).unwrap();
    let entry = contract.topic::<M>(topic, Direction::Out).unwrap();
    let heard: Subscription<M> = robot.subscription_as(entry, publisher.topic()).unwrap();
    while publisher.readers() == 0 {
        std::thread::sleep(PERIOD);
    }
    let message = std::sync::Arc::new(message);
    let write = |_| {
        heard.newest();
        std::thread::sleep(PERIOD);
        measure(|| publisher.publish(message.clone())).count_total
    };
    let mut allocations: Vec<_> = (0..COUNT).map(write).collect();
    allocations.sort_unstable();
    allocations
}

fn command_allocations() -> (u64, u64) {
    let topic = "forward_velocity_controller/commands";
    figures(&writing_allocations(
        topic,
        Float64MultiArray::create(vec![0.5; 6], &[], Duration::ZERO),
        Node::publisher,
    ))
}

/// Returns the median and the sum of numbers that are sorted in ascending order.
fn figures(sorted: &[u64]) -> (u64, u64) {
    (sorted[sorted.len() / 2], sorted.iter().sum())
}

#[tokio::test(flavor = "multi_thread")]
async fn a_cycle_allocates_what_rustdds_does_to_write_its_command_and_nothing_else() {
    if outside("allocations::a_cycle_allocates_what_rustdds_does_to_write_its_command_and_nothing_else") {
        return;
    }
    let writing = command_allocations();
    let (session, (_robots, mut robot)) = (session(), node("robot"));
    let prepared = Prepared::<ServoParameters>::new(&RosArgs::default()).unwrap();
    let joints = prepared.parameters().joints[0].names().to_vec();
    let servo = Assembled::new(&session, prepared).unwrap();
    let robot = Robot::new(&mut robot, &joints).unwrap();
    let _report = servo.report.spawn(servo.snapshots).unwrap();
    let mut cycles = Cycles { cycle: servo.cycle, robot, now: Duration::from_secs(1000), twist: None };
    assert_eq!(cycles.count(State::Holding).last(), Some(&0), "nothing is sent before a goal");
    let goal =
        PoseStamped { header: Header::now("base_link"), pose: [-0.125, 0.2, 0.2, 0.0, 0.0, 0.0, 1.0].into() };
    cycles.robot.goals.publish(goal);
    let pursuing = figures(&cycles.count(State::Tracking));
    cycles.twist = Some(0.02);
    let jogging = figures(&cycles.count(State::Jogging));
    cycles.twist = None;
    let holding = figures(&cycles.count(State::Holding));
    for (what, (median, sum)) in [("pursuing", pursuing), ("jogging", jogging), ("holding", holding)] {
        assert_eq!(median, writing.0, "{what}, of {writing:?}");
        // The buffers of RustDDS grow in other cycles here than in `writing`, so the sum may be larger.
        assert!(sum <= writing.1 + COUNT as u64 / 10, "{what}: {sum} of {}", writing.1);
    }
}

/// Recording a cycle for replay must not allocate memory. Most recorded cycles only append to the message in progress.
#[tokio::test(flavor = "multi_thread")]
async fn a_cycle_that_is_recorded_allocates_what_rustdds_does_to_write_its_command() {
    if outside("allocations::a_cycle_that_is_recorded_allocates_what_rustdds_does_to_write_its_command") {
        return;
    }
    let (writing, _) = command_allocations();
    let (session, (_robots, mut robot)) = (session(), node("robot"));
    let prepared = Prepared::<ServoParameters>::new(&RosArgs::default()).unwrap();
    let joints = prepared.parameters().joints[0].names().to_vec();
    let servo = Assembled::new(&session, prepared).unwrap();
    let contract = Contract::builtin().unwrap().servo;
    let entry = contract.topic::<UInt8MultiArray>("~/events", Direction::Out).unwrap();
    let records: Subscription<UInt8MultiArray> = robot.subscription_as(entry, "/dq_servo/events").unwrap();
    let robot = Robot::new(&mut robot, &joints).unwrap();
    let _report = servo.report.spawn(servo.snapshots).unwrap();
    let mut cycles = Cycles { cycle: servo.cycle, robot, now: Duration::from_secs(1000), twist: None };
    let end = Instant::now() + Duration::from_secs(20);
    while records.newest().count == 0 {
        assert!(Instant::now() < end, "no record begins");
        cycles.run_one();
    }
    let goal =
        PoseStamped { header: Header::now("base_link"), pose: [-0.125, 0.2, 0.2, 0.0, 0.0, 0.0, 1.0].into() };
    cycles.robot.goals.publish(goal);
    let (median, _) = figures(&cycles.count(State::Tracking));
    assert!(records.newest().count > 0, "it goes on");
    assert_eq!(median, writing);
}
