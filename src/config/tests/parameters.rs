//! Tests of the nodes' parameters: accepted and rejected values, and the description of an arm.

use dq_config::*;
use dq_core::servo::{Posture, Settings};
use dq_params::{
    Constraint, Declaration, Declarer, ParameterError, ParameterOverride, ParameterStore, Parameters, Value,
    parameters_for,
};
use std::time::Duration;

#[test]
fn the_built_in_file_fits_both_nodes_whatever_their_names() {
    let (mut servo, mut plant) = (ServoParameters::store().unwrap(), PlantParameters::store().unwrap());
    for (name, value) in parameters_for(BUILTIN_FILE, "puma560.yaml", "/left/renamed").unwrap() {
        servo.override_initial(&name, value.clone()).unwrap();
        plant.override_initial(&name, value).unwrap();
    }
    assert_eq!(ServoParameters::from_store(&servo).unwrap().joints[0].names().len(), 6);
    assert_eq!(PlantParameters::from_store(&plant).unwrap().initial_positions.len(), 6);
}

fn store() -> ParameterStore {
    ServoParameters::start("/dq_servo", Vec::new()).unwrap().0
}

fn change(name: &str, yaml: &str) -> Vec<(String, Value)> {
    vec![(name.to_owned(), Value::from_yaml(yaml).unwrap())]
}

/// Returns the settings after these changes.
fn with(changes: &[(&str, &str)]) -> Result<Settings, ParameterError> {
    let changes: Vec<_> = changes.iter().flat_map(|(name, yaml)| change(name, yaml)).collect();
    ServoParameters::from_store(&store().with(&changes).unwrap()).map(|all| all.settings)
}

#[test]
fn changes_are_taken_together_or_rejected_with_a_reason() {
    let store = store();
    let two = |law: &str| [change("gains.diffc", "10"), change("controller", law)].concat();
    let changed = store.with(&two("diffc")).unwrap();
    assert_eq!(changed.get("controller"), Some(&Value::String("diffc".into())));
    assert_eq!(changed.get("gains.diffc"), Some(&Value::Double(10.0)));
    assert!(store.with(&two("pid")).is_err());
    assert_eq!(store.get("gains.diffc"), Some(&Value::Double(185.0)));
    for (name, yaml, reason) in [
        ("controller", "pid", "one of diffc, diffc_inverse, logc"),
        ("controller", "3", "is a string"),
        ("gains.diffc", "-1.0", "to 10000"),
        ("gains.difc", "1.0", "did you mean \"gains.diffc\""),
        ("gains.logc", "[1.0, 101.0]", "to 100 1/s"),
        ("gains.logc", "2.0", "is a double array"),
        ("update_rate", "100", "read-only"),
        ("limits.joint_velocity", "[1.0, -1.0]", "to 10000"),
        ("use_sim_time", "true", "read-only"),
    ] {
        let message = store.with(&change(name, yaml)).unwrap_err().to_string();
        assert!(message.contains(reason) && !message.contains('\n'), "{message}");
    }
}

#[test]
fn lists_must_fit_the_joints() {
    assert!(store().with(&[("gains.diffc".to_owned(), Value::Double(f64::NAN))]).is_err());
    let store = store().with(&change("limits.joint_velocity", "[1.0, 1.0]")).unwrap();
    let message = ServoParameters::from_store(&store).unwrap_err().to_string();
    assert!(message.contains("limits.joint_velocity") && message.contains("6 numbers"), "{message}");
}

#[test]
fn each_law_has_as_many_gains_as_it_takes() {
    let laws = ServoParameters::declarations().unwrap().into_iter().filter_map(|declared| match declared {
        Declaration { name, default: Value::DoubleArray(gains), .. } => Some((name, gains)),
        _ => None,
    });
    let laws: Vec<_> = laws.filter(|(name, _)| name.starts_with("gains.")).collect();
    assert_eq!(laws.len(), 11);
    for (name, gains) in laws {
        for given in [&gains[..1], &[], &[gains[0]; 3]] {
            let store = store().with(&[(name.to_owned(), Value::DoubleArray(given.to_vec()))]).unwrap();
            let message = ServoParameters::from_store(&store).unwrap_err().to_string();
            let expected =
                format!("parameter {name:?} cannot be a list of {}: expected 2 numbers", given.len());
            assert_eq!(message, expected);
        }
    }
}

