"""ROS 2 messages as types of Eclipse Cyclone DDS, with the names that ROS 2 uses on the wire."""
from dataclasses import dataclass, field

from cyclonedds.idl import IdlStruct, make_idl_struct
from cyclonedds.idl.types import float32, float64, int32, int64, sequence, uint8, uint32, uint64


def make(kind):
    return field(default_factory=kind)


@dataclass
class Time(IdlStruct, typename="builtin_interfaces.msg.dds_.Time_"):
    sec: int32 = 0
    nanosec: uint32 = 0


@dataclass
class Header(IdlStruct, typename="std_msgs.msg.dds_.Header_"):
    stamp: Time = make(Time)
    frame_id: str = ""


@dataclass
class Point(IdlStruct, typename="geometry_msgs.msg.dds_.Point_"):
    x: float64 = 0.0
    y: float64 = 0.0
    z: float64 = 0.0


@dataclass
class Quaternion(IdlStruct, typename="geometry_msgs.msg.dds_.Quaternion_"):
    x: float64 = 0.0
    y: float64 = 0.0
    z: float64 = 0.0
    w: float64 = 1.0


@dataclass
class Pose(IdlStruct, typename="geometry_msgs.msg.dds_.Pose_"):
    position: Point = make(Point)
    orientation: Quaternion = make(Quaternion)


@dataclass
class PoseStamped(IdlStruct, typename="geometry_msgs.msg.dds_.PoseStamped_"):
    header: Header = make(Header)
    pose: Pose = make(Pose)


@dataclass
class Vector3(IdlStruct, typename="geometry_msgs.msg.dds_.Vector3_"):
    x: float64 = 0.0
    y: float64 = 0.0
    z: float64 = 0.0


@dataclass
class Twist(IdlStruct, typename="geometry_msgs.msg.dds_.Twist_"):
    linear: Vector3 = make(Vector3)
    angular: Vector3 = make(Vector3)


@dataclass
class TwistStamped(IdlStruct, typename="geometry_msgs.msg.dds_.TwistStamped_"):
    header: Header = make(Header)
    twist: Twist = make(Twist)


@dataclass
class Wrench(IdlStruct, typename="geometry_msgs.msg.dds_.Wrench_"):
    force: Vector3 = make(Vector3)
    torque: Vector3 = make(Vector3)


@dataclass
class WrenchStamped(IdlStruct, typename="geometry_msgs.msg.dds_.WrenchStamped_"):
    header: Header = make(Header)
    wrench: Wrench = make(Wrench)


@dataclass
class Clock(IdlStruct, typename="rosgraph_msgs.msg.dds_.Clock_"):
    clock: Time = make(Time)


@dataclass
class Transform(IdlStruct, typename="geometry_msgs.msg.dds_.Transform_"):
    translation: Vector3 = make(Vector3)
    rotation: Quaternion = make(Quaternion)


@dataclass
class TransformStamped(IdlStruct, typename="geometry_msgs.msg.dds_.TransformStamped_"):
    header: Header = make(Header)
    child_frame_id: str = ""
    transform: Transform = make(Transform)


@dataclass
class TFMessage(IdlStruct, typename="tf2_msgs.msg.dds_.TFMessage_"):
    transforms: sequence[TransformStamped] = make(list)


@dataclass
class JointState(IdlStruct, typename="sensor_msgs.msg.dds_.JointState_"):
    header: Header = make(Header)
    name: sequence[str] = make(list)
    position: sequence[float64] = make(list)
    velocity: sequence[float64] = make(list)
    effort: sequence[float64] = make(list)


@dataclass
class Float64(IdlStruct, typename="std_msgs.msg.dds_.Float64_"):
    data: float64 = 0.0


@dataclass
class MultiArrayDimension(IdlStruct, typename="std_msgs.msg.dds_.MultiArrayDimension_"):
    label: str = ""
    size: uint32 = 0
    stride: uint32 = 0


@dataclass
class MultiArrayLayout(IdlStruct, typename="std_msgs.msg.dds_.MultiArrayLayout_"):
    dim: sequence[MultiArrayDimension] = make(list)
    data_offset: uint32 = 0


@dataclass
class Float64MultiArray(IdlStruct, typename="std_msgs.msg.dds_.Float64MultiArray_"):
    layout: MultiArrayLayout = make(MultiArrayLayout)
    data: sequence[float64] = make(list)


@dataclass
class UInt8MultiArray(IdlStruct, typename="std_msgs.msg.dds_.UInt8MultiArray_"):
    layout: MultiArrayLayout = make(MultiArrayLayout)
    data: sequence[uint8] = make(list)


@dataclass
class String(IdlStruct, typename="std_msgs.msg.dds_.String_"):
    data: str = ""


