//! The standard messages that go over the wire, as their `.msg` definitions give them: field for field, in order.
//!
//! Only what the nodes publish, subscribe or serve is here. Encoding is plain CDR (little endian on the wire), and a
//! test compares it with the bytes of a real ROS 2 (`tests/data/cdr_jazzy.json`).

use serde::{Deserialize, Serialize, de::DeserializeOwned};

/// A ROS 2 message with its type name.
pub trait Message: Serialize + DeserializeOwned + Clone + Send + Sync + 'static {
    /// The ROS 2 name: `package/msg/Name`.
    const TYPE: &'static str;
}

/// A ROS 2 service: its two messages and its type name.
pub trait ServiceType: 'static {
    /// The ROS 2 name: `package/srv/Name`.
    const TYPE: &'static str;
    /// What the client sends.
    type Request: Serialize + DeserializeOwned + Clone + Send + 'static;
    /// What the server answers.
    type Response: Serialize + DeserializeOwned + Send + 'static;

    /// What is answered in place of an answer of that many bytes, where no more than `room` can be read by the client; none where
    /// the service has no way to say so.
    fn too_long(_bytes: usize, _room: usize) -> Option<Self::Response> {
        None
    }
}

/// Declares message structs that derive what every message needs. Fields say themselves what they are, but for units and the like.
macro_rules! message {
    ($(#[$meta:meta])* $name:ident = $type:literal { $($(#[$field_meta:meta])* $field:ident : $kind:ty),* $(,)? }) => {
        $(#[$meta])*
        #[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
        pub struct $name {
            $(
                $(#[$field_meta])*
                #[doc = concat!("The field `", stringify!($field), "` of the definition.")]
                pub $field: $kind
            ),*
        }
        impl Message for $name { const TYPE: &'static str = $type; }
    };
}

/// Declares a service type by its two message structs.
macro_rules! service {
    (
        $(#[$meta:meta])* $name:ident = $type:literal ($request:ty) -> $response:ty
        $(, too_long |$bytes:ident, $room:ident| $instead:expr)?
    ) => {
        $(#[$meta])*
        pub struct $name;
        impl ServiceType for $name {
            const TYPE: &'static str = $type;
            type Request = $request;
            type Response = $response;
            $(fn too_long($bytes: usize, $room: usize) -> Option<$response> {
                Some($instead)
            })?
        }
    };
}
pub(crate) use {message, service};

message! {
    /// A point in time: seconds and nanoseconds since the Unix epoch.
    Time = "builtin_interfaces/msg/Time" {
        sec: i32,
        nanosec: u32,
    }
}

impl Time {
    /// The wall clock's time. Clocks before 1970 or after 2038 saturate.
    pub fn now() -> Self {
        let since_epoch =
            std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH).unwrap_or_default();
        Self {
            sec: i32::try_from(since_epoch.as_secs()).unwrap_or(i32::MAX),
            nanosec: since_epoch.subsec_nanos(),
        }
    }

    /// Nanoseconds since the Unix epoch.
    pub fn nanoseconds(&self) -> i64 {
        i64::from(self.sec) * 1_000_000_000 + i64::from(self.nanosec)
    }

    /// The time `age` before this one; those before 1970 saturate.
    pub fn before(&self, age: std::time::Duration) -> Self {
        let age = i64::try_from(age.as_nanos()).unwrap_or(i64::MAX);
        Self::from_nanoseconds(self.nanoseconds().saturating_sub(age))
    }

    /// So many nanoseconds since the epoch, which times before it saturate to.
    pub fn from_nanoseconds(nanoseconds: i64) -> Self {
        let nanoseconds = nanoseconds.max(0).unsigned_abs();
        let (sec, nanosec) = (nanoseconds / 1_000_000_000, nanoseconds % 1_000_000_000);
        Self {
            sec: i32::try_from(sec).unwrap_or(i32::MAX),
            nanosec: u32::try_from(nanosec).unwrap_or_default(),
        }
    }

    /// The next instant that differs from this one.
    pub fn plus_a_nanosecond(&self) -> Self {
        match self.nanosec {
            ..999_999_999 => Self { nanosec: self.nanosec + 1, ..*self },
            _ => Self { sec: self.sec.saturating_add(1), nanosec: 0 },
        }
    }

    /// Whether nobody has set it.
    pub fn is_zero(&self) -> bool {
        *self == Self::default()
    }
}

/// Seconds and nanoseconds with a point between, nine digits after it.
impl std::fmt::Display for Time {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}.{:09}", self.sec, self.nanosec)
    }
}

message! {
    /// When and in which frame.
    Header = "std_msgs/msg/Header" {
        stamp: Time,
        #[serde(deserialize_with = "crate::text::deserialize_cut")]
        frame_id: String,
    }
}

impl Header {
    /// A header stamped with the wall clock's time.
    pub fn now(frame_id: &str) -> Self {
        Self { stamp: Time::now(), frame_id: frame_id.to_owned() }
    }
}

message! {
    /// A line of a node's log.
    Log = "rcl_interfaces/msg/Log" {
        /// When it was logged.
        stamp: Time,
        /// 10 debug, 20 info, 30 warn, 40 error, 50 fatal.
        level: u8,
        /// The logger, named as its node with dots for slashes.
        name: String,
        /// The text.
        msg: String,
        /// The source file, if that is said.
        file: String,
        /// The function, if that is said.
        function: String,
        /// The line in the source file.
        line: u32,
    }
}
message! {
    /// UTF-8 text.
    StringMessage = "std_msgs/msg/String" {
        data: String,
    }
}
message! {
    /// One dimension of a multi-array.
    MultiArrayDimension = "std_msgs/msg/MultiArrayDimension" {
        label: String,
        size: u32,
        stride: u32,
    }
}
message! {
    /// How a multi-array is laid out.
    MultiArrayLayout = "std_msgs/msg/MultiArrayLayout" {
        /// The dimensions, outermost first; empty for a plain list.
        ///
        #[serde(deserialize_with = "crate::text::deserialize_few")]
        dim: Vec<MultiArrayDimension>,
        data_offset: u32,
    }
}
message! {
    /// Numbers: the joint velocity command [rad/s] in the order of the parameter `joints`.
    Float64MultiArray = "std_msgs/msg/Float64MultiArray" {
        layout: MultiArrayLayout,
        #[serde(deserialize_with = "crate::text::deserialize_few")]
        data: Vec<f64>,
    }
}
message! {
    /// A point or position \[m\].
    Point = "geometry_msgs/msg/Point" {
        x: f64,
        y: f64,
        z: f64,
    }
}
message! {
    /// A vector in space.
    Vector3 = "geometry_msgs/msg/Vector3" {
        x: f64,
        y: f64,
        z: f64,
    }
}
message! {
    /// A rotation, scalar last as ROS has it.
    Quaternion = "geometry_msgs/msg/Quaternion" {
        x: f64,
        y: f64,
        z: f64,
        w: f64,
    }
}
message! {
    /// Position and orientation.
    Pose = "geometry_msgs/msg/Pose" {
        /// Position \[m\].
        ///
        position: Point,
        orientation: Quaternion,
    }
}
message! {
    /// A pose with time and frame.
    PoseStamped = "geometry_msgs/msg/PoseStamped" {
        header: Header,
        pose: Pose,
    }
}
message! {
    /// Linear \[m\] or [m/s] and angular \[rad\] or [rad/s] parts.
    Twist = "geometry_msgs/msg/Twist" {
        linear: Vector3,
        angular: Vector3,
    }
}
message! {
    /// A twist with time and frame.
    TwistStamped = "geometry_msgs/msg/TwistStamped" {
        header: Header,
        twist: Twist,
    }
}
message! {
    /// Position and orientation of a child frame.
    Transform = "geometry_msgs/msg/Transform" {
        /// Translation \[m\].
        ///
        translation: Vector3,
        rotation: Quaternion,
    }
}
message! {
    /// A transform from `header.frame_id` to `child_frame_id`.
    TransformStamped = "geometry_msgs/msg/TransformStamped" {
        header: Header,
        #[serde(deserialize_with = "crate::text::deserialize_cut")]
        child_frame_id: String,
        transform: Transform,
    }
}
message! {
    /// Transforms for TF.
    TFMessage = "tf2_msgs/msg/TFMessage" {
        #[serde(deserialize_with = "crate::text::deserialize_few")]
        transforms: Vec<TransformStamped>,
    }
}
message! {
    /// Joint names with positions \[rad\], velocities [rad/s] and efforts, each list as long as `name` or empty.
    JointState = "sensor_msgs/msg/JointState" {
        header: Header,
        #[serde(deserialize_with = "crate::text::deserialize_cuts")]
        name: Vec<String>,
        /// Positions \[rad\].
        ///
        #[serde(deserialize_with = "crate::text::deserialize_few")]
        position: Vec<f64>,
        /// Velocities [rad/s].
        ///
        #[serde(deserialize_with = "crate::text::deserialize_few")]
        velocity: Vec<f64>,
        /// Efforts [N m].
        ///
        #[serde(deserialize_with = "crate::text::deserialize_few")]
        effort: Vec<f64>,
    }
}
message! {
    /// The simulated time.
    ClockMessage = "rosgraph_msgs/msg/Clock" {
        clock: Time,
    }
}
message! {
    /// A span of time.
    DurationMessage = "builtin_interfaces/msg/Duration" {
        sec: i32,
        nanosec: u32,
    }
}
message! {
    /// The header of a command, whose frame is a label of what it was made from.
    LabelledHeader = "std_msgs/msg/Header" {
        stamp: Time,
        frame_id: String,
    }
}
message! {
    /// Where the joints are to be at a time, each list as long as the trajectory's names or empty.
    JointTrajectoryPoint = "trajectory_msgs/msg/JointTrajectoryPoint" {
        /// Positions \[rad\].
        ///
        #[serde(deserialize_with = "crate::text::deserialize_few")]
        positions: Vec<f64>,
        /// Velocities [rad/s].
        ///
        #[serde(deserialize_with = "crate::text::deserialize_few")]
        velocities: Vec<f64>,
        /// Accelerations [rad/s²].
        ///
        #[serde(deserialize_with = "crate::text::deserialize_few")]
        accelerations: Vec<f64>,
        /// Efforts [N m].
        ///
        #[serde(deserialize_with = "crate::text::deserialize_few")]
        effort: Vec<f64>,
        time_from_start: DurationMessage,
    }
}
message! {
    /// Joint names with the points that they are to pass.
    JointTrajectory = "trajectory_msgs/msg/JointTrajectory" {
        header: LabelledHeader,
        #[serde(deserialize_with = "crate::text::deserialize_cuts")]
        joint_names: Vec<String>,
        #[serde(deserialize_with = "crate::text::deserialize_few")]
        points: Vec<JointTrajectoryPoint>,
    }
}
message! {
    /// A figure of a status: name and value.
    KeyValue = "diagnostic_msgs/msg/KeyValue" {
        #[serde(deserialize_with = "crate::text::deserialize_cut")]
        key: String,
        #[serde(deserialize_with = "crate::text::deserialize_cut")]
        value: String,
    }
}
message! {
    /// Status of one component.
    DiagnosticStatus = "diagnostic_msgs/msg/DiagnosticStatus" {
        /// 0 OK, 1 WARN, 2 ERROR, 3 STALE.
        ///
        level: u8,
        #[serde(deserialize_with = "crate::text::deserialize_cut")]
        name: String,
        #[serde(deserialize_with = "crate::text::deserialize_cut")]
        message: String,
        #[serde(deserialize_with = "crate::text::deserialize_cut")]
        hardware_id: String,
        values: Vec<KeyValue>,
    }
}
message! {
    /// Statuses at one time.
    DiagnosticArray = "diagnostic_msgs/msg/DiagnosticArray" {
        header: Header,
        status: Vec<DiagnosticStatus>,
    }
}
message! {
    /// The empty request of `std_srvs/srv/Trigger`: CDR gives an empty structure one dummy octet.
    TriggerRequest = "std_srvs/srv/Trigger_Request" {
        /// The octet that rosidl puts into empty structures.
        ///
        structure_needs_at_least_one_member: u8,
    }
}
message! {
    /// Whether a service did what it was asked to.
    SuccessResponse = "std_srvs/srv/Trigger_Response" {
        success: bool,
        #[serde(deserialize_with = "crate::text::deserialize_cut")]
        message: String,
    }
}
message! {
    /// The request of `std_srvs/srv/SetBool`.
    SetBoolRequest = "std_srvs/srv/SetBool_Request" {
        data: bool,
    }
}
service! {
    /// Does one thing.
    Trigger = "std_srvs/srv/Trigger" (TriggerRequest) -> SuccessResponse
}
service! {
    /// Switches one thing on or off.
    SetBool = "std_srvs/srv/SetBool" (SetBoolRequest) -> SuccessResponse
}

#[cfg(test)]
mod tests {
    use super::*;
    use rustdds::{RepresentationIdentifier, serialization};
    use std::fmt::Debug;

    /// Bytes that a real ROS 2 Jazzy made, with the values they encode.
    const FIXTURE: &str = include_str!("../../tests/data/cdr_jazzy.json");

    /// Decodes every fixture of `M` and encodes it back, to the byte. Returns how many there were.
    fn check<M: Message + Debug>() -> usize {
        let all: Vec<serde_json::Value> = serde_json::from_str(FIXTURE).unwrap();
        let cases: Vec<_> = all.iter().filter(|case| case["type"] == M::TYPE).collect();
        for case in &cases {
            let bytes = hex::decode(case["cdr"].as_str().unwrap()).unwrap();
            let (encapsulation, payload) = bytes.split_at(4);
            assert_eq!(encapsulation, [0, 1, 0, 0], "CDR little endian");
            let cdr_le = RepresentationIdentifier::CDR_LE;
            let (message, _) = serialization::deserialize_from_cdr_with_rep_id::<M>(payload, cdr_le).unwrap();
            let mut encoded = Vec::new();
            serialization::to_writer_with_rep_id(&mut encoded, &message, cdr_le).unwrap();
            // ROS 2 pads the payload to four bytes, and the padding carries no data.
            let (data, padding) = payload.split_at(encoded.len());
            assert_eq!(data, encoded, "{message:?}");
            assert!(padding.len() < 4 && padding.iter().all(|&byte| byte == 0), "{message:?}");
            check_value(&case["value"], &serde_json::to_value(&message).unwrap());
        }
        cases.len()
    }

    /// Compares the fixture's value with ours; bytes are one-character strings there.
    fn check_value(expected: &serde_json::Value, ours: &serde_json::Value) {
        use serde_json::Value;
        match (expected, ours) {
            (Value::Object(a), Value::Object(b)) => {
                assert_eq!(a.len(), b.len());
                a.iter().for_each(|(key, value)| check_value(value, &b[key]));
            }
            (Value::Array(a), Value::Array(b)) => {
                assert_eq!(a.len(), b.len());
                a.iter().zip(b).for_each(|(x, y)| check_value(x, y));
            }
            (Value::String(text), Value::Number(byte)) => {
                assert_eq!(text.bytes().next().map(u64::from), byte.as_u64());
            }
            (Value::Number(a), Value::Number(b)) => assert_eq!(a.as_f64(), b.as_f64()),
            _ => assert_eq!(expected, ours),
        }
    }

    #[test]
    fn messages_encode_to_the_bytes_of_a_real_ros_2() {
        assert_eq!(check::<PoseStamped>(), 1);
        assert_eq!(check::<JointState>(), 2);
        assert_eq!(check::<Float64MultiArray>(), 2);
        assert_eq!(check::<StringMessage>(), 1);
        assert_eq!(check::<TwistStamped>(), 1);
        assert_eq!(check::<DiagnosticStatus>(), 1);
        assert_eq!(check::<DiagnosticArray>(), 1);
        assert_eq!(check::<TFMessage>(), 1);
    }

    #[test]
    fn now_is_after_this_code_was_written() {
        assert!(Time::now().sec > 1_790_000_000);
    }

    #[test]
    fn a_time_before_another_is_that_much_earlier() {
        let time = Time { sec: 7, nanosec: 3 };
        let before = |ms| time.before(std::time::Duration::from_millis(ms));
        assert_eq!(before(0), time);
        assert_eq!(before(2500), Time { sec: 4, nanosec: 500_000_003 });
        assert_eq!(before(9000), Time::default());
    }

    #[test]
    fn the_next_instant_is_a_nanosecond_later() {
        for (sec, nanosec) in [(0, 0), (7, 999_999_998), (7, 999_999_999)] {
            let time = Time { sec, nanosec };
            assert_eq!(time.plus_a_nanosecond().nanoseconds(), time.nanoseconds() + 1);
        }
    }
}
