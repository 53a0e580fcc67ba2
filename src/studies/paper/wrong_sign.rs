//! Study (b): diffc starts at its goal, but with the other sign of the goal's quaternion. Without the double-cover rule the tool
//! leaves the goal. With the rule it stays.

use super::simulation::follow;
use super::{Laboratory, PaperError};
use dq_algebra::UnitDualQuaternion;
use dq_core::servo::Arms;
use dq_figures::{Axis, Figure, Line, Series, chart, law_color, over_time};
use dq_kinematics::control::{Law, nearer_goal};
use serde::Serialize;

/// The result of one simulation of this study: how far the tool went away from the goal at which it started.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Departure {
    /// Whether the double-cover rule was applied. It gives the goal's quaternion the same sign as the tool's. Without the rule, the
    /// goal had the opposite sign.
    pub with_rule: bool,
    /// The largest distance of the tool from the goal \[mm\].
    pub largest_distance_mm: f64,
    /// The largest angle between the orientations of the tool and of the goal \[°\].
    pub largest_angle_deg: f64,
}

/// Simulates diffc without and with the double-cover rule on an arm whose tool starts at the goal. Returns the results in this
/// order, and the figure.
///
/// # Errors
/// [`PaperError`] if a simulation fails.
pub fn wrong_sign(lab: &Laboratory) -> Result<(Vec<Departure>, Figure), PaperError> {
    let goal = lab.goal()?;
    let chosen = nearer_goal(&-goal, &goal);
    let (mut departures, mut distances, mut angles) = (Vec::new(), Vec::new(), Vec::new());
    for (with_rule, goal, name, line) in [
        (false, -goal, "diffc without the rule", Line::Dashed),
        (true, chosen, "diffc with the rule", Line::Solid),
    ] {
        let curve = departure(lab, &goal)?;
        let series = |value: fn(&Away) -> f64| Series {
            name: name.to_owned(),
            color: law_color(Law::Diffc),
            line,
            points: curve.iter().map(|away| (away.time, value(away))).collect(),
        };
        let (distance, angle) = (series(|away| away.distance), series(|away| away.angle));
        let largest = |series: &Series| series.points.iter().map(|point| point.1).fold(0.0, f64::max);
        departures.push(Departure {
            with_rule,
            largest_distance_mm: largest(&distance),
            largest_angle_deg: largest(&angle),
        });
        distances.push(distance);
        angles.push(angle);
    }
    let panel = |label: &str, series: Vec<Series>| {
        over_time("", Axis::new("time [s]", 0.0..lab.experiment.wrong_sign.duration), label, series)
    };
    let rows =
        [vec![panel("distance from the goal [mm]", distances), panel("angle from the goal [°]", angles)]];
    Ok((departures, chart("wrong_sign", "Started on the goal, which is given as −q", &rows)))
}

/// The distance and the angle between the tool and the goal at one time. The tool started at the goal.
struct Away {
    /// The time since the start \[s\].
    time: f64,
    /// The distance of the tool from the goal \[mm\].
    distance: f64,
    /// The angle between the orientations of the tool and of the goal \[°\].
    angle: f64,
}

/// Simulates diffc on an arm whose tool starts at the pose of `goal`. Returns how far the tool is from the goal at each sample.
fn departure(lab: &Laboratory, goal: &UnitDualQuaternion) -> Result<Vec<Away>, PaperError> {
    let controller = lab.controller(Law::Diffc, lab.experiment.diffc.gain);
    let (arm, duration) = (Arms::one(lab.chain.clone()), lab.experiment.wrong_sign.duration);
    let run = follow(arm.clone(), &controller, goal, &lab.experiment.theta_desired, duration)?;
    let poses = run.poses(arm);
    let point = |(time, pose): (&f64, &UnitDualQuaternion)| {
        let [distance, angle] = pose.distances(goal);
        Away { time: *time, distance: 1e3 * distance, angle: angle.to_degrees() }
    };
    Ok(run.times.iter().zip(&poses).map(point).collect())
}
