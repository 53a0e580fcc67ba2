//! Tests a single closed loop.

use crate::arm;
use dq_kinematics::control::{Aim, Law, PoseError};
use dq_studies::compare::{ClosedLoop, Interval, Outcome, PLANTS, Plant};

fn closed_loop<'a>(arm: &'a dq_studies::compare::Arm, law: Law, gain: f64) -> ClosedLoop<'a> {
    let controller = arm.parameters.settings.controller.with_law(law, gain);
    ClosedLoop { arm, controller, plant: PLANTS[0], limits: false }
}

#[test]
fn logc_settles_at_its_rate_on_six_joints_and_on_seven() {
    for name in ["puma560", "panda"] {
        let arm = arm(name);
        let settled = |number| {
            let ended = closed_loop(&arm, Law::Logc, 2.0).run(&arm.task(1, number).unwrap(), number).unwrap();
            ended.figures.settling_time().filter(|_| ended.outcome == Outcome::Settled)
        };
        let mut times: Vec<_> = (0..11).filter_map(settled).collect();
        times.sort_by(f64::total_cmp);
        // exp(−2t) = 2 % at 1.96 s; the translation follows the screw.
        assert!(times.len() > 8 && (1.9..2.3).contains(&times[times.len() / 2]), "{name}: {times:?}");
    }
}

#[test]
fn a_law_whose_gain_times_the_age_of_states_is_too_large_does_not_settle() {
    let arm = arm("ur5e");
    let task = arm.task(1, 0).unwrap();
    let ended = |latency, gain| {
        let plant = Plant { name: "latency", latency, noise: 0.0 };
        ClosedLoop { plant, ..closed_loop(&arm, Law::Logc, gain) }.run(&task, 0).unwrap()
    };
    // ẋ(t) = −k x(t − T) is stable for kT < ½π, which the loop must confirm.
    assert_eq!(ended(4, 20.0).outcome, Outcome::Settled);
    assert_ne!(ended(4, 160.0).outcome, Outcome::Settled);
    assert!(ended(4, 60.0).figures.overshoot > ended(0, 60.0).figures.overshoot + 1e-3);
}

#[test]
fn under_limits_no_joint_is_faster_than_it_may_be() {
    let arm = arm("panda");
    let free = closed_loop(&arm, Law::Diffc, 185.0);
    let limited = ClosedLoop { limits: true, ..closed_loop(&arm, Law::Diffc, 185.0) };
    let task = arm.task(1, 3).unwrap();
    assert!(free.run(&task, 3).unwrap().figures.peak_joint_speed > 2.61);
    assert!(limited.run(&task, 3).unwrap().figures.peak_joint_speed <= 2.61 + 1e-9);
}

#[test]
fn failures_have_a_reason() {
    let arm = arm("puma560");
    let outcome = |law, gain, number: u32| {
        closed_loop(&arm, law, gain).run(&arm.task(1, number).unwrap(), number).unwrap().outcome
    };
    assert_eq!(outcome(Law::Logc, 0.05, 0), Outcome::Slow);
    assert_eq!(outcome(Law::LogcTranspose, 1e4, 0), Outcome::Diverged);
}

#[test]
fn intervals_are_those_of_the_textbooks() {
    // Wilson's interval for 8 of 10: 49.0 to 94.3 %.
    let share = Interval::share(8, 10, 1.96);
    assert!((share.low - 49.0).abs() < 0.1 && (share.high - 94.3).abs() < 0.1, "{share:?}");
    assert_eq!(Interval::share(0, 10, 1.96).low, 0.0);
    // For the median of 100 values the binomial distribution gives the 41st and the 61st value.
    let values: Vec<_> = (1..=100).map(f64::from).collect();
    let median = Interval::median(&values, 1.96).unwrap();
    assert_eq!((median.low, median.value, median.high), (41.0, 51.0, 61.0));
    assert_eq!(Interval::median(&[], 1.96), None);
}

/// The page says that two laws with derived gains equal two others with twice the gain for the translation.
#[test]
fn lq_and_h_infinity_are_laws_with_twice_the_gain_for_the_translation() {
    let arm = arm("puma560");
    let task = arm.task(1, 0).unwrap();
    let mut here = arm.parameters.arms.clone();
    here.evaluate(&task.start);
    for (law, like) in [(Law::Lq, Law::DiffcInverse), (Law::HInfinity, Law::UnitQuaternion)] {
        let controller = arm.parameters.settings.controller.with_law(law, 3.0);
        let [linear, angular] = controller.fastest_rates(here.state(), &task.base_from_goal);
        assert!((linear / angular - 2.0).abs() < 1e-12, "{law}: {linear} {angular}");
        let seen = PoseError::of(Aim::Pose, here.state(), &task.base_from_goal);
        assert_eq!((law.map(), law.error(&seen)), (like.map(), like.error(&seen)));
    }
}
