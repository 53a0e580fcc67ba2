//! Tests of the frame tree: poses of frames, the times at which they are known, and what the tree accepts from publishers.

use dq_algebra::UnitDualQuaternion;
use dq_space::frames::{
    Answer, Followed, FrameError, FrameMotion, FrameTree, FramedGoal, Ignored, Transform, WaitingGoals,
};
use nalgebra::{UnitQuaternion, Vector3};
use proptest::prelude::*;
use std::time::Duration;

/// Tolerance for equality.
const ALGEBRA: f64 = 1e-13;
const SECOND: i64 = 1_000_000_000;

fn pose(x: f64, angle: f64) -> UnitDualQuaternion {
    UnitDualQuaternion::from_translation_angle_axis(Vector3::new(x, 0.3, -0.1), angle, &Vector3::z_axis())
}

fn put(
    tree: &mut FrameTree,
    [parent, child]: [&str; 2],
    stamp: i64,
    pose: &UnitDualQuaternion,
    is_static: bool,
) -> Result<(), Ignored> {
    let (t, r) = (pose.translation(), pose.rotation());
    let (translation, rotation_xyzw) = (t.into(), [r.i, r.j, r.k, r.w]);
    tree.insert(&Transform { parent, child, stamp, translation, rotation_xyzw }, is_static)
}

fn near(one: &UnitDualQuaternion, other: &UnitDualQuaternion) -> bool {
    (one.to_vector8() - other.to_vector8()).norm() < 1e-12
        || (one.to_vector8() + other.to_vector8()).norm() < 1e-12
}

/// Returns the tree of base → map (moves from 1 s to 3 s), map → table (static), and base → tool (moves from 2 s to 4 s).
fn tree() -> FrameTree {
    let mut tree = FrameTree::default();
    put(&mut tree, ["/base", "map"], SECOND, &pose(1.0, 0.0), false).unwrap();
    put(&mut tree, ["base", "/map"], 3 * SECOND, &pose(2.0, 1.0), false).unwrap();
    put(&mut tree, ["map", "table"], 0, &pose(0.5, 0.2), true).unwrap();
    put(&mut tree, ["base", "tool"], 2 * SECOND, &pose(0.0, -1.0), false).unwrap();
    put(&mut tree, ["base", "tool"], 4 * SECOND, &pose(4.0, -2.0), false).unwrap();
    tree
}

#[test]
fn a_frame_is_found_up_and_down_the_tree_at_its_time() {
    let tree = tree();
    let (map, table) = (pose(1.5, 0.5), pose(0.5, 0.2));
    // Halfway, rotation and translation are interpolated independently.
    assert!(near(&tree.lookup("base", "map", 2 * SECOND).unwrap(), &map));
    assert!(near(&tree.lookup("base", "/table", 2 * SECOND).unwrap(), &(map * table)));
    assert!(near(&tree.lookup("table", "base", 2 * SECOND).unwrap(), &(map * table).inverse()));
    let tool = pose(0.0, -1.0);
    assert!(near(&tree.lookup("tool", "table", 2 * SECOND).unwrap(), &(tool.inverse() * map * table)));
    assert!(near(&tree.lookup("table", "table", 77).unwrap(), &UnitDualQuaternion::identity()));
    // A stamp of 0 stands for the newest time at which the whole path is known: 3 s in the first case, any time in the second.
    let tool = pose(2.0, -1.5);
    assert!(near(&tree.lookup("tool", "map", 0).unwrap(), &(tool.inverse() * pose(2.0, 1.0))));
    assert!(near(&tree.lookup("map", "table", 0).unwrap(), &table));
    assert_eq!(tree.newest("tool", "table"), Ok(Some(3 * SECOND)));
    assert_eq!(tree.newest("map", "table"), Ok(None));
    assert!(tree.are_rigid("map", "table") && !tree.are_rigid("base", "table"));
}

