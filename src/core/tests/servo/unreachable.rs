//! Tests of rule 9 of the guide's safety page: goals that no configuration reaches, although the arm is long enough.

use crate::arms::{anywhere, servo};
use crate::rig::Rig;
use dq_algebra::UnitDualQuaternion;
use dq_core::servo::{Stall, State};
use nalgebra::Vector3;
use std::time::Duration;

#[test]
fn rule_9_an_arm_that_stands_where_no_motion_brings_it_nearer_does_not_wait_for_the_whole_timeout() {
    let mut waited = Vec::new();
    for number in 0..20 {
        let parameters = servo("ur5e");
        let (limits, mut arms) = (&parameters.settings.limits.position, parameters.arms.clone());
        arms.evaluate(&anywhere(limits, 1000 + number));
        let (pose, longest) = (arms.pose(), arms.reach(&Vector3::zeros(), limits.ranges()).longest);
        let point = 0.98 * longest * pose.translation().normalize();
        let start = anywhere(limits, number);
        let mut rig = Rig::of(parameters, start);
        rig.run(0.3);
        rig.goal_pose(&UnitDualQuaternion::from_parts(pose.rotation(), point));
        let (begin, mut moved) = (rig.now, rig.now);
        while rig.state() != State::Stalled {
            rig.cycle();
            if rig.speed() > 0.01 {
                moved = rig.now;
            }
            assert!(rig.now - begin < Duration::from_secs(20), "{number}: {:?}", rig.servo.status());
        }
        if rig.servo.status().stall == Some(Stall::Unreachable) {
            waited.push(rig.now - moved);
        }
    }
    assert!(waited.len() > 15 && waited.iter().all(|time| *time < Duration::from_secs(3)), "{waited:?}");
}