#[test]
fn a_deceleration_that_does_not_stop_each_joint_within_a_second_is_rejected() {
    let with = |changes: &[(&str, &str)]| with(changes).map(|settings| settings.limits);
    let (velocity, deceleration) = ("limits.joint_velocity", "limits.joint_deceleration");
    assert_eq!(with(&[(deceleration, "[5, 5, 5, 5, 5, 5]")]).unwrap().joint_deceleration, [5.0; 6]);
    // The velocity limits are 5 rad/s.
    let slow = with(&[(deceleration, "[50, 50, 4.9, 50, 50, 50]")]).unwrap_err().to_string();
    let expected = "parameter \"limits.joint_deceleration\" cannot be 4.9 for joint 3: expected at least 5 rad/s^2, which stops it from its velocity limit in 1 s";
    assert_eq!(slow, expected);
    assert!(with(&[(deceleration, "[5, 5, 5, 5, 5, 5]"), (velocity, "[5, 5, 5, 5, 5, 5.1]")]).is_err());
    // Missing decelerations equal the accelerations, but are at least large enough to stop within a second.
    let limits = with(&[("limits.joint_acceleration", "[1e-6, 50, 50, 50, 50, 50]")]).unwrap();
    assert_eq!((limits.deceleration(0), limits.deceleration(1)), (5.0, 50.0));
}

#[test]
fn a_jerk_is_one_number_or_one_per_joint_and_reaches_accelerations_in_time() {
    let with = |changes: &[(&str, &str)]| with(changes).map(|settings| settings.limits);
    let jerk = "limits.jerk";
    assert_eq!(with(&[]).unwrap().joint_jerk, [f64::INFINITY; 6]);
    assert_eq!(with(&[(jerk, "[300]")]).unwrap().joint_jerk, [300.0; 6]);
    let each = [450.0, 250.0, 250.0, 300.0, 350.0, 400.0];
    assert_eq!(with(&[(jerk, "[450, 250, 250, 300, 350, 400]")]).unwrap().joint_jerk, each);
    assert!(with(&[(jerk, "[300, 300]")]).is_err());
    // The accelerations are 50 rad/s².
    let small = with(&[(jerk, "[300, 245, 300, 300, 300, 300]")]).unwrap_err().to_string();
    let expected = "parameter \"limits.jerk\" cannot be 245 for joint 2: expected at least 250 rad/s^3, which brings it to its acceleration and deceleration in 0.2 s";
    assert_eq!(small, expected);
    let small = with(&[(jerk, "[245]")]).unwrap_err().to_string();
    assert!(small.contains("joint 1"), "{small}");
    assert!(with(&[(jerk, "[245]"), ("limits.joint_acceleration", "[40, 40, 40, 40, 40, 40]")]).is_ok());
}

