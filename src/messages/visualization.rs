//! What RViz, Foxglove and the like draw: markers, paths, and the interactive markers that their users drag.

use super::messages::{
    DurationMessage, Header, Message, Point, Pose, PoseStamped, Quaternion, ServiceType, Vector3, message,
    service,
};
use serde::{Deserialize, Serialize};

message! {
    /// A colour, each part from 0 to 1.
    ColorRGBA = "std_msgs/msg/ColorRGBA" {
        r: f32,
        g: f32,
        b: f32,
        a: f32,
    }
}
message! {
    /// A picture, of which ours have none.
    CompressedImage = "sensor_msgs/msg/CompressedImage" {
        header: Header,
        format: String,
        data: Vec<u8>,
    }
}
message! {
    /// A place in a texture, of which ours have none.
    UVCoordinate = "visualization_msgs/msg/UVCoordinate" {
        u: f32,
        v: f32,
    }
}
message! {
    /// A mesh, of which ours have none.
    MeshFile = "visualization_msgs/msg/MeshFile" {
        filename: String,
        data: Vec<u8>,
    }
}
message! {
    /// Something to be drawn.
    Marker = "visualization_msgs/msg/Marker" {
        header: Header,
        /// With `id` the name of the marker.
        ns: String,
        id: i32,
        /// A constant of `Marker.msg`: [`LINE_STRIP`](Self::LINE_STRIP), [`LINE_LIST`](Self::LINE_LIST) and others.
        #[serde(rename = "type")]
        kind: i32,
        /// [`ADD`](Self::ADD) or [`DELETE`](Self::DELETE).
        action: i32,
        pose: Pose,
        /// Of lines `x` is the width \[m\].
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
    /// A line between each two points.
    pub const LINE_LIST: i32 = 5;
    /// A triangle between each three points.
    pub const TRIANGLE_LIST: i32 = 11;
    /// Draws the marker, or draws it anew.
    pub const ADD: i32 = 0;
    /// Removes the marker.
    pub const DELETE: i32 = 2;
    /// Removes all markers.
    pub const DELETE_ALL: i32 = 3;
}

message! {
    /// Things to be drawn.
    MarkerArray = "visualization_msgs/msg/MarkerArray" {
        markers: Vec<Marker>,
    }
}
message! {
    /// Poses along a way.
    Path = "nav_msgs/msg/Path" {
        header: Header,
        poses: Vec<PoseStamped>,
    }
}
message! {
    /// An entry of a marker's menu, of which ours have none.
    MenuEntry = "visualization_msgs/msg/MenuEntry" {
        id: u32,
        parent_id: u32,
        title: String,
        command: String,
        command_type: u8,
    }
}
message! {
    /// A handle of an interactive marker.
    InteractiveMarkerControl = "visualization_msgs/msg/InteractiveMarkerControl" {
        name: String,
        /// Turns x to the direction in which, or about which, the handle moves.
        orientation: Quaternion,
        orientation_mode: u8,
        /// [`MOVE_AXIS`](Self::MOVE_AXIS), [`ROTATE_AXIS`](Self::ROTATE_AXIS) or others.
        interaction_mode: u8,
        always_visible: bool,
        /// How it looks; where there are none, the client draws an arrow or a ring.
        markers: Vec<Marker>,
        independent_marker_orientation: bool,
        description: String,
    }
}

impl InteractiveMarkerControl {
    /// Shifts along x.
    pub const MOVE_AXIS: u8 = 3;
    /// Turns about x.
    pub const ROTATE_AXIS: u8 = 5;
}

message! {
    /// Something to be dragged.
    InteractiveMarker = "visualization_msgs/msg/InteractiveMarker" {
        header: Header,
        pose: Pose,
        name: String,
        description: String,
        /// Size of the handles \[m\].
        scale: f32,
        menu_entries: Vec<MenuEntry>,
        controls: Vec<InteractiveMarkerControl>,
    }
}
message! {
    /// Another pose of an interactive marker.
    InteractiveMarkerPose = "visualization_msgs/msg/InteractiveMarkerPose" {
        header: Header,
        pose: Pose,
        name: String,
    }
}
message! {
    /// What has changed of a server's interactive markers.
    InteractiveMarkerUpdate = "visualization_msgs/msg/InteractiveMarkerUpdate" {
        server_id: String,
        /// Counts the updates: a client that misses one asks for all markers again.
        seq_num: u64,
        /// [`UPDATE`](Self::UPDATE).
        #[serde(rename = "type")]
        kind: u8,
        markers: Vec<InteractiveMarker>,
        poses: Vec<InteractiveMarkerPose>,
        erases: Vec<String>,
    }
}

impl InteractiveMarkerUpdate {
    /// An update, as all are in ROS 2.
    pub const UPDATE: u8 = 1;
}

message! {
    /// What a client's user does with an interactive marker.
    InteractiveMarkerFeedback = "visualization_msgs/msg/InteractiveMarkerFeedback" {
        header: Header,
        #[serde(deserialize_with = "dq_common::text::deserialize_cut")]
        client_id: String,
        #[serde(deserialize_with = "dq_common::text::deserialize_cut")]
        marker_name: String,
        #[serde(deserialize_with = "dq_common::text::deserialize_cut")]
        control_name: String,
        /// [`POSE_UPDATE`](Self::POSE_UPDATE), [`MOUSE_UP`](Self::MOUSE_UP) or others.
        event_type: u8,
        /// Where the user has the marker, in the frame of the header.
        pose: Pose,
        menu_entry_id: u32,
        mouse_point: Point,
        mouse_point_valid: bool,
    }
}

impl InteractiveMarkerFeedback {
    /// The marker is being dragged.
    pub const POSE_UPDATE: u8 = 1;
    /// The user has let go.
    pub const MOUSE_UP: u8 = 5;
}

message! {
    /// The empty request of `visualization_msgs/srv/GetInteractiveMarkers`: CDR gives an empty structure one dummy octet.
    GetInteractiveMarkersRequest = "visualization_msgs/srv/GetInteractiveMarkers_Request" {
        /// The octet that rosidl puts into empty structures.
        structure_needs_at_least_one_member: u8,
    }
}
message! {
    /// All interactive markers of a server.
    GetInteractiveMarkersResponse = "visualization_msgs/srv/GetInteractiveMarkers_Response" {
        server_id: String,
        /// Of the last update.
        sequence_number: u64,
        markers: Vec<InteractiveMarker>,
    }
}
service! {
    /// Gives all interactive markers of a server.
    GetInteractiveMarkers = "visualization_msgs/srv/GetInteractiveMarkers"
        (GetInteractiveMarkersRequest) -> GetInteractiveMarkersResponse
}
