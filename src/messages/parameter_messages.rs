//! The messages of the parameter services, package `rcl_interfaces`.

use super::messages::{Message, ServiceType, Time, message, service};
use dq_params::{Constraint, Declaration, Value};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

message! {
    /// A parameter value: a tag for the type, and one field for each type.
    ParameterValue = "rcl_interfaces/msg/ParameterValue" {
        /// The type: 0 not set, 1 bool, 2 integer, 3 double, 4 string; arrays: 5 bytes, 6 bools, 7 integers, 8 doubles, 9 strings.
        kind: u8,
        bool_value: bool,
        integer_value: i64,
        double_value: f64,
        string_value: String,
        byte_array_value: Vec<u8>,
        bool_array_value: Vec<bool>,
        integer_array_value: Vec<i64>,
        double_array_value: Vec<f64>,
        string_array_value: Vec<String>,
    }

    /// The name and the value of a parameter.
    Parameter = "rcl_interfaces/msg/Parameter" {
        #[serde(deserialize_with = "dq_common::text::deserialize_cut")]
        name: String,
        value: ParameterValue,
    }

    /// The changes of a node's parameters.
    ParameterEvent = "rcl_interfaces/msg/ParameterEvent" {
        stamp: Time,
        #[serde(deserialize_with = "dq_common::text::deserialize_cut")]
        node: String,
        new_parameters: Vec<Parameter>,
        changed_parameters: Vec<Parameter>,
        deleted_parameters: Vec<Parameter>,
    }

    /// Whether a parameter was set, and if not, why.
    SetParametersResult = "rcl_interfaces/msg/SetParametersResult" {
        successful: bool,
        #[serde(deserialize_with = "dq_common::text::deserialize_cut")]
        reason: String,
    }

    /// The bounds of a double.
    FloatingPointRange = "rcl_interfaces/msg/FloatingPointRange" {
        from_value: f64,
        to_value: f64,
        /// The step between values; 0 if every value within the bounds is valid.
        step: f64,
    }

    /// The bounds of an integer.
    IntegerRange = "rcl_interfaces/msg/IntegerRange" {
        from_value: i64,
        to_value: i64,
        /// The step between values; 0 if every value within the bounds is valid.
        step: u64,
    }

    /// The description of a parameter.
    ParameterDescriptor = "rcl_interfaces/msg/ParameterDescriptor" {
        name: String,
        kind: u8,
        description: String,
        additional_constraints: String,
        read_only: bool,
        dynamic_typing: bool,
        floating_point_range: Vec<FloatingPointRange>,
        integer_range: Vec<IntegerRange>,
    }

    /// The names of parameters.
    Names = "rcl_interfaces/srv/GetParameters_Request" {
        #[serde(deserialize_with = "dq_common::text::deserialize_cuts")]
        names: Vec<String>,
    }

    /// The values of parameters, in the order of the requested names.
    Values = "rcl_interfaces/srv/GetParameters_Response" {
        values: Vec<ParameterValue>,
    }

    /// The types of parameters, in the order of the requested names.
    Types = "rcl_interfaces/srv/GetParameterTypes_Response" {
        types: Vec<u8>,
    }

    /// The descriptions of parameters, in the order of the requested names.
    Descriptors = "rcl_interfaces/srv/DescribeParameters_Response" {
        descriptors: Vec<ParameterDescriptor>,
    }

    /// The parameters to set.
    Changes = "rcl_interfaces/srv/SetParameters_Request" {
        parameters: Vec<Parameter>,
    }

    /// The results of a call that sets parameters, one per parameter.
    Results = "rcl_interfaces/srv/SetParameters_Response" {
        results: Vec<SetParametersResult>,
    }

    /// The result of a call that sets all parameters or none.
    AtomicResult = "rcl_interfaces/srv/SetParametersAtomically_Response" {
        result: SetParametersResult,
    }

    /// A request to list parameters.
    ListRequest = "rcl_interfaces/srv/ListParameters_Request" {
        /// The prefixes below which names are listed; empty for all names.
        #[serde(deserialize_with = "dq_common::text::deserialize_cuts")]
        prefixes: Vec<String>,
        /// The number of levels below the prefix that are listed; 0 for all.
        depth: u64,
    }

    /// The names of parameters, and the prefixes of these names.
    ListResult = "rcl_interfaces/msg/ListParametersResult" {
        names: Vec<String>,
        prefixes: Vec<String>,
    }

    /// The names of parameters, and the prefixes of these names.
    ListResponse = "rcl_interfaces/srv/ListParameters_Response" {
        result: ListResult,
    }
}
impl ListResult {
    /// Shortens the encoded list by at least `excess` bytes, if possible. For this, replaces groups of names with a common prefix,
    /// such as `gains`, by the prefix. Begins with the group that takes the most bytes.
    #[must_use]
    pub fn shortened(mut self, mut excess: usize) -> Self {
        let size = |name: &str| size_of::<u32>() + (name.len() + 1).next_multiple_of(size_of::<u32>());
        while excess > 0 {
            let mut sizes = BTreeMap::<_, usize>::new();
            for name in &self.names {
                if let Some((prefix, _)) = name.split_once('.') {
                    *sizes.entry(prefix.to_owned()).or_default() += size(name);
                }
            }
            let Some((prefix, saved)) = sizes.into_iter().max_by_key(|(_, size)| *size) else { break };
            excess = (excess + size(&prefix)).saturating_sub(saved);
            self.names.retain(|name| name.split_once('.').is_none_or(|(group, _)| group != prefix));
            self.prefixes.push(prefix);
        }
        self
    }
}
service! {
    /// Lists the names of parameters. If the list is too long for a reply, prefixes such as `gains` replace groups of names.
    ListParameters = "rcl_interfaces/srv/ListParameters" (ListRequest) -> ListResponse,
    too_long |response, bytes, room| ListResponse { result: response.result.shortened(bytes.saturating_sub(room)) };
    /// Gets the values of parameters. If the values are too long for a reply, the reply has no values, as with rclcpp's nodes.
    GetParameters = "rcl_interfaces/srv/GetParameters" (Names) -> Values, too_long |_response, _bytes, _room| Values::default();
    /// Gets the types of parameters.
    GetParameterTypes = "rcl_interfaces/srv/GetParameterTypes" (Names) -> Types;
    /// Describes parameters.
    DescribeParameters = "rcl_interfaces/srv/DescribeParameters" (Names) -> Descriptors;
    /// Sets each parameter independently of the others.
    SetParameters = "rcl_interfaces/srv/SetParameters" (Changes) -> Results;
    /// Sets either all parameters or none.
    SetParametersAtomically = "rcl_interfaces/srv/SetParametersAtomically" (Changes) -> AtomicResult;
}

