//! The memory of a law lasts for one motion.

use crate::reference::pose;
use crate::rig::Rig;
use dq_core::servo::State;
use dq_kinematics::control::{AngularLinear, ControlLaw, PoseError, ToolMotion, register};
use std::sync::atomic::{AtomicU32, Ordering};

/// A law that counts its motions. Its memory is the time since the motion began. The velocity of the law grows with this time.
struct Counting {
    motions: AtomicU32,
}

impl ControlLaw for Counting {
    fn name(&self) -> &'static str {
        "counting"
    }

    fn error(&self, error: &PoseError) -> AngularLinear {
        error.screw_log()
    }

    fn memory_size(&self) -> usize {
        1
    }

    fn begin(&self, _motion: &ToolMotion, memory: &mut [f64]) {
        self.motions.fetch_add(1, Ordering::Relaxed);
        memory.fill(0.0);
    }

    fn twist_with_memory(&self, motion: &ToolMotion, memory: &mut [f64]) -> AngularLinear {
        memory[0] += motion.period;
        let (angular, linear) = self.twist(motion.gains, &motion.error);
        let faster = 1.0 + memory[0];
        (faster * angular, faster * linear)
    }
}

static COUNTING: Counting = Counting { motions: AtomicU32::new(0) };

fn motions() -> u32 {
    COUNTING.motions.load(Ordering::Relaxed)
}

#[test]
fn each_motion_begins_with_a_new_memory_and_a_stream_is_one_motion() {
    let law = register(&COUNTING).unwrap();
    let mut rig = Rig::new();
    rig.set_law(law);
    rig.run(0.1);
    assert_eq!(motions(), 0, "no motion yet");
    rig.goal("theta_desired");
    rig.run_until(State::Settled, 30.0);
    assert_eq!(motions(), 1);
    rig.goal("theta_initial");
    rig.run(0.5);
    assert_eq!(motions(), 2, "a second goal");
    rig.pause(true);
    rig.run(1.0);
    rig.pause(false);
    rig.run(0.5);
    assert_eq!(motions(), 3, "the rest after a pause is a motion of its own");
    for share in 0..100 {
        rig.stream(&pose("theta_initial").sclerp(&pose("theta_desired"), 0.002 * f64::from(share)));
        rig.run(0.02);
    }
    assert_eq!(motions(), 4, "the first goal of a stream begins a motion, the others do not");
}
