//! What the paper claims, judged by what came out: nothing of the evidence is written before the numbers are known.

use super::comparison::Row;
use super::figures::Runs;
use super::{Laboratory, LogarithmEquations, Metrics, PaperError, TaskSpaceMetrics};
use crate::arm::ArmState;
use serde::Serialize;

/// What the paper says, and what came out.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Claim {
    /// What the paper says.
    pub claim: String,
    /// Whether it holds here.
    pub holds: bool,
    /// By which numbers.
    pub evidence: String,
}

impl Claim {
    fn new(claim: impl Into<String>, holds: bool, evidence: String) -> Self {
        Self { claim: claim.into(), holds, evidence }
    }
}

/// What the paper claims in sections 2, 6, 8 and 10.
///
/// # Errors
/// [`PaperError`].
pub fn claims(
    lab: &Laboratory,
    runs: &Runs,
    [low, diffc, logc, _]: &[Row; 4],
    theirs: &TaskSpaceMetrics,
    equations: &LogarithmEquations,
) -> Result<Vec<Claim>, PaperError> {
    let long = lab.metrics(&runs.diffc_low_long)?;
    Ok(vec![
        settles_to_two_percent(diffc),
        does_not_arrive(low, logc.gain, &long, lab.experiment.diffc.low_gain_duration),
        is_less_curved(theirs, &logc.metrics, &diffc.metrics),
        translates_first(lab, theirs, logc),
        rotates_first(&diffc.metrics),
        overshoots(&diffc.metrics, &logc.metrics),
        is_positive_definite(lab)?,
        is_no_sum(equations),
    ])
}

fn settles_to_two_percent(diffc: &Row) -> Claim {
    const BAND: f64 = 2.0;
    let errors = &diffc.metrics.joint_error_percent;
    let listed: Vec<_> =
        errors.iter().map(|error| error.map_or("-".to_owned(), |error| format!("{error:.2}"))).collect();
    let joints = |is: fn(&Option<f64>) -> bool| {
        let of = |(joint, error): (usize, &Option<f64>)| is(error).then(|| (joint + 1).to_string());
        errors.iter().enumerate().filter_map(of).collect::<Vec<_>>()
    };
    let settled = joints(|error| error.is_some_and(|error| error < BAND));
    let others = joints(|error| error.is_some_and(|error| error >= BAND));
    let without = joints(Option::is_none);
    let mut evidence = format!("the joints are {} % from their final values then", listed.join(", "));
    for (joints, are) in [
        (&settled, "within 2 %"),
        (&others, "not within 2 %"),
        (&without, "without a percentage, as the final value is 0"),
    ] {
        if let Some(joints) = enumeration(joints) {
            evidence += &format!("; {joints}: {are}");
        }
    }
    Claim::new(
        format!("diffc with K = {} settles to 2 % of the final values in {} s", diffc.gain, diffc.duration),
        others.is_empty() && !settled.is_empty(),
        evidence,
    )
}

/// "1, 2 and 3"; none of nothing.
fn enumeration(words: &[String]) -> Option<String> {
    let (last, before) = words.split_last()?;
    Some(if before.is_empty() { last.clone() } else { format!("{} and {last}", before.join(", ")) })
}

fn does_not_arrive(low: &Row, logc_gain: f64, long: &Metrics, long_duration: f64) -> Claim {
    let gain = if low.gain == logc_gain { "logc's gain" } else { "gain" };
    let left = |metrics: &Metrics, duration: f64| {
        let left = metrics.figures.position_error;
        let percent = 100.0 * left / metrics.distance_m;
        format!("{:.0} mm from the goal after {duration} s ({percent:.0} % of the distance)", 1e3 * left)
    };
    Claim::new(
        format!("diffc with {gain} {} does not arrive in {} s", low.gain, low.duration),
        low.metrics.figures.settling_time_position.is_none(),
        format!("{}, {}", left(&low.metrics, low.duration), left(long, long_duration)),
    )
}

fn is_less_curved(theirs: &TaskSpaceMetrics, logc: &Metrics, diffc: &Metrics) -> Claim {
    let ratio = |metrics: &Metrics| metrics.figures.path_ratio.unwrap_or(f64::NAN);
    Claim::new(
        "logc takes a less curved path than diffc",
        theirs.path_ratio < ratio(diffc),
        format!(
            "path over straight line: logc {:.3} in the paper's task space, {:.3} through the joints; diffc {:.3}",
            theirs.path_ratio,
            ratio(logc),
            ratio(diffc)
        ),
    )
}

/// Whether the first settled, and before the second.
fn sooner(first: Option<f64>, second: Option<f64>) -> bool {
    first.is_some_and(|first| second.is_none_or(|second| first < second))
}

fn order(rotation: Option<f64>, position: Option<f64>) -> String {
    let seconds = |time: Option<f64>| time.map_or("not settled".to_owned(), |time| format!("{time:.2} s"));
    format!("rotation {}, position {}", seconds(rotation), seconds(position))
}

fn translates_first(lab: &Laboratory, theirs: &TaskSpaceMetrics, logc: &Row) -> Claim {
    let gains = lab.experiment.task_space_logc;
    let (rotation, position) = (theirs.settling_time_rotation, theirs.settling_time_position);
    let ours = &logc.metrics.figures;
    Claim::new(
        "logc closes the translation before the rotation",
        sooner(position, rotation),
        format!(
            "in the paper's task space with kω = {}, kv = {}, where the translation decays with kω + kv: {}; through the joints with k = {}: {}",
            gains.gain_angular,
            gains.gain_linear,
            order(rotation, position),
            logc.gain,
            order(ours.settling_time_rotation, ours.settling_time_position)
        ),
    )
}

fn rotates_first(diffc: &Metrics) -> Claim {
    let (rotation, position) = (diffc.figures.settling_time_rotation, diffc.figures.settling_time_position);
    Claim::new(
        "diffc closes the rotation before the translation",
        sooner(rotation, position),
        order(rotation, position),
    )
}

fn overshoots(diffc: &Metrics, logc: &Metrics) -> Claim {
    Claim::new(
        "diffc overshoots its goal",
        diffc.figures.overshoot > 1e-3,
        format!(
            "{:.1} mm past the goal along the line from the start; logc {:.1} mm",
            1e3 * diffc.figures.overshoot,
            1e3 * logc.figures.overshoot
        ),
    )
}

/// Eigenvalues below this part of the largest are 0.
const ZERO: f64 = 1e-12;

/// Section 2.3.1. J is 8×n, so that the 8×8 product has rank 6 at most: errors that Jᵀ does not see move no joint.
fn is_positive_definite(lab: &Laboratory) -> Result<Claim, PaperError> {
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

/// Section 6, equations 33 to 36.
fn is_no_sum(equations: &LogarithmEquations) -> Claim {
    /// Numbers that differ by rounding alone are nearer than this.
    const EQUAL: f64 = 1e-12;
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
