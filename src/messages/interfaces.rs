//! The built-in message definitions from `msg_config/interfaces`. Each bag contains the definitions of the types that it uses.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::LazyLock;

/// Embeds `msg_config/interfaces/<name>.msg` for every name.
macro_rules! definitions {
    ($($name:literal),* $(,)?) => {
        &[$(($name, include_str!(concat!("msg_config/interfaces/", $name, ".msg")))),*]
    };
}

/// The types and their definitions, sorted.
pub(super) const DEFINITIONS: &[(&str, &str)] = definitions![
    "builtin_interfaces/msg/Duration",
    "builtin_interfaces/msg/Time",
    "diagnostic_msgs/msg/DiagnosticArray",
    "diagnostic_msgs/msg/DiagnosticStatus",
    "diagnostic_msgs/msg/KeyValue",
    "geometry_msgs/msg/Point",
    "geometry_msgs/msg/Pose",
    "geometry_msgs/msg/PoseStamped",
    "geometry_msgs/msg/Quaternion",
    "geometry_msgs/msg/Transform",
    "geometry_msgs/msg/TransformStamped",
    "geometry_msgs/msg/Twist",
    "geometry_msgs/msg/TwistStamped",
    "geometry_msgs/msg/Vector3",
    "geometry_msgs/msg/Wrench",
    "geometry_msgs/msg/WrenchStamped",
    "nav_msgs/msg/Path",
    "rcl_interfaces/msg/Log",
    "rcl_interfaces/msg/Parameter",
    "rcl_interfaces/msg/ParameterEvent",
    "rcl_interfaces/msg/ParameterValue",
    "rosgraph_msgs/msg/Clock",
    "sensor_msgs/msg/CompressedImage",
    "sensor_msgs/msg/JointState",
    "std_msgs/msg/ColorRGBA",
    "std_msgs/msg/Float64",
    "std_msgs/msg/Float64MultiArray",
    "std_msgs/msg/Header",
    "std_msgs/msg/MultiArrayDimension",
    "std_msgs/msg/MultiArrayLayout",
    "std_msgs/msg/String",
    "std_msgs/msg/UInt8MultiArray",
    "tf2_msgs/msg/TFMessage",
    "trajectory_msgs/msg/JointTrajectory",
    "trajectory_msgs/msg/JointTrajectoryPoint",
    "visualization_msgs/msg/InteractiveMarker",
    "visualization_msgs/msg/InteractiveMarkerControl",
    "visualization_msgs/msg/InteractiveMarkerFeedback",
    "visualization_msgs/msg/InteractiveMarkerPose",
    "visualization_msgs/msg/InteractiveMarkerUpdate",
    "visualization_msgs/msg/Marker",
    "visualization_msgs/msg/MarkerArray",
    "visualization_msgs/msg/MenuEntry",
    "visualization_msgs/msg/MeshFile",
    "visualization_msgs/msg/UVCoordinate",
];

/// The RIHS01 type hashes, as a real ROS 2 Jazzy has them.
static TYPE_HASHES: LazyLock<BTreeMap<String, String>> = LazyLock::new(|| {
    serde_json::from_str(include_str!("msg_config/interfaces/type_hashes.json")).unwrap_or_default()
});

/// The line that rosbag2 writes between the definition of a type and those of its dependencies.
const SEPARATOR: &str = "================================================================================";

/// Returns the definition of `message` (`package/msg/Name`), followed by those of all types that it uses, in rosbag2's format.
/// Returns `None` for a type that is not in `msg_config/interfaces`.
pub fn definition(message: &str) -> Option<String> {
    let mut text = own_text(message)?.to_owned();
    let mut seen = BTreeSet::from([message.to_owned()]);
    append_dependencies(message, &mut seen, &mut text)?;
    Some(text)
}

/// Returns the RIHS01 hash of a type; empty if the type is unknown.
pub fn type_hash(message: &str) -> &'static str {
    TYPE_HASHES.get(message).map_or("", String::as_str)
}

/// Returns the type with this RIHS01 hash.
pub(super) fn type_of_hash(hash: &str) -> Option<&'static str> {
    TYPE_HASHES.iter().find(|(_, known)| *known == hash).map(|(name, _)| name.as_str())
}

/// Returns the definition of `message`, without those of the types that it uses.
pub(super) fn own_text(message: &str) -> Option<&'static str> {
    let index = DEFINITIONS.binary_search_by_key(&message, |(name, _)| name).ok()?;
    Some(DEFINITIONS[index].1)
}

/// Appends the definitions of the dependencies in rosbag2's order: depth first, each type once, alphabetically.
fn append_dependencies(message: &str, seen: &mut BTreeSet<String>, text: &mut String) -> Option<()> {
    for dependency in dependencies(message)? {
        if seen.insert(dependency.clone()) {
            let short = dependency.replace("/msg/", "/");
            text.push_str(&format!("\n{SEPARATOR}\nMSG: {short}\n{}", own_text(&dependency)?));
            append_dependencies(&dependency, seen, text)?;
        }
    }
    Some(())
}

/// Returns the message types of the fields of `message`. A type without a package is in the message's own package.
pub(super) fn dependencies(message: &str) -> Option<BTreeSet<String>> {
    let (own_package, _) = message.split_once('/')?;
    let field_types = own_text(message)?.lines().filter_map(|line| line.split_whitespace().next());
    let messages = field_types.map(|field| field.trim_end_matches("[]")).filter_map(|field| {
        match field.split_once('/') {
            Some((package, name)) => Some(format!("{package}/msg/{name}")),
            // Built-in types are lower case.
            None if field.starts_with(char::is_uppercase) => Some(format!("{own_package}/msg/{field}")),
            None => None,
        }
    });
    Some(messages.collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    #[test]
    fn every_definition_file_is_built_in_and_complete() {
        assert!(DEFINITIONS.is_sorted());
        for (name, text) in DEFINITIONS {
            assert!(definition(name).is_some(), "{name} needs a type that is not here");
            assert!(text.ends_with('\n') && !text.contains('\r'), "{name}");
        }
        let root = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/msg_config/interfaces"));
        let packages = root.read_dir().unwrap().map(|entry| entry.unwrap().path());
        let files =
            packages.filter(|path| path.is_dir()).flat_map(|path| path.join("msg").read_dir().unwrap());
        assert_eq!(files.count(), DEFINITIONS.len());
    }

    #[test]
    fn dependencies_follow_once_each_in_rosbag2_s_order() {
        let text = definition("geometry_msgs/msg/PoseStamped").unwrap();
        let parts: Vec<_> = text.lines().filter_map(|line| line.strip_prefix("MSG: ")).collect();
        let expected = ["Pose", "Point", "Quaternion"].map(|name| format!("geometry_msgs/{name}"));
        assert_eq!(parts[..3], expected);
        assert_eq!(parts[3..], ["std_msgs/Header", "builtin_interfaces/Time"]);
        assert_eq!(definition("std_msgs/msg/String").unwrap(), "string data\n");
        assert_eq!(definition("sensor_msgs/msg/Image"), None);
    }
}
