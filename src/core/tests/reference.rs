//! The arm of the reference work (Sathuluri 2018), joint positions from that work, and the settings of the servos for this arm. The
//! tests call this arm the paper's arm.

use dq_algebra::UnitDualQuaternion;
use dq_config::{DualParameters, NodeParameters, ServoParameters};
use dq_core::servo::Settings;
use dq_kinematics::arm::Chain;
use nalgebra::Vector3;
use std::sync::LazyLock;

#[path = "../../algebra/tests/reference.rs"]
mod numbers;
pub use numbers::distance;

static PARAMETERS: LazyLock<ServoParameters> = LazyLock::new(built_in);

fn built_in<P: NodeParameters>() -> P {
    let (store, _) = P::start("/any", Vec::new()).unwrap();
    P::from_store(&store).unwrap()
}

pub fn parameters() -> ServoParameters {
    PARAMETERS.clone()
}

pub fn dual_parameters() -> ServoParameters {
    built_in::<DualParameters>().0
}

pub fn puma() -> Chain {
    PARAMETERS.arms.chain().clone()
}

pub fn settings() -> Settings {
    PARAMETERS.settings.clone()
}

/// Returns the joint angles that the reference work calls `name` \[rad\].
pub fn theta(name: &str) -> Vec<f64> {
    numbers::numbers(&numbers::json()[name])
}

/// Returns `pose`, moved along the base's x axis by `x` \[m\].
pub fn moved_by(pose: &UnitDualQuaternion, x: f64) -> UnitDualQuaternion {
    UnitDualQuaternion::from_parts(pose.rotation(), pose.translation() + Vector3::x() * x)
}

/// Returns the tool's pose at the joint angles that the reference work calls `theta`.
pub fn pose(theta: &str) -> UnitDualQuaternion {
    puma().forward_kinematics(&self::theta(theta)).unwrap()
}
