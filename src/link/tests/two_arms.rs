//! Tests of the link to two arms.

use super::MS;
use crate::{JointOrder, JointReading, Link, LinkSettings};
use dq_kinematics::arm::JointKind;
use dq_limits::{Interface, Limits, PositionLimits};

const NAMES: [&str; 2] = ["left", "right"];
/// The speed of both arms [rad/s].
const SPEED: f64 = 0.5;

/// Runs cycles of 10 ms from `from` to `to` \[ms\]. In each cycle, the arms in `heard` report that they move at [`SPEED`]. Returns the
/// speeds of [`Link::coasting`], at which the next command must start. At most one cycle may have such speeds. If none has, the
/// list is empty.
fn begins(link: &mut Link, from: u32, to: u32, heard: &[usize]) -> Vec<f64> {
    let limits = Limits {
        joint_velocity: vec![1.0; 2],
        joint_acceleration: vec![10.0; 2],
        joint_deceleration: vec![10.0; 2],
        joint_jerk: vec![f64::INFINITY; 2],
        linear_speed: 1.0,
        angular_speed: 1.0,
        position: PositionLimits { lower: vec![-9.0; 2], upper: vec![9.0; 2], margin: 0.0 },
    };
    let (state_timeout, rearm_timeout) = (200 * MS, 1000 * MS);
    let settings =
        LinkSettings { limits: &limits, state_timeout, rearm_timeout, latency: None, integral: 0.0 };
    let mut speeds = Vec::new();
    for now in (from..to).step_by(10).map(|ms| ms * MS) {
        for arm in heard {
            let names = [NAMES[*arm].to_owned()];
            let (positions, velocities) = ([SPEED * now.as_secs_f64()], [SPEED]);
            let state = JointReading {
                names: &names,
                positions: &positions,
                velocities: &velocities,
                source: *arm as u32,
                stamp_age: None,
            };
            link.take(*arm, &state, now, state_timeout).unwrap();
        }
        link.advance(now, &settings);
        let begun: Vec<_> = link.coasting().map(|(_, speed)| speed).collect();
        assert!(begun.is_empty() || speeds.is_empty(), "again at {now:?}");
        speeds.extend(begun);
        link.command(now, &[SPEED; 2]);
    }
    speeds
}

#[test]
fn both_arms_begin_at_their_speeds_when_the_state_of_the_later_one_is_known() {
    let orders = NAMES.map(|name| JointOrder::new(vec![name.to_owned()])).to_vec();
    let mut link = Link::new(orders, &[JointKind::Revolute; 2], 10 * MS, Interface::Velocity);
    assert_eq!(begins(&mut link, 0, 500, &[0]), [0.0; 0], "the other arm is not there yet");
    assert_eq!(begins(&mut link, 500, 1000, &[0, 1]), [SPEED; 2]);
    // The cycles have a gap of 0.4 s. Then the joint states of one arm arrive 0.1 s before those of the other.
    assert_eq!(begins(&mut link, 1400, 1500, &[0]), [0.0; 0], "the state of the other arm is old");
    assert_eq!(begins(&mut link, 1500, 2000, &[0, 1]), [SPEED; 2]);
}