#[test]
fn unknown_frames_and_times_are_reported_by_name() {
    let mut tree = tree();
    put(&mut tree, ["moon", "crater"], 0, &pose(0.0, 0.0), true).unwrap();
    for (base, frame, stamp, label, text) in [
        ("base", "chair", 0, "unknown_frame", "TF has no frame \"chair\""),
        ("hall", "map", 0, "unknown_frame", "TF has no frame \"hall\""),
        ("base", "moon", 0, "unconnected_frame", "TF does not connect \"moon\" with \"base\""),
        ("base", "crater", 0, "unconnected_frame", "TF does not connect \"crater\" with \"base\""),
        ("base", "table", SECOND / 2, "transform_too_old", "0.500 s before the oldest transform of \"map\""),
        ("base", "table", 4 * SECOND, "transform_too_new", "1.000 s after the newest transform of \"map\""),
    ] {
        let why = tree.lookup(base, frame, stamp).unwrap_err();
        assert_eq!(why.label(), label);
        assert!(why.to_string().contains(text), "{why}");
        assert_eq!(why.may_pass(), label != "transform_too_old");
    }
    // Extreme values of the stamp.
    for stamp in [i64::MIN, i64::MAX] {
        assert!(tree.lookup("base", "map", stamp).is_err());
    }
}

/// Like tf2, the tree accepts a quaternion whose squared norm is within 10e-3 of 1, because people type only two digits.
#[test]
fn a_quaternion_of_two_digits_is_accepted() {
    let mut tree = FrameTree::default();
    for rotation_xyzw in [[0.0, 0.0, 0.71, 0.71], [0.0, 0.0, 0.0, 0.9951]] {
        let (parent, child, translation) = ("base", "table", [0.0; 3]);
        tree.insert(&Transform { parent, child, stamp: 0, translation, rotation_xyzw }, true).unwrap();
        assert!((tree.lookup("base", "table", 0).unwrap().rotation().norm() - 1.0).abs() < ALGEBRA);
    }
}

#[test]
fn a_circle_of_parents_is_an_error_until_it_is_opened() {
    let mut tree = tree();
    put(&mut tree, ["table", "base"], 0, &pose(0.0, 0.0), true).unwrap();
    assert_eq!(tree.lookup("tool", "map", 0), Err(FrameError::Loop("map".to_owned())));
    assert_eq!(tree.lookup("else", "tool", 0), Err(FrameError::Loop("tool".to_owned())));
    put(&mut tree, ["world", "base"], 0, &pose(0.0, 0.0), true).unwrap();
    assert!(tree.lookup("tool", "map", 0).is_ok());
}

#[test]
fn another_parent_or_kind_removes_earlier_transforms() {
    let mut tree = tree();
    put(&mut tree, ["table", "tool"], 5 * SECOND, &pose(7.0, 0.0), false).unwrap();
    assert!(matches!(tree.lookup("table", "tool", 3 * SECOND), Err(FrameError::TooOld { .. })));
    assert!(near(&tree.lookup("table", "tool", 0).unwrap(), &pose(7.0, 0.0)));
    put(&mut tree, ["table", "tool"], 0, &pose(8.0, 0.0), true).unwrap();
    assert!(near(&tree.lookup("table", "tool", 99).unwrap(), &pose(8.0, 0.0)));
    put(&mut tree, ["table", "tool"], SECOND, &pose(9.0, 0.0), false).unwrap();
    assert_eq!(tree.newest("table", "tool"), Ok(Some(SECOND)));
}

#[test]
fn moving_frames_can_be_removed_and_static_ones_stay() {
    let mut tree = tree();
    tree.forget_moving();
    assert_eq!(tree.lookup("base", "map", 0), Err(FrameError::Unknown("base".to_owned())));
    assert!(near(&tree.lookup("map", "table", 0).unwrap(), &pose(0.5, 0.2)));
    put(&mut tree, ["base", "map"], SECOND, &pose(3.0, 0.0), false).unwrap();
    assert!(near(&tree.lookup("base", "table", 0).unwrap(), &(pose(3.0, 0.0) * pose(0.5, 0.2))));
}

#[test]
fn transforms_may_arrive_in_any_order_and_are_kept_for_ten_seconds() {
    let mut tree = FrameTree::default();
    let frames = ["base", "map"];
    for i in [0, 4, 2, 2, 3, 1, 12, 11] {
        put(&mut tree, frames, i * SECOND, &pose(i as f64, 0.0), false).unwrap();
    }
    let x = |tree: &FrameTree, stamp| tree.lookup("base", "map", stamp).map(|pose| pose.translation().x);
    assert!(matches!(x(&tree, SECOND), Err(FrameError::TooOld { .. })));
    for time in [2.0, 2.5, 3.75, 8.0, 11.0, 11.5, 12.0] {
        assert!((x(&tree, (time * 1e9) as i64).unwrap() - time).abs() < ALGEBRA);
    }
    // Someone may set a clock back by an hour, or forward by a year for one message.
    put(&mut tree, frames, -3600 * SECOND, &pose(-1.0, 0.0), false).unwrap();
    assert!((x(&tree, 0).unwrap() + 1.0).abs() < ALGEBRA);
    put(&mut tree, frames, 31_536_000 * SECOND, &pose(-2.0, 0.0), false).unwrap();
    put(&mut tree, frames, 13 * SECOND, &pose(13.0, 0.0), false).unwrap();
    assert!((x(&tree, 0).unwrap() - 13.0).abs() < ALGEBRA);
    for stamp in [i64::MAX, i64::MIN, i64::MAX, 0] {
        put(&mut tree, frames, stamp, &pose(0.0, 0.0), false).unwrap();
        let _ = tree.lookup("base", "map", i64::MIN);
    }
}

