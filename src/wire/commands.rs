//! Commands to an arm, as messages. Topic and message type depend on the arm's controller.

use dq_core::servo::Interface;
use dq_messages::messages::*;
use std::time::Duration;

/// The mark of a guard's commands. By this mark, guards and servos distinguish a guard's commands from those of a servo.
const GUARD: &str = "guard";

/// Returns the topic of the commands to an arm with this interface: the default topic of ros2_control's controller for the
/// interface.
pub fn command_topic(interface: Interface) -> &'static str {
    match interface {
        Interface::Velocity => "forward_velocity_controller/commands",
        Interface::Position => "forward_position_controller/commands",
        Interface::Trajectory => "joint_trajectory_controller/joint_trajectory",
    }
}

/// Creates a command of velocities [rad/s, prismatic: m/s] or positions \[rad, prismatic: m\], one per joint.
pub fn command_array(numbers: Vec<f64>) -> Float64MultiArray {
    Float64MultiArray { layout: MultiArrayLayout::default(), data: numbers }
}

/// Creates a trajectory of one point: the `joints` should be at `positions` \[rad, prismatic: m\] after `time`.
pub fn command_trajectory(joints: Vec<String>, positions: Vec<f64>, time: Duration) -> JointTrajectory {
    let point = JointTrajectoryPoint { positions, time_from_start: time.into(), ..Default::default() };
    JointTrajectory { header: Header::default(), joint_names: joints, points: vec![point] }
}

/// A command that can be overwritten without allocating.
pub trait Rewrite {
    /// Overwrites the numbers of the command. `numbers` must be as long as the command.
    fn rewrite(&mut self, numbers: &[f64]);
}

impl Rewrite for Float64MultiArray {
    fn rewrite(&mut self, numbers: &[f64]) {
        self.data.copy_from_slice(numbers);
    }
}

impl Rewrite for JointTrajectory {
    fn rewrite(&mut self, numbers: &[f64]) {
        self.points.iter_mut().for_each(|point| point.positions.copy_from_slice(numbers));
    }
}

/// A command to an arm.
pub trait Command: Message {
    /// Returns the velocities [rad/s, prismatic: m/s] or positions \[rad, prismatic: m\], in the order of the command.
    fn numbers(self) -> Vec<f64>;

    /// Returns the numbers in the order of `joints`; an empty list if the command does not name all these joints.
    fn in_order(&self, joints: &[String]) -> Vec<f64>;

    /// Returns whether a guard has sent the command.
    fn is_of_guard(&self) -> bool;

    /// Returns the command with the mark of a guard.
    #[must_use]
    fn of_guard(self) -> Self;
}

impl Command for Float64MultiArray {
    fn numbers(self) -> Vec<f64> {
        self.data
    }

    fn in_order(&self, _joints: &[String]) -> Vec<f64> {
        self.data.clone()
    }

    fn is_of_guard(&self) -> bool {
        self.layout.dim.first().is_some_and(|dim| dim.label == GUARD)
    }

    fn of_guard(self) -> Self {
        let size = u32::try_from(self.data.len()).unwrap_or(u32::MAX);
        let dim = vec![MultiArrayDimension { label: GUARD.to_owned(), size, stride: size }];
        Self { layout: MultiArrayLayout { dim, data_offset: 0 }, ..self }
    }
}

impl Command for JointTrajectory {
    fn numbers(self) -> Vec<f64> {
        self.points.into_iter().next_back().unwrap_or_default().positions
    }

    fn in_order(&self, joints: &[String]) -> Vec<f64> {
        self.target(joints).map(|(positions, _)| positions).unwrap_or_default()
    }

    /// The mark of a guard is the frame in the header. Controllers ignore the frame.
    fn is_of_guard(&self) -> bool {
        self.header.frame_id == GUARD
    }

    fn of_guard(self) -> Self {
        Self { header: Header { frame_id: GUARD.to_owned(), ..self.header }, ..self }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Contract;
    use dq_messages::Direction;

    #[test]
    fn the_contract_has_a_topic_for_each_interface() {
        let contract = Contract::builtin().unwrap();
        for name in Interface::NAMES {
            let interface: Interface = name.parse().unwrap();
            let topic = command_topic(interface);
            let has = |node: &dq_messages::NodeContract, topic: &str, direction| match interface {
                Interface::Trajectory => node.topic::<JointTrajectory>(topic, direction).is_ok(),
                _ => node.topic::<Float64MultiArray>(topic, direction).is_ok(),
            };
            assert!(
                has(&contract.servo, topic, Direction::Out) && has(&contract.plant, topic, Direction::In)
            );
            assert!(has(&contract.dual, &format!("left/{topic}"), Direction::Out));
            assert!(has(&contract.dual, &format!("right/{topic}"), Direction::Out));
        }
    }

    #[test]
    fn a_trajectory_is_read_by_joint_name() {
        let names = |names: [&str; 2]| names.map(str::to_owned).to_vec();
        let time = Duration::from_millis(1250);
        let message = command_trajectory(names(["a", "b"]), vec![1.0, 2.0], time);
        assert_eq!(message.target(&names(["b", "a"])), Some((vec![2.0, 1.0], time)));
        assert_eq!(message.target(&names(["a", "c"])), None);
        assert_eq!(message.numbers(), [1.0, 2.0]);
        assert_eq!(JointTrajectory::default().target(&names(["a", "b"])), None);
        let negative = DurationMessage { sec: -1, nanosec: 5 };
        assert_eq!(Duration::from(&negative), Duration::ZERO);
    }

    /// With six joints, the encoded command has 48 bytes for the speeds. The rest encodes the number of joints and an empty layout.
    #[test]
    fn commands_carry_their_numbers_and_nothing_else() {
        let mut command = command_array(vec![0.0; 6]);
        command.rewrite(&[0.5; 6]);
        let cdr_le = rustdds::RepresentationIdentifier::CDR_LE;
        let mut bytes = Vec::new();
        rustdds::serialization::to_writer_with_rep_id(&mut bytes, &command, cdr_le).unwrap();
        assert_eq!(
            bytes.len(),
            48 + 4 + 4 + 4 + 4,
            "two lengths, an offset and the padding before the speeds"
        );
    }

    #[test]
    fn a_guard_s_commands_are_recognized_in_every_type() {
        let array = command_array(vec![0.0; 6]);
        assert!(!array.is_of_guard() && array.of_guard().is_of_guard());
        let trajectory = command_trajectory(Vec::new(), Vec::new(), Duration::ZERO);
        assert!(!trajectory.is_of_guard() && trajectory.of_guard().is_of_guard());
    }
}
