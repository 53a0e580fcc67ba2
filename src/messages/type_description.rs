//! Descriptions of message types. Every ROS 2 node serves them on `~/get_type_description`.

use super::interfaces::{dependencies, own_text, type_of_hash};
use super::messages::{Message, ServiceType, message, service};
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;

message! {
    /// A request to describe a type.
    GetTypeDescriptionRequest = "type_description_interfaces/srv/GetTypeDescription_Request" {
        /// The name of the type: `package/msg/Name`.
        #[serde(deserialize_with = "dq_common::text::deserialize_cut")]
        type_name: String,
        /// The RIHS01 hash of the type.
        #[serde(deserialize_with = "dq_common::text::deserialize_cut")]
        type_hash: String,
        /// Whether the response should include the texts of the definitions.
        include_type_sources: bool,
    }

    /// The response: the description of a type, or the reason why there is none.
    GetTypeDescriptionResponse = "type_description_interfaces/srv/GetTypeDescription_Response" {
        /// Whether the type is known.
        successful: bool,
        /// The reason, if the type is not known.
        failure_reason: String,
        /// The description.
        type_description: TypeDescription,
        /// The texts of the definitions of the type and of the types that it uses.
        type_sources: Vec<TypeSource>,
        /// Not used.
        extra_information: Vec<super::messages::KeyValue>,
    }
}
service! {
    /// Describes a message type.
    GetTypeDescription = "type_description_interfaces/srv/GetTypeDescription"
        (GetTypeDescriptionRequest) -> GetTypeDescriptionResponse,
    too_long |_response, bytes, room| GetTypeDescriptionResponse::failed(format!(
        "the description has {bytes} bytes, and one datagram to this client holds {room}"
    ));
}
message! {
    /// The description of a type, and of all types that it uses.
    TypeDescription = "type_description_interfaces/msg/TypeDescription" {
        /// The type.
        type_description: IndividualTypeDescription,
        /// The types that the described type uses, sorted by name.
        referenced_type_descriptions: Vec<IndividualTypeDescription>,
    }

    /// The description of one type, without the types that it uses.
    IndividualTypeDescription = "type_description_interfaces/msg/IndividualTypeDescription" {
        /// The name of the type: `package/msg/Name`.
        type_name: String,
        /// The fields of the type, in their order.
        fields: Vec<Field>,
    }

    /// A field of a type.
    Field = "type_description_interfaces/msg/Field" {
        /// The name.
        name: String,
        /// The type.
        #[serde(rename = "type")]
        kind: FieldType,
        /// The default value; empty for zero.
        default_value: String,
    }

    /// The type of a field.
    FieldType = "type_description_interfaces/msg/FieldType" {
        /// The number that `FieldType.msg` assigns to the type.
        type_id: u8,
        /// The length of an array or of a bounded sequence; 0 for other types.
        capacity: u64,
        /// The length of a bounded string; 0 for other types.
        string_capacity: u64,
        /// The name of a message type; empty for other types.
        nested_type_name: String,
    }

    /// The text of a definition.
    TypeSource = "type_description_interfaces/msg/TypeSource" {
        /// The name of the type: `package/msg/Name`.
        type_name: String,
        /// The language of the text: "msg".
        encoding: String,
        /// The text.
        raw_file_contents: String,
    }
}

impl GetTypeDescriptionResponse {
    /// Creates the response to a request that failed.
    pub fn failed(why: String) -> Self {
        Self { failure_reason: why, ..Self::default() }
    }
}

/// Answers a request about a type of `msg_config/interfaces`.
pub fn describe(request: &GetTypeDescriptionRequest) -> GetTypeDescriptionResponse {
    let GetTypeDescriptionRequest { type_name, type_hash, include_type_sources } = request;
    let Some(name) = type_of_hash(type_hash).filter(|name| type_name.is_empty() || name == type_name) else {
        return GetTypeDescriptionResponse::failed(format!(
            "{type_name} with the hash {type_hash:?} is not in use by this node"
        ));
    };
    match description(name) {
        Some(type_description) => GetTypeDescriptionResponse {
            successful: true,
            type_sources: if *include_type_sources { sources(&type_description) } else { Vec::new() },
            type_description,
            ..GetTypeDescriptionResponse::default()
        },
        None => GetTypeDescriptionResponse::failed(format!("{name} cannot be described")),
    }
}

/// Returns the description of a type and of the types that it uses. Returns `None` if a definition is missing, or if it has a
/// feature that this function does not support.
fn description(message: &str) -> Option<TypeDescription> {
    let mut referenced = BTreeSet::new();
    let mut to_visit = dependencies(message)?;
    while let Some(next) = to_visit.pop_first() {
        to_visit.extend(dependencies(&next)?.into_iter().filter(|name| !referenced.contains(name)));
        referenced.insert(next);
    }
    Some(TypeDescription {
        type_description: individual(message)?,
        referenced_type_descriptions: referenced
            .iter()
            .map(|name| individual(name))
            .collect::<Option<_>>()?,
    })
}

fn individual(message: &str) -> Option<IndividualTypeDescription> {
    let (package, _) = message.split_once('/')?;
    // Constants are not fields.
    let lines = own_text(message)?.lines().filter(|line| !line.contains('='));
    let fields = lines.map(|line| field(package, line)).collect::<Option<_>>()?;
    Some(IndividualTypeDescription { type_name: message.to_owned(), fields })
}

