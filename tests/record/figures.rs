//! Tests the figures of recorded runs.

use crate::bags::{DEMO, Sample, alter, demo, dq_servo, jazzy, place, write};
use crate::runs::{only_run, puma560};
use assert_cmd::Command;
use dq_bags::WriterOptions;
use dq_figures::{Figure, Width};
use dq_messages::messages::DiagnosticStatus;
use dq_runs::{RecordedRun, plot, recorded};
use std::ffi::OsStr;
use std::path::Path;

/// The arm moves to a goal under one law and back under another. Goals, laws and threshold are shown.
#[test]
fn figures_show_goals_laws_and_the_threshold_of_damping() {
    let run = only_run(Path::new(DEMO));
    let figures = plot(&[run]);
    let figure = |name: &str| figures.iter().find(|figure| figure.name == name).unwrap();
    let path = &figure("path").svg(Width::Screen);
    assert!(path.contains(">goal 1<") && path.contains(">start, goal 2, end<"), "one name for one point");
    for name in ["pose_error", "joint_positions", "joint_velocities", "path", "singular_value"] {
        let svg = &figure(name).svg(Width::Screen);
        assert!(svg.contains("#D55E00") && svg.contains("#0072B2"), "{name}: logc's colour and diffc's");
        assert!(svg.contains("bag, logc") && svg.contains("bag, diffc"), "{name}");
    }
    let series = figure("singular_value").data["panels"][0]["series"].as_array().unwrap();
    let threshold = series.iter().find(|series| series["name"] == "damped below").unwrap();
    assert_eq!(threshold["points"][0][1], 0.05, "damping.threshold");
}

/// This happens with two arms whose law and primitive are set one after the other before a goal.
#[test]
fn a_law_without_a_motion_has_no_curve() {
    let run = only_run(Path::new(DEMO));
    let legend = |run: &RecordedRun| {
        let figures = plot(std::slice::from_ref(run));
        let series = figures[1].data["panels"][0]["series"].as_array().unwrap();
        series.iter().map(|series| series["name"].as_str().unwrap().to_owned()).collect::<Vec<_>>()
    };
    let (_directory, bag) = place("bag");
    let mut messages = demo();
    let goal = messages.iter().rposition(|message| message.topic == "/goal_pose").unwrap();
    let status = messages[..goal].iter().rposition(|message| message.topic == "/dq_servo/status").unwrap();
    alter(&mut messages[status], |status: &mut DiagnosticStatus| {
        let mut law = status.values.iter_mut().filter(|pair| pair.key == "law");
        law.next().unwrap().value = "lq".to_owned();
    });
    write(&bag, WriterOptions::default(), &messages);
    let set_between = only_run(&bag);
    assert!(set_between.laws.iter().any(|(_, law)| law == "lq"), "{:?}", set_between.laws);
    assert_eq!(legend(&set_between), legend(&run));
}

/// A message with stamp 0, a message from a year ahead, and a run of another day are left out. The axis shows the rest, and a note
/// says what is left out.
#[test]
fn states_far_from_the_rest_of_a_run_are_left_out_of_its_figures_and_reported() {
    const DAY: i64 = 86_400_000_000_000;
    let original = demo();
    let states = |of: &Sample| of.topic.ends_with("joint_states");
    let state = original.iter().find(|message| states(message)).unwrap().clone();
    let moved = |message: &Sample, time: i64| Sample { time, ..message.clone() };
    let first = original.iter().filter(|message| states(message)).take(100);
    let cases = [
        (vec![moved(&state, 0)], "a joint state "),
        (vec![moved(&state, state.time + 365 * DAY)], "a joint state 3153"),
        (
            first.map(|message| moved(message, message.time - 2 * DAY)).collect(),
            "100 joint states or more 1727",
        ),
    ];
    let times = |figures: &[Figure]| {
        let all = figures.iter().filter(|figure| figure.name != "path").flat_map(|figure| {
            let panels = figure.data["panels"].as_array().unwrap();
            let series = panels.iter().flat_map(|panel| panel["series"].as_array().unwrap());
            series.flat_map(|series| {
                series["points"].as_array().unwrap().iter().map(|point| point[0].as_f64().unwrap())
            })
        });
        all.fold((f64::INFINITY, f64::NEG_INFINITY), |(least, most), time| (least.min(time), most.max(time)))
    };
    let (begin, end) = times(&plot(&[only_run(Path::new(DEMO))]));
    for (more, named) in cases {
        let directory = tempfile::tempdir().unwrap();
        let bag = directory.path().join("bag");
        let mut messages: Vec<_> =
            original.iter().map(|message| moved(message, message.time)).chain(more).collect();
        messages.sort_by_key(|message| message.time);
        write(&bag, WriterOptions::default(), &messages);
        let read = recorded(&bag, "bag", &puma560()).unwrap();
        let [warning] = &read.warnings[..] else { panic!("{:?}", read.warnings) };
        assert!(warning.contains(named) && warning.contains("left out of the figures"), "{warning}");
        let (from, to) = times(&plot(&read.runs));
        assert!((from - begin).abs() < 1e-3 && (to - end).abs() < 1e-3, "{from} to {to}, {begin} to {end}");
    }
}

