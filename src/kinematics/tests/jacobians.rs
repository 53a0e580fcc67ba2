//! Jacobians compared with finite differences.

use crate::tolerance::ALGEBRA;
use dq_algebra::dual_hamilton_plus;
use dq_kinematics::arm::{ArmState, Chain};

/// Tolerance of central finite differences with step 1e-6.
pub const FINITE_DIFFERENCE: f64 = 1e-8;

pub fn state(chain: &Chain, theta: &[f64]) -> ArmState {
    let mut state = ArmState::new(chain);
    chain.evaluate(theta, &mut state).unwrap();
    state
}

/// Compares the pose Jacobian with central differences of the pose along each joint. Compares the body Jacobian with rows 2–4 and
/// 6–8 of `2 H⁺₈(q*) J`.
pub fn check_jacobians(chain: &Chain, theta: &[f64]) {
    const STEP: f64 = 1e-6;
    let state = state(chain, theta);
    let jacobian = state.pose_jacobian();
    for (i, column) in jacobian.column_iter().enumerate() {
        let pose = |step: f64| {
            let mut moved = theta.to_vec();
            moved[i] += step;
            chain.forward_kinematics(&moved).unwrap().to_vector8()
        };
        let difference = (pose(STEP) - pose(-STEP)) / (2.0 * STEP);
        assert!((difference - column).norm() < FINITE_DIFFERENCE, "joint {i} at {theta:?}");
    }
    let conjugate = *state.base_from_tool().inverse().as_dual_quaternion();
    let (twists, body) = (2.0 * dual_hamilton_plus(&conjugate) * jacobian, state.body_jacobian());
    assert!((twists.rows(1, 3) - body.rows(0, 3)).norm() < ALGEBRA * 10.0);
    assert!((twists.rows(5, 3) - body.rows(3, 3)).norm() < ALGEBRA * 10.0);
}
