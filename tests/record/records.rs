//! Tests the encoded record of a cycle.

use dq_algebra::UnitDualQuaternion;
use dq_core::servo::{
    Event, GoalMotion, GoalReading, JointGoalReading, JointOrder, JointReading, Sent, TwistReading,
    WrenchReading,
};
use dq_params::Value;
use dq_search::Found;
use dq_wire::{CycleRecord, Recorded, RecordedParameters};
use std::time::Duration;

fn joints() -> [JointOrder; 2] {
    [["a", "b"], ["c", "d"]].map(|names| JointOrder::new(names.map(str::to_owned).to_vec()))
}

#[test]
fn a_record_reads_back_bit_for_bit_and_a_truncated_one_is_rejected() {
    let (joints, numbers) = (joints(), [0.1, -0.0]);
    let others = ["b".to_owned(), "x".to_owned()];
    let state = |names| JointReading {
        names,
        positions: &numbers,
        velocities: &[],
        source: 7,
        stamp_age: Some(Duration::new(0, 5)),
    };
    let goal = GoalReading {
        position: [f64::MIN_POSITIVE, f64::NAN, 1.0 / 3.0],
        orientation_xyzw: [0.0, 0.0, 0.0, 1.0],
        frame_id: "base",
        stamp: -1,
        waited: Duration::from_nanos(3),
        sent: Sent { by: 4, ago: Duration::from_secs(5) },
    };
    let twist = TwistReading { linear: [0.1; 3], angular: [0.2; 3], frame_id: "tool", sent: Sent::default() };
    let events = [
        Event::Pause { paused: true, ago: Duration::from_millis(2) },
        Event::Stop,
        Event::Reconfigure { ago: Duration::ZERO },
        Event::Found(Found { asked: Duration::from_secs(9), starts: 3, positions: Some(&numbers) }),
        Event::Found(Found { asked: Duration::from_secs(9), starts: 3, positions: None }),
        Event::JointState(1, state(joints[1].names())),
        Event::JointState(1, state(&others)),
        Event::Listeners(0, true),
        Event::Rival(1, false),
        Event::Goal(goal),
        Event::GoalMotion(GoalMotion::To(goal)),
        Event::GoalMotion(GoalMotion::Lost),
        Event::Twist(twist),
        Event::JointGoal(JointGoalReading {
            positions: &[Some(0.1), None],
            stamp: 5,
            sent: Sent { by: 3, ..goal.sent },
        }),
        Event::Wrench(WrenchReading {
            force: [f64::NAN, 0.1, 1e300],
            torque: [0.3; 3],
            frame_id: "sensor",
            sensor: UnitDualQuaternion::identity(),
            source: 7,
            stamp_age: Some(Duration::from_micros(3)),
        }),
        Event::Tare,
        Event::IdentifyTool,
    ];
    let mut bytes = Vec::new();
    CycleRecord::begin(300, Duration::from_nanos(1 << 40), &mut bytes);
    let set = RecordedParameters { values: vec![("p".to_owned(), Value::Double(0.1))], drawn: Vec::new() };
    Recorded::Parameters(set.clone()).write(&mut bytes);
    events.iter().for_each(|event| Recorded::of(event, &joints).unwrap().write(&mut bytes));
    CycleRecord::end(Some(&numbers), &mut bytes);
    let records = CycleRecord::read_all(&bytes).unwrap();
    let [record] = records.as_slice() else { panic!("{records:?}") };
    assert_eq!((record.number, record.now), (300, Duration::from_nanos(1 << 40)));
    assert_eq!(record.output.as_deref().map(<[f64]>::to_vec), Some(numbers.to_vec()));
    assert!(record.output.as_ref().unwrap()[1].is_sign_negative());
    assert_eq!(record.events[0], Recorded::Parameters(set));
    let told: Vec<_> = record.events[1..].iter().map(|event| event.event(&joints).unwrap()).collect();
    assert_eq!(format!("{told:?}"), format!("{events:?}"));
    // A state of the arm's own joints is recorded without their names.
    let names = |event: &Recorded<'_>| matches!(event, Recorded::JointState { names: Some(_), .. });
    assert_eq!((names(&record.events[6]), names(&record.events[7])), (false, true));
    for length in 1..bytes.len() {
        assert_eq!(CycleRecord::read_all(&bytes[..length]), None, "{length} of {} bytes", bytes.len());
    }
    // Several cycles may follow each other.
    let twice = [bytes.as_slice(), &bytes].concat();
    assert_eq!(CycleRecord::read_all(&twice).unwrap().len(), 2);
}

#[test]
fn a_cycle_in_which_six_joints_move_takes_some_hundred_bytes() {
    let joints = [JointOrder::new((1..7).map(|i| format!("shoulder_joint_{i}")).collect())];
    let mut bytes = Vec::new();
    CycleRecord::begin(1_000_000, Duration::from_secs(100_000), &mut bytes);
    let reading = JointReading {
        names: joints[0].names(),
        positions: &[0.5; 6],
        velocities: &[0.5; 6],
        source: 1,
        stamp_age: Some(Duration::from_millis(1)),
    };
    for event in [Event::JointState(0, reading), Event::Listeners(0, true), Event::Rival(0, false)] {
        Recorded::of(&event, &joints).unwrap().write(&mut bytes);
    }
    CycleRecord::end(Some(&[0.5; 6]), &mut bytes);
    assert!(bytes.len() < 190, "{} bytes, 144 of them numbers", bytes.len());
}

#[test]
fn a_recorded_event_of_a_missing_arm_is_ignored() {
    let reading = |arm| Recorded::Listeners(arm, true).event(&joints()).is_some();
    assert_eq!((reading(1), reading(2)), (true, false));
}
