//! What a servo's state means, in words and with the names of the joints.

use super::Wiring;
use crate::servo::{Servo, State};

/// The name of the joint number `joint`, counted from 1, arm after arm; with two arms `left/` or `right/` stands before it.
pub(super) fn joint_name<T: Wiring>(servo: &Servo<T>, joint: usize) -> String {
    let mut before = 0;
    let arm = servo.joint_counts().iter().position(|count| {
        before += count;
        joint <= before
    });
    let arm = arm.and_then(|arm| T::ARMS.get(arm)).copied().unwrap_or_default();
    format!("{arm}{}", servo.joint_name(joint))
}

/// Why the arm does not arrive, and what to try; none where nothing holds it up.
pub(super) fn reason<T: Wiring>(servo: &Servo<T>) -> Option<String> {
    let status = servo.status();
    match status.state {
        State::Stalled => status.stall.map(|stall| stall.explain(|joint| joint_name(servo, joint))),
        State::JointLimit => status
            .joint_at_limit
            .map(|joint| format!("{} is at its position limit", joint_name(servo, joint))),
        State::Tracking if status.leaving_singularity => {
            Some("at a singularity the law stands still: the arm is led out of it".to_owned())
        }
        _ => None,
    }
}
