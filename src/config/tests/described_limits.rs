//! Tests of limits in descriptions. Many exporters write something that is not a limit: the number 0, no number, or an empty
//! range. The tests also check the limits of a description that is made from DH rows.

use crate::described::{GANTRY, frames};
use crate::{given, started, text};
use dq_config::{ForArm, NodeParameters, PlantParameters, ServoParameters, arm_file};
use dq_description::{DescribedArm, Description, Motion};
use dq_params::{ParameterOverride, Value, parameters_for};
use nalgebra::Vector3;

/// A parameter that is a list, with its numbers.
type List = (&'static str, Vec<f64>);

fn values(document: &str, more: &[List]) -> Vec<(&'static str, Value)> {
    let mut values = frames("a", "e").to_vec();
    values.push(("robot_description", text(document)));
    values.extend(more.iter().map(|(name, list)| (*name, Value::DoubleArray(list.clone()))));
    values
}

fn with(from: &str, to: &str) -> String {
    assert!(GANTRY.contains(from));
    GANTRY.replacen(from, to, 1)
}

#[test]
fn an_invalid_limit_is_rejected_with_advice_and_can_be_overridden() {
    let velocity = ("limits.joint_velocity", vec![1.0, 0.2, 1.0]);
    let range = [
        ("limits.joint_position_lower", vec![-0.5, 0.1, -9.0]),
        ("limits.joint_position_upper", vec![0.5, 3.0, 9.0]),
    ];
    let both = [velocity.clone(), range[0].clone(), range[1].clone()];
    let cases: [(String, &str, &[List]); 8] = [
        (with(" velocity='0.5'", ""), "joint \"j2\" has no velocity limit", &both[..1]),
        (
            with("velocity='0.5'", "velocity='0'"),
            "joint \"j2\" has the velocity limit 0: expected more than 0",
            &both[..1],
        ),
        (with("velocity='0.5'", "velocity='-1'"), "the velocity limit -1", &both[..1]),
        (with("velocity='0.5'", "velocity='1e16'"), "10000 at most", &both[..1]),
        (with("lower='-0.1'", "lower='0.4'"), "joint \"j2\" has the position limits 0.4 and 0.4", &both[1..]),
        (with("lower='-1' upper='2' ", ""), "joint \"j1\" has the position limits 0 and 0", &both[1..]),
        (with("lower='-0.1' upper='0.4'", "lower='5' upper='1'"), "the position limits 5 and 1", &both[1..]),
        (
            with("<limit lower='-1' upper='2' velocity='1.5' effort='1'/>", ""),
            "joint \"j1\" has no velocity limit",
            &both,
        ),
    ];
    for (document, why, override_) in cases {
        let refused = started(&values(&document, &[])).unwrap_err();
        assert!(refused.contains(why) && refused.contains("give limits.joint_"), "{refused}");
        assert!(!refused.contains('\n'));
        let limits = started(&values(&document, override_)).unwrap().settings.limits;
        let (velocity_given, range_given) = (override_[0].0 == velocity.0, override_.len() > 1);
        assert!(!velocity_given || limits.joint_velocity == velocity.1, "{why}");
        assert!(
            !range_given || (limits.position.lower == range[0].1 && limits.position.upper == range[1].1),
            "{why}"
        );
    }
    // If the user has set an invalid value, the error names this value, and not the invalid limits that result from it.
    let fast = values(GANTRY, &[]).into_iter().chain([("limits.joint_velocity", text("fast"))]);
    for wrong in [values(GANTRY, &[("limits.joint_velocity", vec![1.0, 0.0, 1.0])]), fast.collect()] {
        let refused = started(&wrong).unwrap_err();
        assert!(refused.starts_with("parameter \"limits.joint_velocity\""), "{refused}");
    }
    // Half of a range does not count.
    let flat = with("lower='-1' upper='2' ", "");
    let refused = started(&values(&flat, &range[..1])).unwrap_err();
    assert!(refused.contains("limits.joint_position_lower and limits.joint_position_upper"), "{refused}");
}

/// Checks that the tighter limit counts. A controller should keep within the soft limits. They are inside the hard limits, at which
/// the robot's own controller stops or brakes.
#[test]
fn the_tighter_of_a_hard_and_a_soft_limit_counts() {
    let limit = "<limit lower='-1' upper='2' velocity='1.5' effort='1'/>";
    let first = |soft: &str| {
        let document = with(limit, &format!("{limit}<safety_controller k_velocity='10' {soft}/>"));
        let position = started(&values(&document, &[])).unwrap().settings.limits.position;
        let read = Description::read(&document, "a", "e").unwrap().arm;
        assert_eq!(Description::read(&read.urdf(), "a", "e").unwrap().arm, read);
        (position.lower[0], position.upper[0])
    };
    assert_eq!(first("soft_lower_limit='-0.5' soft_upper_limit='1.5'"), (-0.5, 1.5));
    assert_eq!(first("soft_lower_limit='-3' soft_upper_limit='0.5'"), (-1.0, 0.5));
    assert_eq!(first("soft_lower_limit='-0.25'"), (-0.25, 2.0));
    assert_eq!(first(""), (-1.0, 2.0));
    let none = with(limit, &format!("{limit}<safety_controller soft_upper_limit='-2'/>"));
    let refused = started(&values(&none, &[])).unwrap_err();
    assert!(refused.contains("\"j1\" has the position limits -1 and -2"), "{refused}");
}

#[test]
fn a_plant_starts_within_the_effective_limits_and_needs_none() {
    let start = |document: &str, more: &[List]| {
        let (store, _) = PlantParameters::start("/arm", given(&values(document, more))).unwrap();
        PlantParameters::from_store(&store).unwrap().initial_positions
    };
    let none = with("lower='-1' upper='2' velocity='1.5'", "velocity='0'");
    assert_eq!(start(&none, &[]), [0.0; 3]);
    let range = [
        ("limits.joint_position_lower", vec![0.5, -0.1, -9.0]),
        ("limits.joint_position_upper", vec![1.5, 0.4, 9.0]),
    ];
    assert_eq!(start(GANTRY, &range), [1.0, 0.0, 0.0]);
    assert_eq!(start(&none, &range), [1.0, 0.0, 0.0]);
}

#[test]
fn limits_of_extreme_size_count_as_none() {
    let document = with(
        "lower='-1' upper='2' velocity='1.5'",
        "lower='-1e16' upper='inf' velocity='1.5' acceleration='0'",
    );
    let limits = started(&values(&document, &[])).unwrap().settings.limits;
    assert_eq!((limits.position.lower[0], limits.position.upper[0]), (-1e5, 1e5));
    assert_eq!(limits.joint_acceleration[0], 3.0);
}

/// Checks that a prismatic joint may have one position limit without the other, like a revolute joint.
#[test]
fn a_sliding_joint_may_have_no_limit() {
    for lower in ["-1e9", "-1e16", "-inf"] {
        let document = with("lower='-0.1'", &format!("lower='{lower}'"));
        let servo = started(&values(&document, &[])).unwrap();
        let position = servo.settings.limits.position;
        assert_eq!((position.lower[1], position.upper[1]), (-1e5, 0.4));
    }
}

/// Also checks that there is no warning if parameters replace the limits.
#[test]
fn limits_that_look_like_degrees_cause_a_warning() {
    let range = [
        ("limits.joint_position_lower", vec![-1.0, -0.1, -3.0]),
        ("limits.joint_position_upper", vec![1.0, 0.4, 3.0]),
    ];
    let warned = |document: &str, more: &[List]| {
        let (_, warnings) = ServoParameters::start("/dq_servo", given(&values(document, more))).unwrap();
        warnings.into_iter().find(|warning| warning.contains("degrees"))
    };
    let degrees = with("lower='-1' upper='2' velocity='1.5'", "lower='-170' upper='170' velocity='180'");
    let warning = warned(&degrees, &[]).unwrap();
    assert!(warning.contains("joint \"j1\" are -170 to 170 rad and 180 rad/s"), "{warning}");
    let warning = warned(&degrees, &range).unwrap();
    assert!(warning.contains("joint \"j1\" are 180 rad/s"), "{warning}");
    let turns = with("lower='-1' upper='2'", "lower='-12.6' upper='12.6'");
    let slides = with("lower='-0.1' upper='0.4'", "lower='-100' upper='100'");
    for fine in [GANTRY, &turns, &slides, &with("lower='-1' upper='2'", "lower='-1e16' upper='1e16'")] {
        assert_eq!(warned(fine, &[]), None);
    }
}

/// The default body has one capsule for each link, so a body must allow as many capsules as links.
#[test]
fn an_arm_may_have_64_joints() {
    let (mut links, mut joints) = ("<link name='l0'/>".to_owned(), String::new());
    for joint in 1..=64 {
        links += &format!("<link name='l{joint}'/>");
        joints += &format!(
            "<joint name='j{joint}' type='revolute'><parent link='l{}'/><child link='l{joint}'/><origin xyz='0 0 0.1'/>\
             <limit lower='-1' upper='1' velocity='1'/></joint>",
            joint - 1
        );
    }
    let document = format!("<robot name='snake'>{links}{joints}</robot>");
    let [base, tool] = frames("l0", "l64");
    let servo = started(&[("robot_description", text(&document)), base, tool]).unwrap();
    assert_eq!(servo.joints[0].names().len(), 64);
}

/// A rail along x from 0 to 4 m. It carries a post of 0.3 m, a swivel, and an arm of 0.5 m.
const RAIL: &str = "<robot name='r'><link name='a'/><link name='b'/><link name='c'/><link name='e'/>
  <joint name='rail' type='prismatic'><parent link='a'/><child link='b'/><limit lower='0' upper='4' velocity='1' effort='1'/></joint>
  <joint name='swivel' type='continuous'><parent link='b'/><child link='c'/><origin xyz='0 0 0.3'/><limit velocity='1' effort='1'/></joint>
  <joint name='end' type='fixed'><parent link='c'/><child link='e'/><origin xyz='0 0.5 0'/></joint></robot>";

fn is_beyond(document: &str, goal: [f64; 3], more: &[List]) -> bool {
    let servo = started(&values(document, more)).unwrap();
    servo.arms.reach(&Vector3::from(goal), servo.settings.limits.position.ranges()).is_beyond(1e-3)
}

/// The reach of an arm with prismatic joints depends on the effective limits, not on the limits in the description.
#[test]
fn an_arm_reaches_as_far_as_its_limits_let_it_slide() {
    // The links have 0.37 m and 0.5 m, and the prismatic joint has 0.4 m.
    assert!(!is_beyond(GANTRY, [1.27, 0.0, 0.0], &[]) && is_beyond(GANTRY, [1.28, 0.0, 0.0], &[]));
    let farther = [
        ("limits.joint_position_lower", vec![-1.0, -7.0, -9.0]),
        ("limits.joint_position_upper", vec![1.0, 3.0, 9.0]),
    ];
    assert!(!is_beyond(GANTRY, [7.87, 0.0, 0.0], &farther) && is_beyond(GANTRY, [7.88, 0.0, 0.0], &farther));
}

#[test]
fn an_arm_on_a_rail_reaches_as_far_as_its_links_from_any_point_of_the_rail() {
    for (goal, beyond) in [
        ([-0.7, 0.0, 0.0], false),
        ([-0.9, 0.0, 0.0], true),
        ([2.0, 0.79, 0.0], false),
        ([2.0, 0.0, 0.9], true),
        ([4.7, 0.0, 0.1], false),
        ([4.9, 0.0, 0.1], true),
    ] {
        assert_eq!(is_beyond(RAIL, goal, &[]), beyond, "{goal:?}");
    }
    // If all joints are prismatic, the arm reaches only as far as their ranges.
    let slides = RAIL.replace("type='continuous'", "type='prismatic'").replace(
        "<limit velocity='1' effort='1'/>",
        "<axis xyz='0 0.6 0.8'/><limit lower='-1' upper='1' velocity='1' effort='1'/>",
    );
    for (goal, beyond) in [([1.0, 0.1, -0.1], false), ([3.0, 1.1, 1.1], false), ([3.0, 1.2, 1.1], true)] {
        assert_eq!(is_beyond(&slides, goal, &[]), beyond, "{goal:?}");
    }
}

#[test]
fn joints_that_start_beyond_their_limits_are_named() {
    let beyond = |positions: [f64; 3]| {
        let more = [("initial_positions", positions.to_vec())];
        let (store, _) = PlantParameters::start("/arm", given(&values(GANTRY, &more))).unwrap();
        PlantParameters::from_store(&store).unwrap().beyond_limits()
    };
    assert_eq!(beyond([2.0, -0.1, 50.0]), None);
    assert_eq!(
        beyond([2.5, -0.2, 50.0]).unwrap(),
        "initial_positions are beyond the position limits: \"j1\" at 2.5 rad, above 2 rad; \"j2\" at -0.2 m, below -0.1 m: a servo \
         with these limits moves such a joint only back"
    );
}

/// Returns the parameters of a built-in arm.
pub fn of_arm(name: &str) -> Vec<ParameterOverride> {
    let (name, text) = arm_file(name).unwrap();
    let values = parameters_for(text, name, "/dq_servo").unwrap().into_iter();
    values.map(|(name, value)| ParameterOverride::new(name, value, "the box")).collect()
}

/// RViz and other tools read the limits from the robot description that the plant makes from DH rows.
#[test]
fn the_description_of_rows_has_the_limits_of_the_parameters() {
    let (store, _) = PlantParameters::start("/arm", of_arm("ur5e")).unwrap();
    let plant = PlantParameters::from_store(&store).unwrap();
    let links: Vec<_> = (1..=6).map(|i| format!("link{i}")).collect();
    let arm = DescribedArm::of_chain(&plant.arm.chain, "arm", &plant.arm.joints, ["base", "tool0"], &links);
    let text = arm.unwrap().with_limits(plant.limits.clone()).drawn_urdf();
    let read = Description::read(&text, "base", "tool0").unwrap().arm;
    let limits: Vec<_> = read.moving().map(|joint| joint.limits).collect();
    assert_eq!(limits, plant.limits);
    let servo = ServoParameters::for_arm("ur5e").unwrap().settings.limits;
    let of_servo = (servo.position.lower[2], servo.position.upper[2], servo.joint_velocity[2]);
    assert_eq!((limits[2].lower, limits[2].upper), (Some(of_servo.0), Some(of_servo.1)));
    assert_eq!(limits[2].velocity, Some(of_servo.2));
    assert!(read.moving().all(|joint| joint.motion == Motion::Revolute));
    // URDF requires a speed if there are position limits.
    let without_speeds = |value: &ParameterOverride| value.name != "limits.joint_velocity";
    let given: Vec<_> = of_arm("ur5e").into_iter().filter(without_speeds).collect();
    let (store, _) = PlantParameters::start("/arm", given).unwrap();
    let plant = PlantParameters::from_store(&store).unwrap();
    let arm = DescribedArm::of_chain(&plant.arm.chain, "arm", &plant.arm.joints, ["base", "tool0"], &links);
    let read =
        Description::read(&arm.unwrap().with_limits(plant.limits).drawn_urdf(), "base", "tool0").unwrap().arm;
    assert!(read.moving().all(|joint| joint.motion == Motion::Continuous));
    // The built-in arm has only speeds, and an arm of rows alone has no limits.
    let limits = |given| {
        let (store, _) = PlantParameters::start("/arm", given).unwrap();
        PlantParameters::from_store(&store).unwrap().limits
    };
    let builtin = limits(Vec::new());
    assert!(builtin.iter().all(|limits| limits.lower.is_none() && limits.velocity == Some(5.0)));
    let bare: Vec<_> =
        of_arm("panda").into_iter().filter(|value| !value.name.starts_with("limits.")).collect();
    assert_eq!(limits(bare), [dq_description::JointLimits::default(); 7]);
}