@dataclass
class KeyValue(IdlStruct, typename="diagnostic_msgs.msg.dds_.KeyValue_"):
    key: str = ""
    value: str = ""


@dataclass
class DiagnosticStatus(IdlStruct, typename="diagnostic_msgs.msg.dds_.DiagnosticStatus_"):
    level: uint8 = 0
    name: str = ""
    message: str = ""
    hardware_id: str = ""
    values: sequence[KeyValue] = make(list)


@dataclass
class DiagnosticArray(IdlStruct, typename="diagnostic_msgs.msg.dds_.DiagnosticArray_"):
    header: Header = make(Header)
    status: sequence[DiagnosticStatus] = make(list)


@dataclass
class ParameterValue(IdlStruct, typename="rcl_interfaces.msg.dds_.ParameterValue_"):
    type: uint8 = 0
    bool_value: bool = False
    integer_value: int64 = 0
    double_value: float64 = 0.0
    string_value: str = ""
    byte_array_value: sequence[uint8] = make(list)
    bool_array_value: sequence[bool] = make(list)
    integer_array_value: sequence[int64] = make(list)
    double_array_value: sequence[float64] = make(list)
    string_array_value: sequence[str] = make(list)


@dataclass
class Parameter(IdlStruct, typename="rcl_interfaces.msg.dds_.Parameter_"):
    name: str = ""
    value: ParameterValue = make(ParameterValue)


@dataclass
class ParameterEvent(IdlStruct, typename="rcl_interfaces.msg.dds_.ParameterEvent_"):
    stamp: Time = make(Time)
    node: str = ""
    new_parameters: sequence[Parameter] = make(list)
    changed_parameters: sequence[Parameter] = make(list)
    deleted_parameters: sequence[Parameter] = make(list)


@dataclass
class SetParametersResult(IdlStruct, typename="rcl_interfaces.msg.dds_.SetParametersResult_"):
    successful: bool = False
    reason: str = ""


def service(package, name, request, response):
    """The four types of a service: request and reply as Fast DDS encodes them (payload only), then as Cyclone DDS encodes them (after a
    header with client id and sequence number)."""
    header = {"client": uint64, "sequence_number": int64}

    def struct(suffix, fields):
        return make_idl_struct(f"{name}{suffix}{len(fields)}", f"{package}.srv.dds_.{name}_{suffix}_", fields)

    plain = [struct("Request", request), struct("Response", response)]
    return plain + [struct("Request", header | request), struct("Response", header | response)]


SET_PARAMETERS = service(
    "rcl_interfaces",
    "SetParameters",
    {"parameters": sequence[Parameter]},
    {"results": sequence[SetParametersResult]},
)
GET_PARAMETERS = service(
    "rcl_interfaces",
    "GetParameters",
    {"names": sequence[str]},
    {"values": sequence[ParameterValue]},
)
TRIGGER = service(
    "std_srvs",
    "Trigger",
    {"structure_needs_at_least_one_member": uint8},
    {"success": bool, "message": str},
)
SET_BOOL = service(
    "std_srvs",
    "SetBool",
    {"data": bool},
    {"success": bool, "message": str},
)


@dataclass
class FieldType(IdlStruct, typename="type_description_interfaces.msg.dds_.FieldType_"):
    type_id: uint8 = 0
    capacity: uint64 = 0
    string_capacity: uint64 = 0
    nested_type_name: str = ""


@dataclass
class Field(IdlStruct, typename="type_description_interfaces.msg.dds_.Field_"):
    name: str = ""
    type: FieldType = make(FieldType)
    default_value: str = ""


@dataclass
class IndividualTypeDescription(IdlStruct, typename="type_description_interfaces.msg.dds_.IndividualTypeDescription_"):
    type_name: str = ""
    fields: sequence[Field] = make(list)


@dataclass
class TypeDescription(IdlStruct, typename="type_description_interfaces.msg.dds_.TypeDescription_"):
    type_description: IndividualTypeDescription = make(IndividualTypeDescription)
    referenced_type_descriptions: sequence[IndividualTypeDescription] = make(list)


@dataclass
class TypeSource(IdlStruct, typename="type_description_interfaces.msg.dds_.TypeSource_"):
    type_name: str = ""
    encoding: str = ""
    raw_file_contents: str = ""


GET_TYPE_DESCRIPTION = service(
    "type_description_interfaces",
    "GetTypeDescription",
    {"type_name": str, "type_hash": str, "include_type_sources": bool},
    {
        "successful": bool,
        "failure_reason": str,
        "type_description": TypeDescription,
        "type_sources": sequence[TypeSource],
        "extra_information": sequence[KeyValue],
    },
)


