//! Geometric messages: positions, poses and motions.

use super::{Header, Message, message};
use serde::{Deserialize, Serialize};

message! {
    /// A point or position \[m\].
    Point = "geometry_msgs/msg/Point" {
        x: f64,
        y: f64,
        z: f64,
    }

    /// A vector in space.
    Vector3 = "geometry_msgs/msg/Vector3" {
        x: f64,
        y: f64,
        z: f64,
    }

    /// A rotation. The scalar comes last, as in ROS.
    Quaternion = "geometry_msgs/msg/Quaternion" {
        x: f64,
        y: f64,
        z: f64,
        w: f64,
    }

    /// A position and an orientation.
    Pose = "geometry_msgs/msg/Pose" {
        /// Position \[m\].
        position: Point,
        orientation: Quaternion,
    }

    /// A pose, with its time and frame.
    PoseStamped = "geometry_msgs/msg/PoseStamped" {
        header: Header,
        pose: Pose,
    }

    /// A linear velocity [m/s] and an angular velocity [rad/s]. In a pose error, the two vectors are in \[m\] and \[rad\].
    Twist = "geometry_msgs/msg/Twist" {
        linear: Vector3,
        angular: Vector3,
    }

    /// A twist, with its time and frame.
    TwistStamped = "geometry_msgs/msg/TwistStamped" {
        header: Header,
        twist: Twist,
    }

    /// A force \[N\] and a torque \[N m\].
    Wrench = "geometry_msgs/msg/Wrench" {
        force: Vector3,
        torque: Vector3,
    }

    /// A wrench, with its time and frame.
    WrenchStamped = "geometry_msgs/msg/WrenchStamped" {
        header: Header,
        wrench: Wrench,
    }

    /// The position and the orientation of a child frame in its parent frame.
    Transform = "geometry_msgs/msg/Transform" {
        /// Translation \[m\].
        translation: Vector3,
        rotation: Quaternion,
    }

    /// The pose of the frame `child_frame_id` in the frame `header.frame_id`.
    TransformStamped = "geometry_msgs/msg/TransformStamped" {
        header: Header,
        #[serde(deserialize_with = "dq_common::text::deserialize_cut")]
        child_frame_id: String,
        transform: Transform,
    }

    /// Transforms, as TF publishes them.
    TFMessage = "tf2_msgs/msg/TFMessage" {
        #[serde(deserialize_with = "dq_common::text::deserialize_few")]
        transforms: Vec<TransformStamped>,
    }
}
