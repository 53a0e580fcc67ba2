//! Judges the claims of the paper by the results of the simulations. The evidence for each verdict is written from these results.

use super::claim::Claim;
use super::comparison::Row;
use super::equation_claims::{is_no_sum, is_positive_definite, is_the_logarithm, is_the_pose};
use super::figures::Runs;
use super::{Laboratory, LogarithmEquations, Metrics, PaperError, PoseEquations, Swept, TaskSpaceMetrics};
use dq_kinematics::control::Law;

/// The results by which the claims are judged.
pub struct Evidence<'a> {
    /// The arm and the constants.
    pub lab: &'a Laboratory,
    /// The simulated motions.
    pub runs: &'a Runs,
    /// The rows of the comparison: diffc with logc's gain, diffc, logc, double_geodesic.
    pub comparison: &'a [Row; 4],
    /// The metrics of logc's motion in task space. The paper integrates logc there, without an arm.
    pub theirs: &'a TaskSpaceMetrics,
    /// The results of equations 33 to 36.
    pub logarithms: &'a LogarithmEquations,
    /// The results of equations 13, 31 and 32.
    pub pose: &'a PoseEquations,
    /// The results of diffc and logc with other gains.
    pub swept: &'a [Swept],
}

/// Judges the claims of sections 2, 6, 8 and 10.
///
/// # Errors
/// [`PaperError`] if a simulation fails.
pub fn claims(evidence: &Evidence) -> Result<Vec<Claim>, PaperError> {
    let Evidence { lab, runs, comparison: [low, diffc, logc, _], theirs, logarithms, pose, swept } = evidence;
    let long = lab.metrics(&runs.diffc_low_long)?;
    Ok(vec![
        settles_to_two_percent(diffc),
        settle_alike(logc, diffc),
        does_not_arrive(low, logc.gain, &long, lab.experiment.diffc.low_gain_duration),
        is_less_curved(theirs, &logc.metrics, &diffc.metrics),
        translates_first_in_task_space(lab, theirs),
        translates_first_through_the_joints(logc),
        rotates_first(&diffc.metrics),
        overshoots(&diffc.metrics, &logc.metrics),
        is_abrupt(swept),
        is_positive_definite(lab)?,
        is_the_pose(pose),
        is_the_logarithm(pose),
        is_no_sum(logarithms),
    ])
}

/// Judges the claim of section 8 that gains of 1 and 185 are chosen "to achieve the same settling time (within 2% of the final
/// value) of 10s".
fn settle_alike(logc: &Row, diffc: &Row) -> Claim {
    /// The relative difference below which times count as equal.
    const ALIKE: f64 = 0.1;
    let of = |row: &Row| {
        let joints = &row.metrics.settling_time_2_percent_joints_s;
        joints.iter().try_fold(0.0, |most: f64, time| Some(most.max((*time)?)))
    };
    let said = |time: Option<f64>, row: &Row| {
        time.map_or(format!("not within {} s", row.duration), |time| format!("{time:.2} s"))
    };
    let ([ours, theirs], at) = ([of(logc), of(diffc)], logc.duration);
    let alike = |time: Option<f64>| time.is_some_and(|time| (time / at - 1.0).abs() < ALIKE);
    Claim::new(
        format!("logc with gain {} and diffc with K = {} settle alike, in {at} s", logc.gain, diffc.gain),
        alike(ours) && alike(theirs),
        format!(
            "the slowest joint is within 2 % of its final value: logc {}, diffc {}; the tool's position within 2 % of its way: logc {}, diffc {}",
            said(ours, logc),
            said(theirs, diffc),
            said(logc.metrics.figures.settling_time_position, logc),
            said(diffc.metrics.figures.settling_time_position, diffc),
        ),
    )
}

/// Judges the claim of section 10: "Both the controllers behave abruptly as the gain is increased".
fn is_abrupt(swept: &[Swept]) -> Claim {
    let of = |law: Law| swept.iter().filter(|row| row.law == law.name()).copied().collect::<Vec<_>>();
    let laws = [Law::Diffc, Law::Logc].map(of);
    let faster = |rows: &Vec<Swept>| rows.windows(2).all(|pair| pair[1].peak_rad_s > pair[0].peak_rad_s);
    let said = |rows: &Vec<Swept>| {
        let (Some(first), Some(last)) = (rows.first(), rows.last()) else { return String::new() };
        let ratio = |row: &Swept| row.path_ratio.map_or("-".to_owned(), |ratio| format!("{ratio:.2}"));
        format!(
            "{} from {:.3} to {:.3} rad/s as the gain goes from {} to {}, on a path of {} and {} times the straight line",
            first.law,
            first.peak_rad_s,
            last.peak_rad_s,
            first.gain,
            last.gain,
            ratio(first),
            ratio(last)
        )
    };
    Claim::new(
        "both laws behave more abruptly as the gain is increased",
        laws.iter().all(faster),
        format!("the peak joint speed goes {}", laws.iter().map(said).collect::<Vec<_>>().join("; ")),
    )
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

/// Lists numbers as "1, 2 and 3"; `None` for an empty list.
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
        // This compares the two laws on the simulated arm, whose joints bend the path. The paper's task space has no joints.
        ratio(logc) < ratio(diffc),
        format!(
            "path over straight line, through the joints: logc {:.3}, diffc {:.3}; logc in the paper's task space {:.3}",
            ratio(logc),
            ratio(diffc),
            theirs.path_ratio
        ),
    )
}

/// Returns whether the first motion settled earlier than the second. Returns true if only the first motion settled.
fn sooner(first: Option<f64>, second: Option<f64>) -> bool {
    first.is_some_and(|first| second.is_none_or(|second| first < second))
}

fn order(rotation: Option<f64>, position: Option<f64>) -> String {
    let seconds = |time: Option<f64>| time.map_or("not settled".to_owned(), |time| format!("{time:.2} s"));
    format!("rotation {}, position {}", seconds(rotation), seconds(position))
}

fn translates_first_in_task_space(lab: &Laboratory, theirs: &TaskSpaceMetrics) -> Claim {
    let gains = lab.experiment.task_space_logc;
    let (rotation, position) = (theirs.settling_time_rotation, theirs.settling_time_position);
    Claim::new(
        "logc closes the translation before the rotation, in the paper's task space",
        sooner(position, rotation),
        format!(
            "with kω = {}, kv = {}, where the translation decays with kω + kv: {}",
            gains.gain_angular,
            gains.gain_linear,
            order(rotation, position),
        ),
    )
}

fn translates_first_through_the_joints(logc: &Row) -> Claim {
    let figures = &logc.metrics.figures;
    let (rotation, position) = (figures.settling_time_rotation, figures.settling_time_position);
    Claim::new(
        "logc closes the translation before the rotation, through the joints",
        sooner(position, rotation),
        format!("with k = {}: {}", logc.gain, order(rotation, position)),
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