#[test]
fn opposite_rotations_without_a_unique_arc_cause_no_fault() {
    let mut tree = FrameTree::default();
    put(&mut tree, ["base", "map"], SECOND, &pose(0.0, 0.0), false).unwrap();
    put(&mut tree, ["base", "map"], 2 * SECOND, &pose(1.0, std::f64::consts::PI), false).unwrap();
    for tenth in 0..=10 {
        let found = tree.lookup("base", "map", SECOND + tenth * SECOND / 10).unwrap();
        assert!((found.real().norm() - 1.0).abs() < ALGEBRA, "{tenth}");
        assert!((found.translation().x - 0.1 * tenth as f64).abs() < ALGEBRA);
    }
    // The tree interpolates along the shorter arc, whatever the signs of the quaternions are.
    put(&mut tree, ["base", "turned"], SECOND, &pose(0.0, 0.2), false).unwrap();
    put(&mut tree, ["base", "turned"], 2 * SECOND, &-pose(0.0, 0.4), false).unwrap();
    let found = tree.lookup("base", "turned", SECOND * 3 / 2).unwrap();
    assert!(near(&found, &pose(0.0, 0.3)), "{found:?}");
}

#[test]
fn invalid_transforms_are_ignored_and_change_nothing() {
    let mut tree = tree();
    let before = format!("{tree:?}");
    let good = Transform {
        parent: "base",
        child: "map",
        stamp: 4 * SECOND,
        translation: [0.0; 3],
        rotation_xyzw: [0.0, 0.0, 0.0, 1.0],
    };
    for (bad, why) in [
        (Transform { parent: "", ..good }, Ignored::Names),
        (Transform { child: "/", ..good }, Ignored::Names),
        (Transform { child: "/base", ..good }, Ignored::Names),
        (Transform { translation: [0.0, f64::NAN, 0.0], ..good }, Ignored::Numbers),
        (Transform { translation: [0.0, 0.0, 1e8], ..good }, Ignored::Numbers),
        (Transform { translation: [f64::NEG_INFINITY, 0.0, 0.0], ..good }, Ignored::Numbers),
        (Transform { rotation_xyzw: [0.0; 4], ..good }, Ignored::Numbers),
        (Transform { rotation_xyzw: [0.0, 0.0, 0.0, 1.0051], ..good }, Ignored::Numbers),
        (Transform { rotation_xyzw: [1e200; 4], ..good }, Ignored::Numbers),
        (Transform { rotation_xyzw: [0.0, f64::NAN, 0.0, 1.0], ..good }, Ignored::Numbers),
    ] {
        for is_static in [false, true] {
            assert_eq!(tree.insert(&bad, is_static), Err(why), "{bad:?}");
        }
    }
    assert_eq!(format!("{tree:?}"), before);
    assert!(tree.insert(&good, false).is_ok());
}

