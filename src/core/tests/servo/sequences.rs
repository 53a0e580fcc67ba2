//! Tests with random sequences of events. The invariants must hold, and the arm must move if and only if it may.

use super::events::{Event, any_event, apply, attacks as random_attacks, change_often, gentle_event, near};
use crate::rig::{Rig, reading};
use dq_algebra::UnitDualQuaternion;
use dq_config::ForArm;
use dq_core::servo::{Goal, Interface, Limits, RAMP_TIME, Reconfigure, Rejection, State};
use dq_kinematics::arm::{Chain, Convention, DhRow};
use dq_kinematics::control::Aim;
use proptest::prelude::*;
use proptest::test_runner::{RngSeed, TestRunner};
use std::time::Duration;

/// Returns the configuration of a property test: `quick` random sequences, the same in each run. If the environment variable
/// `PROPTEST_CASES` is set, the test runs that number of random sequences, different ones in each run.
fn cases(quick: u32) -> ProptestConfig {
    let config = ProptestConfig::default();
    match std::env::var_os("PROPTEST_CASES") {
        Some(_) => config,
        None => ProptestConfig { cases: quick, rng_seed: RngSeed::Fixed(0), ..config },
    }
}

/// Returns random limits on jerk, or no limit [rad/s³].
pub fn jerk() -> impl Strategy<Value = f64> {
    prop_oneof![1 => Just(f64::INFINITY), 3 => (1.0..5.0f64).prop_map(|exponent| 10f64.powf(exponent))]
}

fn limit_jerk(rig: &mut Rig, jerk: f64) {
    rig.change(|settings| settings.limits.joint_jerk.fill(jerk));
}

/// Applies all events, then a stop, and checks that the arm stands within a second plus the time that its limits on acceleration
/// and jerk need.
fn apply_all(mut rig: Rig, events: Vec<Event>, jerk: f64) {
    limit_jerk(&mut rig, jerk);
    rig.check_positions = false;
    // The servo knows the time only from its first cycle on.
    rig.cycle();
    events.into_iter().for_each(|event| apply(&mut rig, event));
    rig.cycle();
    rig.stop();
    let is_eased = rig.servo.settings().limits.joint_jerk.iter().any(|jerk| jerk.is_finite());
    rig.run(if is_eased { 1.01 + 2.0 * RAMP_TIME } else { 1.01 });
    assert_eq!(rig.speed(), 0.0);
    assert_eq!(rig.servo.replaced().last, None);
}

/// Returns the paper's arm, a UR5e (six joints, standard DH parameters) and a Panda (seven joints, modified DH parameters). Each arm is
/// in a configuration from which it can move.
pub fn arms() -> [Rig; 3] {
    let [ur5e, panda] = ["ur5e", "panda"].map(|name| Chain::for_arm(name).unwrap());
    [
        Rig::new(),
        Rig::of_arm(ur5e, vec![0.3, -1.2, 1.5, -1.8, -1.4, 0.2]),
        Rig::of_arm(panda, vec![0.1, -0.7, 0.2, -2.3, 0.1, 1.6, 0.8]),
    ]
}

proptest! {
    #![proptest_config(cases(300))]

    #[test]
    fn no_order_of_events_breaks_an_invariant(arm in 0..3usize, events in prop::collection::vec(any_event(), 1..40), jerk in jerk()) {
        apply_all(arms().into_iter().nth(arm).unwrap(), events, jerk);
    }

    #[test]
    fn no_order_of_events_breaks_an_invariant_of_two_arms(events in prop::collection::vec(any_event(), 1..40), jerk in jerk()) {
        apply_all(Rig::two_arms(), events, jerk);
    }
}

