//! Joint states that their stamps do not distinguish.

use crate::bags::{alter, read, write};
use crate::runs::{DEMO, replay_demo};
use dq_servo::record::WriterOptions;
use dq_servo::wire::messages::{Float64MultiArray, JointState, Message, Time};
use dq_servo::wire::{ArmLabel, CycleLabel};
use std::collections::HashMap;
use std::path::Path;

/// As by a simulated clock that is slow, with a recorder that hears late of what is commanded.
#[test]
fn states_of_one_stamp_are_distinguished_by_their_digests() {
    const TICK: i64 = 50_000_000;
    let directory = tempfile::tempdir().unwrap();
    for (name, differ) in [("with digests", false), ("without", true)] {
        let mut messages = read(Path::new(DEMO));
        let mut digests = HashMap::new();
        for message in messages.iter_mut().filter(|message| message.topic == "/joint_states") {
            alter(message, |state: &mut JointState| {
                let stamp = state.header.stamp.nanoseconds();
                digests.insert(stamp, ArmLabel::digest_of(state));
                state.header.stamp = Time::from_nanoseconds(stamp - stamp % TICK);
            });
        }
        for message in messages.iter_mut().filter(|message| message.message == Float64MultiArray::TYPE) {
            message.time += 15_000_000;
            alter(message, |command: &mut Float64MultiArray| {
                let mut label = CycleLabel::of(command).unwrap();
                let arm = &mut label.arms[0];
                arm.digest = digests.get(&arm.stamp).copied().filter(|_| !differ);
                arm.stamp -= arm.stamp % TICK;
                command.layout.dim[0].label = label.to_string();
            });
        }
        messages.sort_by_key(|message| message.time);
        write(&directory.path().join(name), WriterOptions::default(), &messages);
        let replayed = replay_demo(&directory.path().join(name));
        assert_eq!(replayed.different > 0, differ, "{name}: {replayed:?}");
        assert!(replayed.commands > 500, "{name}: {replayed:?}");
    }
}