#[test]
fn keep_outs_are_read_or_rejected_with_the_reason() {
    let with = |changes: &[(&str, &str)]| with(changes).map(|settings| settings.scene);
    let keep_out = |text: &str| with(&[("keep_out", &format!("[\"{text}\"]"))]);
    assert_eq!(keep_out("table half_space 0 0 1 -0.1"), Ok(None), "constraints are off");
    let on = ("constraints", "true");
    let things = "[table half_space 0 0 1 -0.1, ball sphere 1 0 0 0.1, crate box 1 0 0 0.1 0.2 0.3 0 0 0 1]";
    let scene = with(&[on, ("keep_out", things)]).unwrap().unwrap();
    assert_eq!((scene.keep_outs().len(), scene.body().capsules.len()), (3, 2));
    let body = "[base 0 0 -0.5 0 0 0 0.1, joint2 0 0 0 0.4 0 0 0.06, joint3 0 0 0 0 0.4 0 0.05, joint6 0 0 0 0 0 0.1 0.03]";
    let scene = with(&[on, ("body", body)]).unwrap().unwrap();
    let joints: Vec<_> = scene.body().capsules.iter().map(|capsule| capsule.link).collect();
    assert_eq!(joints, [0, 2, 3, 6]);
    let thick = with(&[on, ("body", "[\"0.08\"]")]).unwrap().unwrap();
    assert!(thick.body().capsules.iter().all(|capsule| capsule.radius == 0.08));
    for (text, why) in [
        ("", "expected a name of 1 to 24 letters"),
        ("a:b sphere 0 0 0 1", "expected a name of 1 to 24 letters"),
        (
            "ball",
            "expected a name, then half_space or sphere or box or cylinder or capsule or hull, then its numbers",
        ),
        ("ball cube 0 0 0 1", "cannot be \"ball cube 0 0 0 1\": expected a name, then half_space"),
        ("ball sphere 0 0 0", "expected finite numbers after sphere: x y z radius"),
        ("ball sphere 0 0 nan 1", "expected finite numbers after sphere: x y z radius"),
        (
            "wall half_space 0 0 1 inf",
            "expected finite numbers after half_space: normal x y z, offset along it",
        ),
        ("ball sphere 0 0 0 -1", "expected lengths of more than 0 m, 1000 m at most, not -1"),
        ("ball sphere 0 0 1e9 1", "expected a place no farther away than 1000 m, not 1000000000"),
        ("wall half_space 0 0 0 1", "a direction of any length above 0"),
        ("crate box 0 0 0 1 1 1 0 0 0 2", "an orientation of length 1"),
        ("tent hull 0 0 0 1 0 0 0 1 0", "expected finite numbers after hull: x y z of 4 to 100 points"),
        ("tent hull 0 0 0 1 0 0 0 1 0 0 0", "expected finite numbers after hull: x y z of 4 to 100 points"),
        ("tent hull 0 0 0 1 0 0 0 1 0 0 0 nan", "expected finite numbers after hull"),
        (&format!("tent hull{}", " 0 0 1".repeat(101)), "expected finite numbers after hull"),
        (
            "tent hull 0 0 0 1 0 0 0 1 0 0 0 1e9",
            "expected a place no farther away than 1000 m, not 1000000000",
        ),
        ("tent hull 0 0 0 1 0 0 0 1 0 1 1 1e-9", "expected points that do not lie in a plane"),
        (&format!("tent hull{}", " 1 2 3".repeat(100)), "expected points that do not lie in a plane"),
    ] {
        let refused = keep_out(text).unwrap_err().to_string();
        let is_said_once = refused.matches("expected").count() == 1;
        assert!(
            refused.contains("\"keep_out\"") && refused.contains(why) && is_said_once,
            "{text}: {refused}"
        );
    }
    for text in [
        "elbow 0 0 0 0 0 0 0.1",
        "joint2 0 0 0 0.1",
        "joint2 0 0 0 0 0 0 0",
        "joint2 0 0 inf 0 0 0 0.1",
        "99",
    ] {
        let refused = with(&[("body", &format!("[\"{text}\"]"))]).unwrap_err().to_string();
        assert!(
            refused.contains("\"body\"") && refused.matches("expected").count() == 1,
            "{text}: {refused}"
        );
    }
    let twice = with(&[("keep_out", "[a sphere 1 1 1 0.1, a sphere 2 2 2 0.1]")]).unwrap_err().to_string();
    assert!(twice.contains("names that are not repeated"), "{twice}");
    let many: Vec<_> = (0..65).map(|i| format!("thing{i} sphere 1 1 1 0.1")).collect();
    let refused = with(&[("keep_out", &format!("[{}]", many.join(", ")))]).unwrap_err().to_string();
    assert!(refused.contains("65 of them") && refused.contains("no room for thing64"), "{refused}");
    let cell = "[cell box 0 0 0.5 1 1 1, low half_space 0 0 1 0.8]";
    let scene = with(&[on, ("keep_in", cell)]).unwrap().unwrap();
    assert_eq!((scene.keep_ins().len(), scene.keep_outs().len()), (2, 0));
    let refused = with(&[("keep_in", "[cell box 0 0 0.5 1 1]")]).unwrap_err().to_string();
    assert!(refused.contains("\"keep_in\" cannot be \"cell box 0 0 0.5 1 1\""), "{refused}");
    let both = [("keep_in", cell), ("keep_out", &format!("[{}]", many[..63].join(", ")))];
    let refused = with(&both).unwrap_err().to_string();
    assert!(refused.contains("65 of them: expected at most 64, including those of keep_in"), "{refused}");
}