@dataclass
class Duration(IdlStruct, typename="builtin_interfaces.msg.dds_.Duration_"):
    sec: int32 = 0
    nanosec: uint32 = 0


@dataclass
class ColorRGBA(IdlStruct, typename="std_msgs.msg.dds_.ColorRGBA_"):
    r: float32 = 0.0
    g: float32 = 0.0
    b: float32 = 0.0
    a: float32 = 0.0


@dataclass
class CompressedImage(IdlStruct, typename="sensor_msgs.msg.dds_.CompressedImage_"):
    header: Header = make(Header)
    format: str = ""
    data: sequence[uint8] = make(list)


@dataclass
class UVCoordinate(IdlStruct, typename="visualization_msgs.msg.dds_.UVCoordinate_"):
    u: float32 = 0.0
    v: float32 = 0.0


@dataclass
class MeshFile(IdlStruct, typename="visualization_msgs.msg.dds_.MeshFile_"):
    filename: str = ""
    data: sequence[uint8] = make(list)


@dataclass
class Marker(IdlStruct, typename="visualization_msgs.msg.dds_.Marker_"):
    header: Header = make(Header)
    ns: str = ""
    id: int32 = 0
    type: int32 = 0
    action: int32 = 0
    pose: Pose = make(Pose)
    scale: Vector3 = make(Vector3)
    color: ColorRGBA = make(ColorRGBA)
    lifetime: Duration = make(Duration)
    frame_locked: bool = False
    points: sequence[Point] = make(list)
    colors: sequence[ColorRGBA] = make(list)
    texture_resource: str = ""
    texture: CompressedImage = make(CompressedImage)
    uv_coordinates: sequence[UVCoordinate] = make(list)
    text: str = ""
    mesh_resource: str = ""
    mesh_file: MeshFile = make(MeshFile)
    mesh_use_embedded_materials: bool = False


@dataclass
class MarkerArray(IdlStruct, typename="visualization_msgs.msg.dds_.MarkerArray_"):
    markers: sequence[Marker] = make(list)


@dataclass
class Path(IdlStruct, typename="nav_msgs.msg.dds_.Path_"):
    header: Header = make(Header)
    poses: sequence[PoseStamped] = make(list)


@dataclass
class MenuEntry(IdlStruct, typename="visualization_msgs.msg.dds_.MenuEntry_"):
    id: uint32 = 0
    parent_id: uint32 = 0
    title: str = ""
    command: str = ""
    command_type: uint8 = 0


@dataclass
class InteractiveMarkerControl(IdlStruct, typename="visualization_msgs.msg.dds_.InteractiveMarkerControl_"):
    name: str = ""
    orientation: Quaternion = make(Quaternion)
    orientation_mode: uint8 = 0
    interaction_mode: uint8 = 0
    always_visible: bool = False
    markers: sequence[Marker] = make(list)
    independent_marker_orientation: bool = False
    description: str = ""


@dataclass
class InteractiveMarker(IdlStruct, typename="visualization_msgs.msg.dds_.InteractiveMarker_"):
    header: Header = make(Header)
    pose: Pose = make(Pose)
    name: str = ""
    description: str = ""
    scale: float32 = 0.0
    menu_entries: sequence[MenuEntry] = make(list)
    controls: sequence[InteractiveMarkerControl] = make(list)


@dataclass
class InteractiveMarkerPose(IdlStruct, typename="visualization_msgs.msg.dds_.InteractiveMarkerPose_"):
    header: Header = make(Header)
    pose: Pose = make(Pose)
    name: str = ""


@dataclass
class InteractiveMarkerUpdate(IdlStruct, typename="visualization_msgs.msg.dds_.InteractiveMarkerUpdate_"):
    server_id: str = ""
    seq_num: uint64 = 0
    type: uint8 = 0
    markers: sequence[InteractiveMarker] = make(list)
    poses: sequence[InteractiveMarkerPose] = make(list)
    erases: sequence[str] = make(list)


@dataclass
class InteractiveMarkerFeedback(IdlStruct, typename="visualization_msgs.msg.dds_.InteractiveMarkerFeedback_"):
    header: Header = make(Header)
    client_id: str = ""
    marker_name: str = ""
    control_name: str = ""
    event_type: uint8 = 0
    pose: Pose = make(Pose)
    menu_entry_id: uint32 = 0
    mouse_point: Point = make(Point)
    mouse_point_valid: bool = False


# The number of updates is called sequence_number there, which is already a field of the header here. Names are not sent over the wire.
GET_INTERACTIVE_MARKERS = service(
    "visualization_msgs",
    "GetInteractiveMarkers",
    {"structure_needs_at_least_one_member": uint8},
    {"server_id": str, "updates": uint64, "markers": sequence[InteractiveMarker]},
)
