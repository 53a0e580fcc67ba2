//! Tests of numbers that are finite but huge, and of the final check of commands.

use crate::reference::parameters;
use crate::rig::{PERIOD, Rig, at_rest};
use dq_core::servo::{Arms, BeyondReach, Servo, Settings, State, Violation};
use dq_kinematics::arm::{ArmError, Chain, Convention, DhRow, bounds};
use dq_kinematics::control::{
    Aim, AngularLinear, ControlLaw, Controller, Damping, Law, Map, PoseError, register,
};
use proptest::prelude::*;

const UNIT: [f64; 4] = [0.0, 0.0, 0.0, 1.0];

#[test]
fn rule_12_goals_farther_than_any_arm_are_rejected_and_the_last_good_one_stays() {
    let mut rig = Rig::new();
    rig.set_law(Law::Diffc);
    rig.goal("theta_desired");
    rig.run(0.1);
    let before = rig.servo.status().goal;
    for x in [1e308, -1e160, 1e150, 1000.1] {
        let why = rig.take_point([0.0, x, 0.0], UNIT, "").unwrap_err();
        assert_eq!(why.label(), "out_of_range");
        assert!(why.to_string().ends_with("m: expected at most 1e3 m either way"), "{why}");
        rig.run(0.01);
    }
    assert_eq!(rig.servo.status().goal, before);
    rig.run_until(State::Settled, 30.0);

    let mut two = Rig::two_arms();
    two.run(0.1);
    assert_eq!(two.servo.take_goal([1e160; 3], UNIT, "", two.now).unwrap_err().label(), "out_of_range");
    two.run(0.1);
    assert_eq!(two.state(), State::Holding);
}

#[test]
fn rule_12_joint_states_beyond_all_turns_are_rejected() {
    let mut rig = Rig::new();
    for angle in [1e308, -1e100, 1.1e5] {
        let why = rig.servo.take_joint_state(0, &at_rest(&rig.names, &[angle; 6]), rig.now).unwrap_err();
        assert_eq!(why.label(), "out_of_range");
    }
    rig.servo.take_joint_state(0, &at_rest(&rig.names, &[1e5; 6]), rig.now).unwrap();
}

#[test]
fn rule_12_arms_larger_than_any_are_refused_by_the_number() {
    let row = |change: fn(&mut DhRow)| {
        let mut row = DhRow { alpha: 0.0, a: 0.1, d: 0.0, theta_offset: 0.0 };
        change(&mut row);
        Chain::new(Convention::StandardDh, &[row]).unwrap_err()
    };
    for error in [row(|row| row.a = 1e155), row(|row| row.d = -1001.0), row(|row| row.theta_offset = 90.0)] {
        assert!(matches!(error, ArmError::OutOfRange { joint: 1, .. }), "{error}");
    }
    let degrees = row(|row| row.alpha = -90.0).to_string();
    assert_eq!(
        degrees,
        "alpha of joint 1 is -90 rad: expected at most 6.28319 rad either way (is it in degrees?)"
    );
}

/// Coordinates of goals \[m\].
const GOALS: [f64; 4] = [0.0, 0.3, bounds::LENGTH, -bounds::LENGTH];

#[test]
fn rule_12_within_the_bounds_two_arms_command_what_the_gate_lets_pass() {
    let damping = Damping { max: 0.0, threshold: 0.05 };
    for aim in Aim::ALL {
        for (map, gain) in [(Map::Transpose, 1e4), (Map::DampedInverse, 1.0)] {
            let mut rig = Rig::two_arms();
            rig.change(|settings| {
                settings.controller = Controller::of_two_arms(map, aim, gain, damping);
                settings.beyond_reach = BeyondReach::Approach;
            });
            for goal in GOALS {
                rig.take_point([goal, -goal, goal], UNIT, "").unwrap();
                rig.run(0.05);
            }
            assert_eq!(rig.servo.replaced().count, 0, "{aim} {map}");
        }
    }
}

/// A defective law that returns NaN or infinity at some gains. A correct law does not do this at any gain.
struct Broken;

