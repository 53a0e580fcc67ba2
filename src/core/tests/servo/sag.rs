//! Tests of an arm that takes velocity commands while an external force pulls at its joints. The force stands for a payload, or for
//! gravity that the joints' controllers do not compensate for.

use crate::reference::distance;
use crate::rig::Rig;
use dq_core::servo::{Reason, Stall, State};

/// Returns an arm on which a force acts: its second joint moves with the commanded velocity minus 0.05 rad/s.
fn pulled(integral: f64) -> Rig {
    let mut rig = Rig::with(|settings| settings.integral = integral);
    rig.wires = |speeds| speeds[1] -= 0.05;
    // The pull moves the tool slightly faster than its limits.
    rig.check_tools = false;
    rig
}

/// Returns how far the second joint sinks in `seconds` \[rad\].
fn sinks(rig: &mut Rig, seconds: f64) -> f64 {
    let before = rig.positions()[1];
    rig.run(seconds);
    before - rig.positions()[1]
}

#[test]
fn with_the_integral_an_arm_that_is_pulled_at_arrives_and_stays_within_its_limits() {
    for (integral, jerk) in [(2.0, f64::INFINITY), (5.0, 500.0), (10.0, f64::INFINITY)] {
        let mut rig = pulled(integral);
        rig.change(|settings| settings.limits.joint_jerk.fill(jerk));
        rig.goal("theta_desired");
        let limits = rig.servo.settings().limits.clone();
        let (mut before, mut steps, mut settled) = (vec![0.0; 6], vec![0.0; 6], None);
        for cycle in 0..10_000 {
            rig.cycle();
            let sent = rig.output.clone().unwrap();
            for (joint, (now, before)) in sent.iter().zip(&before).enumerate() {
                assert!(now.abs() <= limits.joint_velocity[joint] * (1.0 + 1e-9), "{cycle}: {now}");
                let step = 0.002 * limits.joint_acceleration[joint].max(limits.joint_deceleration[joint]);
                let change = 0.002 * 0.002 * limits.jerk(joint);
                let (last, this) = (steps[joint], now - before);
                assert!(this.abs() <= step * (1.0 + 1e-9), "{cycle}: {before} {now}");
                assert!((this - last).abs() <= change * (1.0 + 1e-9) + 1e-14, "{cycle}: {last} {this}");
                steps[joint] = this;
            }
            before = sent;
            if settled.is_none() && rig.state() == State::Settled {
                settled = Some(cycle);
            }
            assert!(settled.is_none() || rig.state() == State::Settled, "{integral}: {}", rig.state());
        }
        assert!(settled.is_some() && rig.servo.status().figures.overshoot < 1e-3, "{integral}");
    }
}

#[test]
fn where_nothing_pulls_the_integral_changes_nothing_that_can_be_seen() {
    let ends = [0.0, 5.0].map(|integral| {
        let mut rig = Rig::with(|settings| settings.integral = integral);
        rig.goal("theta_desired");
        rig.run_until(State::Settled, 20.0);
        rig.servo.status().figures.elapsed
    });
    assert!((ends[0] - ends[1]).abs() <= 0.02, "{ends:?}");
}

#[test]
fn without_the_integral_an_arm_that_is_pulled_at_does_not_settle_and_is_told_why() {
    let mut rig = pulled(0.0);
    rig.goal("theta_desired");
    for _ in 0..10_000 {
        rig.cycle();
        assert_ne!(rig.state(), State::Settled, "it passes through");
        if rig.state() == State::Stalled {
            break;
        }
    }
    let stall = rig.servo.status().stall.unwrap();
    let Stall::Sagging { joint: 2, speed, error, .. } = stall else { panic!("{stall:?}") };
    assert!((speed - 0.05).abs() < 0.01 && error.position > 1e-3, "{stall:?}");
    let text = stall.explain(|joint| format!("joint{joint}"));
    assert!(
        text.starts_with("stands ") && text.contains("joint2 sags by 0.0") && text.contains("integral"),
        "{text}"
    );
}

#[test]
fn an_arm_that_sinks_where_it_was_to_stand_is_told_or_held() {
    for integral in [0.0, 5.0] {
        let mut rig = pulled(integral);
        assert!(
            sinks(&mut rig, 2.0) < 1e-9,
            "nothing is sent, and nothing is said of a robot that nobody drives"
        );
        assert_eq!(rig.servo.status().reason, None);
        rig.goal("theta_desired");
        rig.run(2.0);
        rig.stop();
        rig.run(1.5);
        assert_eq!(rig.state(), State::Holding);
        let (way, reason) = (sinks(&mut rig, 2.0), rig.servo.status().reason);
        if integral > 0.0 {
            assert!(way.abs() < 1e-3, "{way} rad");
            assert!(!matches!(reason, Some(Reason::Sagging { .. })), "{reason:?}");
            continue;
        }
        let Some(Reason::Sagging { joint: 2, speed, .. }) = reason else { panic!("{reason:?}") };
        assert!((way - 0.1).abs() < 1e-3 && (speed + 0.05).abs() < 2e-3, "{way} rad, {speed} rad/s");
    }
}

#[test]
fn the_integral_is_switched_without_a_step_and_ends_with_joint_states() {
    let mut rig = pulled(5.0);
    rig.goal("theta_desired");
    rig.run_until(State::Settled, 20.0);
    rig.run(1.0);
    let held = rig.output.clone().unwrap()[1];
    assert!((held - 0.05).abs() < 1e-3, "{held}");
    let mut before = held;
    for on in [false, true] {
        rig.change(|settings| settings.integral = if on { 5.0 } else { 0.0 });
        for _ in 0..1000 {
            rig.cycle();
            let now = rig.output.clone().unwrap()[1];
            assert!((now - before).abs() <= 0.05, "{before} {now}");
            before = now;
        }
    }
    rig.run_until(State::Settled, 20.0);
    rig.connect(false);
    rig.run(1.0);
    assert_eq!(
        (rig.state(), rig.output.clone().unwrap()[1]),
        (State::StaleState, 0.0),
        "nobody knows what pulls now"
    );
}

#[test]
fn an_arm_that_does_not_obey_gets_nothing_against_what_pulls() {
    let mut rig = pulled(5.0);
    rig.goal("theta_desired");
    rig.run(1.5);
    rig.following = false;
    rig.wires = |_| {};
    rig.run(5.0);
    assert_eq!(rig.output.clone().unwrap(), [0.0; 6]);
    let before = rig.positions();
    rig.following = true;
    rig.run(2.0);
    assert!(distance(&before, &rig.positions()) < 1e-9, "{before:?} {:?}", rig.positions());
}
