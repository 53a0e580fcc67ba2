//! (c) Many random tasks under each law: who wins where.

use super::simulation::{Precision, Span, follow};
use super::{Laboratory, Measured, PaperError};
use crate::arm::ArmState;
use crate::control::{Controller, Law, nearer_goal, pose_error};
use crate::dq::UnitDualQuaternion;
use crate::draw::{Axis, DrawError, Figure, Line, Panel, Series, chart, law_color};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use rayon::prelude::*;
use serde::Serialize;
use std::f64::consts::PI;

/// The laws, in the order of every list here.
pub const LAWS: [Law; 3] = [Law::Diffc, Law::Logc, Law::DoubleGeodesic];

/// What a law made of a task.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Outcome {
    /// When rotation and position had settled to 2 % \[s\]; none where they have not, which is a failure.
    #[serde(rename = "settling_time_2_percent_s")]
    pub settling_time: Option<f64>,
    /// Path length by straight line.
    pub path_ratio: f64,
    /// Largest joint speed [rad/s].
    #[serde(rename = "peak_joint_speed_rad_s")]
    pub peak_joint_speed: f64,
}

/// A task and what each law made of it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Pair {
    /// Angle between start and goal \[°\].
    pub angle_deg: f64,
    /// Distance between start and goal \[m\].
    pub distance_m: f64,
    /// What each law made of it, in the order of [`LAWS`].
    pub outcomes: [Outcome; 3],
}

/// A law over all tasks.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LawSummary {
    /// The law's name.
    pub law: &'static str,
    /// Its gain [1/s].
    pub gain: f64,
    /// Tasks that did not settle in the time given.
    pub failures: usize,
    /// Their share of all tasks \[%\].
    pub failures_percent: f64,
    /// Settling times below which 10 %, 50 % and 90 % of the tasks that settled are.
    #[serde(rename = "settling_time_2_percent_s")]
    pub settling_time: [f64; 3],
    /// Path ratios below which 10 %, 50 % and 90 % of the tasks that settled are.
    pub path_ratio: [f64; 3],
    /// Peak speeds below which 10 %, 50 % and 90 % of the tasks that settled are.
    #[serde(rename = "peak_joint_speed_rad_s")]
    pub peak_joint_speed: [f64; 3],
}

/// Who wins among tasks of like angle.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Bin {
    /// The least and the largest angle between start and goal \[°\].
    pub angle_deg: [f64; 2],
    /// Number of tasks between these angles.
    pub pairs: usize,
    /// Share of tasks at which each law failed \[%\], in the order of the laws.
    pub failures_percent: [f64; 3],
    /// Share of tasks that each law settled first \[%\].
    pub fastest_percent: [f64; 3],
    /// Share of tasks that each law settled on the shortest path \[%\].
    pub shortest_percent: [f64; 3],
    /// Share of tasks that each law settled with the lowest peak speed \[%\].
    pub gentlest_percent: [f64; 3],
}

/// The sweep in numbers.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct SweepSummary {
    /// Number of tasks.
    pub pairs: usize,
    /// Seed of the random numbers that make the tasks.
    pub seed: u64,
    /// Time given to each task \[s\].
    pub duration_s: f64,
    /// The laws over all tasks.
    pub laws: Vec<LawSummary>,
    /// The laws over tasks of like angle.
    pub by_angle: Vec<Bin>,
}

/// Runs all tasks on all cores; `done` is called after each. The same constants give the same outcomes on any number of cores.
///
/// # Errors
/// [`PaperError::Arm`] where the constants are not for this arm.
pub fn sweep(lab: &Laboratory, done: impl Fn() + Sync) -> Result<Vec<Pair>, PaperError> {
    let finished = |number: u32| {
        let pair = pair(lab, number);
        done();
        pair
    };
    (0..lab.experiment.sweep.pairs).into_par_iter().map(finished).collect()
}

/// Joint angles at the start and at the goal \[rad\] of the task of that number: a stream of random numbers of its own, so that the
/// order of running does not matter.
pub fn task(lab: &Laboratory, number: u32) -> (Vec<f64>, Vec<f64>) {
    let mut random = ChaCha8Rng::seed_from_u64(lab.experiment.sweep.seed);
    random.set_stream(u64::from(number));
    let mut angles = || (0..lab.chain.joint_count()).map(|_| angle(&mut random)).collect();
    (angles(), angles())
}

