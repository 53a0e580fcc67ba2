//! The reference work repeated: its numbers met, its claims judged, and the sweep repeated.
#![cfg(feature = "ros")]

use dq_servo::config::{BUILTIN_FILE, NodeParameters, ServoParameters, parameters_for};
use dq_servo::control::{TwistGains, logc_twist};
use dq_servo::dq::UnitDualQuaternion;
use dq_servo::draw::frameplotter;
use dq_servo::paper::{
    Experiment, Laboratory, Precision, Reproduction, Span, follow_freely, pose, reproduce, sweep,
};
use serde_json::Value;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicU32, Ordering};

fn reference() -> Value {
    serde_json::from_str(include_str!("../data/reference.json")).unwrap()
}

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect()
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("{value}"))
}

fn distance(a: &[f64], b: &[f64]) -> f64 {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).map(|(x, y)| (x - y).abs()).fold(0.0, f64::max)
}

/// The paper's, with so many random tasks.
fn laboratory(pairs: u32) -> Laboratory {
    let mut store = ServoParameters::store();
    for (name, value) in parameters_for(BUILTIN_FILE, "puma560.yaml", "/any").unwrap() {
        store.override_initial(&name, value).unwrap();
    }
    let parameters = ServoParameters::from_store(&store).unwrap();
    let mut experiment = Experiment::builtin().unwrap();
    experiment.sweep.pairs = pairs;
    Laboratory { chain: parameters.task.chain().clone(), settings: parameters.settings, experiment }
}

/// Everything, once for all tests.
fn reproduction() -> &'static Reproduction {
    static DONE: OnceLock<Reproduction> = OnceLock::new();
    DONE.get_or_init(|| reproduce(&laboratory(60), || {}).unwrap())
}

fn row(law: &str, gain: f64) -> &'static Value {
    let rows = reproduction().results["comparison"].as_array().unwrap();
    rows.iter().find(|row| row["law"] == law && row["gain"] == gain).unwrap()
}

#[test]
fn diffc_meets_the_computed_figures_of_the_reference_work() {
    let computed = reference()["computed"]["diffc_K185"].clone();
    let diffc = row("diffc", 185.0);
    let percent = numbers(&diffc["joint_error_percent_at_10s"]);
    assert!(distance(&percent, &numbers(&computed["joint_error_percent_at_10s"])) < 1e-4);
    let close = |ours: &Value, theirs: &Value, to: f64| {
        assert!((number(ours) - number(theirs)).abs() < to, "{ours} {theirs}");
    };
    close(&diffc["position_error_mm_at_10s"], &computed["position_error_mm_at_10s"], 1e-5);
    close(&diffc["straight_line_m"], &computed["straight_line"], 1e-12);
    // The length of a polygon: both are sampled.
    close(&diffc["path_length_m"], &computed["path_length_first_10s"], 1e-4);
    close(
        &row("diffc", 1.0)["position_error_mm_at_10s"],
        &reference()["computed"]["diffc_K1"]["position_error_mm_at_10s"],
        1e-5,
    );
}

#[test]
fn what_the_paper_claims_is_judged() {
    let holds: Vec<_> = reproduction().claims.iter().map(|claim| claim.holds).collect();
    // All but the wrist's settling within 10 s.
    assert_eq!(holds, [false, true, true, true, true, true]);
    assert!(reproduction().claims[0].evidence.contains("1.85, 1.99, 0.44, 4.89, 3.04, 1.24 %"));
    let settled = &row("diffc", 185.0)["settling_time_s"];
    assert!(number(&settled["joints"][1]) < 10.0 && settled["joints"][3].is_null());
    assert!(row("diffc", 1.0)["settling_time_s"]["position"].is_null());
}

