//! Compares the messages with the bytes of a real ROS 2.

use super::*;
use rustdds::{RepresentationIdentifier, serialization};
use std::fmt::Debug;

/// Bytes from a real ROS 2 Jazzy, with the values that these bytes encode.
const FIXTURE: &str = include_str!("../../../tests/data/cdr_jazzy.json");

/// Decodes every example of `M`, and checks that encoding gives the same bytes again. Returns the number of examples.
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
        // ROS 2 pads the payload to four bytes. The padding has no data.
        let (data, padding) = payload.split_at(encoded.len());
        assert_eq!(data, encoded, "{message:?}");
        assert!(padding.len() < 4 && padding.iter().all(|&byte| byte == 0), "{message:?}");
        check_value(&case["value"], &serde_json::to_value(&message).unwrap());
    }
    cases.len()
}

/// Compares the value of an example with ours. In the examples, bytes are strings of one character.
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
fn a_text_that_is_not_utf_8_is_read_as_latin_1() {
    for (bytes, text) in [(&b"m\xfcller\0"[..], "m\u{fc}ller"), (b"\xc3\xbc\0", "\u{fc}"), (b"\0", "")] {
        let length = u32::try_from(bytes.len()).unwrap().to_le_bytes();
        let cdr = [&[0, 1, 0, 0][..], &length, bytes].concat();
        assert_eq!(crate::decode::<StringMessage>(&cdr).unwrap().data, text);
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
