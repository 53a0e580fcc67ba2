//! Commands to an arm, as messages. Topic and message type depend on the arm's controller.

use dq_core::servo::Interface;
use dq_messages::messages::*;
use std::time::Duration;

/// The mark of a guard's commands. Guards and servos use it to distinguish the commands of a guard from those of a servo.
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

/// Evaluates `$expression`. In it, `$Command` is the message type of the commands to an arm with the interface `$interface`.
#[macro_export]
macro_rules! with_command {
    ($interface:expr, $Command:ident => $expression:expr) => {
        match $interface {
            $crate::command_types::Interface::Velocity | $crate::command_types::Interface::Position => {
                type $Command = $crate::command_types::Float64MultiArray;
                $expression
            }
            $crate::command_types::Interface::Trajectory => {
                type $Command = $crate::command_types::JointTrajectory;
                $expression
            }
        }
    };
}

/// A command to an arm. [`with_command`](crate::with_command) chooses the message type.
pub trait Command: Message {
    /// Creates a command of velocities [rad/s, prismatic: m/s] or positions \[rad, prismatic: m\], one for each of the `joints`. If
    /// the command is a trajectory, it reaches the positions after `time`. Other commands ignore `time`.
    fn create(numbers: Vec<f64>, joints: &[String], time: Duration) -> Self;

    /// Overwrites the numbers of the command without allocating. The command keeps its length, so there must be as many numbers
    /// as before.
    fn rewrite(&mut self, numbers: &[f64]);

    /// Returns the velocities [rad/s, prismatic: m/s] or positions \[rad, prismatic: m\], in the order of the servo's joints.
    fn numbers(self) -> Vec<f64>;

    /// Returns the numbers in the order of `joints`, and the time within which the arm should reach them. `None` for a trajectory
    /// that has no position for one of the `joints`.
    fn target(&self, joints: &[String]) -> Option<(Vec<f64>, Duration)>;

    /// Returns whether a guard has sent the command.
    fn is_of_guard(&self) -> bool;

    /// Marks the command as one of a guard, and returns it. Controllers ignore the mark.
    #[must_use]
    fn of_guard(self) -> Self;
}

impl Command for Float64MultiArray {
    fn create(numbers: Vec<f64>, _joints: &[String], _time: Duration) -> Self {
        Self { layout: MultiArrayLayout::default(), data: numbers }
    }

    fn rewrite(&mut self, numbers: &[f64]) {
        self.data.copy_from_slice(numbers);
    }

    fn numbers(self) -> Vec<f64> {
        self.data
    }

    fn target(&self, _joints: &[String]) -> Option<(Vec<f64>, Duration)> {
        Some((self.data.clone(), Duration::ZERO))
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
    fn create(positions: Vec<f64>, joints: &[String], time: Duration) -> Self {
        let point = JointTrajectoryPoint { positions, time_from_start: time.into(), ..Default::default() };
        Self { header: Header::default(), joint_names: joints.to_vec(), points: vec![point] }
    }

    fn rewrite(&mut self, numbers: &[f64]) {
        self.points.iter_mut().for_each(|point| point.positions.copy_from_slice(numbers));
    }

    fn numbers(self) -> Vec<f64> {
        self.points.into_iter().next_back().unwrap_or_default().positions
    }

    fn target(&self, joints: &[String]) -> Option<(Vec<f64>, Duration)> {
        let point = self.points.last()?;
        let position = |joint: &String| {
            let place = self.joint_names.iter().position(|name| name == joint)?;
            point.positions.get(place).copied()
        };
        let positions = joints.iter().map(position).collect::<Option<Vec<_>>>()?;
        Some((positions, (&point.time_from_start).into()))
    }

    /// Checks the frame in the header, because [`of_guard`](Self::of_guard) writes the mark there.
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
            let has = |node: &dq_messages::NodeContract, topic: &str, direction| with_command!(interface, M => node.topic::<M>(topic, direction).is_ok());
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
        let message = JointTrajectory::create(vec![1.0, 2.0], &names(["a", "b"]), time);
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
        let mut command = Float64MultiArray::create(vec![0.0; 6], &[], Duration::ZERO);
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
        for name in Interface::NAMES {
            with_command!(name.parse().unwrap(), M => {
                let command = M::create(vec![0.0; 6], &[], Duration::ZERO);
                assert!(!command.is_of_guard() && command.of_guard().is_of_guard());
            });
        }
    }
}