#[test]
fn logc_and_double_geodesic_settle_at_their_gain() {
    // exp(−t) = 2 % at 3.91 s; DESIGN section 4 has 4.2 s for logc's position, across the singularity.
    let logc = &row("logc", 1.0);
    assert!((number(&logc["settling_time_s"]["rotation"]) - 3.91).abs() < 0.02);
    assert!((number(&logc["settling_time_s"]["position"]) - 4.2).abs() < 0.05);
    assert!((number(&logc["peak_joint_speed_rad_s"]) - 2.5).abs() < 0.1);
    let ratio = |law, gain| number(&row(law, gain)["path_ratio"]);
    assert!(ratio("double_geodesic", 1.0) < ratio("logc", 1.0) && ratio("logc", 1.0) < ratio("diffc", 185.0));
    assert!(number(&row("logc", 1.0)["overshoot_mm"]) < 1.0);
}

#[test]
fn two_arms_meet_the_computed_end_of_the_reference_work() {
    let end = numbers(&reproduction().results["figures"]["fig3"]["theta_beta_alpha_at_end_rad"]);
    let computed = reference()["computed"]["relative_position_K10"]["theta_beta_alpha_15s"].clone();
    assert!(distance(&end, &numbers(&computed)) < 1e-6);
}

#[test]
fn in_task_space_logc_decays_at_its_rates() {
    let start = UnitDualQuaternion::half_exp(&nalgebra::Vector6::new(0.6, -0.3, 0.4, 0.1, -0.2, 0.3));
    let goal = UnitDualQuaternion::identity();
    let span = Span { duration: 2.0, interval: 0.5, precision: Precision::FINE };
    let gains = TwistGains { angular: 1.5, linear: 1.5 };
    let run = follow_freely(|error| logc_twist(&gains, error), &goal, &start, &span).unwrap();
    assert_eq!(run.times, [0.0, 0.5, 1.0, 1.5, 2.0]);
    for (time, numbers) in run.times.iter().zip(&run.states) {
        let expected = start.screw_log() * (-1.5 * time).exp();
        assert!((pose(numbers).unwrap().screw_log() - expected).norm() < 1e-7, "at {time} s");
    }
}

#[test]
fn frameplotter_draws_the_frame_of_the_paper_s_logarithm() {
    let half_log = nalgebra::Vector6::new(0.3, -0.2, 0.5, 0.1, 0.2, 0.3);
    let frame = frameplotter(&half_log);
    assert!((frame.translation.vector - nalgebra::Vector3::new(0.2, 0.4, 0.6)).norm() < 1e-15);
    let expected = nalgebra::UnitQuaternion::from_scaled_axis(nalgebra::Vector3::new(0.6, -0.4, 1.0));
    assert!(frame.rotation.angle_to(&expected) < 1e-12);
}

#[test]
fn only_diffc_depends_on_the_base_frame() {
    for row in reproduction().results["base_shift"].as_array().unwrap() {
        let (shift, deviation) = (number(&row["shift_m"]), number(&row["deviation_mm"]));
        match row["law"] == "diffc" && shift > 0.0 {
            true => assert!(deviation > 10.0, "{row}"),
            false => assert!(deviation < 1e-3, "{row}"),
        }
    }
}

#[test]
fn the_wrong_sign_leaves_without_the_rule_and_stays_with_it() {
    let departures = reproduction().results["wrong_sign"].as_array().unwrap();
    assert!(departures[0]["with_rule"] == false && number(&departures[0]["largest_distance_mm"]) > 100.0);
    assert!(departures[1]["with_rule"] == true && number(&departures[1]["largest_distance_mm"]) < 1e-6);
}

#[test]
fn the_sweep_is_the_same_for_a_seed_whatever_the_cores() {
    let mut lab = laboratory(24);
    let count = AtomicU32::new(0);
    let all_cores = sweep(&lab, || {
        count.fetch_add(1, Ordering::Relaxed);
    })
    .unwrap();
    let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    assert_eq!(all_cores, one.install(|| sweep(&lab, || {})).unwrap());
    assert_eq!((all_cores.len(), count.into_inner()), (24, 24));
    lab.experiment.sweep.seed += 1;
    assert_ne!(all_cores, sweep(&lab, || {}).unwrap());
    for pair in &all_cores {
        for outcome in pair.outcomes.iter().filter(|outcome| outcome.settling_time_s.is_some()) {
            assert!(outcome.path_ratio > 0.97 && outcome.peak_joint_speed > 0.0, "{pair:?}");
        }
    }
}

