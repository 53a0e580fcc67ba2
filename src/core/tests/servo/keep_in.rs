//! Tests of rule 22 of the guide's safety page: the tool stays in its keep-ins.

use super::keep_out::{beside, rig, scene_within};
use crate::reference::puma;
use crate::rig::Rig;
use dq_core::servo::{Arms, Stall, State};
use dq_kinematics::control::Law;
use nalgebra::Vector3;

/// Returns the paper's arm with these keep-ins. In their texts, `{x}`, `{y}` and `{z}` stand for the coordinates of a point: the
/// tool's position plus `beside`. `{low}` stands for the height 0.15 m below this point, and `{below}` for the negative of `{low}`.
fn within(keep_ins: &[&str], beside: [f64; 3]) -> Rig {
    let mut rig = rig(&[]);
    let tool = rig.servo.pose().unwrap().translation() + Vector3::from(beside);
    let placed = |text: &&str| {
        let numbers = [
            ("{x}", tool.x),
            ("{y}", tool.y),
            ("{z}", tool.z),
            ("{below}", 0.15 - tool.z),
            ("{low}", tool.z - 0.15),
        ];
        numbers
            .iter()
            .fold((*text).to_owned(), |text, (name, number)| text.replace(name, &number.to_string()))
    };
    let texts: Vec<_> = keep_ins.iter().map(placed).collect();
    let texts: Vec<_> = texts.iter().map(String::as_str).collect();
    rig.change(|settings| settings.scene = scene_within(&Arms::one(puma()), &[], &texts));
    rig
}

const SHAPES: [&str; 6] = [
    "cell half_space 0 0 -1 {below}",
    "cell sphere {x} {y} {z} 0.15",
    "cell box {x} {y} {z} 0.3 0.3 0.3",
    "cell cylinder {x} {y} {z} 0.15 0.3",
    "cell capsule {x} {y} {z} 0.15 0.2 0.6 0 0 0.8",
    "cell hull 9 9 {low} -9 9 {low} -9 -9 {low} 9 -9 {low} 0 0 9",
];

#[test]
fn a_goal_outside_is_come_as_near_to_as_may_be_and_the_edge_is_said() {
    for (shape, law) in SHAPES.iter().flat_map(|shape| [Law::Logc, Law::Diffc].map(|law| (shape, law))) {
        let mut rig = within(&[shape], [0.0; 3]);
        rig.set_law(law);
        let down = beside(&rig, [0.0, 0.02, -0.4]);
        rig.goal_pose(&down);
        rig.run_until(State::Constrained, 20.0);
        rig.run_until(State::Stalled, 60.0);
        assert!((0.009..0.02).contains(&rig.least_gap), "{shape} {law}: {} m", rig.least_gap);
        let stall = rig.servo.status().stall.unwrap();
        assert!(matches!(stall, Stall::Constrained(_)), "{shape} {law}: {stall:?}");
        let says = stall.explain(|joint| format!("joint{joint}"));
        let right =
            "the tool is 10 mm from the edge of cell, and may come no nearer: try a goal farther from there";
        assert!(says.starts_with(right), "{shape} {law}: {says}");
    }
}

#[test]
fn a_twist_into_a_corner_ends_in_it() {
    let mut rig = within(&["cell box {x} {y} {z} 0.2 0.2 0.2"], [0.0; 3]);
    let start = rig.servo.pose().unwrap().translation();
    for _ in 0..3000 {
        rig.twist([-0.05, 0.1, -0.07], [0.0; 3], "base_link").unwrap();
        rig.cycle();
    }
    let way = rig.servo.pose().unwrap().translation() - start;
    assert!((way - Vector3::new(-0.09, 0.09, -0.09)).norm() < 0.005, "{way}");
    assert!(rig.least_gap > 0.009, "{} m", rig.least_gap);
}

#[test]
fn a_tool_that_is_outside_may_come_back_in_and_go_no_farther() {
    for shape in SHAPES {
        // The keep-in is above the tool.
        let mut rig = within(&[shape], [0.0, 0.0, 0.25]);
        let start = rig.servo.pose().unwrap().translation();
        let deeper = beside(&rig, [0.05, 0.0, -0.2]);
        rig.goal_pose(&deeper);
        rig.run(3.0);
        let then = rig.servo.pose().unwrap().translation();
        assert!(then.z > start.z - 0.02, "{shape}: {start} {then}");
        let held = rig.servo.status().held_by.map(|pair| pair.explain(|joint| joint.to_string()));
        let is_said = held
            .as_ref()
            .is_some_and(|says| says.starts_with("the tool is") && says.ends_with("mm outside cell"));
        assert!(is_said, "{shape}: {held:?}");
        let inside = beside(&rig, [0.0, 0.0, 0.25]);
        rig.goal_pose(&inside);
        rig.run_until(State::Settled, 20.0);
    }
}

#[test]
fn both_tools_of_two_arms_stay_inside() {
    let mut rig = Rig::two_arms();
    let arms = rig.arms().clone();
    let positions = rig.positions();
    let tools: Vec<_> = arms
        .chains()
        .zip(positions.chunks(6))
        .map(|(chain, theta)| chain.forward_kinematics(theta).unwrap().translation())
        .collect();
    let middle = 0.5 * (tools[0] + tools[1]);
    let radius = 0.5 * (tools[0] - tools[1]).norm() + 0.05;
    let cell = format!("cell sphere {} {} {} {radius}", middle.x, middle.y, middle.z);
    rig.change(|settings| settings.scene = scene_within(&arms, &[], &[&cell]));
    rig.run(0.1);
    let apart = rig.servo.pose().unwrap();
    // The two tool points are farther apart than the ball is wide.
    let far = dq_algebra::UnitDualQuaternion::from_parts(apart.rotation(), 2.0 * apart.translation());
    rig.goal_pose(&far);
    rig.run(10.0);
    assert!((0.0..0.03).contains(&rig.least_gap), "{} m", rig.least_gap);
    let held =
        rig.servo.status().held_by.map(|pair| pair.explain(|joint| joint.to_string())).unwrap_or_default();
    assert!(held.starts_with("the left tool is") || held.starts_with("the right tool is"), "{held}");
}

#[test]
fn a_tool_at_the_edge_gets_away_from_it() {
    for (shape, gap) in SHAPES[..4].iter().flat_map(|shape| [1e-6, 1e-4].map(|gap| (shape, gap))) {
        for law in [Law::Logc, Law::Diffc] {
            // The lowest point of the keep-in is below the tool.
            let mut rig = within(&[shape], [0.0, 0.0, 0.15 - gap]);
            rig.set_law(law);
            let away = beside(&rig, [0.03, -0.04, 0.12]);
            rig.goal_pose(&away);
            rig.run_until(State::Settled, 20.0);
            assert!(rig.least_gap > 0.0, "{shape} {gap} {law}: {} m", rig.least_gap);
        }
    }
}
