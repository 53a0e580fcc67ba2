//! Tests of the texts of [`Reconfiguration`].

use crate::servo::Stall;
use crate::servo::reconfiguration::*;
use dq_kinematics::arm::JointKind;
use std::time::Duration;

const STALL: Stall = Stall::AtLimit { joint: 3 };

#[test]
fn a_stall_explains_what_to_do_about_it() {
    let found = Duration::from_secs(9);
    let detour = Detour { joint: 3, kind: JointKind::Revolute, from: 2.356, to: -0.52, found };
    let says =
        |reconfiguration: Reconfiguration| reconfiguration.explain(&STALL, |joint| format!("joint{joint}"));
    assert_eq!(
        says(Reconfiguration::Found(detour)),
        "joint3 is at its position limit; with joint3 at -0.52 rad instead of 2.36 rad the goal is reachable: \
         `dq_servo reconfigure` or ~/reconfigure takes the arm there"
    );
    assert_eq!(
        says(Reconfiguration::NotFound { starts: 256 }),
        "joint3 is at its position limit; no configuration within the limits was found in 256 starts"
    );
    assert_eq!(says(Reconfiguration::Taken), STALL.explain(|joint| format!("joint{joint}")));
}
