//! Judges the paper's claims about its equations by numbers.

use super::claim::Claim;
use super::{Laboratory, LogarithmEquations, PaperError, PoseEquations};
use dq_kinematics::arm::ArmState;

/// Two numbers count as equal if their difference is at most this. Such a difference comes from rounding.
const EQUAL: f64 = 1e-12;

/// An eigenvalue counts as 0 if it is below this fraction of the largest eigenvalue.
const ZERO: f64 = 1e-12;

/// Judges the claim of section 2.3.1 that `J Jᵀ` is positive definite. The product is 8×8, but its rank is at most 6, because a pose
/// has six degrees of freedom. Errors in the null space of Jᵀ move no joint.
pub(super) fn is_positive_definite(lab: &Laboratory) -> Result<Claim, PaperError> {
    let mut state = ArmState::new(&lab.chain);
    lab.chain.evaluate(&lab.experiment.theta_initial, &mut state)?;
    let jacobian = state.pose_jacobian();
    let mut eigenvalues: Vec<f64> =
        (&jacobian * jacobian.transpose()).symmetric_eigenvalues().iter().copied().collect();
    eigenvalues.sort_by(|a, b| b.total_cmp(a));
    let largest = eigenvalues.first().copied().unwrap_or_default();
    let rank = eigenvalues.iter().filter(|value| **value > ZERO * largest).count();
    let listed: Vec<_> = eigenvalues
        .iter()
        .map(|value| if *value > ZERO * largest { format!("{value:.3}") } else { "0".to_owned() })
        .collect();
    Ok(Claim::new(
        "J Jᵀ is positive definite",
        rank == eigenvalues.len(),
        format!(
            "J is 8×{}; at the start the rank of the 8×8 product is {rank}, its eigenvalues are {}: an error in the null space of Jᵀ moves no joint",
            state.joint_count(),
            listed.join(", ")
        ),
    ))
}

/// Judges the claims of section 6 about equations 33 to 36.
pub(super) fn is_no_sum(equations: &LogarithmEquations) -> Claim {
    let differences = equations.differences();
    let [product, sum, difference, relative] = differences;
    Claim::new(
        "log(q₁ q₂) is log q, not log q₁ + log q₂, and log(q₁* q) is log q₂, not log q − log q₁",
        product < EQUAL && relative < EQUAL && sum > EQUAL && difference > EQUAL,
        format!(
            "the sides of equations 33 to 36 differ by {} at most, with q and q₁ the poses at start and goal",
            differences
                .map(|apart| if apart < EQUAL { "0".to_owned() } else { format!("{apart:.3}") })
                .join(", ")
        ),
    )
}

/// Judges the claim of section 6 about equation 31.
pub(super) fn is_the_pose(pose: &PoseEquations) -> Claim {
    Claim::new(
        "r exp(ε ½ t) (eq. 31) is the pose r + ε ½ t r (eq. 13)",
        pose.product_off_m < EQUAL,
        format!(
            "at the start the translations differ by {:.3} m: eq. 31 turns t first, as it is r + ε ½ r t",
            pose.product_off_m
        ),
    )
}

/// Judges the claim of section 6 about equation 32. The equation uses the sum of the logarithms of the two factors of eq. 31 as
/// the logarithm of their product. But eq. 34 says that the sum is not the logarithm of the product.
pub(super) fn is_the_logarithm(pose: &PoseEquations) -> Claim {
    Claim::new(
        "the logarithm of a pose is ½ θ k + ε ½ t (eq. 32)",
        pose.logarithm_off_m < EQUAL,
        format!(
            "at the start its exponential is off by {:.3} m: it is the sum of the logarithms of both factors of eq. 31, which eq. 34 rules out",
            pose.logarithm_off_m
        ),
    )
}
