//! Tests of the search for another configuration, for each built-in arm and for two arms that one servo controls.

use crate::arms::{anywhere, servo};
use crate::reference::{distance, dual_parameters, parameters};
use dq_algebra::UnitDualQuaternion;
use dq_config::{ARMS, ServoParameters};
use dq_core::servo::Settings;
use dq_kinematics::control::Aim;
use dq_metrics::GoalError;
use dq_search::{STARTS, Search};
use nalgebra::{UnitQuaternion, Vector3};
use std::time::Duration;

/// Number of tasks per arm.
const TASKS: usize = 60;

/// Searches for joint positions at which the tool has the same pose as at the joint positions `there`. The arm is at the joint
/// positions `here`, and the search tries `starts` start positions. Returns the positions found, or `None` if the search finds none.
/// Checks that the positions found reach the pose and keep the position limits.
fn look(parameters: &ServoParameters, here: &[f64], there: &[f64], starts: u32) -> Option<Vec<f64>> {
    let ServoParameters { arms, settings, .. } = parameters;
    let mut arms = arms.clone();
    arms.evaluate(there);
    let goal = arms.pose();
    let mut search = Search::new(arms.clone());
    let measured = allocation_counter::measure(|| {
        search.put(Duration::from_secs(7), &settings.question(&goal, here));
        search.run(starts, || true);
    });
    assert_eq!(measured.count_total, 0);
    let found = search.found();
    assert_eq!((found.asked, found.starts), (Duration::from_secs(7), starts));
    let positions = found.positions?;
    arms.evaluate(positions);
    let pose = arms.pose();
    let nearer = dq_kinematics::control::nearer_goal(&goal, &pose);
    let error = GoalError::of(settings.controller.aim, arms.state(), &nearer);
    assert!(error.is_within(&settings.goal_tolerance), "{error:?}");
    let limits = &settings.limits.position;
    let mut joints = positions.iter().zip(limits.ranges());
    assert!(joints.all(|(position, (lower, upper))| (lower..=upper).contains(position)), "{positions:?}");
    Some(positions.to_vec())
}

/// Returns the travel time between two joint positions at the largest speeds \[s\].
fn time(settings: &Settings, here: &[f64], there: &[f64]) -> f64 {
    let speeds = &settings.limits.joint_velocity;
    here.iter().zip(there).zip(speeds).map(|((a, b), speed)| (a - b).abs() / speed).fold(0.0, f64::max)
}

#[test]
fn every_arm_of_the_box_finds_each_pose_of_joint_angles_within_its_limits_and_none_farther_away() {
    for (name, _) in ARMS {
        let parameters = servo(name);
        let limits = &parameters.settings.limits.position;
        for number in 0..TASKS {
            let (here, there) = (anywhere(limits, number), anywhere(limits, 1000 + number));
            let found = look(&parameters, &here, &there, STARTS);
            let found = found.unwrap_or_else(|| panic!("{name}: no configuration for task {number}"));
            let [found, known] = [&found, &there].map(|there| time(&parameters.settings, &here, there));
            // An arm with seven joints has infinitely many configurations, and the search finds some of them.
            assert!(
                found <= known * if there.len() > 6 { 1.5 } else { 1.01 } + 1e-3,
                "{name}, task {number}: {found} s, but {known} s is enough"
            );
        }
    }
}

#[test]
fn a_few_starts_find_nearly_all() {
    for name in ["puma560", "ur5e", "xarm6", "panda"] {
        let parameters = servo(name);
        let limits = &parameters.settings.limits.position;
        let finds = |number: &usize| {
            let (here, there) = (anywhere(limits, *number), anywhere(limits, 1000 + number));
            look(&parameters, &here, &there, 16).is_some()
        };
        let found = (0..TASKS).filter(finds).count();
        assert!(100 * found > 95 * TASKS, "{name}: {found} of {TASKS}");
    }
}

#[test]
fn a_turn_that_leads_to_the_same_place_is_not_gone() {
    let mut parameters = servo("ur5e");
    let here = [3.0, -1.2, 1.4, -0.9, -1.3, 5.0];
    let there = [-3.0, -1.2, 1.4, -0.9, -1.3, -1.0];
    let found = look(&parameters, &here, &there, STARTS).unwrap();
    let expected = [-3.0 + std::f64::consts::TAU, -1.2, 1.4, -0.9, -1.3, -1.0 + std::f64::consts::TAU];
    let off = distance(&found, &expected);
    assert!(off < 1e-2, "{found:?}");
    // If a limit excludes the nearest configuration, the search finds another configuration.
    parameters.settings.limits.position.upper[0] = 3.1;
    let found = look(&parameters, &here, &there, STARTS).unwrap();
    assert!(found[0] <= 3.1, "{found:?}");
}

#[test]
fn less_than_a_pose_and_two_arms_are_found_too() {
    let mut parameters = parameters();
    let limits = parameters.settings.limits.position.clone();
    for aim in Aim::ALL {
        parameters.settings.controller.aim = aim;
        for number in 0..10 {
            let (here, there) = (anywhere(&limits, number), anywhere(&limits, 1000 + number));
            assert!(look(&parameters, &here[..6], &there[..6], STARTS).is_some(), "{aim}, task {number}");
        }
    }
    let mut two = dual_parameters();
    let limits = &two.settings.limits.position;
    let both = |number| [&anywhere(limits, number)[..6], &anywhere(limits, number + 7)[..6]].concat();
    let (here, there) = (both(3), both(1003));
    two.settings.controller.aim = Aim::Pose;
    assert!(look(&two, &here, &there, STARTS).is_some());
}

#[test]
fn nothing_is_found_of_what_is_out_of_reach_and_a_search_ends_when_it_may_not_go_on() {
    let parameters = parameters();
    let far = UnitDualQuaternion::from_parts(UnitQuaternion::identity(), Vector3::new(5.0, 0.0, 0.0));
    let mut search = Search::new(parameters.arms.clone());
    assert_eq!(search.asked(), None);
    search.put(Duration::ZERO, &parameters.settings.question(&far, &[0.0; 6]));
    search.run(20, || true);
    assert_eq!((search.found().starts, search.found().positions), (20, None));
    let mut left = 3;
    search.put(Duration::ZERO, &parameters.settings.question(&far, &[0.0; 6]));
    search.run(STARTS, || {
        left -= 1;
        left >= 0
    });
    assert_eq!(search.found().starts, 3);
    // The search also ends with meaningless numbers, and finds nothing.
    let meaningless = [f64::NAN, 1e300, 0.0, f64::INFINITY, 0.0, -1e300];
    search.put(Duration::ZERO, &parameters.settings.question(&far, &meaningless));
    search.run(20, || true);
    assert_eq!(search.found().positions, None);
}
