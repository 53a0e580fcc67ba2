//! Tests of [`Setpoint`].

use crate::servo::setpoint::*;
use dq_kinematics::arm::JointKind;
use dq_limits::PositionLimits;

#[test]
fn it_begins_at_the_measured_positions_and_stays_within_position_limits() {
    let limits = PositionLimits { lower: vec![-1.0, 0.0], upper: vec![1.0, 5.0], margin: 0.1 };
    let mut setpoint = Setpoint::new(vec![JointKind::Revolute, JointKind::Prismatic]);
    assert_eq!((setpoint.get(), setpoint.farthest(&[0.0; 2])), (None, None));
    setpoint.lead(&[0.5, -2.0]);
    setpoint.lead(&[9.0, 9.0]);
    setpoint.advance(&[0.4, 1.0], &limits, 0.5, 1.0);
    assert_eq!(setpoint.get(), Some(&[0.7, -1.5][..]), "one found outside may come inside");
    setpoint.advance(&[2.0, -1.0], &limits, 0.5, 2.0);
    assert_eq!(setpoint.get(), Some(&[1.0, -1.5][..]), "but none goes on outward");
    assert!(
        (setpoint.speeds()[0] - 0.3).abs() < 1e-15 && setpoint.speeds()[1] == 0.0,
        "in the time of two cycles"
    );
    assert_eq!(setpoint.farthest(&[0.9, -1.0]), Some((2, 0.5, JointKind::Prismatic)));
    let turn = std::f64::consts::TAU;
    assert_eq!(setpoint.farthest(&[1.0 + turn, -1.5]).map(|(joint, ..)| joint), Some(2), "a turn is no way");
    assert_eq!(
        setpoint.farthest(&[1.0, -1.5 + turn]),
        Some((2, turn, JointKind::Prismatic)),
        "but six metres are"
    );
    setpoint.give_way();
    setpoint.go_back(&[0.8, -1.5]);
    assert_eq!(setpoint.get(), Some(&[0.8, -1.5][..]), "where the arm is");
    setpoint.go_back(&[0.9, -1.5]);
    setpoint.advance(&[1.0, 1.0], &limits, 0.5, 1.0);
    assert_eq!((setpoint.get(), setpoint.speeds()), (None, &[0.0; 2][..]));
}
