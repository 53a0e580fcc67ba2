//! Whatever happens in whatever order: the invariants hold.

use crate::bench::Bench;
use dq_servo::control::Law;
use dq_servo::servo::{Goal, JointReading, OneArm, Rejection};
use proptest::prelude::*;

/// What may happen to a servo.
#[derive(Clone, Debug)]
enum Event {
    Goal([f64; 3], [f64; 4]),
    BadGoal(usize),
    BadJointState(usize),
    Law(usize),
    Pause(bool),
    Stop,
    Connect(bool),
    Follow(bool),
    Velocity(f64),
    Acceleration(f64),
    ProgressTimeout(f64),
    Cycles(usize),
    LateCycle(u32),
}

/// What no position limit has to fear.
fn gentle_event() -> impl Strategy<Value = Event> {
    prop_oneof![
        (prop::array::uniform3(-1.0..1.0f64), prop::array::uniform4(-1.0..1.0f64))
            .prop_map(|(p, q)| Event::Goal(p, q)),
        (0..4usize).prop_map(Event::BadGoal),
        (0..4usize).prop_map(Event::BadJointState),
        (0..Law::ALL.len()).prop_map(Event::Law),
        any::<bool>().prop_map(Event::Pause),
        Just(Event::Stop),
        any::<bool>().prop_map(Event::Connect),
        (0.01..5.0f64).prop_map(Event::Velocity),
        (0.01..0.2f64).prop_map(Event::ProgressTimeout),
        (1..80usize).prop_map(Event::Cycles),
        (1..80usize).prop_map(Event::Cycles),
    ]
}

/// All. A joint cannot be kept from a limit with less deceleration than was counted on, nor in cycles that were missed.
fn any_event() -> impl Strategy<Value = Event> {
    prop_oneof![
        8 => gentle_event(),
        1 => (0.1..100.0f64).prop_map(Event::Acceleration),
        1 => (1..60u32).prop_map(Event::LateCycle),
        1 => any::<bool>().prop_map(Event::Follow),
    ]
}

/// Lets it happen; the bench checks the invariants.
fn apply(bench: &mut Bench<OneArm>, event: Event) {
    let now = bench.now;
    match event {
        Event::Goal(p, q) => {
            let norm = q.iter().map(|x| x * x).sum::<f64>().sqrt();
            let _: Result<(), Rejection> = bench.servo.take_goal(p, q.map(|x| x / norm), "", now);
        }
        Event::BadGoal(i) => {
            let (number, quaternion, frame) = [
                (f64::NAN, [0.0, 0.0, 0.0, 1.0], ""),
                (0.1, [0.0; 4], ""),
                (0.1, [0.0, f64::INFINITY, 0.0, 1.0], ""),
                (0.1, [0.0, 0.0, 0.0, 1.0], "map"),
            ][i];
            bench.servo.take_goal([number; 3], quaternion, frame, now).unwrap_err();
        }
        Event::BadJointState(i) => {
            let names = &bench.names[..[6, 6, 5, 0][i]];
            let positions: &[f64] = [&[f64::NAN; 6][..], &[0.0; 5], &[0.0; 5], &[]][i];
            let reading = JointReading { names, positions, velocities: &[], source: 0, stamp_age: None };
            bench.servo.take_joint_state(0, &reading, now).unwrap_err();
        }
        Event::Law(i) => bench.set_law(Law::ALL[i]),
        Event::Pause(paused) => bench.servo.pause(paused),
        Event::Stop => bench.servo.stop(),
        Event::Connect(connected) => bench.connect(connected),
        Event::Follow(following) => bench.following = following,
        Event::Velocity(limit) => bench.change(|settings| settings.limits.joint_velocity = vec![limit; 6]),
        Event::Acceleration(limit) => {
            bench.change(|settings| settings.limits.joint_acceleration = vec![limit; 6]);
        }
        Event::ProgressTimeout(seconds) => bench.change(|settings| {
            settings.progress_timeout = Some(std::time::Duration::from_secs_f64(seconds));
        }),
        Event::Cycles(count) => (0..count).for_each(|_| bench.cycle()),
        Event::LateCycle(missed) => bench.cycle_late(missed),
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    #[test]
    fn no_order_of_events_breaks_an_invariant(events in prop::collection::vec(any_event(), 1..40)) {
        let mut bench = Bench::new();
        bench.check_positions = false;
        events.into_iter().for_each(|event| apply(&mut bench, event));
        bench.cycle();
    }

    #[test]
    fn no_order_of_events_passes_a_position_limit(
        // From outside by 0.3 rad to inside by 1 rad.
        room in prop::array::uniform6((-0.3..1.0f64, -0.3..1.0f64)),
        margin in prop_oneof![Just(0.0), 0.0..0.5f64],
        events in prop::collection::vec(gentle_event(), 1..40),
    ) {
        let mut bench = Bench::with(|settings| {
            let start = crate::reference::numbers(&crate::reference::json()["theta_initial"]);
            let position = &mut settings.limits.position;
            position.lower = start.iter().zip(room).map(|(angle, (below, _))| angle - below).collect();
            position.upper = start.iter().zip(room).map(|(angle, (_, above))| angle + above).collect();
            // As the parameters are checked: a joint has room.
            for (lower, upper) in position.lower.iter_mut().zip(&mut position.upper) {
                *upper = upper.max(*lower + 0.01);
            }
            position.margin = margin;
        });
        events.into_iter().for_each(|event| apply(&mut bench, event));
        bench.run(0.1);
    }

    #[test]
    fn goals_of_any_numbers_are_taken_or_rejected(p in prop::array::uniform3(any::<f64>()), q in prop::array::uniform4(any::<f64>())) {
        if let Ok(goal) = Goal::new(p, q, "", "base") {
            prop_assert!(goal.base_from_goal().to_vector8().iter().all(|x| x.is_finite()));
        }
    }
}
