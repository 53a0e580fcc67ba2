//! Tests of rule 22 (keep-outs and keep-ins) with random arms, obstacles, goals, twists, stops, pauses, laws and late cycles. The main
//! test runs 600 tasks, the same each time. With the environment variable `TASKS=100000`, it runs 100 000 new random tasks.

use super::keep_out::scene_within;
use super::sequences::{arms, first_difference, jerk};
use crate::rig::{Rig, twist};
use dq_core::servo::{GoalReading, Reconfigure, Rejection, Sent};
use dq_kinematics::control::Law;
use dq_space::space::{Pair, Placed};
use proptest::prelude::*;
use proptest::test_runner::{RngAlgorithm, TestRng, TestRunner};
use std::time::Duration;

/// Number of tasks in each scene.
const EACH: usize = 6;

/// An event in the middle of a task.
#[derive(Clone, Copy, Debug)]
enum Event {
    Nothing,
    Stop,
    Pause,
    Law(usize),
    /// The servo misses one cycle. Rule 22 must hold even so, because the servo always allows for one more missed cycle than it has
    /// missed recently.
    Late,
    Twist([f64; 3], [f64; 3]),
}

#[derive(Clone, Debug)]
struct Task {
    position: [f64; 3],
    turn: [f64; 4],
    event: Event,
    /// The number of cycles before the event, and the number of cycles after the event.
    cycles: (usize, usize),
}

fn task() -> impl Strategy<Value = Task> {
    let number = || prop::array::uniform3(-0.8..0.8f64);
    let event = prop_oneof![
        3 => Just(Event::Nothing),
        2 => Just(Event::Stop),
        1 => Just(Event::Pause),
        1 => (0..Law::ALL.len()).prop_map(Event::Law),
        1 => Just(Event::Late),
        1 => (number(), number()).prop_map(|(linear, angular)| Event::Twist(linear, angular)),
    ];
    (number(), prop::array::uniform4(-1.0..1.0f64), event, (0..300usize, 0..300usize))
        .prop_map(|(position, turn, event, cycles)| Task { position, turn, event, cycles })
}

/// Returns random keep-outs as texts without their names.
fn keep_out() -> impl Strategy<Value = String> {
    let (at, sizes) = (prop::array::uniform3(-0.9..0.9f64), prop::array::uniform3(0.02..0.5f64));
    (0..6usize, at, sizes).prop_map(|(kind, [x, y, z], [a, b, c])| match kind {
        0 => format!("half_space {x} {y} {} {}", z + 1.0, -a - b),
        1 => format!("sphere {x} {y} {z} {a}"),
        2 => format!("box {x} {y} {z} {a} {b} {c} 0.5 0.5 0.5 0.5"),
        3 => format!("cylinder {x} {y} {z} {a} {b}"),
        4 => format!("capsule {x} {y} {z} {a} {b} 0.6 0.0 0.0 0.8"),
        _ => format!("hull {x} {y} {z} {} {y} {z} {x} {} {z} {} {} {}", x + a, y - b, x + b, y + c, z + a),
    })
}

/// Returns random keep-ins as texts without their names, each with the offset of its center from the tool's start position.
fn keep_in() -> impl Strategy<Value = ([f64; 3], String)> {
    let (beside, sizes) = (prop::array::uniform3(-0.15..0.15f64), prop::array::uniform3(0.1..0.8f64));
    (0..6usize, beside, sizes).prop_map(|(kind, [x, y, z], [a, b, c])| match kind {
        0 => ([x, y, z], format!("half_space {{at}} {a}")),
        1 => ([x, y, z], format!("sphere {{at}} {a}")),
        2 => ([x, y, z], format!("box {{at}} {a} {b} {c} 0.5 0.5 0.5 0.5")),
        3 => ([x, y, z], format!("cylinder {{at}} {a} {b}")),
        4 => ([x, y, z], format!("capsule {{at}} {a} {b} 0.6 0.0 0.0 0.8")),
        _ => {
            // A tent around the arm.
            let [l, w, h] = [0.4 + a, 0.4 + b, 0.5 + c];
            let floor = format!("{l} {w} -1 -{l} {w} -1 -{l} -{w} -1 {l} -{w} -1");
            ([x, y, z], format!("hull {floor} {x} {w} {h} {y} -{w} {h}"))
        }
    })
}

fn rig(arm: usize) -> Rig {
    match arms().into_iter().nth(arm) {
        Some(rig) => rig,
        None => Rig::two_arms(),
    }
}

/// Returns the arm number `arm` at its start. Its scene leaves out each keep-out that the arm touches, and each keep-in that does
/// not contain its tools.
fn among(arm: usize, keep_outs: &[String], keep_ins: &[([f64; 3], String)]) -> Rig {
    let mut rig = rig(arm);
    let positions = rig.positions();
    let controlled = rig.arms().clone();
    let is_free = |out: &[&str], inside: &[&str]| {
        let scene = scene_within(&controlled, out, inside).unwrap();
        let mut placed = Placed::of(&scene);
        placed.place(&scene, controlled.chains(), &positions);
        let with_it = |pair: &usize| !matches!(scene.pair(*pair), Pair::Body(..));
        (0..scene.pair_count()).filter(with_it).all(|pair| placed.gap_of(&scene, pair).distance > 0.0)
    };
    let left = controlled.chain();
    let tool = left.forward_kinematics(&positions[..left.joint_count()]).unwrap().translation();
    let out = keep_outs.iter().enumerate().map(|(i, text)| format!("thing{i} {text}"));
    let out: Vec<_> = out.filter(|text| is_free(&[text], &[])).collect();
    let inside = keep_ins.iter().enumerate().map(|(i, ([x, y, z], text))| {
        let at = format!("{} {} {}", tool.x + x, tool.y + y, tool.z + z);
        format!("cell{i} {}", text.replace("{at}", &at))
    });
    let inside: Vec<_> = inside.filter(|text| is_free(&[], &[text])).collect();
    let (out, inside): (Vec<_>, Vec<_>) =
        (out.iter().map(String::as_str).collect(), inside.iter().map(String::as_str).collect());
    rig.change(|settings| settings.scene = scene_within(&controlled, &out, &inside));
    rig
}

