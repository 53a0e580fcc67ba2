//! Messages for RViz, Foxglove and similar viewers: markers, paths, and interactive markers.

use super::messages::{
    DurationMessage, Header, Message, Point, Pose, PoseStamped, Quaternion, ServiceType, Vector3, message,
    service,
};
use serde::{Deserialize, Serialize};

message! {
    /// A color. Each component is from 0 to 1.
    ColorRGBA = "std_msgs/msg/ColorRGBA" {
        r: f32,
        g: f32,
        b: f32,
        a: f32,
    }

    /// An image; our messages have none.
    CompressedImage = "sensor_msgs/msg/CompressedImage" {
        header: Header,
        format: String,
        data: Vec<u8>,
    }

    /// A position in a texture; our messages have none.
    UVCoordinate = "visualization_msgs/msg/UVCoordinate" {
        u: f32,
        v: f32,
    }

    /// A mesh; our messages have none.
    MeshFile = "visualization_msgs/msg/MeshFile" {
        filename: String,
        data: Vec<u8>,
    }

    /// A shape to draw.
    Marker = "visualization_msgs/msg/Marker" {
        header: Header,
        /// The namespace of the marker. Namespace and `id` together identify the marker.
        ns: String,
        id: i32,
        /// The shape: a constant of `Marker.msg`, such as [`LINE_STRIP`](Self::LINE_STRIP) or [`LINE_LIST`](Self::LINE_LIST).
        #[serde(rename = "type")]
        kind: i32,
        /// What to do with the marker: [`ADD`](Self::ADD) or [`DELETE`](Self::DELETE).
        action: i32,
        pose: Pose,
        /// The size \[m\]. For lines, `x` is the width.
        scale: Vector3,
        color: ColorRGBA,
        lifetime: DurationMessage,
        frame_locked: bool,
        points: Vec<Point>,
        colors: Vec<ColorRGBA>,
        texture_resource: String,
        texture: CompressedImage,
        uv_coordinates: Vec<UVCoordinate>,
        text: String,
        mesh_resource: String,
        mesh_file: MeshFile,
        mesh_use_embedded_materials: bool,
    }
}

impl Marker {
    /// A box.
    pub const CUBE: i32 = 1;
    /// A ball.
    pub const SPHERE: i32 = 2;
    /// A cylinder.
    pub const CYLINDER: i32 = 3;
    /// A line through all points.
    pub const LINE_STRIP: i32 = 4;
    /// Separate lines: one from point 0 to point 1, one from point 2 to point 3, and so on.
    pub const LINE_LIST: i32 = 5;
    /// A triangle for every three points.
    pub const TRIANGLE_LIST: i32 = 11;
    /// Draws or replaces the marker.
    pub const ADD: i32 = 0;
    /// Removes the marker.
    pub const DELETE: i32 = 2;
    /// Removes all markers.
    pub const DELETE_ALL: i32 = 3;
}

message! {
    /// Shapes to draw.
    MarkerArray = "visualization_msgs/msg/MarkerArray" {
        markers: Vec<Marker>,
    }

    /// A sequence of poses.
    Path = "nav_msgs/msg/Path" {
        header: Header,
        poses: Vec<PoseStamped>,
    }

    /// An entry of a marker's menu; our markers have none.
    MenuEntry = "visualization_msgs/msg/MenuEntry" {
        id: u32,
        parent_id: u32,
        title: String,
        command: String,
        command_type: u8,
    }

    /// A handle of an interactive marker.
    InteractiveMarkerControl = "visualization_msgs/msg/InteractiveMarkerControl" {
        name: String,
        /// The rotation that turns x to the handle's axis. The handle moves along this axis, or rotates about it.
        orientation: Quaternion,
        orientation_mode: u8,
        /// How the handle moves: [`MOVE_AXIS`](Self::MOVE_AXIS), [`ROTATE_AXIS`](Self::ROTATE_AXIS) or others.
        interaction_mode: u8,
        always_visible: bool,
        /// The shapes of the handle. If there are none, the client draws an arrow or a ring.
        markers: Vec<Marker>,
        independent_marker_orientation: bool,
        description: String,
    }
}

impl InteractiveMarkerControl {
    /// The handle moves along x.
    pub const MOVE_AXIS: u8 = 3;
    /// The handle rotates about x.
    pub const ROTATE_AXIS: u8 = 5;
}

message! {
    /// A marker that a user can drag.
    InteractiveMarker = "visualization_msgs/msg/InteractiveMarker" {
        header: Header,
        pose: Pose,
        name: String,
        description: String,
        /// The size of the handles \[m\].
        scale: f32,
        menu_entries: Vec<MenuEntry>,
        controls: Vec<InteractiveMarkerControl>,
    }

    /// A new pose of an interactive marker.
    InteractiveMarkerPose = "visualization_msgs/msg/InteractiveMarkerPose" {
        header: Header,
        pose: Pose,
        name: String,
    }

    /// The changes of a server's interactive markers.
    InteractiveMarkerUpdate = "visualization_msgs/msg/InteractiveMarkerUpdate" {
        server_id: String,
        /// The number of the update. A client that misses an update requests all markers again.
        seq_num: u64,
        /// The kind of the message, which is [`UPDATE`](Self::UPDATE).
        #[serde(rename = "type")]
        kind: u8,
        markers: Vec<InteractiveMarker>,
        poses: Vec<InteractiveMarkerPose>,
        erases: Vec<String>,
    }
}

impl InteractiveMarkerUpdate {
    /// An update. ROS 2 has no other kind.
    pub const UPDATE: u8 = 1;
}

message! {
    /// The action of a user on an interactive marker.
    InteractiveMarkerFeedback = "visualization_msgs/msg/InteractiveMarkerFeedback" {
        header: Header,
        #[serde(deserialize_with = "dq_common::text::deserialize_cut")]
        client_id: String,
        #[serde(deserialize_with = "dq_common::text::deserialize_cut")]
        marker_name: String,
        #[serde(deserialize_with = "dq_common::text::deserialize_cut")]
        control_name: String,
        /// The kind of action: [`POSE_UPDATE`](Self::POSE_UPDATE), [`MOUSE_UP`](Self::MOUSE_UP) or others.
        event_type: u8,
        /// The pose of the marker, in the frame of the header.
        pose: Pose,
        menu_entry_id: u32,
        mouse_point: Point,
        mouse_point_valid: bool,
    }
}

impl InteractiveMarkerFeedback {
    /// The user is dragging the marker.
    pub const POSE_UPDATE: u8 = 1;
    /// The user has released the marker.
    pub const MOUSE_UP: u8 = 5;
}

message! {
    /// The empty request of `visualization_msgs/srv/GetInteractiveMarkers`. CDR gives an empty structure one dummy octet.
    GetInteractiveMarkersRequest = "visualization_msgs/srv/GetInteractiveMarkers_Request" {
        /// The octet that rosidl puts into empty structures.
        structure_needs_at_least_one_member: u8,
    }

    /// All interactive markers of a server.
    GetInteractiveMarkersResponse = "visualization_msgs/srv/GetInteractiveMarkers_Response" {
        server_id: String,
        /// The number of the last update.
        sequence_number: u64,
        markers: Vec<InteractiveMarker>,
    }
}
service! {
    /// Returns all interactive markers of a server.
    GetInteractiveMarkers = "visualization_msgs/srv/GetInteractiveMarkers"
        (GetInteractiveMarkersRequest) -> GetInteractiveMarkersResponse;
}