/// Parses a line of a definition: type, name, and an optional default.
fn field(package: &str, line: &str) -> Option<Field> {
    let mut words = line.split_whitespace();
    let (kind, name) = (words.next()?, words.next()?);
    // In these definitions, only floating-point fields have defaults.
    let default_value = words.next().map(|value| value.parse::<f64>().map(|value| format!("{value:?}")));
    let (element, sequence) = match kind.strip_suffix("[]") {
        Some(element) => (element, UNBOUNDED_SEQUENCE),
        None => (kind, 0),
    };
    let plain = TYPE_IDS.iter().find(|(name, _)| *name == element).map(|(_, id)| *id);
    let nested_type_name = match (plain, element.split_once('/')) {
        (Some(_), _) => String::new(),
        (None, Some((package, name))) => format!("{package}/msg/{name}"),
        (None, None) => format!("{package}/msg/{element}"),
    };
    let type_id = plain.unwrap_or(NESTED_TYPE) + sequence;
    let kind = FieldType { type_id, nested_type_name, ..FieldType::default() };
    Some(Field {
        name: name.to_owned(),
        kind,
        default_value: default_value.transpose().ok()?.unwrap_or_default(),
    })
}

/// The number of `FIELD_TYPE_NESTED_TYPE` in `FieldType.msg`.
const NESTED_TYPE: u8 = 1;

/// The number that `FieldType.msg` adds for an unbounded sequence.
const UNBOUNDED_SEQUENCE: u8 = 144;

/// The numbers of `FieldType.msg` that the definitions use.
const TYPE_IDS: [(&str, u8); 10] = [
    ("uint8", 3),
    ("int32", 6),
    ("uint32", 7),
    ("int64", 8),
    ("uint64", 9),
    ("float32", 10),
    ("float64", 11),
    ("bool", 15),
    ("byte", 16),
    ("string", 17),
];

fn sources(description: &TypeDescription) -> Vec<TypeSource> {
    let all = std::iter::once(&description.type_description).chain(&description.referenced_type_descriptions);
    let source = |of: &IndividualTypeDescription| {
        let raw_file_contents = own_text(&of.type_name)?.to_owned();
        Some(TypeSource { type_name: of.type_name.clone(), encoding: "msg".to_owned(), raw_file_contents })
    };
    all.filter_map(source).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::interfaces::{DEFINITIONS, type_hash};
    use sha2::{Digest, Sha256};

    /// Returns the RIHS01 hash of a type: the SHA-256 of its description in JSON without default values (REP 2016).
    fn hash(of: &TypeDescription) -> String {
        let individual = |of: &IndividualTypeDescription| {
            let fields: Vec<_> = of.fields.iter().map(|Field { name, kind, .. }| {
                let FieldType { type_id, capacity, string_capacity, nested_type_name } = kind;
                format!(
                    r#"{{"name": "{name}", "type": {{"type_id": {type_id}, "capacity": {capacity}, "string_capacity": {string_capacity}, "nested_type_name": "{nested_type_name}"}}}}"#
                )
            }).collect();
            format!(r#"{{"type_name": "{}", "fields": [{}]}}"#, of.type_name, fields.join(", "))
        };
        let referenced: Vec<_> = of.referenced_type_descriptions.iter().map(individual).collect();
        let text = format!(
            r#"{{"type_description": {}, "referenced_type_descriptions": [{}]}}"#,
            individual(&of.type_description),
            referenced.join(", ")
        );
        format!("RIHS01_{}", hex::encode(Sha256::digest(text)))
    }

    #[test]
    fn descriptions_have_the_hashes_that_a_real_ros_2_gives_the_types() {
        let known: Vec<_> = DEFINITIONS.iter().filter(|(name, _)| !type_hash(name).is_empty()).collect();
        assert!(known.len() > 15);
        for (name, _) in known {
            assert_eq!(hash(&description(name).unwrap()), type_hash(name), "{name}");
        }
    }

    #[test]
    fn a_type_is_found_by_its_hash_and_its_sources_are_sent_on_request() {
        let ask = |type_name: &str, type_hash: &str, include_type_sources| {
            let (type_name, type_hash) = (type_name.to_owned(), type_hash.to_owned());
            describe(&GetTypeDescriptionRequest { type_name, type_hash, include_type_sources })
        };
        let (pose, of_pose) = ("geometry_msgs/msg/PoseStamped", type_hash("geometry_msgs/msg/PoseStamped"));
        let answer = ask(pose, of_pose, true);
        let names: Vec<_> = answer.type_sources.iter().map(|source| source.type_name.as_str()).collect();
        let referenced = [
            "builtin_interfaces/msg/Time",
            "geometry_msgs/msg/Point",
            "geometry_msgs/msg/Pose",
            "geometry_msgs/msg/Quaternion",
            "std_msgs/msg/Header",
        ];
        assert_eq!((names[0], &names[1..]), (pose, &referenced[..]));
        let quaternion = &answer.type_description.referenced_type_descriptions[3];
        assert_eq!(quaternion.fields[3].default_value, "1.0");
        assert!(ask("", of_pose, false).successful && ask("", of_pose, false).type_sources.is_empty());
        for (name, hash) in [(pose, ""), (pose, "RIHS01_0"), ("std_msgs/msg/String", of_pose)] {
            let answer = ask(name, hash, true);
            assert!(!answer.successful && answer.failure_reason.contains("not in use"), "{answer:?}");
        }
    }
}