/// A limit is drawn with its value at each time. A position limit is drawn if the joint comes near it.
#[test]
fn figures_show_limits_that_were_in_force() {
    let mut run = only_run(Path::new(DEMO));
    let (since, mut limits) = run.limits[0].clone();
    let lowest = run.samples.iter().map(|sample| sample.positions[0]).fold(f64::INFINITY, f64::min);
    limits.position.lower[0] = lowest - 0.1;
    limits.position.lower[1] = lowest - 100.0;
    run.limits = vec![(since, limits.clone())];
    limits.joint_velocity[0] = 1.0;
    run.limits.push((5.0, limits));
    let figures = plot(&[run]);
    let drawn = |figure: &str, joint: usize| {
        let figure = figures.iter().find(|known| known.name == figure).unwrap();
        let series = figure.data["panels"][joint]["series"].as_array().unwrap();
        let limits = series.iter().filter(|series| series["name"] == "limit");
        limits.map(|series| series["points"].as_array().unwrap().clone()).collect::<Vec<_>>()
    };
    let speeds = drawn("joint_velocities", 0);
    let at_end = |points: &[serde_json::Value]| points.last().unwrap()[1].as_f64().unwrap();
    assert_eq!(speeds.iter().map(|points| at_end(points)).collect::<Vec<_>>(), [1.0, -1.0]);
    assert!(speeds[0][0][1].as_f64().unwrap() > 1.0, "{speeds:?}");
    assert_eq!((drawn("joint_positions", 0).len(), drawn("joint_positions", 1).len()), (1, 0));
}

/// Several runs share one line if their limits are equal. Otherwise each run has its own line with its name and color. The same is
/// true of position limits and the threshold of damping.
#[test]
fn figures_show_the_limits_of_each_run() {
    let one = only_run(Path::new(DEMO));
    let mut other = RecordedRun { name: "other".to_owned(), ..one.clone() };
    let drawn = |runs: &[&RecordedRun], figure: &str| {
        let runs: Vec<_> = runs.iter().map(|run| (*run).clone()).collect();
        let figures = plot(&runs);
        let figure = figures.into_iter().find(|known| known.name == figure).unwrap();
        let series = figure.data["panels"][0]["series"].as_array().unwrap();
        let bounds = series.iter().filter_map(|series| {
            let name = series["name"].as_str().unwrap();
            let is_bound = name.contains("limit") || name.contains("damped below");
            is_bound.then(|| (name.to_owned(), series["points"][0][1].as_f64().unwrap()))
        });
        (bounds.collect::<Vec<_>>(), figure.svg(Width::Screen))
    };
    let named = |bounds: &[(&str, f64)]| -> Vec<(String, f64)> {
        bounds.iter().map(|(name, value)| ((*name).to_owned(), *value)).collect()
    };
    let speed = one.limits[0].1.joint_velocity[0];
    let (bounds, _) = drawn(&[&one, &other], "joint_velocities");
    assert_eq!(bounds, named(&[("limit", speed), ("limit", -speed)]));
    // A limit of another quantity than joint velocities does not count here.
    other.limits[0].1.joint_acceleration[0] += 1.0;
    assert_eq!(drawn(&[&one, &other], "joint_velocities").0, bounds);
    let lowest = one.samples.iter().map(|sample| sample.positions[0]).fold(f64::INFINITY, f64::min);
    let limits = &mut other.limits[0].1;
    (limits.joint_velocity[0], limits.position.lower[0]) = (0.7, lowest - 0.1);
    other.damping_thresholds = vec![(f64::NEG_INFINITY, 0.2)];
    for runs in [[&one, &other], [&other, &one]] {
        let (mut bounds, svg) = drawn(&runs, "joint_velocities");
        bounds.sort_by(|a, b| b.1.total_cmp(&a.1));
        let each =
            [("bag, limit", speed), ("other, limit", 0.7), ("other, limit", -0.7), ("bag, limit", -speed)];
        assert_eq!(bounds, named(&each));
        assert!(!svg.contains("(presumed"), "both say");
        assert_eq!(drawn(&runs, "joint_positions").0, named(&[("other, limit", lowest - 0.1)]));
        let (mut damped, _) = drawn(&runs, "singular_value");
        damped.sort_by(|a, b| a.1.total_cmp(&b.1));
        assert_eq!(damped, named(&[("bag, damped below", 0.05), ("other, damped below", 0.2)]));
    }
    other.parameters_known = false;
    let (bounds, _) = drawn(&[&other, &one], "joint_velocities");
    assert_eq!(bounds, named(&[("limit", speed), ("limit", -speed)]), "the other does not say");
}