impl ControlLaw for Broken {
    fn name(&self) -> &'static str {
        "broken"
    }

    fn error(&self, error: &PoseError) -> AngularLinear {
        error.screw_log()
    }

    fn twist_gains(&self, [gain, _]: [f64; 2], _error: &AngularLinear) -> [f64; 2] {
        match gain {
            2.0 => [f64::NAN; 2],
            3.0 => [f64::INFINITY; 2],
            _ => [gain; 2],
        }
    }
}

#[test]
fn rule_12_what_is_no_number_is_replaced_by_braking_and_counted() {
    let broken = register(&Broken).unwrap();
    for gain in [2.0, 3.0] {
        let mut rig = Rig::new();
        rig.set_law(broken);
        rig.goal("theta_desired");
        rig.run(0.3);
        assert!(rig.speed() > 0.5);
        rig.change(|settings| settings.controller.set_gains(broken, [gain; 2]));
        rig.run(0.2);
        assert_eq!(rig.speed(), 0.0);
        let replaced = rig.servo.replaced();
        assert_eq!(replaced.count, 100);
        assert!(matches!(replaced.last, Some(Violation::NonFinite { joint: 1, .. })), "{replaced:?}");
        rig.change(|settings| settings.controller.set_gains(broken, [1.0; 2]));
        rig.run_until(State::Settled, 30.0);
        assert_eq!(rig.servo.replaced().count, 100);
    }
}

/// The largest arm that the bounds allow, as rows of alpha, a, d and offset.
const LARGEST: [(f64, f64, f64, f64); 6] = [(1.5, bounds::LENGTH, -bounds::LENGTH, 6.0); 6];

/// Returns numbers of every magnitude.
fn any_size() -> impl Strategy<Value = f64> {
    prop_oneof![
        4 => -2.0..2.0f64,
        2 => (-300.0..300.0f64, any::<bool>())
            .prop_map(|(exponent, minus)| if minus { -1.0 } else { 1.0 } * 10f64.powf(exponent)),
        1 => prop::sample::select(vec![0.0, -0.0, f64::NAN, f64::INFINITY, f64::MIN_POSITIVE, f64::MAX, bounds::LENGTH, -bounds::LENGTH, bounds::JOINT_ANGLE]),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    #[test]
    fn rule_12_whatever_numbers_are_taken_the_commands_are_numbers(
        rows in prop_oneof![prop::collection::vec((any_size(), any_size(), any_size(), any_size()), 6), Just(LARGEST.to_vec())],
        states in prop::array::uniform6(any_size()),
        goals in prop::collection::vec(prop::array::uniform3(any_size()), 3),
        law in prop::sample::select(Law::ALL.to_vec()),
        most in any::<bool>(),
    ) {
        let rows: Vec<_> =
            rows.into_iter().map(|(alpha, a, d, theta_offset)| DhRow { alpha, a, d, theta_offset }).collect();
        // Most arms of such numbers are rejected. Then the test uses the paper's arm instead.
        let chain = Chain::new(Convention::StandardDh, &rows).unwrap_or_else(|_| crate::reference::puma());
        let mut parameters = parameters();
        let Settings { controller, limits, .. } = &mut parameters.settings;
        controller.law = law;
        if most {
            controller.damping.max = 0.0;
            controller.set_gains(law, [if law == Law::Diffc { 1e4 } else { 100.0 }; 2]);
            limits.joint_acceleration = vec![1e4; 6];
        }
        let names = parameters.joints[0].names().to_vec();
        let mut servo =
            Servo::new(Arms::one(chain), parameters.joints, "", parameters.settings, PERIOD).unwrap();
        let mut now = PERIOD;
        for goal in goals {
            let _ = servo.take_joint_state(0, &at_rest(&names, &[0.1; 6]), now);
            let _ = servo.take_goal(goal, UNIT, "", now);
            for _ in 0..3 {
                now += PERIOD;
                let _ = servo.take_joint_state(0, &at_rest(&names, &states), now);
                let command = servo.step(now);
                prop_assert!(command.iter().all(|speed| speed.abs() <= 5.0), "{:?}", command);
            }
        }
        prop_assert_eq!(&servo.replaced().last, &None);
    }
}
