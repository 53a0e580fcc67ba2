//! Messages about joints: their states and commands.

use super::{DurationMessage, Header, Message, message};
use serde::{Deserialize, Serialize};

message! {
    /// A number, for example the fraction of the commanded speed at which a robot moves.
    Float64 = "std_msgs/msg/Float64" {
        data: f64,
    }

    /// One dimension of a multi-array.
    MultiArrayDimension = "std_msgs/msg/MultiArrayDimension" {
        label: String,
        size: u32,
        stride: u32,
    }

    /// The layout of a multi-array.
    MultiArrayLayout = "std_msgs/msg/MultiArrayLayout" {
        /// The dimensions, outermost first; empty for a plain list.
        #[serde(deserialize_with = "dq_common::text::deserialize_few")]
        dim: Vec<MultiArrayDimension>,
        data_offset: u32,
    }

    /// A list of numbers, such as the commanded joint velocities [rad/s, prismatic: m/s] in the order of the parameter `joints`.
    Float64MultiArray = "std_msgs/msg/Float64MultiArray" {
        layout: MultiArrayLayout,
        #[serde(deserialize_with = "dq_common::text::deserialize_few")]
        data: Vec<f64>,
    }

    /// A list of bytes, such as the record of a servo's cycle.
    UInt8MultiArray = "std_msgs/msg/UInt8MultiArray" {
        layout: MultiArrayLayout,
        data: Vec<u8>,
    }

    /// The positions, velocities and efforts of the joints in `name`. Each of the other lists is as long as `name`, or empty.
    JointState = "sensor_msgs/msg/JointState" {
        header: Header,
        #[serde(deserialize_with = "dq_common::text::deserialize_cuts")]
        name: Vec<String>,
        /// Positions \[rad, prismatic: m\].
        #[serde(deserialize_with = "dq_common::text::deserialize_few")]
        position: Vec<f64>,
        /// Velocities [rad/s, prismatic: m/s].
        #[serde(deserialize_with = "dq_common::text::deserialize_few")]
        velocity: Vec<f64>,
        /// Efforts [N m, prismatic: N].
        #[serde(deserialize_with = "dq_common::text::deserialize_few")]
        effort: Vec<f64>,
    }

    /// The desired state of joints at a time. Each list is as long as the trajectory's list of names, or empty.
    JointTrajectoryPoint = "trajectory_msgs/msg/JointTrajectoryPoint" {
        /// Positions \[rad, prismatic: m\].
        #[serde(deserialize_with = "dq_common::text::deserialize_few")]
        positions: Vec<f64>,
        /// Velocities [rad/s, prismatic: m/s].
        #[serde(deserialize_with = "dq_common::text::deserialize_few")]
        velocities: Vec<f64>,
        /// Accelerations [rad/s², prismatic: m/s²].
        #[serde(deserialize_with = "dq_common::text::deserialize_few")]
        accelerations: Vec<f64>,
        /// Efforts [N m, prismatic: N].
        #[serde(deserialize_with = "dq_common::text::deserialize_few")]
        effort: Vec<f64>,
        time_from_start: DurationMessage,
    }

    /// Joint names, and the points that these joints should pass.
    JointTrajectory = "trajectory_msgs/msg/JointTrajectory" {
        header: Header,
        #[serde(deserialize_with = "dq_common::text::deserialize_cuts")]
        joint_names: Vec<String>,
        #[serde(deserialize_with = "dq_common::text::deserialize_few")]
        points: Vec<JointTrajectoryPoint>,
    }
}
