//! Tests of the servo with logc_pd, a law whose velocity also depends on the previous cycles.

use crate::reference::settings;
use crate::rig::Rig;
use dq_core::servo::State;
use dq_kinematics::control::Law;

/// Returns the largest acceleration of a joint in the first cycles of a motion [rad/s²].
fn first_acceleration(law: Law) -> f64 {
    let mut rig = Rig::new();
    rig.set_law(law);
    rig.run(0.1);
    rig.goal("theta_desired");
    let mut before = vec![0.0; 6];
    let mut fastest = 0.0_f64;
    for _ in 0..5 {
        rig.cycle();
        let now = rig.servo.command().to_vec();
        let changes = now.iter().zip(&before).map(|(now, before)| (now - before).abs() / 0.002);
        fastest = changes.fold(fastest, f64::max);
        before = now;
    }
    fastest
}

#[test]
fn a_motion_begins_without_a_step_of_the_acceleration_to_its_limit() {
    let (first_order, second_order) = (first_acceleration(Law::Logc), first_acceleration(Law::LogcPd));
    // logc uses all the acceleration that the joints have.
    assert!((first_order - settings().limits.joint_acceleration[0]).abs() < 1e-6, "{first_order}");
    assert!(second_order < 0.5 * first_order, "{second_order}");
}

#[test]
fn it_takes_an_arm_over_at_its_speed() {
    let mut rig = Rig::new();
    rig.run(0.1);
    rig.goal("theta_desired");
    // Away from singularities. Near one, damping removes a part of the velocity with which the law begins.
    rig.run(0.2);
    let before = rig.servo.command().to_vec();
    rig.set_law(Law::LogcPd);
    rig.cycle();
    let fastest = before.iter().fold(0.0_f64, |most, speed| most.max(speed.abs()));
    let change = rig.servo.command().iter().zip(&before).map(|(now, before)| (now - before).abs());
    let change = change.fold(0.0, f64::max);
    assert!(fastest > 0.5 && change < 0.02 * fastest, "{change} of {fastest}");
    rig.run_until(State::Settled, 30.0);
}

#[test]
fn what_a_limit_takes_is_not_made_up_for() {
    let reach = |limit: f64| {
        let mut rig = Rig::new();
        let mut settings = rig.servo.settings().clone();
        settings.limits.joint_velocity.fill(limit);
        rig.servo.configure(settings).unwrap();
        rig.set_law(Law::LogcPd);
        rig.run(0.1);
        rig.goal("theta_desired");
        rig.run_until(State::Settled, 60.0);
        rig.servo.status().figures.overshoot
    };
    assert!(reach(0.2) < 2e-3, "{}", reach(0.2));
}