impl From<&Value> for ParameterValue {
    fn from(value: &Value) -> Self {
        let mut wire = Self { kind: kind_of(value), ..Self::default() };
        match value {
            Value::Bool(value) => wire.bool_value = *value,
            Value::Integer(value) => wire.integer_value = *value,
            Value::Double(value) => wire.double_value = *value,
            Value::String(value) => wire.string_value = value.clone(),
            Value::ByteArray(list) => wire.byte_array_value = list.clone(),
            Value::BoolArray(list) => wire.bool_array_value = list.clone(),
            Value::IntegerArray(list) => wire.integer_array_value = list.clone(),
            Value::DoubleArray(list) => wire.double_array_value = list.clone(),
            Value::StringArray(list) => wire.string_array_value = list.clone(),
        }
        wire
    }
}

impl ParameterValue {
    /// Returns the value; `None` if it is not set or has an unknown type.
    pub fn into_value(self) -> Option<Value> {
        match self.kind {
            1 => Some(Value::Bool(self.bool_value)),
            2 => Some(Value::Integer(self.integer_value)),
            3 => Some(Value::Double(self.double_value)),
            4 => Some(Value::String(self.string_value)),
            5 => Some(Value::ByteArray(self.byte_array_value)),
            6 => Some(Value::BoolArray(self.bool_array_value)),
            7 => Some(Value::IntegerArray(self.integer_array_value)),
            8 => Some(Value::DoubleArray(self.double_array_value)),
            9 => Some(Value::StringArray(self.string_array_value)),
            _ => None,
        }
    }
}

/// Returns the tag for the type of a value.
pub fn kind_of(value: &Value) -> u8 {
    match value {
        Value::Bool(_) => 1,
        Value::Integer(_) => 2,
        Value::Double(_) => 3,
        Value::String(_) => 4,
        Value::ByteArray(_) => 5,
        Value::BoolArray(_) => 6,
        Value::IntegerArray(_) => 7,
        Value::DoubleArray(_) => 8,
        Value::StringArray(_) => 9,
    }
}

impl ParameterDescriptor {
    /// Returns the name of the type, as `ros2 param describe` prints it.
    pub fn type_name(&self) -> &'static str {
        let value = ParameterValue { kind: self.kind, ..ParameterValue::default() };
        value.into_value().map_or("not set", |value| value.type_name())
    }
}

impl From<&Declaration> for ParameterDescriptor {
    fn from(declared: &Declaration) -> Self {
        let unit = if declared.unit.is_empty() { String::new() } else { format!(" [{}]", declared.unit) };
        let (mut floating_point_range, mut integer_range) = (Vec::new(), Vec::new());
        match (declared.constraint, &declared.default) {
            (Constraint::Range { min, max }, Value::Integer(_)) => {
                let [from_value, to_value] = [min, max].map(|bound| bound as i64);
                integer_range.push(IntegerRange { from_value, to_value, step: 0 });
            }
            (Constraint::Range { min, max }, _) => {
                floating_point_range.push(FloatingPointRange { from_value: min, to_value: max, step: 0.0 });
            }
            _ => {}
        }
        Self {
            name: declared.name.to_owned(),
            kind: kind_of(&declared.default),
            description: format!("{}{unit}", declared.description),
            additional_constraints: declared.expected(),
            read_only: declared.read_only,
            dynamic_typing: false,
            floating_point_range,
            integer_range,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use dq_params::{ParameterStore, Parameters};

    /// Checks that arrays are announced with a range, as in rclcpp. The range applies to each element.
    #[test]
    fn ranges_are_announced_of_numbers_and_of_arrays() {
        #[derive(Parameters)]
        struct Ranges {
            /// one [1/s]
            #[parameter(range = 0.0..=2.5)]
            _number: f64,
            /// a list of numbers
            #[parameter(range = -1.0..=1.0)]
            _numbers: Vec<f64>,
            /// a count
            #[parameter(range = 1..=500)]
            _count: i64,
            /// a text
            #[parameter()]
            _text: String,
        }
        let store = ParameterStore::of::<Ranges>().unwrap();
        let all: Vec<_> = store.iter().map(|(declared, _)| ParameterDescriptor::from(declared)).collect();
        let double = |from_value, to_value| vec![FloatingPointRange { from_value, to_value, step: 0.0 }];
        let ranges: Vec<_> = all.iter().map(|one| one.floating_point_range.clone()).collect();
        assert_eq!(ranges, [double(0.0, 2.5), double(-1.0, 1.0), Vec::new(), Vec::new()]);
        assert_eq!(all[2].integer_range, [IntegerRange { from_value: 1, to_value: 500, step: 0 }]);
        assert_eq!((all[0].description.as_str(), all[1].kind), ("one [1/s]", 8));
    }
}