fn given(yaml: &[(&str, &str)]) -> Vec<ParameterOverride> {
    let value = |(name, yaml): &(&str, &str)| {
        ParameterOverride::new(*name, Value::from_yaml(yaml).unwrap(), "arm.yaml")
    };
    yaml.iter().map(value).collect()
}

const ARM: [(&str, &str); 8] = [
    ("joints", "[a, b]"),
    ("arm.convention", "standard_dh"),
    ("arm.alpha", "[0, 1.5]"),
    ("arm.a", "[0.5, 0.5]"),
    ("arm.d", "[0, 0]"),
    ("limits.joint_velocity", "[1, 1]"),
    ("limits.joint_acceleration", "[9, 9]"),
    ("initial_positions", "[0, 0]"),
];

#[test]
fn an_incomplete_arm_is_rejected_with_what_is_missing() {
    let start = |values: &[(&str, &str)]| ServoParameters::start("/dq_servo", given(values));
    let (store, warnings) = start(&ARM).unwrap();
    assert_eq!(warnings, [""; 0]);
    assert_eq!(ServoParameters::from_store(&store).unwrap().joints[0].names(), ["a", "b"]);
    for i in 0..7 {
        let mut values = ARM.to_vec();
        let (missing, _) = values.remove(i);
        let message = start(&values).unwrap_err().to_string();
        assert!(message.contains(missing) && !message.contains('\n'), "{message}");
    }
    let message = start(&ARM[..1]).unwrap_err().to_string();
    assert!(message.contains("arm.convention, arm.alpha, arm.a, arm.d, limits.joint_velocity"), "{message}");
    let message = PlantParameters::start("/puma560", given(&ARM[..7])).unwrap_err().to_string();
    assert!(message.contains("initial_positions") && !message.contains("limits"), "{message}");
}

#[test]
fn without_an_arm_the_built_in_one_is_used() {
    let limit = given(&[("limits.joint_velocity", "[1, 1, 1, 1, 1, 1]")]);
    let (store, _) = ServoParameters::start("/x", limit).unwrap();
    let parameters = ServoParameters::from_store(&store).unwrap();
    assert_eq!(parameters.settings.limits.joint_velocity, [1.0; 6]);
}

#[test]
fn every_node_accepts_simulated_time_at_its_start() {
    fn start<P: NodeParameters>() -> P {
        let (store, warnings) = P::start("/node", given(&[("use_sim_time", "true")])).unwrap();
        assert_eq!(warnings, [""; 0]);
        P::from_store(&store).unwrap()
    }
    assert!(start::<ServoParameters>().simulated_time && start::<DualParameters>().0.simulated_time);
    assert!(start::<PlantParameters>().arm.simulated_time);
    start::<GuardParameters>();
}