#[test]
fn endless_publishing_neither_fills_memory_nor_displaces_others() {
    let mut tree = tree();
    let names: Vec<_> = (0..2000).map(|i| format!("frame{i}")).collect();
    let mut refused = 0;
    for name in &names {
        refused +=
            usize::from(put(&mut tree, ["base", name], 0, &pose(0.0, 0.0), true) == Err(Ignored::TooMany));
    }
    assert_eq!(refused, 2000 - 997);
    for i in 0..3000 {
        put(&mut tree, ["base", "map"], 4 * SECOND + i, &pose(i as f64, 0.0), false).unwrap();
    }
    assert!((tree.lookup("base", "map", 0).unwrap().translation().x - 2999.0).abs() < 1e-9);
    assert!(tree.lookup("base", "map", 4 * SECOND + 1000).is_ok());
    assert!(tree.lookup("base", "map", 4 * SECOND + 999).is_err(), "2000 are kept");
    // All frames together have at most 100 000 transforms. Beyond that, each frame keeps its present number.
    let mut tree = FrameTree::default();
    for stamp in 0..1500 {
        for name in &names[..100] {
            put(&mut tree, ["base", name], stamp, &pose(stamp as f64, 0.0), false).unwrap();
        }
    }
    let newest = tree.lookup("base", "frame99", 0).unwrap().translation().x;
    assert!((newest - 1499.0).abs() < 1e-9, "the newest always has room");
    assert!(tree.lookup("base", "frame99", 400).is_err() && tree.lookup("base", "frame99", 520).is_ok());
    assert_eq!(put(&mut tree, ["base", "one more"], 0, &pose(0.0, 0.0), true), Err(Ignored::TooMany));
    // The tree shortens names.
    let long = "x".repeat(10_000_000);
    let mut tree = FrameTree::default();
    put(&mut tree, ["base", &long], 0, &pose(0.0, 0.0), true).unwrap();
    assert!(format!("{tree:?}").len() < 2000);
    assert!(tree.lookup("base", &long, 0).unwrap_err().to_string().len() < 400);
}

proptest! {
    /// The pose found by the tree equals the product of the transforms, apart from rounding.
    #[test]
    fn a_long_path_is_the_product_of_its_transforms(
        numbers in prop::collection::vec((-1.0..1.0_f64, -3.0..3.0_f64), 2..12),
        split in 0..12_usize,
    ) {
        let mut tree = FrameTree::default();
        let split = split.min(numbers.len() - 1);
        let name = |i: usize| format!("f{i}");
        // Up to frame `split`, the parent of a frame has a higher number than the frame; from there on, a lower number.
        let mut expected = UnitDualQuaternion::identity();
        for (i, (x, angle)) in numbers.iter().enumerate() {
            let turn = UnitQuaternion::from_scaled_axis(Vector3::new(*angle, 0.3 * x, -0.5));
            let step = UnitDualQuaternion::from_parts(turn, Vector3::new(*x, 0.1, 0.2));
            expected *= step;
            let (one, other) = (name(i), name(i + 1));
            if i < split {
                put(&mut tree, [&other, &one], SECOND, &step.inverse(), false).unwrap();
            } else {
                put(&mut tree, [&one, &other], SECOND, &step, i % 2 == 0).unwrap();
            }
        }
        let found = tree.lookup("f0", &name(numbers.len()), SECOND).unwrap();
        prop_assert!(near(&found, &expected), "{found:?} {expected:?}");
    }
}

const MS: Duration = Duration::from_millis(1);

fn goal(number: u64, frame: &str, stamp: i64) -> FramedGoal {
    FramedGoal { number, frame: frame.to_owned(), stamp, by: 0, came: MS, frame_from_goal: pose(0.1, 0.0) }
}

fn numbers(answers: &[Answer]) -> Vec<(u64, Option<&str>)> {
    answers
        .iter()
        .map(|it| (it.goal.number, it.base_from_goal.as_ref().err().map(FrameError::label)))
        .collect()
}

#[test]
fn a_goal_waits_for_its_transform_but_not_forever() {
    let (mut tree, mut waiting) = (tree(), WaitingGoals::default());
    let patience = 500 * MS;
    waiting.add(goal(1, "map", 7 * SECOND / 2), MS);
    waiting.add(goal(2, "map", 4 * SECOND), 2 * MS);
    waiting.add(goal(3, "table", 5 * SECOND), 3 * MS);
    waiting.add(goal(4, "chair", 0), 4 * MS);
    waiting.add(goal(5, "map", 1), 5 * MS);
    assert_eq!(waiting.deadline(patience), Some(501 * MS));
    let answers = waiting.look(&tree, "base", 6 * MS, patience);
    assert_eq!(numbers(&answers), [(5, Some("transform_too_old"))], "what cannot pass is said at once");
    // The newest goal whose pose is found replaces earlier goals.
    put(&mut tree, ["base", "map"], 4 * SECOND, &pose(3.0, 0.0), false).unwrap();
    let answers = waiting.look(&tree, "base", 100 * MS, patience);
    assert_eq!(numbers(&answers), [(1, None), (2, None)]);
    let expected = pose(3.0, 0.0) * pose(0.1, 0.0);
    assert!(near(answers[1].base_from_goal.as_ref().unwrap(), &expected));
    assert!(waiting.look(&tree, "base", 502 * MS, patience).is_empty());
    let answers = waiting.look(&tree, "base", 504 * MS, patience);
    assert_eq!(numbers(&answers), [(3, Some("transform_too_new")), (4, Some("unknown_frame"))]);
    assert_eq!(waiting.deadline(patience), None);
}

