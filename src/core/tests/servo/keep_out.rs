//! Tests of rule 22 of the guide's safety page: the arm keeps clear of its keep-outs and of itself.

use crate::reference::puma;
use crate::rig::Rig;
use dq_algebra::UnitDualQuaternion;
use dq_core::servo::{Arms, Reconfigure, Stall, State};
use dq_kinematics::control::Law;
use dq_space::space::{Body, KeepOut, Pair, Scene};
use nalgebra::Vector3;
use std::sync::Arc;
use std::time::Duration;

/// Returns the scene of these arms, with capsules of 5 cm around their links.
pub fn scene(arms: &Arms, keep_outs: &[&str]) -> Option<Arc<Scene>> {
    scene_within(arms, keep_outs, &[])
}

/// Returns the scene of these arms with keep-outs and with keep-ins of their tools.
pub fn scene_within(arms: &Arms, keep_outs: &[&str], keep_ins: &[&str]) -> Option<Arc<Scene>> {
    let chains: Vec<_> = arms.chains().cloned().collect();
    let [keep_outs, keep_ins] = [keep_outs, keep_ins]
        .map(|texts| texts.iter().map(|text| text.parse::<KeepOut>().unwrap()).collect::<Vec<_>>());
    let ranges = vec![(-3.0, 3.0); arms.joint_count()];
    let scene = Scene::new(Body::along(&chains, 0.05), keep_outs, &chains, &ranges).unwrap();
    Some(Arc::new(scene.staying_in(keep_ins, &chains, &ranges).unwrap()))
}

/// The start position of the arm \[rad\]: elbow up, tool low and in front of the base.
const START: [f64; 6] = [0.3, -0.9, 0.0, 0.2, 0.9, 0.4];

/// Returns the paper's arm with these keep-outs.
pub fn rig(keep_outs: &[&str]) -> Rig {
    let mut rig = Rig::of_arm(puma(), START.to_vec());
    rig.change(|settings| settings.scene = scene(&Arms::one(puma()), keep_outs));
    rig.run(0.1);
    rig
}

/// Adds a table of height `z` \[m\], which the arm must stay above.
fn put_table(rig: &mut Rig, z: f64) {
    rig.change(|settings| {
        settings.scene = scene(&Arms::one(puma()), &[&format!("table half_space 0 0 1 {z}")])
    });
}

/// Returns the tool's pose, moved along the base's axes by `way` \[m\].
pub fn beside(rig: &Rig, way: [f64; 3]) -> UnitDualQuaternion {
    let here = rig.servo.pose().unwrap();
    UnitDualQuaternion::from_parts(here.rotation(), here.translation() + Vector3::from(way))
}

#[test]
fn a_goal_inside_is_come_as_near_to_as_may_be_and_the_pair_that_holds_it_is_said() {
    for law in Law::ALL {
        let mut rig = rig(&[]);
        rig.set_law(law);
        let z = rig.servo.pose().unwrap().translation().z;
        put_table(&mut rig, z - 0.2);
        rig.goal_pose(&beside(&rig, [0.0, 0.05, -0.4]));
        rig.run_until(State::Constrained, 20.0);
        rig.run_until(State::Stalled, 60.0);
        let status = rig.servo.status();
        let Some(Stall::Constrained(close)) = status.stall else { panic!("{law}: {:?}", status.stall) };
        assert!(matches!(close.pair, Pair::KeepOut(_, name) if name.as_str() == "table"), "{law} {close:?}");
        assert!((0.009..0.02).contains(&rig.least_gap), "{law}: {} m", rig.least_gap);
        let says = status.stall.unwrap().explain(|joint| format!("joint{joint}"));
        assert!(says.contains("and table are 1"), "{says}");
    }
}

#[test]
fn a_twist_into_a_wall_slides_along_it() {
    let mut rig = rig(&[]);
    let start = rig.servo.pose().unwrap().translation();
    put_table(&mut rig, start.z - 0.15);
    for _ in 0..2500 {
        rig.twist([-0.02, 0.1, -0.1], [0.0; 3], "base_link").unwrap();
        rig.cycle();
    }
    let way = rig.servo.pose().unwrap().translation() - start;
    assert!(way.y > 0.2, "it goes on along the table: {way}");
    assert!((0.009..0.02).contains(&rig.least_gap), "{} m", rig.least_gap);
}

