//! Commands to an arm as messages: their topic and type follow from what its controller takes.

use super::CycleLabel;
use super::messages::*;
use crate::servo::Interface;
use std::fmt::{self, Write};
use std::time::Duration;

/// The label of a guard's commands.
pub const GUARD_LABEL: &str = "guard";

/// The topic of the commands to an arm whose controller takes these: the default name of ros2_control's controller for it.
pub fn command_topic(interface: Interface) -> &'static str {
    match interface {
        Interface::Velocity => "forward_velocity_controller/commands",
        Interface::Position => "forward_position_controller/commands",
        Interface::Trajectory => "joint_trajectory_controller/joint_trajectory",
    }
}

/// Velocities [rad/s] or positions \[rad\], one a joint, with what they were made from.
pub fn command_array(numbers: Vec<f64>, label: &str) -> Float64MultiArray {
    let size = u32::try_from(numbers.len()).unwrap_or(u32::MAX);
    let dim = vec![MultiArrayDimension { label: label.to_owned(), size, stride: size }];
    Float64MultiArray { layout: MultiArrayLayout { dim, data_offset: 0 }, data: numbers }
}

/// A trajectory of one point: `joints` are at `positions` \[rad\] after `time`. Controllers do not look at the header's frame, so what
/// the point was made from stands there.
pub fn command_trajectory(
    joints: Vec<String>,
    positions: Vec<f64>,
    time: Duration,
    label: &str,
) -> JointTrajectory {
    let point = JointTrajectoryPoint { positions, time_from_start: time.into(), ..Default::default() };
    let header = LabelledHeader { stamp: Time::default(), frame_id: label.to_owned() };
    JointTrajectory { header, joint_names: joints, points: vec![point] }
}

/// The longest label of a command that finds its room made [bytes]; one of two arms has some 300.
const LABEL_ROOM: usize = 1024;

/// A command that is written into the one before, without allocating.
pub trait Rewrite {
    /// Becomes the command of these `numbers`, as many as before, made from what `label` says.
    fn rewrite(&mut self, numbers: &[f64], label: &impl fmt::Display);
}

impl Rewrite for Float64MultiArray {
    fn rewrite(&mut self, numbers: &[f64], label: &impl fmt::Display) {
        self.layout.dim.iter_mut().for_each(|dim| relabel(&mut dim.label, label));
        self.data.copy_from_slice(numbers);
    }
}

impl Rewrite for JointTrajectory {
    fn rewrite(&mut self, numbers: &[f64], label: &impl fmt::Display) {
        relabel(&mut self.header.frame_id, label);
        self.points.iter_mut().for_each(|point| point.positions.copy_from_slice(numbers));
    }
}

fn relabel(text: &mut String, label: &impl fmt::Display) {
    text.clear();
    text.reserve(LABEL_ROOM);
    // Writing into a string does not fail.
    let _ = write!(text, "{label}");
}

impl JointTrajectory {
    /// The positions \[rad\] of its last point in the order of `joints`, and when they are to be reached; none where it has no point,
    /// or not one position of each joint.
    pub fn target(&self, joints: &[String]) -> Option<(Vec<f64>, Duration)> {
        let point = self.points.last()?;
        let position = |joint: &String| {
            let place = self.joint_names.iter().position(|name| name == joint)?;
            point.positions.get(place).copied()
        };
        let positions = joints.iter().map(position).collect::<Option<Vec<_>>>()?;
        Some((positions, (&point.time_from_start).into()))
    }
}

/// The numbers of a command, and what it was made from; the label is none where it is from another program.
pub trait Command: Message {
    /// Velocities [rad/s] or positions \[rad\], in the order of the servo's joints.
    fn numbers(self) -> Vec<f64>;

    /// The same in the order of `joints`, where the command names them; none where it has other ones.
    fn in_order(&self, joints: &[String]) -> Vec<f64>;

    /// The text of its label.
    fn label_text(&self) -> Option<&str>;

    /// What it was made from.
    fn label(&self) -> Option<CycleLabel> {
        self.label_text()?.parse().ok()
    }
}

impl Command for Float64MultiArray {
    fn numbers(self) -> Vec<f64> {
        self.data
    }

    fn in_order(&self, _joints: &[String]) -> Vec<f64> {
        self.data.clone()
    }

    fn label_text(&self) -> Option<&str> {
        self.layout.dim.first().map(|dim| dim.label.as_str())
    }
}

impl Command for JointTrajectory {
    fn numbers(self) -> Vec<f64> {
        self.points.into_iter().next_back().unwrap_or_default().positions
    }

    fn in_order(&self, joints: &[String]) -> Vec<f64> {
        self.target(joints).map(|(positions, _)| positions).unwrap_or_default()
    }

    fn label_text(&self) -> Option<&str> {
        Some(&self.header.frame_id)
    }
}

impl From<Duration> for DurationMessage {
    fn from(time: Duration) -> Self {
        Self { sec: i32::try_from(time.as_secs()).unwrap_or(i32::MAX), nanosec: time.subsec_nanos() }
    }
}

/// A time that is negative counts as none.
impl From<&DurationMessage> for Duration {
    fn from(time: &DurationMessage) -> Self {
        u64::try_from(time.sec)
            .map_or(Self::ZERO, |seconds| Self::from_secs(seconds) + Self::from_nanos(time.nanosec.into()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wire::{Contract, Direction};

    #[test]
    fn the_contract_has_a_topic_for_each_interface() {
        let contract = Contract::builtin().unwrap();
        for name in Interface::NAMES {
            let interface: Interface = name.parse().unwrap();
            let topic = command_topic(interface);
            let has = |node: &crate::wire::NodeContract, topic: &str, direction| match interface {
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
    fn a_trajectory_is_read_by_joint_name_and_keeps_its_label() {
        let label = CycleLabel { goals: 3, ..CycleLabel::new(2) };
        let names = |names: [&str; 2]| names.map(str::to_owned).to_vec();
        let time = Duration::from_millis(1250);
        let message = command_trajectory(names(["a", "b"]), vec![1.0, 2.0], time, &label.to_string());
        assert_eq!(message.target(&names(["b", "a"])), Some((vec![2.0, 1.0], time)));
        assert_eq!(message.target(&names(["a", "c"])), None);
        assert_eq!(message.label(), Some(label));
        assert_eq!(message.numbers(), [1.0, 2.0]);
        assert_eq!(JointTrajectory::default().target(&names(["a", "b"])), None);
        let negative = DurationMessage { sec: -1, nanosec: 5 };
        assert_eq!(Duration::from(&negative), Duration::ZERO);
    }
}