#[test]
fn a_goal_that_is_found_replaces_older_waiting_ones_and_a_stop_removes_all() {
    let (mut tree, mut waiting) = (tree(), WaitingGoals::default());
    waiting.add(goal(1, "map", 9 * SECOND), MS);
    waiting.add(goal(2, "map", 2 * SECOND), MS);
    assert_eq!(numbers(&waiting.look(&tree, "base", MS, 500 * MS)), [(2, None)]);
    put(&mut tree, ["base", "map"], 10 * SECOND, &pose(3.0, 0.0), false).unwrap();
    assert!(waiting.look(&tree, "base", MS, 500 * MS).is_empty(), "the older one would come after the newer");
    waiting.add(goal(3, "map", 11 * SECOND), MS);
    waiting.add(goal(4, "map", 11 * SECOND), MS);
    waiting.forget(3);
    put(&mut tree, ["base", "map"], 11 * SECOND, &pose(3.0, 0.0), false).unwrap();
    assert_eq!(numbers(&waiting.look(&tree, "base", MS, 500 * MS)), [(4, None)]);
    for number in 0..5000 {
        waiting.add(goal(number, "map", 12 * SECOND), MS);
    }
    put(&mut tree, ["base", "map"], 12 * SECOND, &pose(3.0, 0.0), false).unwrap();
    assert_eq!(waiting.look(&tree, "base", MS, 500 * MS).len(), 1000);
}

#[test]
fn a_frame_is_followed_until_it_is_silent_and_again_when_it_is_heard() {
    let (mut tree, patience) = (tree(), 500 * MS);
    let mut followed = Followed::new(goal(1, "table", 0), MS);
    let x = |motion: Option<FrameMotion>| match motion {
        Some(FrameMotion::To { stamp, base_from_goal }) => Some((stamp, base_from_goal.translation().x)),
        _ => None,
    };
    let place = |x: f64| pose(x, 0.0) * pose(0.5, 0.2) * pose(0.1, 0.0);
    let (stamp, _) = x(followed.look(&tree, "base", MS, patience)).unwrap();
    assert_eq!(stamp, 3 * SECOND, "the newest");
    assert_eq!(followed.look(&tree, "base", 500 * MS, patience), None);
    put(&mut tree, ["base", "map"], 4 * SECOND, &pose(7.0, 0.0), false).unwrap();
    let moved = x(followed.look(&tree, "base", 500 * MS, patience)).unwrap();
    assert!((moved.1 - place(7.0).translation().x).abs() < 1e-12 && moved.0 == 4 * SECOND);
    assert_eq!(followed.deadline(patience), Some(1000 * MS));
    // A repeated transform is not a motion.
    put(&mut tree, ["base", "map"], 4 * SECOND, &pose(7.0, 0.0), false).unwrap();
    assert_eq!(followed.look(&tree, "base", 999 * MS, patience), None);
    assert_eq!(followed.look(&tree, "base", 1000 * MS, patience), Some(FrameMotion::Lost));
    assert_eq!(
        (followed.look(&tree, "base", 2000 * MS, patience), followed.deadline(patience)),
        (None, None)
    );
    put(&mut tree, ["base", "map"], 5 * SECOND, &pose(8.0, 0.0), false).unwrap();
    assert!(x(followed.look(&tree, "base", 2001 * MS, patience)).is_some());
    // A frame that is cut off from the base is lost, too. It is found again when it is reconnected.
    put(&mut tree, ["moon", "map"], 6 * SECOND, &pose(8.0, 0.0), false).unwrap();
    assert_eq!(followed.look(&tree, "base", 2002 * MS, patience), None);
    assert_eq!(followed.look(&tree, "base", 2600 * MS, patience), Some(FrameMotion::Lost));
    put(&mut tree, ["base", "map"], 0, &pose(1.0, 0.0), true).unwrap();
    assert!(x(followed.look(&tree, "base", 2601 * MS, patience)).is_some());
    // A frame that never moves is never silent.
    assert_eq!(followed.look(&tree, "base", 60_000 * MS, patience), None);
    put(&mut tree, ["base", "map"], 0, &pose(2.0, 0.0), true).unwrap();
    let moved = x(followed.look(&tree, "base", 60_001 * MS, patience)).unwrap();
    assert!((moved.1 - place(2.0).translation().x).abs() < 1e-12 && moved.0 == 0);
}