#[test]
fn a_guard_timeout_below_three_periods_of_its_servo_is_rejected() {
    let of = |values: &[(&str, &str)]| {
        let (store, _) = GuardParameters::start("/guard", given(values)).unwrap();
        GuardParameters::from_store(&store).map(|guard| guard.command_timeout).map_err(|why| why.to_string())
    };
    let milliseconds = |time| Ok(Duration::from_millis(time));
    assert_eq!(of(&[]), milliseconds(100));
    assert_eq!(of(&[("update_rate", "30")]), milliseconds(100));
    assert_eq!(of(&[("update_rate", "5"), ("command_timeout", "0.6")]), milliseconds(600));
    let (slow, trajectory) = (("trajectory_rate", "5"), ("interface", "trajectory"));
    assert_eq!(of(&[slow]), milliseconds(100), "not the rate of these commands");
    for values in [&[("update_rate", "5")][..], &[slow, trajectory], &[("update_rate", "29")]] {
        let why = of(values).unwrap_err();
        assert!(why.contains("command_timeout") && why.contains("three"), "{why}");
    }
}

/// If the plant accepted limits that the servo rejects, the servo could not read the plant's robot_description.
#[test]
fn empty_position_ranges_are_rejected_by_servo_and_plant() {
    let crossed = given(&[
        ("limits.joint_position_lower", "[-1, -1, 2, -1, -1, -1]"),
        ("limits.joint_position_upper", "[1, 1, 2, 1, 1, 1]"),
    ]);
    fn refused<P: NodeParameters>(given: Vec<ParameterOverride>) -> String {
        let (store, _) = P::start("/node", given).unwrap();
        P::from_store(&store).err().map(|why| why.to_string()).unwrap_or_default()
    }
    for why in [refused::<ServoParameters>(crossed.clone()), refused::<PlantParameters>(crossed.clone())] {
        assert!(
            why.contains("joint_position_upper") && why.contains("above the joint's lower limit, 2"),
            "{why}"
        );
    }
}

#[test]
fn values_for_all_nodes_that_fit_none_are_ignored_with_one_warning() {
    let mut values = given(&[("controler", "lq"), ("nope", "1"), ("command_timeout", "1")]);
    let (_, warnings) = ServoParameters::start("/dq_servo", values.clone()).unwrap();
    let [warning] = warnings.as_slice() else { panic!("{warnings:?}") };
    for part in ["arm.yaml", "/dq_servo", "did you mean \"controller\"?", "\"nope\""] {
        assert!(warning.contains(part), "{warning}");
    }
    assert!(!warning.contains("command_timeout"), "one of another of our nodes");
    values[1].by_name = true;
    let refused = ServoParameters::start("/dq_servo", values).unwrap_err();
    assert!(refused.to_string().contains("\"nope\""));
}

/// `param set` reports success before the cycle takes the new values, so the cycle must accept them.
#[test]
fn a_running_servo_accepts_what_the_parameters_accept() {
    let store = store();
    let mut servo = ServoParameters::from_store(&store).unwrap().build().unwrap();
    let mut taken = 0;
    for (declared, value) in store.iter().filter(|(declared, _)| !declared.read_only) {
        let ends = match declared.constraint {
            Constraint::Range { min, max } => vec![min, max, 0.5 * (min + max), f64::NAN, f64::INFINITY],
            _ => vec![0.0, -1.0, f64::MAX],
        };
        for end in ends {
            let other = match value {
                Value::DoubleArray(list) if list.is_empty() => Value::DoubleArray(vec![end; 6]),
                Value::DoubleArray(list) => Value::DoubleArray(vec![end; list.len()]),
                Value::Double(_) => Value::Double(end),
                other => other.clone(),
            };
            let Ok(changed) = store.with(&[(declared.name.to_owned(), other)]) else { continue };
            let Ok(parameters) = ServoParameters::from_store(&changed) else { continue };
            assert_eq!(servo.configure(parameters.settings), Ok(()), "{} at {end}", declared.name);
            taken += 1;
        }
    }
    assert!(taken > 100, "{taken}");
    let mut spoilt = ServoParameters::from_store(&store).unwrap();
    spoilt.settings.limits.joint_velocity.pop();
    assert!(servo.configure(spoilt.settings).is_err());
}