#[test]
fn the_sweep_s_shares_add_up() {
    let sweep = &reproduction().results["sweep"];
    assert_eq!(sweep["pairs"], 60);
    let bins = sweep["by_angle"].as_array().unwrap();
    assert_eq!(bins.iter().map(|bin| number(&bin["pairs"])).sum::<f64>(), 60.0);
    for bin in bins.iter().filter(|bin| number(&bin["pairs"]) > 0.0) {
        for wins in ["fastest_percent", "shortest_percent", "gentlest_percent"] {
            let sum: f64 = numbers(&bin[wins]).iter().sum();
            assert!(sum <= 100.0 + 1e-9 && sum > 0.0, "{wins} in {bin}");
        }
    }
    for law in sweep["laws"].as_array().unwrap() {
        assert!(number(&law["failures_percent"]) < 30.0, "{law}");
        let quantiles = numbers(&law["settling_time_s"]);
        assert!(quantiles.is_sorted(), "{law}");
    }
}

/// Coordinates of every polyline, in the figure's pixels.
fn polylines(svg: &str) -> Vec<Vec<(f64, f64)>> {
    let points = |text: &str| {
        let pair = |pair: &str| {
            let (x, y) = pair.split_once(',').unwrap();
            (0.1 * x.parse::<f64>().unwrap(), 0.1 * y.parse::<f64>().unwrap())
        };
        text.split_whitespace().map(pair).collect()
    };
    svg.split("<polyline")
        .skip(1)
        .map(|tag| points(tag.split("points=\"").nth(1).unwrap().split('"').next().unwrap()))
        .collect()
}

#[test]
fn every_figure_has_its_curves_on_the_sheet_and_its_law_s_colour() {
    let names: Vec<_> = reproduction().figures.iter().map(|figure| figure.name.as_str()).collect();
    assert_eq!(names[..9], ["fig1", "fig2", "fig3", "fig4", "fig5", "fig6", "fig7", "fig8", "fig9"]);
    for figure in &reproduction().figures {
        let attribute = |name: &str| {
            let text = figure.svg.split(&format!("{name}=\"")).nth(1).unwrap().split('"').next().unwrap();
            text.parse::<f64>().unwrap()
        };
        let (width, height) = (attribute("width"), attribute("height"));
        let lines = polylines(&figure.svg);
        assert!(lines.iter().map(Vec::len).sum::<usize>() > 200, "{}", figure.name);
        for (x, y) in lines.into_iter().flatten() {
            assert!((0.0..=width).contains(&x) && (0.0..=height).contains(&y), "{} at {x} {y}", figure.name);
        }
        let (diffc, logc) = (figure.svg.contains("#0072B2"), figure.svg.contains("#D55E00"));
        let expected = match figure.name.as_str() {
            "fig1" | "fig2" | "fig3" | "fig4" => (false, false),
            "fig6" | "fig7" | "fig8" | "wrong_sign" => (true, false),
            "fig9" => (false, true),
            _ => (true, true),
        };
        assert_eq!((diffc, logc), expected, "{}", figure.name);
    }
}

#[test]
fn pictures_show_their_text_without_fonts_of_the_system() {
    let figure = &reproduction().figures[0];
    let dark = |svg: &str| {
        let figure = dq_servo::draw::Figure { svg: svg.to_owned(), ..figure.clone() };
        let pixels = resvg::tiny_skia::Pixmap::decode_png(&figure.png().unwrap()).unwrap();
        pixels
            .pixels()
            .iter()
            .filter(|pixel| pixel.red() < 100 && pixel.green() < 100 && pixel.blue() < 100)
            .count()
    };
    let without_text = figure.svg.replace("<text", "<desc").replace("</text", "</desc");
    assert!(dark(&figure.svg) > dark(&without_text) + 1000);
}