/// Returns the output of each cycle while the events happen. Every `restored_each` cycles, another servo continues with the saved
/// state.
fn sent(
    mut rig: Rig,
    events: &[Event],
    (jerk, integral): (f64, f64),
    restored_each: u32,
) -> Vec<Option<Vec<f64>>> {
    (rig.check_positions, rig.restored_each, rig.sent) = (false, restored_each, Some(Vec::new()));
    rig.change(|settings| settings.integral = integral);
    limit_jerk(&mut rig, jerk);
    rig.cycle();
    events.iter().cloned().for_each(|event| apply(&mut rig, event));
    rig.sent.unwrap()
}

/// Returns the first cycle in which the two outputs differ in any bit.
pub fn first_difference(one: &[Option<Vec<f64>>], other: &[Option<Vec<f64>>]) -> Option<usize> {
    let bits = |sent: &Option<Vec<f64>>| {
        sent.as_ref().map(|sent| sent.iter().map(|x| x.to_bits()).collect::<Vec<_>>())
    };
    assert_eq!(one.len(), other.len());
    one.iter().zip(other).position(|(one, other)| bits(one) != bits(other))
}

proptest! {
    #![proptest_config(cases(150))]

    /// Another servo that loads the saved state sends exactly the same commands. So a replay can begin in any cycle.
    #[test]
    fn another_servo_that_knows_what_this_one_knew_goes_on_to_the_bit(
        arm in 0..4usize,
        events in prop::collection::vec(any_event(), 1..30),
        (jerk, integral) in (jerk(), prop_oneof![Just(0.0), 0.0..10.0f64]),
        each in 1..60u32,
    ) {
        let rig = || arms().into_iter().nth(arm).unwrap_or_else(Rig::two_arms);
        let [one, other] = [0, each].map(|each| sent(rig(), &events, (jerk, integral), each));
        prop_assert_eq!(first_difference(&one, &other), None);
    }
}

/// Returns the size of the pose error's logarithm.
fn error(rig: &Rig) -> f64 {
    rig.servo.status().pose_error.norm()
}

proptest! {
    #![proptest_config(cases(60))]

    /// After any events, a new request moves the arm. The arm then arrives, keeps getting nearer, or stalls within its timeouts,
    /// even if a parameter keeps changing meanwhile.
    #[test]
    fn whatever_happened_a_fresh_goal_is_gone_to_or_stalls(arm in 0..3usize, events in prop::collection::vec(gentle_event(), 1..15)) {
        let mut rig = arms().into_iter().nth(arm).unwrap();
        rig.check_positions = false;
        rig.cycle();
        events.into_iter().for_each(|event| apply(&mut rig, event));
        rig.connect(true);
        rig.change(|settings| {
            let Limits { joint_velocity, joint_acceleration, joint_deceleration, joint_jerk, .. } = &mut settings.limits;
            joint_velocity.fill(2.0);
            [joint_acceleration, joint_deceleration].into_iter().for_each(|list| list.fill(20.0));
            joint_jerk.fill(f64::INFINITY);
            (settings.limits.linear_speed, settings.limits.angular_speed) = (1.0, 2.0);
            settings.progress_timeout = Some(Duration::from_millis(200));
            settings.controller.aim = Aim::Pose;
        });
        // By then, earlier twists and streams have lapsed.
        change_often(&mut rig, 60);
        rig.pause(false);
        let here = rig.servo.pose().unwrap();
        let goal = here * UnitDualQuaternion::screw_exp(&[0.0, 0.1, 0.0, 0.05, 0.0, 0.0].into());
        let taken = rig.take_single(&reading(&goal, 0));
        prop_assert!(matches!(taken, Ok(()) | Err(Rejection::BeyondReach(_))), "{taken:?}");
        let mut before = f64::INFINITY;
        for _ in 0..10 {
            change_often(&mut rig, 40);
            if matches!(rig.state(), State::Settled | State::Stalled) || taken.is_err() {
                break;
            }
            // On its way to another configuration, the tool may move away from the goal.
            let goes_round = rig.state() == State::Reconfiguring;
            prop_assert!(goes_round || error(&rig) < before, "{} {:?} {before}", rig.state(), rig.servo.status());
            before = error(&rig);
        }
    }
}