#[test]
fn bags_are_drawn_over_each_other() {
    let directory = tempfile::tempdir().unwrap();
    let bag = jazzy(directory.path(), "mcap");
    let first = only_run(&bag);
    let mut second = RecordedRun { name: "second".to_owned(), ..first.clone() };
    second.joints[0] = "left/joint1".to_owned();
    for figure in plot(&[first, second]) {
        let svg = figure.svg(Width::Screen);
        assert!(svg.contains("bag") && svg.contains("second"), "{}", figure.name);
        let shared = svg.contains(">joint1, left/joint1<") && svg.contains(">joint6<");
        assert_eq!(shared, figure.name.starts_with("joint_"), "{}: whose joints are in a panel", figure.name);
    }
}

#[test]
fn plot_writes_its_figures_and_a_table_or_json() {
    let directory = tempfile::tempdir().unwrap();
    let out = directory.path().join("plots");
    let of_demo = |more: &[&dyn AsRef<OsStr>]| {
        let plot: [&dyn AsRef<OsStr>; 4] = [&"plot", &DEMO, &"--out", &out];
        let (code, said, _) = dq_servo(&[&plot, more].concat());
        assert_eq!(code, Some(0));
        said
    };
    let other = jazzy(directory.path(), "sqlite3");
    let (_, no_table, _) = dq_servo(&[&"plot", &other, &"--out", &directory.path().join("others")]);
    assert!(no_table.starts_with("the bag has no motions"), "{no_table}");
    let table = of_demo(&[]);
    assert!(table.contains("effort") && table.contains("rad²/s"), "{table}");
    assert!(
        table.lines().take_while(|line| !line.is_empty()).all(|line| line.chars().count() <= 80),
        "{table}"
    );
    let rows: Vec<serde_json::Value> = serde_json::from_str(&of_demo(&[&"--json"])).unwrap();
    assert_eq!((rows[0]["motion"].as_u64(), rows[0]["stalls"].as_f64()), (Some(1), Some(0.0)));
    of_demo(&[&"--csv"]);
    let rows = |name: &str, second: &str| {
        let text = std::fs::read_to_string(out.join(name)).unwrap();
        let lines: Vec<_> = text.lines().map(|line| line.split(',').count()).collect();
        assert!(
            text.starts_with(&format!("time [s],{second},")) && lines.iter().all(|count| *count == lines[0]),
            "{name}"
        );
        (lines.len() - 1, lines[0])
    };
    let run = only_run(Path::new(DEMO));
    assert_eq!(rows("samples.csv", "position joint1"), (run.samples.len(), 1 + 6 + 6 + 7 + 1));
    assert_eq!(rows("pose_error.csv", "distance from the goal [m]"), (run.errors.len(), 3));
    assert_eq!(rows("velocity_commands.csv", "velocity joint1"), (run.commands[0].velocities.len(), 7));
    let before = std::fs::read(out.join("path.svg")).unwrap();
    let (code, _, refused) = dq_servo(&[&"plot", &other, &"--out", &out]);
    assert_eq!(code, Some(2));
    assert!(refused.contains("has figures of another run: choose another folder by --out"), "{refused}");
    assert_eq!(std::fs::read(out.join("path.svg")).unwrap(), before);
    std::fs::remove_file(out.join("bags.txt")).unwrap();
    assert_eq!(dq_servo(&[&"plot", &DEMO, &"--out", &out]).0, Some(2));
    for name in ["pose_error", "joint_positions", "joint_velocities", "path", "singular_value"] {
        let png = std::fs::read(out.join(format!("{name}.png"))).unwrap();
        assert!(png.starts_with(b"\x89PNG") && png.len() > 5000, "{name}");
    }
}