/// Returns the scene of the paper's arm with a body of these capsules.
fn of_body(capsules: &[&str], keep_out: &str) -> Option<Arc<Scene>> {
    let names: Vec<_> = (1..=6).map(|joint| format!("joint{joint}")).collect();
    let capsules: Vec<_> = capsules.iter().map(|text| (*text).to_owned()).collect();
    let (body, keep_outs) = (Body::parse(&capsules, &names).unwrap(), vec![keep_out.parse().unwrap()]);
    Some(Arc::new(Scene::new(body, keep_outs, &[puma()], &[(-3.0, 3.0); 6]).unwrap()))
}

/// Returns an arm in a scene with one keep-out. The arm is stretched, and has a hand of 10 cm at its tool.
fn stretched(keep_out: &str) -> Rig {
    let mut rig = Rig::of_arm(puma(), vec![1.3, -0.1, -1.45, 0.0, 0.1, 0.0]);
    let body = ["joint2 0 0 0 0.43 0 0 0.05", "joint3 0 0 0 0 0.43 0 0.05", "joint6 0 0 -0.05 0 0 0.05 0.03"];
    rig.change(|settings| settings.scene = of_body(&body, keep_out));
    rig.run(0.1);
    rig
}

#[test]
fn what_is_outside_of_a_keep_out_that_it_is_seldom_out_of_is_kept_out() {
    let tool = stretched("far half_space 0 0 1 -9").servo.pose().unwrap().translation();
    assert!(tool.y > 0.8, "{tool}");
    // The hand is 14 mm outside of the wall, the rest of the arm inside.
    let wall = tool.y - 0.05 - 0.03 - 0.014;
    let mut rig = stretched(&format!("wall half_space 0 1 0 {wall}"));
    let back = beside(&rig, [0.0, -0.6, 0.0]);
    rig.goal_pose(&back);
    rig.run(10.0);
    let then = rig.servo.pose().unwrap().translation();
    assert!(then.y > wall, "the tool is {} m in", wall - then.y);
    assert!(rig.servo.status().held_by.is_some(), "{:?}", rig.servo.status());
}

#[test]
fn an_arm_that_is_all_inside_of_a_keep_out_goes_no_deeper_and_says_so() {
    // The keep-out is in the wrong unit.
    let mut rig = stretched("ball sphere 400 300 300 1000");
    let here = rig.positions();
    let forth = beside(&rig, [0.2, -0.3, 0.2]);
    rig.goal_pose(&forth);
    rig.run(10.0);
    assert_ne!(rig.state(), State::Settled, "{here:?} {:?}", rig.positions());
    let held = rig.servo.status().held_by.unwrap().explain(|joint| format!("joint{joint}"));
    assert!(held.contains("and ball are") && held.ends_with("in each other"), "{held}");
}

#[test]
fn what_the_arm_stands_in_does_not_hold_it() {
    // The first link turns in the keep-out, and no joint moves it out.
    let mut rig = stretched("far half_space 0 0 1 -9");
    let body = ["joint1 0.01 0 -0.3 0 0.02 0 0.05", "joint3 0 0 0 0 0.43 0 0.05"];
    rig.change(|settings| settings.scene = of_body(&body, "table half_space 0 0 1 -0.2"));
    let round = beside(&rig, [0.3, -0.2, 0.1]);
    rig.goal_pose(&round);
    rig.run_until(State::Settled, 20.0);
    assert!(rig.servo.status().closest.is_none_or(|pair| pair.distance > 0.0));
}

#[test]
fn a_keep_out_that_appears_in_the_way_or_upon_the_arm_is_gone_no_deeper_into() {
    // The height of the tool above the table when the table appears [m].
    for ahead in [0.2, 0.06, 0.0, -0.04] {
        let mut rig = rig(&[]);
        rig.goal_pose(&beside(&rig, [0.0, 0.0, -0.3]));
        rig.run(0.4);
        let z = rig.servo.pose().unwrap().translation().z;
        assert!(rig.servo.command().iter().any(|speed| speed.abs() > 0.2), "it moves");
        put_table(&mut rig, z - ahead);
        rig.run(0.3);
        let stopped = rig.servo.pose().unwrap().translation().z;
        rig.run(2.0);
        let then = rig.servo.pose().unwrap().translation().z;
        assert!(
            ahead > 0.1 || (then > stopped - 1e-3 && stopped > z - 0.05),
            "{ahead}: {z} {stopped} {then}"
        );
        rig.goal_pose(&beside(&rig, [0.0, 0.0, 0.3]));
        rig.run_until(State::Settled, 20.0);
    }
}

