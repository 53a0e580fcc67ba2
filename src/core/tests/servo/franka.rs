//! Tests of random tasks for Franka's arms, with the manufacturer's limits on jerk.

use crate::arms::anywhere;
use crate::rig::Rig;
use dq_config::{ForArm, ServoParameters};
use dq_core::servo::State;
use std::time::Duration;

/// Returns how many of 25 random tasks of the arm settle within 12 s at 1 kHz, with or without the arm's limits on jerk.
fn settled(arm: &str, with_jerk: bool) -> usize {
    let settles = |number: &usize| {
        let parameters = ServoParameters::for_arm(arm).unwrap().with_period(Duration::from_millis(1));
        let limits = &parameters.settings.limits.position;
        let (start, end) = (anywhere(limits, *number), anywhere(limits, 1000 + *number));
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
    (0..25).filter(settles).count()
}

#[test]
fn as_many_tasks_of_frankas_arms_settle_under_their_makers_jerks() {
    for arm in ["panda", "fr3"] {
        let (without, with) = (settled(arm, false), settled(arm, true));
        println!("{arm}: {with} of 25 under a limit on jerk, {without} without");
        assert!(with + 1 >= without && with > 10, "{arm}: {with}, {without} without a limit on jerk");
    }
}
