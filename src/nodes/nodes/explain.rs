//! Why the arm does not arrive, in words and with the names of the joints.

use dq_core::servo::{Reconfiguration, State, Status};

/// The name of the joint of that number, counted from 1.
pub(super) fn joint(number: usize, joints: &[String]) -> String {
    joints.get(number.wrapping_sub(1)).cloned().unwrap_or_else(|| number.to_string())
}

/// A robot that moves at less than this part of the commanded speed was told to be slow.
const SLOW: f64 = 0.8;

/// Why the arm does not arrive, and what to try; none where nothing holds it up. `joints` are the names of all joints, arm after arm.
pub(super) fn reason(status: &Status, joints: &[String]) -> Option<String> {
    let name = |number: usize| joint(number, joints);
    match status.state {
        State::Stalled => status.stall.map(|stall| status.reconfiguration.explain(&stall, name)),
        State::Reconfiguring => match status.reconfiguration {
            Reconfiguration::Underway(detour) => {
                Some(format!("{}, and the arm goes there", detour.explain(name)))
            }
            _ => None,
        },
        State::JointLimit => {
            status.joint_at_limit.map(|joint| format!("{} is at its position limit", name(joint)))
        }
        State::Constrained => status.held_by.map(|pair| pair.explain(name)),
        State::Tracking | State::Jogging | State::Settled if status.too_far.is_some() => {
            status.too_far.map(|(number, factor)| {
                format!(
                    "{} goes {factor:.1} times as far as commanded: are its units and its gear right?",
                    name(number)
                )
            })
        }
        State::Tracking | State::Jogging if status.speed_factor < SLOW => Some(format!(
            "the robot moves at {:.0} % of its speed: was it told to be slow?",
            100.0 * status.speed_factor
        )),
        State::Tracking if status.leaving_singularity => {
            Some("the law stands still at a singularity: the arm is led out of it".to_owned())
        }
        _ => None,
    }
}