/// Labels are 8 pt high at the stated width. Everything is on the sheet. The sheet is at most as high as a page.
#[test]
fn figures_for_a_paper_are_as_wide_as_its_columns() {
    let directory = tempfile::tempdir().unwrap();
    for (width, inches, dots) in [("one-column", 3.4, 2040.0), ("two-columns", 7.16, 4296.0)] {
        assert_eq!(dq_servo(&[&"plot", &DEMO, &"--width", &width, &"--out", &directory.path()]).0, Some(0));
        for name in ["pose_error", "joint_velocities", "path"] {
            let file = directory.path().join(name);
            let svg = std::fs::read_to_string(file.with_extension("svg")).unwrap();
            let document = roxmltree::Document::parse(&svg).unwrap();
            let attribute = |name: &str| document.root_element().attribute(name).unwrap();
            let size = ["width", "height"]
                .map(|name| attribute(name).strip_suffix("in").unwrap().parse::<f64>().unwrap());
            assert!((size[0] - inches).abs() < 0.01 && size[1] < 9.5, "{name}: {size:?}");
            let sheet: Vec<f64> =
                attribute("viewBox").split(' ').map(|number| number.parse().unwrap()).collect();
            let number =
                |node: &roxmltree::Node, name: &str| node.attribute(name).unwrap().parse::<f64>().unwrap();
            let texts: Vec<_> = document.descendants().filter(|node| node.has_tag_name("text")).collect();
            let points = |text: &roxmltree::Node| 72.0 * inches / sheet[2] * number(text, "font-size");
            let largest = texts.iter().map(points).fold(0.0, f64::max);
            assert!((7.9..8.1).contains(&largest), "{name}: labels of {largest} pt");
            let on_sheet = |x: f64, y: f64| (0.0..=sheet[2]).contains(&x) && (0.0..=sheet[3]).contains(&y);
            assert!(texts.iter().all(|text| on_sheet(number(text, "x"), number(text, "y"))), "{name}");
            let lines = document.descendants().filter_map(|node| node.attribute("points"));
            let mut pairs = lines.flat_map(|line| line.split(' ')).map(|pair| pair.split_once(',').unwrap());
            assert!(pairs.all(|(x, y)| on_sheet(x.parse().unwrap(), y.parse().unwrap())), "{name}");
            let picture = std::fs::read(file.with_extension("png")).unwrap();
            let pixels = resvg::tiny_skia::Pixmap::decode_png(&picture).unwrap();
            assert!((f64::from(pixels.width()) - dots).abs() < 12.0, "{name}: 600 in an inch");
        }
    }
}

/// As on a full disk, no file may grow beyond 10 kB.
#[test]
fn figures_that_cannot_be_written_completely_leave_earlier_ones_unchanged() {
    let directory = tempfile::tempdir().unwrap();
    let (bag, out) = (jazzy(directory.path(), "mcap"), directory.path().join("plots"));
    let plot = |limit: &str| {
        let mut command = Command::new("sh");
        let program = assert_cmd::cargo::cargo_bin("dq_servo");
        let script = format!("ulimit -f {limit}; exec \"$@\"");
        command.args(["-c", &script, "sh"]).arg(program).arg("plot").arg(&bag).arg("--out").arg(&out);
        command.output().unwrap()
    };
    let files = || -> std::collections::BTreeMap<_, _> {
        let files = std::fs::read_dir(&out).unwrap().map(|file| file.unwrap().path());
        files.map(|file| (file.clone(), std::fs::read(file).unwrap())).collect()
    };
    let failed = plot("10");
    let told = String::from_utf8_lossy(&failed.stderr);
    assert!(!failed.status.success() && told.contains("joint_positions.svg cannot be written"), "{told}");
    assert!(files().keys().eq([&out.join("bags.txt")]), "{:?}", files().keys());
    assert!(plot("unlimited").status.success());
    let before = files();
    assert!(before.len() == 9 && !plot("10").status.success() && files() == before);
}