fn run(rig: &mut Rig, task: &Task) {
    let norm = task.turn.iter().map(|x| x * x).sum::<f64>().sqrt().max(1e-3);
    let goal = GoalReading {
        position: task.position,
        orientation_xyzw: task.turn.map(|x| x / norm),
        frame_id: "",
        stamp: 0,
        waited: Duration::ZERO,
        sent: Sent::default(),
    };
    // Some goals are beyond reach.
    let _: Result<(), Rejection> = rig.take_goal(&goal);
    (0..task.cycles.0).for_each(|_| rig.cycle());
    match task.event {
        Event::Nothing => {}
        Event::Stop => rig.stop(),
        Event::Pause => {
            rig.pause(true);
            (0..task.cycles.1).for_each(|_| rig.cycle());
            rig.pause(false);
        }
        Event::Law(number) if rig.plants.len() == 1 => rig.set_law(Law::ALL[number]),
        Event::Law(_) => {}
        Event::Late => rig.cycle_late(1),
        Event::Twist(linear, angular) => {
            for _ in 0..task.cycles.1 {
                let _: Result<(), Rejection> = rig.take_twist(&twist(linear, angular, ""));
                rig.cycle();
            }
        }
    }
    (0..task.cycles.1).for_each(|_| rig.cycle());
}

#[test]
fn no_order_of_events_leads_into_anything() {
    let asked = std::env::var("TASKS").ok().and_then(|tasks| tasks.parse().ok());
    let tasks = asked.unwrap_or(600_usize);
    let cases = u32::try_from(tasks.div_ceil(EACH)).unwrap();
    let config = ProptestConfig { cases, failure_persistence: None, ..ProptestConfig::default() };
    let strategy = (
        0..4usize,
        (prop::collection::vec(keep_out(), 0..7), prop::collection::vec(keep_in(), 0..3)),
        prop::collection::vec(task(), EACH),
        any::<bool>(),
        prop::array::uniform12(0.0..1.0f64),
        jerk(),
    );
    let held = std::cell::Cell::new(0_u64);
    // A usual run has the same tasks each time, so that it fails only if the code has changed.
    let mut runner = match asked {
        Some(_) => TestRunner::new(config),
        None => TestRunner::new_with_rng(config, TestRng::deterministic_rng(RngAlgorithm::ChaCha)),
    };
    let ran = runner.run(&strategy, |(arm, (keep_outs, keep_ins), tasks, round, brakes, jerk)| {
        let mut rig = among(arm, &keep_outs, &keep_ins);
        // Each joint has its own deceleration, from the least that is allowed to its acceleration. So stops leave the path.
        rig.change(|settings| {
            let limits = &mut settings.limits;
            let joints = limits
                .joint_deceleration
                .iter_mut()
                .zip(&limits.joint_velocity)
                .zip(&limits.joint_acceleration);
            joints
                .zip(brakes)
                .for_each(|(((most, least), full), part)| *most = least + part * (full - least));
        });
        rig.change(|settings| settings.limits.joint_jerk.fill(jerk));
        rig.check_tools = false;
        if round {
            rig.change(|settings| {
                settings.reconfigure = Reconfigure::Always;
                settings.progress_timeout = Some(Duration::from_millis(200));
            });
        }
        rig.run(0.02);
        for task in &tasks {
            run(&mut rig, task);
            held.set(held.get() + u64::from(rig.servo.status().held_by.is_some()));
        }
        Ok(())
    });
    ran.unwrap();
    assert!(held.get() > 10, "{} tasks were held up", held.get());
}

/// The servo keeps the measured gaps of a scene from cycle to cycle, but does not save them. The output must not depend on these
/// gaps.
#[test]
fn another_servo_that_knows_what_this_one_knew_goes_on_among_keep_outs_to_the_bit() {
    let config = ProptestConfig { cases: 40, failure_persistence: None, ..ProptestConfig::default() };
    let keep_outs = prop::collection::vec(keep_out(), 0..7);
    let strategy = (0..4usize, keep_outs, prop::collection::vec(task(), 4), jerk(), 1..60u32);
    let ended = TestRunner::new(config).run(&strategy, |(arm, keep_outs, tasks, jerk, each)| {
        let [one, other] = [0, each].map(|each| {
            let mut rig = among(arm, &keep_outs, &[]);
            rig.change(|settings| settings.limits.joint_jerk.fill(jerk));
            (rig.check_tools, rig.restored_each, rig.sent) = (false, each, Some(Vec::new()));
            rig.run(0.02);
            tasks.iter().for_each(|task| run(&mut rig, task));
            rig.sent.unwrap()
        });
        prop_assert_eq!(first_difference(&one, &other), None);
        Ok(())
    });
    ended.unwrap();
}