#[test]
fn the_arm_keeps_clear_of_itself() {
    let mut rig = rig(&["far half_space 0 0 1 -9"]);
    // The goal is inside the shoulder.
    let here = rig.servo.pose().unwrap();
    rig.goal_pose(&UnitDualQuaternion::from_parts(here.rotation(), Vector3::new(0.02, 0.05, 0.0)));
    rig.run(20.0);
    assert!(rig.least_gap > 0.005, "{} m", rig.least_gap);
    assert_ne!(rig.state(), State::Settled);
}

#[test]
fn cycles_among_obstacles_allocate_nothing() {
    let z = rig(&[]).servo.pose().unwrap().translation().z;
    let table = format!("table half_space 0 0 1 {}", z - 0.1);
    let wedge = "wedge hull 0.1 0.5 -0.1 0.4 0.5 -0.1 0.1 0.8 -0.1 0.2 0.6 0.1";
    let mut rig = rig(&[&table, "ball sphere 0.3 -0.3 0.3 0.1", "crate box 0.2 0.6 0.0 0.2 0.2 0.2", wedge]);
    rig.goal_pose(&beside(&rig, [-0.1, 0.2, -0.4]));
    rig.run(0.1);
    rig.allocations = 0;
    rig.run(3.0);
    assert_eq!(rig.allocations, 0);
    assert!(rig.servo.status().closest.is_some());
}

#[test]
fn another_scene_is_taken_without_an_allocation() {
    let mut rig = rig(&[]);
    let many: Vec<_> =
        (0..64).map(|i| format!("ball{i} sphere 0.5 {} 0.8 0.05", 0.02 * f64::from(i))).collect();
    let many: Vec<_> = many.iter().map(String::as_str).collect();
    for keep_outs in [&many[..], &many[..3], &[], &many[..]] {
        let mut settings = rig.servo.settings().clone();
        settings.scene = scene(&Arms::one(puma()), keep_outs);
        let taken = allocation_counter::measure(|| rig.servo.configure(settings).unwrap());
        assert_eq!(taken.count_total, 0, "{}", keep_outs.len());
    }
}

#[test]
fn an_arm_that_goes_round_keeps_clear_too() {
    let mut rig = rig(&[]);
    let z = rig.servo.pose().unwrap().translation().z;
    put_table(&mut rig, z - 0.1);
    rig.change(|settings| {
        settings.reconfigure = Reconfigure::Always;
        settings.progress_timeout = Some(Duration::from_millis(200));
        settings.limits.position.lower = vec![-2.8; 6];
        settings.limits.position.upper = vec![2.8; 6];
        settings.limits.position.upper[2] = 0.4;
    });
    rig.run(0.1);
    // The upper arm begins inside the table, and stays inside while it turns.
    let begins = rig.least_gap;
    // The arm reaches this goal only with the elbow down, which the table forbids.
    rig.goal_pose(&puma().forward_kinematics(&[0.3, -0.2, 0.0, 0.2, 0.9, 0.4]).unwrap());
    rig.run(20.0);
    assert!(begins < 0.0 && rig.least_gap > begins - 1e-6, "{begins} {} m", rig.least_gap);
}

#[test]
fn two_arms_keep_clear_of_each_other() {
    let mut rig = Rig::two_arms();
    let arms = rig.arms().clone();
    rig.change(|settings| settings.scene = scene(&arms, &[]));
    rig.run(0.1);
    // The goal puts the right tool into the left tool.
    rig.goal_pose(&UnitDualQuaternion::from_parts(rig.servo.pose().unwrap().rotation(), Vector3::zeros()));
    rig.run(20.0);
    assert!((0.0..0.05).contains(&rig.least_gap), "{} m", rig.least_gap);
    assert_ne!(rig.state(), State::Settled);
}