fn pair(lab: &Laboratory, number: u32) -> Result<Pair, PaperError> {
    let (start, theta_goal) = task(lab, number);
    let base_from_start = lab.chain.forward_kinematics(&start)?;
    let goal = nearer_goal(&lab.chain.forward_kinematics(&theta_goal)?, &base_from_start);
    let mut outcomes = [Outcome::default(); 3];
    for (outcome, law) in outcomes.iter_mut().zip(LAWS) {
        *outcome = run(lab, &lab.controller(law, lab.gain(law)), &goal, &start)?;
    }
    Ok(Pair {
        angle_deg: base_from_start.rotation().angle_to(&goal.rotation()).to_degrees(),
        distance_m: (base_from_start.translation() - goal.translation()).norm(),
        outcomes,
    })
}

/// An angle in [−π, π).
fn angle(random: &mut ChaCha8Rng) -> f64 {
    // The 53 highest bits make a number in [0, 1).
    let unit = (random.next_u64() >> 11) as f64 / (1_u64 << 53) as f64;
    (2.0 * unit - 1.0) * PI
}

/// A tenth of the 2 % band: from there no law has turned back.
const ARRIVED: f64 = 2e-3;

fn run(
    lab: &Laboratory,
    controller: &Controller,
    goal: &UnitDualQuaternion,
    start: &[f64],
) -> Result<Outcome, PaperError> {
    // At even times alone diffc's paths would be 1 % short and peaks at a singularity 5 % low.
    let span = Span {
        duration: lab.experiment.sweep.duration,
        interval: 0.01,
        parts_of_steps: 8,
        precision: Precision::COARSE,
    };
    let mut state = ArmState::new(&lab.chain);
    let mut errors = |theta: &[f64]| {
        let _ = lab.chain.evaluate(theta, &mut state);
        let error = pose_error(&state, goal);
        (error.translation().norm(), 2.0 * error.half_log().fixed_rows::<3>(0).norm())
    };
    let (distance, angle) = errors(start);
    let arrived = |theta: &[f64]| {
        let (position, rotation) = errors(theta);
        position < ARRIVED * distance && rotation < ARRIVED * angle
    };
    // A loop that cannot be integrated has failed its task.
    let Ok(trajectory) = follow(&lab.chain, controller, goal, start, &span, arrived) else {
        return Ok(Outcome::default());
    };
    let measured = Measured { chain: &lab.chain, controller, goal, theta_goal: &[], trajectory: &trajectory };
    let figures = measured.figures(&lab.settings.goal_tolerance)?;
    Ok(Outcome {
        settling_time: figures.settling_time(),
        path_ratio: figures.path_length / distance,
        peak_joint_speed: figures.peak_joint_speed,
    })
}

impl SweepSummary {
    /// The summary of these outcomes.
    pub fn new(lab: &Laboratory, pairs: &[Pair]) -> Self {
        let constants = lab.experiment.sweep;
        let laws = LAWS.iter().enumerate().map(|(i, law)| summarize(lab, *law, i, pairs)).collect();
        let by_angle = (0..BINS).map(|bin| Bin::new(bin, pairs)).collect();
        Self { pairs: pairs.len(), seed: constants.seed, duration_s: constants.duration, laws, by_angle }
    }
}

fn summarize(lab: &Laboratory, law: Law, index: usize, pairs: &[Pair]) -> LawSummary {
    let failures = pairs.iter().filter(|pair| pair.outcomes[index].settling_time.is_none()).count();
    let quantiles = |value: fn(&Outcome) -> f64| {
        let values = settled(pairs, index, value);
        [0.1, 0.5, 0.9].map(|part| quantile(&values, part))
    };
    LawSummary {
        law: law.name(),
        gain: lab.gain(law),
        failures,
        failures_percent: percent(failures, pairs.len()),
        settling_time: quantiles(|outcome| outcome.settling_time.unwrap_or_default()),
        path_ratio: quantiles(|outcome| outcome.path_ratio),
        peak_joint_speed: quantiles(|outcome| outcome.peak_joint_speed),
    }
}

/// The values of the tasks that a law settled, in order of size.
fn settled(pairs: &[Pair], law: usize, value: fn(&Outcome) -> f64) -> Vec<f64> {
    let outcomes = pairs.iter().map(|pair| &pair.outcomes[law]);
    let mut values: Vec<_> = outcomes.filter(|outcome| outcome.settling_time.is_some()).map(value).collect();
    values.sort_by(f64::total_cmp);
    values
}

fn quantile(sorted: &[f64], part: f64) -> f64 {
    let index = (part * sorted.len() as f64) as usize;
    sorted.get(index.min(sorted.len().saturating_sub(1))).copied().unwrap_or(f64::NAN)
}

fn percent(count: usize, of: usize) -> f64 {
    if of == 0 { 0.0 } else { 100.0 * count as f64 / of as f64 }
}

/// Angles between start and goal are sorted into this many bins, up to 180°.
const BINS: usize = 6;