/// Checks that a node rejects an unknown parameter name in a namespace of this project, such as `limits`. The name probably has a
/// typing error, so the node suggests a known name.
#[test]
fn unknown_names_in_our_namespaces_are_rejected_for_every_node() {
    for (name, near) in [
        ("limits.joint_velocty", "limits.joint_velocity"),
        ("damping.mx", "damping.max"),
        ("gains.difc", "gains.diffc"),
    ] {
        let why = [
            ServoParameters::start("/dq_servo", given(&[(name, "1")])).unwrap_err(),
            PlantParameters::start("/puma560", given(&[(name, "1")])).unwrap_err(),
        ];
        let expected = format!("unknown parameter {name:?}: did you mean {near:?}?");
        assert_eq!(why.map(|why| why.to_string()), [expected.clone(), expected]);
    }
    assert!(PlantParameters::start("/puma560", given(&[("gains.diffc", "1")])).unwrap().1.is_empty());
}

/// The typed parameters have exactly the values that the store has accepted.
#[test]
fn each_live_number_is_read_as_it_was_set() {
    // The numbers of contact have an effect with compliance only.
    let store = store().with(&[("contact.compliance".to_owned(), Value::Bool(true))]).unwrap();
    let settings = |store: &ParameterStore| format!("{:?}", ServoParameters::from_store(store).unwrap());
    let before = settings(&store);
    for (declared, value) in store.iter().filter(|(declared, _)| !declared.read_only) {
        let other = match value {
            Value::DoubleArray(list) if list.len() == 7 => {
                Value::DoubleArray(vec![0.1, 0.0, 0.0, 0.0, 0.6, 0.0, 0.8])
            }
            Value::Bool(now) => Value::Bool(!now),
            Value::Double(x) => Value::Double(if *x == 0.0 { 0.25 } else { x / 2.0 }),
            Value::DoubleArray(list) if !list.is_empty() => {
                Value::DoubleArray(list.iter().map(|x| if *x == 0.0 { 0.25 } else { x / 2.0 }).collect())
            }
            Value::DoubleArray(_) if declared.name == "limits.jerk" => Value::DoubleArray(vec![650.0]),
            Value::DoubleArray(_) => Value::DoubleArray(vec![6.5; 6]),
            Value::String(now) => match &declared.constraint {
                Constraint::OneOf(names) => {
                    let other = names.iter().find(|name| *name != now).unwrap();
                    Value::String((*other).to_owned())
                }
                _ => continue,
            },
            _ => continue,
        };
        let changed = store.with(&[(declared.name.to_owned(), other)]).unwrap();
        assert!(settings(&changed) != before, "{}", declared.name);
    }
}

#[test]
fn every_arm_has_the_same_declarations() {
    for (_, arm) in ARMS {
        let values = parameters_for(arm, "arm.yaml", "/dq_servo").unwrap();
        let mut declarer = Declarer::new(values);
        ServoParameters::declare(&mut declarer).unwrap();
        assert_eq!(declarer.into_declarations(), ServoParameters::declarations().unwrap());
    }
}

#[test]
fn a_posture_is_that_of_the_start_by_default_and_has_a_number_for_each_joint() {
    let of_start = Posture { positions: Vec::new(), gain: 1.0 };
    assert_eq!(ServoParameters::for_arm("panda").unwrap().settings.posture, of_start);
    let (store, _) = ServoParameters::start("/dq_servo", crate::described_limits::of_arm("panda")).unwrap();
    let set = |positions: usize, gain: f64| {
        let changes = [
            ("posture.positions".to_owned(), Value::DoubleArray(vec![0.5; positions])),
            ("posture.gain".to_owned(), Value::Double(gain)),
        ];
        ServoParameters::from_store(&store.with(&changes).unwrap()).map(|all| all.settings.posture)
    };
    assert_eq!(set(7, 1.0).unwrap(), Posture { positions: vec![0.5; 7], gain: 1.0 });
    let why = set(6, 1.0).unwrap_err().to_string();
    assert!(why.contains("posture.positions") && why.contains("7 numbers"), "{why}");
}
