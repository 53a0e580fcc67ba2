//! Franka's arms under their makers' limits on jerk, on random tasks.

use crate::rig::Rig;
use dq_config::{ForArm, ServoParameters};
use dq_core::servo::State;
use std::time::Duration;

/// The next of some numbers within 0 and 1.
fn part(random: &mut u64) -> f64 {
    *random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
    (*random >> 11) as f64 / (1_u64 << 53) as f64
}

/// How many of some random tasks of that arm settle at 1 kHz within 12 s, under its limits with that on jerk or without.
fn settled(arm: &str, with_jerk: bool) -> usize {
    let mut random = 7_u64;
    let mut settles = |_: &u32| {
        let parameters = ServoParameters::for_arm(arm).unwrap().with_period(Duration::from_millis(1));
        let position = &parameters.settings.limits.position;
        let mut anywhere = || -> Vec<f64> {
            let ranges = position.lower.iter().zip(&position.upper);
            ranges.map(|(lower, upper)| lower + (0.2 + 0.6 * part(&mut random)) * (upper - lower)).collect()
        };
        let (start, end) = (anywhere(), anywhere());
        let goal = parameters.arms.chain().forward_kinematics(&end).unwrap();
        let jerk = if with_jerk { 0.0 } else { f64::INFINITY };
        let raise = |limit: &mut f64| *limit = limit.max(jerk);
        let parameters = parameters.with(|settings| settings.limits.joint_jerk.iter_mut().for_each(raise));
        let mut rig = Rig::of(parameters, start);
        rig.run(0.01);
        rig.goal_pose(&goal);
        let cycles = (0..12_000).take_while(|_| {
            rig.cycle();
            !matches!(rig.state(), State::Settled | State::Stalled)
        });
        cycles.count();
        rig.state() == State::Settled
    };
    (0..25).filter(|number| settles(number)).count()
}

#[test]
fn as_many_tasks_of_frankas_arms_settle_under_their_makers_jerks() {
    for arm in ["panda", "fr3"] {
        let (without, with) = (settled(arm, false), settled(arm, true));
        println!("{arm}: {with} of 25 under a limit on jerk, {without} without");
        assert!(with + 1 >= without && with > 10, "{arm}: {with}, {without} without a limit on jerk");
    }
}
