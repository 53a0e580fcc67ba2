//! The servo's memory does not grow with its input.

use crate::reference::pose;
use crate::rig::{Rig, reading};
use allocation_counter::measure;
use dq_algebra::UnitDualQuaternion;
use dq_core::servo::{GoalReading, Sent};

/// The goals come from 100 000 publishers or from a single publisher. In one of the cases, nobody collects the updates of motions.
#[test]
fn a_hundred_thousand_goals_leave_nothing_behind() {
    for (publishers, is_heard) in [(100_000, true), (100_000, false), (1, true)] {
        let mut rig = Rig::new();
        rig.run(0.1);
        let (goal, period) = (pose("theta_desired"), crate::rig::PERIOD);
        let mut now = rig.now;
        let mut run = |count: u32| {
            for number in 0..count {
                now += period;
                let step = UnitDualQuaternion::screw_exp(
                    &[0.0, 0.0, 0.0, 1e-3 * f64::from(number % 7), 0.0, 0.0].into(),
                );
                let sent = Sent { by: number % publishers, ..Sent::default() };
                rig.servo.begin(now);
                let _ = rig.servo.take_stamped_goal(&GoalReading { sent, ..reading(&(goal * step), 0) }, now);
                rig.servo.step(now);
                if is_heard {
                    rig.servo.take_motions().for_each(drop);
                }
            }
        };
        run(1000);
        let kept = measure(|| run(100_000)).bytes_current;
        assert!(kept < 2 << 20, "{kept} bytes of {publishers} publishers");
    }
}