proptest! {
    #![proptest_config(cases(1000))]

    #[test]
    fn no_order_of_events_passes_a_position_limit(
        // Each joint starts between 0.3 rad outside and 1 rad inside its limits.
        room in prop::array::uniform6((-0.3..1.0f64, -0.3..1.0f64)),
        margin in prop_oneof![Just(0.0), 0.0..0.5f64],
        events in prop::collection::vec(gentle_event(), 1..40),
        jerk in jerk(),
        integral in prop_oneof![Just(0.0), 0.0..10.0f64],
    ) {
        let mut rig = Rig::with(|settings| {
            settings.integral = integral;
            let start = crate::reference::theta("theta_initial");
            let position = &mut settings.limits.position;
            position.lower = start.iter().zip(room).map(|(angle, (below, _))| angle - below).collect();
            position.upper = start.iter().zip(room).map(|(angle, (_, above))| angle + above).collect();
            // As the parameters demand, each joint has a range.
            for (lower, upper) in position.lower.iter_mut().zip(&mut position.upper) {
                *upper = upper.max(*lower + 0.01);
            }
            position.margin = margin;
        });
        limit_jerk(&mut rig, jerk);
        rig.cycle();
        events.into_iter().for_each(|event| apply(&mut rig, event));
        rig.run(0.1);
    }

    #[test]
    fn goals_of_any_numbers_are_taken_or_rejected(p in prop::array::uniform3(any::<f64>()), q in prop::array::uniform4(any::<f64>())) {
        if let Ok(goal) = Goal::new(p, q, "", "base") {
            prop_assert!(goal.base_from_goal().to_vector8().iter().all(|x| x.is_finite()));
        }
    }
}

/// The arm has narrow position limits, and may always move to another configuration. Some events happen while it moves there.
#[test]
fn no_order_of_events_on_ways_round_passes_a_limit() {
    let underway = std::cell::Cell::new(0_u32);
    let room = prop::array::uniform6((0.2..2.0f64, 0.2..2.0f64));
    // The events are goals that the arm reaches within the limits, perhaps in another configuration, and gentle events.
    let places = prop::collection::vec(prop::array::uniform6(0.0..1.0f64), 1..5);
    let strategy = (room, places, prop::collection::vec(gentle_event(), 1..8), 0..40u64);
    let mut runner = TestRunner::new(ProptestConfig { failure_persistence: None, ..cases(150) });
    let ended = runner.run(&strategy, |(room, places, events, search)| {
        let start = crate::reference::theta("theta_initial");
        let limits = start.iter().zip(room).map(|(angle, (below, above))| (angle - below, angle + above));
        let limits: Vec<_> = limits.collect();
        let mut rig = Rig::with(|settings| {
            settings.reconfigure = Reconfigure::Always;
            settings.progress_timeout = Some(Duration::from_millis(100));
            settings.limits.position.lower = limits.iter().map(|(lower, _)| *lower).collect();
            settings.limits.position.upper = limits.iter().map(|(_, upper)| *upper).collect();
        });
        rig.search_time = Duration::from_millis(search);
        rig.run(0.1);
        for (number, event) in events.into_iter().enumerate() {
            let parts = places[number % places.len()];
            let place: Vec<_> = limits
                .iter()
                .zip(parts)
                .map(|((lower, upper), part)| lower + part * (upper - lower))
                .collect();
            let _: Result<(), Rejection> =
                rig.take_goal(&reading(&crate::reference::puma().forward_kinematics(&place).unwrap(), 0));
            for _ in 0..1500 {
                rig.cycle();
                if rig.state() == State::Reconfiguring {
                    underway.set(underway.get() + 1);
                    if underway.get().is_multiple_of(97) {
                        break;
                    }
                }
            }
            apply(&mut rig, event);
        }
        rig.run(0.1);
        Ok(())
    });
    ended.unwrap();
    assert!(underway.get() > 1000, "{} cycles on ways round", underway.get());
}

