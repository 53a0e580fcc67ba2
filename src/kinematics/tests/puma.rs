//! The PUMA 560, the arm of the reference work (Sathuluri 2018), with its default law and gains.

use dq_config::{ForArm, ServoParameters};
use dq_kinematics::arm::Chain;
use dq_kinematics::control::Controller;
use std::sync::LazyLock;

static PARAMETERS: LazyLock<ServoParameters> = LazyLock::new(|| ServoParameters::for_arm("puma560").unwrap());

pub fn puma() -> Chain {
    PARAMETERS.arms.chain().clone()
}

pub fn controller() -> Controller {
    PARAMETERS.settings.controller
}
