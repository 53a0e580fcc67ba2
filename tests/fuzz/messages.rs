//! Tests bytes in place of messages.

use crate::damage::{Damage, apply, damage};
use crate::{assert_one_line, cases, measured};
use dq_messages::ParameterEvent;
use dq_messages::decode;
use dq_messages::messages::*;
use proptest::prelude::*;
use proptest::sample::Index;
use rustdds::RepresentationIdentifier;
use rustdds::serialization::to_writer_with_rep_id;
use serde_json::Value;
use std::sync::LazyLock;

/// Messages of a real ROS 2.
static ORIGINALS: LazyLock<Vec<Vec<u8>>> = LazyLock::new(|| {
    let all: Vec<Value> = serde_json::from_str(include_str!("../data/cdr_jazzy.json")).unwrap();
    all.iter().map(|case| hex::decode(case["cdr"].as_str().unwrap()).unwrap()).collect()
});

/// The largest memory that a decoder may allocate before it has the data, even if lengths claim more: serde stops at 1 MiB per
/// sequence. The limit also covers parallel tests \[bytes\].
const AHEAD: usize = 8 << 20;
/// The largest ratio of a decoded value to its encoding: an empty string of four bytes takes 24 bytes here.
const FACTOR: usize = 32;

fn encode<M: Message>(message: &M) -> Vec<u8> {
    let mut bytes = vec![0, 1, 0, 0];
    to_writer_with_rep_id(&mut bytes, message, RepresentationIdentifier::CDR_LE).unwrap();
    bytes
}

/// Decodes the bytes. Returns whether they are a message.
fn check<M: Message>(bytes: &[u8]) -> bool {
    let (decoded, memory) = measured(|| decode::<M>(bytes));
    assert!(memory <= AHEAD + FACTOR * bytes.len(), "{}: {memory} bytes for {}", M::TYPE, bytes.len());
    let message = match decoded {
        Ok(message) => message,
        Err(why) => {
            assert_one_line(&why);
            return false;
        }
    };
    // Encoding need not give the same bytes: padding, byte order and the end of an empty string may differ. But the second encoding
    // equals the first.
    let encoded = encode(&message);
    assert_eq!(encode(&decode::<M>(&encoded).unwrap()), encoded, "{}", M::TYPE);
    true
}

/// Decodes the bytes as each type that our nodes, tools or bag readers decode. Returns the number of successes.
fn check_all(bytes: &[u8]) -> usize {
    let found = [
        check::<JointState>(bytes),
        check::<PoseStamped>(bytes),
        check::<Float64MultiArray>(bytes),
        check::<DiagnosticStatus>(bytes),
        check::<DiagnosticArray>(bytes),
        check::<ParameterEvent>(bytes),
        check::<StringMessage>(bytes),
        check::<TFMessage>(bytes),
        check::<TwistStamped>(bytes),
        check::<SetBoolRequest>(bytes),
        check::<TriggerRequest>(bytes),
        check::<SuccessResponse>(bytes),
    ];
    found.iter().filter(|it| **it).count()
}

#[test]
fn the_originals_are_messages() {
    assert!(ORIGINALS.iter().all(|bytes| check_all(bytes) > 0));
}

#[test]
fn claimed_lengths_take_no_memory() {
    // In turn, each word of each message claims to be the largest possible length.
    for original in ORIGINALS.iter() {
        for at in (4..original.len()).step_by(4) {
            for length in [u32::MAX, 1 << 31, 1 << 28, 1 << 20] {
                let mut bytes = original.clone();
                bytes
                    .iter_mut()
                    .skip(at)
                    .zip(length.to_le_bytes())
                    .for_each(|(byte, claimed)| *byte = claimed);
                check_all(&bytes);
            }
        }
    }
}

#[test]
fn a_large_message_takes_no_more_than_its_size_says() {
    let numbers = Float64MultiArray { layout: MultiArrayLayout::default(), data: vec![1.5; 50_000] };
    assert!(check::<Float64MultiArray>(&encode(&numbers)));
    let names = JointState { name: vec![String::new(); 50_000], ..JointState::default() };
    assert!(check::<JointState>(&encode(&names)));
}

/// Returns a message with some damage.
fn damaged() -> impl Strategy<Value = (Index, Vec<Damage>)> {
    (any::<Index>(), prop::collection::vec(damage(), 1..6))
}

proptest! {
    #![proptest_config(cases(20_000))]
    #[test]
    fn damaged_messages_are_decoded_or_refused((original, damages) in damaged()) {
        let mut bytes = original.get(&ORIGINALS).clone();
        damages.iter().for_each(|damage| apply(damage, &mut bytes));
        check_all(&bytes);
    }

    #[test]
    fn any_bytes_are_decoded_or_refused(bytes in prop::collection::vec(any::<u8>(), 0..200), big_endian in any::<bool>()) {
        check_all(&[&[0, u8::from(!big_endian), 0, 0], &bytes[..]].concat());
    }
}