/// Returns an arm of 1, 2, 6, 7 or 12 joints, or two arms, in a configuration from which it can move.
fn attacked(number: usize, interface: Interface) -> Rig {
    let row = |alpha, a, d| DhRow { alpha, a, d, theta_offset: 0.0 };
    let half = std::f64::consts::FRAC_PI_2;
    let rows = [row(half, 0.0, 0.3), row(0.0, 0.4, 0.0), row(-half, 0.1, 0.1)];
    let of_rows = |count: usize| {
        let rows: Vec<_> = rows.into_iter().cycle().take(count).collect();
        (
            Chain::new(Convention::StandardDh, &rows).unwrap(),
            (0..count).map(|i| 0.3 + 0.1 * i as f64).collect(),
        )
    };
    let (chain, start) = match number {
        0 => of_rows(1),
        1 => of_rows(2),
        2 => (Chain::for_arm("ur5e").unwrap(), vec![0.3, -1.2, 1.5, -1.8, -1.4, 0.2]),
        3 => (Chain::for_arm("panda").unwrap(), vec![0.1, -0.7, 0.2, -2.3, 0.1, 1.6, 0.8]),
        4 => of_rows(12),
        _ => return Rig::two_arms_with(|settings| settings.interface = interface),
    };
    Rig::of_arm_with(chain, start, |settings| settings.interface = interface)
}

/// Repairs the robot at the joint positions `place`, sends nothing for 4 s so that all earlier requests end, and then sends a goal
/// nearby. Checks that the arm arrives.
fn is_gone_to_at_last(mut rig: Rig, place: &[f64]) {
    rig.make_sound(place);
    rig.run(4.0);
    rig.pause(false);
    near(&mut rig, None, [0.1, -0.15, 0.2, 0.1], Default::default());
    rig.arrives();
}

/// Applies sequences of requests and faults to each kind of arm. After each sequence the arm must still reach a goal.
fn attacks(arms: std::ops::Range<usize>, quick: u32) {
    let interface = prop::sample::select(vec![
        Interface::Velocity,
        Interface::Velocity,
        Interface::Position,
        Interface::Trajectory,
    ]);
    let strategy = (arms, interface, random_attacks(), jerk());
    let config = ProptestConfig { failure_persistence: None, ..cases(quick) };
    let ended = TestRunner::new(config).run(&strategy, |(arm, interface, events, jerk)| {
        attack(attacked(arm, interface), events, jerk);
        Ok(())
    });
    ended.unwrap();
}

fn attack(mut rig: Rig, events: Vec<Event>, jerk: f64) {
    let place = rig.positions();
    limit_jerk(&mut rig, jerk);
    rig.check_positions = false;
    rig.cycle();
    for event in events {
        apply(&mut rig, event);
    }
    is_gone_to_at_last(rig, &place);
}

#[test]
fn sequences_that_longer_runs_found_break_no_rule() {
    use Event::*;
    let found = [
        // The command ceased to balance the force. But the servo kept the part to which the joints had responded, and the arm stopped.
        (0, vec![Pull(1.0, 0, 0.118), FrameAway(0, 172), Gap(500, false)]),
        // A gap in the cycles was taken for an external force.
        (0, vec![Pull(1.0, 0, 0.133), FrameAway(0, 157), Gap(148, false)]),
    ];
    for (arm, events) in found {
        attack(attacked(arm, Interface::Velocity), events, f64::INFINITY);
    }
}

#[test]
fn an_arm_moves_if_and_only_if_it_may() {
    attacks(0..4, 60);
}

#[test]
fn long_and_two_arms_move_if_and_only_if_they_may() {
    attacks(4..6, 20);
}