impl Bin {
    fn new(bin: usize, pairs: &[Pair]) -> Self {
        let width = 180.0 / BINS as f64;
        let range = [bin as f64 * width, (bin + 1) as f64 * width];
        let inside = |pair: &&Pair| (pair.angle_deg / width).min(BINS as f64 - 1.0) as usize == bin;
        let inside: Vec<_> = pairs.iter().filter(inside).collect();
        let share = |counts: [usize; 3]| counts.map(|count| percent(count, inside.len()));
        let failed =
            |law: usize| inside.iter().filter(|pair| pair.outcomes[law].settling_time.is_none()).count();
        let won = |value: fn(&Outcome) -> f64| {
            let mut wins = [0; 3];
            inside.iter().filter_map(|pair| best(pair, value)).for_each(|law| wins[law] += 1);
            share(wins)
        };
        Self {
            angle_deg: range,
            pairs: inside.len(),
            failures_percent: share(std::array::from_fn(failed)),
            fastest_percent: won(|outcome| outcome.settling_time.unwrap_or(f64::INFINITY)),
            shortest_percent: won(|outcome| outcome.path_ratio),
            gentlest_percent: won(|outcome| outcome.peak_joint_speed),
        }
    }
}

/// The law with the least value among those that settled.
fn best(pair: &Pair, value: fn(&Outcome) -> f64) -> Option<usize> {
    let settled = pair.outcomes.iter().enumerate().filter(|(_, outcome)| outcome.settling_time.is_some());
    settled.min_by(|a, b| value(a.1).total_cmp(&value(b.1))).map(|(law, _)| law)
}

/// Distributions above, who wins where below.
///
/// # Errors
/// [`PaperError::Drawing`].
pub fn figure(pairs: &[Pair], summary: &SweepSummary) -> Result<Figure, DrawError> {
    let longest = summary.duration_s;
    let distributions = vec![
        distribution(pairs, "settled to 2 %", "settling time [s]", 0.0..longest, |o| {
            o.settling_time.unwrap_or_default()
        }),
        distribution(pairs, "path of those that settled", "path length / straight line", 1.0..4.0, |o| {
            o.path_ratio
        }),
        distribution(
            pairs,
            "speed of those that settled",
            "log₁₀ of peak joint speed [rad/s]",
            -0.5..2.5,
            |o| o.peak_joint_speed.log10(),
        ),
    ];
    let mut failures = over_angle(summary, "did not settle", |bin| bin.failures_percent);
    let most = summary.by_angle.iter().flat_map(|bin| bin.failures_percent).fold(1.0, f64::max);
    failures.y.range = 0.0..1.2 * most;
    let winners = vec![
        failures,
        over_angle(summary, "settled first", |bin| bin.fastest_percent),
        over_angle(summary, "settled on the shortest path", |bin| bin.shortest_percent),
    ];
    let title =
        format!("{} random tasks (seed {}), {} s each", summary.pairs, summary.seed, summary.duration_s);
    chart("sweep", &title, &[distributions, winners])
}

/// The share of all tasks whose value is at most x: where a curve ends below 100 %, tasks failed.
fn distribution(
    pairs: &[Pair],
    title: &str,
    label: &str,
    range: std::ops::Range<f64>,
    value: fn(&Outcome) -> f64,
) -> Panel {
    let curve = |(i, law): (usize, &Law)| {
        let values = settled(pairs, i, value);
        let point = |(k, value): (usize, &f64)| (*value, percent(k + 1, pairs.len()));
        let mut points: Vec<_> = values.iter().enumerate().map(point).collect();
        points.extend(points.last().map(|last| (range.end, last.1)));
        Series { name: law.name().to_owned(), color: law_color(*law), line: Line::Solid, points }
    };
    let series = LAWS.iter().enumerate().map(curve).collect();
    Panel {
        title: format!("{title}: share of all tasks"),
        x: Axis::new(label, range.clone()),
        y: Axis::new("tasks [%]", 0.0..100.0),
        series,
        ..Panel::default()
    }
}

fn over_angle(summary: &SweepSummary, title: &str, share: fn(&Bin) -> [f64; 3]) -> Panel {
    let curve = |(i, law): (usize, &Law)| {
        let bins = summary.by_angle.iter().filter(|bin| bin.pairs > 0);
        let points = bins.map(|bin| (0.5 * (bin.angle_deg[0] + bin.angle_deg[1]), share(bin)[i])).collect();
        Series { name: law.name().to_owned(), color: law_color(*law), line: Line::Solid, points }
    };
    Panel {
        title: title.to_owned(),
        x: Axis::new("angle between start and goal [°]", 0.0..180.0),
        y: Axis::new("tasks [%]", 0.0..100.0),
        series: LAWS.iter().enumerate().map(curve).collect(),
        ..Panel::default()
    }
}
